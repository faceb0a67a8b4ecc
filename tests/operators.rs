//! Operations on a running coordinator: listing workers and jobs, reading the log, checking its
//! health, copying its store, changing tokens and certificates.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[path = "support/secure.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod secure;
#[cfg(test)]
#[path = "support/service.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod service;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use secure::{Made, Secure, certificate};
use serde_json::Value;
use service::{Service, undisturbed};
use support::{
    Coordinator, Finished, Owned, Scratch, eventually, job, osteon, run, run_with, text, warnings,
};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Returns whether a value is a time of the last hour by RFC 3339.
fn is_recent(time: &Value) -> bool {
    let time = time.as_str().and_then(|time| OffsetDateTime::parse(time, &Rfc3339).ok());
    time.is_some_and(|time| {
        let age = OffsetDateTime::now_utc() - time;
        (-1..3600).contains(&age.whole_seconds())
    })
}

fn client(url: &str, arguments: &[&str]) -> Finished {
    run(&[arguments, &["--coordinator", url]].concat())
}

#[test]
fn an_operator_sees_the_workers_and_sends_one_away() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(2000, 400));
    let coordinator = Coordinator::start(&scratch.path("store"));
    assert_eq!(coordinator.client(&["worker", "list"]).succeeded(), "no workers\n");
    let mut first = coordinator.worker(1);
    let listed = || coordinator.client(&["worker", "list", "--json"]).json();
    eventually("a worker is attached", || listed()["workers"][0]["state"] == "ok");
    let _second = coordinator.worker(2);
    coordinator.submit(&file);
    eventually("both compute", || {
        let workers = listed()["workers"].clone();
        let rate = |i: usize| workers[i]["realizations_per_second"].as_f64() > Some(0.0);
        rate(0) && rate(1)
    });
    let workers = listed()["workers"].clone();
    assert_eq!(workers[0]["process"], first.id());
    assert_eq!((&workers[0]["slots"], &workers[1]["slots"]), (&1.into(), &2.into()));
    assert_eq!(workers[0]["version"], env!("CARGO_PKG_VERSION"));
    assert!(is_recent(&workers[0]["attached"]), "{workers}");
    assert!(workers[0]["silent_s"].as_f64() < Some(60.0), "{workers}");
    let table = coordinator.client(&["worker", "list"]).succeeded().to_owned();
    assert!(table.starts_with("NUMBER") && table.contains("STATE"), "{table}");
    assert_eq!(table.lines().count(), 3, "{table}");

    let number = workers[0]["number"].to_string();
    let drained = coordinator.client(&["worker", "drain", &number, "--json"]).json();
    assert_eq!(drained["state"], "draining");
    // It ends as if its own user had asked it to, and nobody is blamed.
    assert_eq!(first.code(), Some(0));
    eventually("it is gone", || listed()["workers"].as_array().map(Vec::len) == Some(1));
    let gone = listed()["departed"][0].clone();
    assert_eq!((&gone["number"], &gone["batches"]), (&workers[0]["number"], &0.into()));
    assert!(gone["reason"].as_str().unwrap().contains("drained"), "{gone}");
    assert!(is_recent(&gone["departed"]), "{gone}");
    let unknown = coordinator.client(&["worker", "drain", &number]);
    assert_eq!(unknown.code, Some(2), "{unknown:?}");
    assert!(unknown.stderr.contains(&format!("no worker with number {number}")), "{unknown:?}");
}

