//! `osteon job explain`: a job says what delays it, and `--log-format json` what happened, with real
//! processes.

#![expect(clippy::panic, reason = "a test that cannot go on should say why")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use osteon_proto::v1::PaceReason;
use serde_json::Value;
use support::{Coordinator, Owned, Scratch, eventually, job, osteon, run, text};

#[test]
fn a_job_says_what_delays_it() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(5000, 40));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let id = coordinator.submit(&file);
    let explained = || coordinator.client(&["explain", &id, "--json"]).json();
    let told = explained();
    assert_eq!((&told["job"], &told["reason"]), (&id.as_str().into(), &"no_workers".into()));
    assert_eq!((&told["slots"], &told["realizations"]), (&0.into(), &5000.into()));
    assert!(told["waiting_s"].as_f64() >= Some(0.0), "{told}");
    let said = coordinator.client(&["explain", &id]).succeeded().replace('\n', " ");
    assert!(
        said.contains("No worker has been attached") && said.contains("Start workers"),
        "{said}"
    );
    let worker = coordinator.worker(1);
    eventually("it computes", || {
        let told = explained();
        told["reason"] == "computing" && told["realizations_per_second"].as_f64() > Some(0.0)
    });
    let told = explained();
    assert_eq!(told["slots"], 1, "{told}");
    drop(worker);
    eventually("it has no workers again", || explained()["reason"] == "no_workers");
    coordinator.client(&["cancel", &id]).succeeded();
    let told = explained();
    assert_eq!(told["reason"], "ended");
    assert!(told["text"].as_str().unwrap().contains("cancelled"), "{told}");
    let unknown = coordinator.client(&["explain", "99"]);
    assert_eq!(unknown.code, Some(2), "{unknown:?}");
    assert!(unknown.stderr.contains("no such job: 99"), "{unknown:?}");
}

#[test]
fn the_page_lists_every_reason() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cluster.md");
    let page = fs::read_to_string(path).unwrap();
    let (_, table) = page.split_once("| `reason` | the job |\n|---|---|\n").unwrap();
    let rows = table.lines().take_while(|line| line.starts_with("| `"));
    let listed: Vec<&str> = rows.map(|row| row.split('`').nth(1).unwrap()).collect();
    let reasons = (1..).map_while(|number| PaceReason::try_from(number).ok());
    let name = |reason: PaceReason| reason.as_str_name().to_ascii_lowercase();
    let expected: Vec<String> = reasons.map(|it| name(it).replace("pace_reason_", "")).collect();
    assert_eq!(listed, expected);
}

/// Returns the lines of a log, each of which must be an object without objects in it.
fn lines(log: &str) -> Vec<Value> {
    let read = |line: &str| {
        let value: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}"));
        let fields = value.as_object().unwrap_or_else(|| panic!("no object: {line}"));
        for (key, field) in fields {
            assert!(!field.is_object() && !field.is_array(), "{key} in {line}");
        }
        for key in ["timestamp", "level", "message"] {
            assert!(fields[key].is_string(), "{key} in {line}");
        }
        value
    };
    log.lines().map(read).collect()
}

#[test]
fn a_log_of_json_has_one_object_in_each_line() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 2));
    let log = |name: &str| fs::read_to_string(scratch.path(name)).unwrap_or_default();
    let mut command = osteon();
    command.args(["coordinator", "--listen", "127.0.0.1:0", "--log-format", "json", "--store"]);
    command.arg(scratch.path("store"));
    let mut coordinator = Owned::spawn_logging(&mut command, &scratch.path("coordinator.log"));
    let url = coordinator.line();
    let mut command = osteon();
    command.args(["worker", "--coordinator", &url, "--threads", "1", "--log-format", "json"]);
    let mut worker = Owned::spawn_logging(&mut command, &scratch.path("worker.log"));
    // A name that would break a line, hide, or end a string.
    let name = "left \"tibia\" \u{202e}\u{e0041}";
    let client = |arguments: &[&str]| run(&[arguments, &["--coordinator", &url]].concat());
    let id = client(&["submit", text(&file), "--name", name, "--json"]).json();
    client(&["watch", id["job"].as_str().unwrap()]).succeeded();
    for process in [&mut worker, &mut coordinator] {
        process.signal("TERM");
        assert_eq!(process.code(), Some(0));
    }
    let told = lines(&log("coordinator.log"));
    let line = |message: &str| {
        let found = told.iter().find(|line| line["message"] == message);
        found.unwrap_or_else(|| panic!("{message} is not in {told:?}"))
    };
    let accepted = line("job accepted");
    assert_eq!((&accepted["job"], &accepted["name"]), (&id["job"], &name.into()));
    assert_eq!((&accepted["level"], &accepted["priority"]), (&"INFO".into(), &0.into()));
    let attached = line("worker attached");
    assert_eq!((&attached["worker"], &attached["slots"]), (&"1".into(), &1.into()));
    assert_eq!(attached["process"], worker.id());
    assert_eq!(line("job ended")["status"], "max_evaluations");
    assert!(line("job ended")["elapsed_s"].is_number());
    let hidden = log("coordinator.log").contains(['\u{202e}', '\u{e0041}']);
    assert!(!hidden);
    let told = lines(&log("worker.log"));
    assert!(told.iter().any(|line| line["message"] == "attached" && line["worker"] == "1"));

    // The reason of a failure is a line of the same kind.
    let arguments = ["worker", "--coordinator", &url, "--give-up-after", "0.2"];
    let gone = run(&[&arguments[..], &["--log-format", "json"]].concat());
    assert_eq!(gone.code, Some(1), "{gone:?}");
    let told = lines(&gone.stderr);
    let last = told.last().unwrap();
    assert_eq!((&last["level"], &last["exit_code"]), (&"ERROR".into(), &1.into()));
    assert!(last["reason"].as_str().unwrap().contains(&url), "{last}");
}