#[test]
fn a_job_says_whose_it_is_what_it_is_called_and_when_it_came() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 2));
    let mut service = Service::start(&scratch, &[]);
    let url = service.url().to_owned();
    let submit = |options: &[&str]| {
        let arguments = [&["submit", text(&file), "--json"], options].concat();
        let mut command = osteon();
        command.args(arguments).args(["--coordinator", &url]).env("USER", "ann");
        Finished::of(command.output().unwrap())
    };
    let named = ["--name", "left tibia, day 3", "--priority", "7", "--propagate"];
    let id = submit(&[&named[..], &["--request-id", "a"]].concat()).json()["job"].clone();
    // A repeated request is the same job, whatever its name.
    let other = submit(&["--name", "other", "--propagate", "--request-id", "a"]).json();
    assert_eq!(other["job"], id);
    // The reason for waiting is shown at once.
    let table = client(&url, &["jobs"]).succeeded().to_owned();
    assert!(table.contains("no worker is attached"), "{table}");
    let row = table.lines().nth(1).unwrap().to_owned();
    for expected in ["left tibia, day 3", "ann@", "  7  ", "  waiting  ", "Z  "] {
        assert!(row.contains(expected), "{expected}: {row}");
    }
    let check = |ended: bool| {
        let listed = client(&url, &["jobs", "--json"]).json();
        let job = &listed[0];
        assert_eq!((&job["job"], &job["name"]), (&id, &"left tibia, day 3".into()));
        assert!(job["user"].as_str().unwrap().starts_with("ann@"), "{job}");
        assert_eq!(job["priority"], 7);
        assert!(is_recent(&job["submitted"]), "{job}");
        assert_eq!(is_recent(&job["ended"]), ended, "{job}");
    };
    check(false);
    service.kill();
    service.start_again();
    check(false);
    let worker = service.worker(&scratch);
    client(&url, &["watch", id.as_str().unwrap()]).succeeded();
    check(true);
    drop(worker);
    service.end();
    service.start_again();
    check(true);
    // A complete propagation is not said to have converged.
    let table = client(&url, &["jobs"]).succeeded().to_owned();
    assert!(table.contains("  done  ") && !table.contains("converged"), "{table}");
    assert_eq!(client(&url, &["jobs", "--json"]).json()[0]["status"], "converged");
}

#[test]
fn the_log_tells_what_happened_to_every_job_and_worker() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 2));
    let mut service = Service::start(&scratch, &[]);
    let url = service.url().to_owned();
    let submitted = client(&url, &["submit", text(&file), "--name", "knee", "--json"]).json();
    let id = submitted["job"].as_str().unwrap().to_owned();
    let mut worker = service.worker(&scratch);
    client(&url, &["watch", &id]).succeeded();
    worker.signal("TERM");
    assert_eq!(worker.code(), Some(0));
    eventually("the worker is gone", || service.log().contains("worker disconnected"));
    service.end();
    service.start_again();
    let log = service.log();
    let line = |what: &str| {
        let found: Vec<&str> = log.lines().filter(|line| line.contains(what)).collect();
        assert!(!found.is_empty(), "{what} is not in the log:\n{log}");
        found
    };
    for (what, fields) in [
        ("listening", &["url=http://127.0.0.1:"] as &[&str]),
        ("worker attached", &["worker=1", "host=", "process=", "slots=1"]),
        ("worker disconnected", &["worker=1", "host=", "process=", "drained"]),
        ("job accepted", &["job=1", "user=", "name=\"knee\"", "kind=\"identification\""]),
        ("job started", &["job=1"]),
        (
            "job ended",
            &["job=1", "user=", "status=\"max_evaluations\"", "evaluations=", "elapsed_s="],
        ),
        ("stopping", &[]),
        ("stopped", &[]),
    ] {
        for field in fields {
            assert!(line(what).iter().all(|line| line.contains(field)), "{what}: {field}\n{log}");
        }
        line(what);
    }
    let recovered = line("jobs recovered");
    assert!(recovered[0].contains("unfinished_jobs=0 ended_jobs=0"), "{recovered:?}");
    assert!(recovered[1].contains("unfinished_jobs=0 ended_jobs=1"), "{recovered:?}");
    // None of this was an error.
    assert!(warnings(&log).is_empty(), "{log}");
    let worker = fs::read_to_string(scratch.path("workers.log")).unwrap();
    for what in ["attached", "worker=1", "draining", "ended"] {
        assert!(worker.contains(what), "{what}:\n{worker}");
    }
}

#[test]
fn a_log_level_that_cannot_be_meant_is_refused() {
    for value in ["warning", "osteon=loud"] {
        let refused =
            run_with(("RUST_LOG", value), &["jobs", "--coordinator", "unix:/nonexistent"]);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(
            refused.stderr.contains(value) && refused.stderr.contains("RUST_LOG"),
            "{refused:?}"
        );
    }
}

#[test]
fn a_probe_learns_from_the_exit_code_whether_a_coordinator_serves() {
    let mut secure = Secure::start();
    let ca = secure.scratch.path("certs/ca.pem");
    let url = secure.url.clone();
    // Works without a token, and with one that cannot be read.
    let health = |options: &[&str]| {
        let own = ["coordinator", "health", "--coordinator", &url, "--tls-ca", text(&ca)];
        run_with(("OSTEON_TOKEN_FILE", "/nonexistent"), &[&own, options].concat())
    };
    assert_eq!(health(&[]).succeeded(), "serving\n");
    assert_eq!(health(&["--json"]).json()["serving"], true);
    // A stopped coordinator accepts connections, but does not answer.
    secure.process.signal("STOP");
    let silent = health(&["--timeout", "0.5"]);
    secure.process.signal("CONT");
    assert_eq!(silent.code, Some(1), "{silent:?}");
    secure.process.signal("TERM");
    assert_eq!(secure.process.code(), Some(0));
    let gone = health(&[]);
    assert_eq!((gone.code, gone.stdout.as_str()), (Some(1), ""), "{gone:?}");
    assert!(gone.stderr.contains(&url), "{gone:?}");
    let gone = health(&["--json"]);
    assert_eq!(gone.code, Some(1), "{gone:?}");
    let told: Value = serde_json::from_str(&gone.stdout).unwrap();
    assert_eq!(told["serving"], false);
    assert!(told["reason"].as_str().unwrap().contains(&url), "{told}");
}

#[test]
fn a_backup_of_a_running_coordinator_is_a_store_to_go_on_from() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(300, 12));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let worker = coordinator.worker(1);
    let id = coordinator.submit(&file);
    eventually("the job is under way", || coordinator.job(&id)["evaluations"].as_u64() > Some(2));
    let copy = scratch.path("copy/of/monday");
    let made = coordinator.client(&["coordinator", "backup", text(&copy), "--json"]).json();
    let bytes = fs::metadata(copy.join("osteon.sqlite")).unwrap().len();
    assert_eq!(made["bytes"], bytes);
    assert_eq!(fs::read_dir(&copy).unwrap().count(), 1, "something else is left there");
    assert!(!scratch.path("store/osteon.backup").exists());
    // An existing file is never replaced.
    let before = fs::read(copy.join("osteon.sqlite")).unwrap();
    let again = coordinator.client(&["coordinator", "backup", text(&copy)]);
    assert_eq!(again.code, Some(2), "{again:?}");
    assert!(again.stderr.contains("already exists"), "{again:?}");
    assert_eq!(fs::read(copy.join("osteon.sqlite")).unwrap(), before);
    // Nor is a copy combined with another store's journal.
    let beside = scratch.path("beside");
    scratch.write("beside/osteon.sqlite-wal", "of another store");
    assert_eq!(coordinator.client(&["coordinator", "backup", text(&beside)]).code, Some(2));

    let digest = undisturbed("identify", &file);
    let ended = |coordinator: &Coordinator| {
        coordinator.client(&["watch", &id]).succeeded();
        let out = scratch.path(&format!("out-{}", coordinator.process.id()));
        coordinator.client(&["fetch", &id, "--out", text(&out)]).succeeded();
        let result = fs::read_to_string(out.join("result.json")).unwrap();
        serde_json::from_str::<Value>(&result).unwrap()["digest"].clone()
    };
    // The coordinator was not disturbed, and one that starts on the copy continues from there.
    assert_eq!(ended(&coordinator), digest.as_str());
    drop((worker, coordinator));
    let second = Coordinator::start(&copy);
    assert!(second.job(&id)["evaluations"].as_u64() > Some(2));
    assert_eq!(second.job(&id)["status"], Value::Null);
    let _worker = second.worker(1);
    assert_eq!(ended(&second), digest.as_str());
}

#[test]
fn earlier_names_of_commands_do_the_same() {
    let scratch = Scratch::new();
    let coordinator = Coordinator::start(&scratch.path("store"));
    for (earlier, new) in [
        (&["jobs"][..], &["job", "list"][..]),
        (&["jobs", "prune"], &["job", "prune"]),
        (&["workers"], &["worker", "list"]),
        (&["workers", "--json"], &["worker", "list", "--json"]),
        (&["health"], &["coordinator", "health"]),
    ] {
        let new = coordinator.client(new).succeeded().to_owned();
        assert_eq!(coordinator.client(earlier).succeeded(), new, "{earlier:?}");
    }
    for (earlier, new) in [
        (&["workers", "drain", "7"][..], &["worker", "drain", "7"][..]),
        (&["workers", "unban", "a"], &["worker", "unban", "a"]),
        (
            &["backup", text(&scratch.path("store"))],
            &["coordinator", "backup", text(&scratch.path("store"))],
        ),
    ] {
        let (earlier, new) = (coordinator.client(earlier), coordinator.client(new));
        assert_eq!((earlier.code, &earlier.stderr), (new.code, &new.stderr));
        assert_eq!(earlier.code, Some(2), "{earlier:?}");
    }
    let copy = scratch.path("copy");
    coordinator.client(&["backup", text(&copy)]).succeeded();
    assert!(copy.join("osteon.sqlite").exists());
}

#[test]
fn a_store_is_copied_for_admins_only() {
    let secure = Secure::start();
    let copy = secure.scratch.path("copy");
    let refused = secure.client("submit", &["coordinator", "backup", text(&copy)]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("this needs role admin"), "{refused:?}");
    assert!(!copy.join("osteon.sqlite").exists());
    secure.client("admin", &["coordinator", "backup", text(&copy)]).succeeded();
    assert!(copy.join("osteon.sqlite").exists());
}

/// Replaces the list of tokens by one that only its owner can read.
fn write_tokens(secure: &Secure, text: &str) {
    fs::write(secure.scratch.path("tokens"), text).unwrap();
}

#[test]
fn tokens_and_certificates_are_read_again_at_sighup() {
    let mut secure = Secure::start();
    let code = |secure: &Secure, role: &str| secure.client(role, &["jobs"]).code;
    let list = secure.read("tokens");
    let without: String = list
        .lines()
        .filter(|line| !line.contains("read-holder"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert_eq!(code(&secure, "read"), Some(0));
    write_tokens(&secure, &without);
    // Nothing changes before the signal.
    assert_eq!(code(&secure, "read"), Some(0));
    secure.process.signal("HUP");
    eventually("the token is withdrawn", || code(&secure, "read") == Some(1));
    assert!(secure.client("read", &["jobs"]).stderr.contains("does not accept the token"));
    assert_eq!(code(&secure, "submit"), Some(0));
    // A list that cannot be used changes nothing, and the log gives the reason.
    write_tokens(&secure, "nonsense\n");
    secure.process.signal("HUP");
    let told = "the previous tokens and certificates stay in use";
    eventually("the log says so", || secure.read("coordinator.log").contains(told));
    assert_eq!((code(&secure, "submit"), code(&secure, "read")), (Some(0), Some(1)));
    // The old list again, with a certificate for another host, which clients then refuse.
    write_tokens(&secure, &list);
    let later = OffsetDateTime::now_utc() + time::Duration::days(1);
    certificate(&secure.scratch, "server", Made::Server("elsewhere.example"), later);
    secure.process.signal("HUP");
    eventually("the certificate is another", || {
        let told = secure.client("submit", &["jobs"]);
        told.stderr.contains("elsewhere.example")
    });
    let later = OffsetDateTime::now_utc() + time::Duration::days(2);
    certificate(&secure.scratch, "server", Made::Server("127.0.0.1"), later);
    secure.process.signal("HUP");
    eventually("the token is taken again", || code(&secure, "read") == Some(0));
    secure.process.signal("TERM");
    assert_eq!(secure.process.code(), Some(0));
}

/// Runs a command with environment variables.
fn with(variables: &[(&str, &Path)], arguments: &[&str]) -> Finished {
    let mut command = osteon();
    command.args(arguments).envs(variables.iter().copied());
    Finished::of(command.output().unwrap())
}

#[test]
fn the_environment_names_what_every_command_repeats() {
    let secure = Secure::start();
    let scratch = &secure.scratch;
    let (ca, token) = (scratch.path("certs/ca.pem"), scratch.path("read.token"));
    let url = secure.url.clone();
    let own = [
        ("OSTEON_COORDINATOR", Path::new(&url)),
        ("OSTEON_TLS_CA", &ca),
        ("OSTEON_TOKEN_FILE", &token),
    ];
    with(&own, &["jobs"]).succeeded();
    // An option takes precedence.
    let file = scratch.write("job.toml", &job(20, 1));
    let weak = with(&own, &["submit", text(&file)]);
    assert_eq!(weak.code, Some(1), "{weak:?}");
    let strong = scratch.path("submit.token");
    with(&own, &["submit", text(&file), "--token-file", text(&strong)]).succeeded();
    // A worker takes its certificate from the environment, too.
    let files = ["worker.pem", "worker-key.pem"].map(|name| scratch.path("certs").join(name));
    let mut command = osteon();
    command.args(["worker", "--threads", "1"]).envs(own);
    command.env("OSTEON_TLS_CERT", &files[0]).env("OSTEON_TLS_KEY", &files[1]);
    let _worker = Owned::spawn_logging(&mut command, &scratch.path("worker.log"));
    eventually("the worker is attached", || {
        with(&own, &["worker", "list", "--json"]).json()["workers"].as_array().map(Vec::len)
            == Some(1)
    });
    // A run on this machine ignores them.
    let nowhere = Path::new("/nonexistent");
    let wrong = ["OSTEON_TLS_CA", "OSTEON_TLS_CERT", "OSTEON_TLS_KEY", "OSTEON_TOKEN_FILE"]
        .map(|it| (it, nowhere));
    with(&wrong, &["identify", text(&file), "--json"]).succeeded();
}

/// A token is not sent to a different coordinator on the command line, and the refusal says so.
#[test]
fn files_of_the_environment_are_not_used_for_another_coordinator() {
    let secure = Secure::start();
    let scratch = &secure.scratch;
    let (ca, token) = (scratch.path("certs/ca.pem"), scratch.path("read.token"));
    let jobs = ["jobs", "--coordinator", &secure.url];
    let own = [("OSTEON_TLS_CA", ca.as_path()), ("OSTEON_TOKEN_FILE", &token)];
    // If the environment names no coordinator, its files apply to any.
    with(&own, &jobs).succeeded();
    let files = ["worker.pem", "worker-key.pem"].map(|name| scratch.path("certs").join(name));
    let own = [
        ("OSTEON_COORDINATOR", Path::new("https://elsewhere.example:7000")),
        ("OSTEON_TLS_CA", &ca),
        ("OSTEON_TLS_CERT", &files[0]),
        ("OSTEON_TLS_KEY", &files[1]),
        ("OSTEON_TOKEN_FILE", &token),
    ];
    let check = |arguments: &[&str], code: i32, expected: &[&str]| {
        let refused = with(&own, arguments);
        assert_eq!(refused.code, Some(code), "{refused:?}");
        for part in expected {
            assert!(refused.stderr.contains(part), "{part} in {refused:?}");
        }
    };
    let every = "OSTEON_TLS_CA, OSTEON_TLS_CERT, OSTEON_TLS_KEY, OSTEON_TOKEN_FILE were not used";
    let why = "is not the one that OSTEON_COORDINATOR names";
    check(&jobs, 2, &["needs --tls-ca FILE", every, why]);
    check(
        &["coordinator", "health", "--coordinator", &secure.url],
        2,
        &["needs --tls-ca FILE", every, why],
    );
    let with_ca = [&jobs[..], &["--tls-ca", text(&ca)]].concat();
    check(
        &with_ca,
        1,
        &["requires a token", "OSTEON_TOKEN_FILE were not used", "--token-file FILE"],
    );
    let worker = ["worker", "--coordinator", &secure.url, "--tls-ca", text(&ca)];
    check(&worker, 1, &["give --tls-cert and --tls-key", "OSTEON_TLS_KEY", why]);
    let with_token = [&with_ca[..], &["--token-file", text(&token)]].concat();
    with(&own, &with_token).succeeded();
}
