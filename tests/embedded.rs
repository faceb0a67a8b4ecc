//! `identify` and `propagate` on worker processes of their own: the same bits for any number of
//! workers, results kept and resumed, nothing left behind.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "support/page.rs"]
mod page;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use page::Page;
use serde_json::Value;
use support::{
    Coordinator, Owned, Scratch, children, eventually, is_alive, job, option, osteon, run, signal,
    text, warnings,
};

#[test]
fn the_digest_does_not_depend_on_who_computes() {
    check_digest(&job(60, 8));
    let result = check_digest(&sampled(60, 8));
    assert_eq!(result["sampling"], "sobol");
    assert_eq!(result["scrambles"], 3);
    assert_eq!(result["control_variate"], true);
    assert_eq!(result["velocity"]["controlled"], true);
}

/// A job whose germs are Sobol' points, in three scrambles.
fn sampled(realizations: u32, evaluations: u32) -> String {
    let sampling = "seed = 7\nsampling = \"sobol\"\nscrambles = 3\ncontrol_variate = true\n";
    job(realizations, evaluations).replace("seed = 7\n", sampling)
}

fn check_digest(job: &str) -> Value {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", job);
    let mut results = BTreeSet::new();
    for (workers, threads) in [("1", "1"), ("2", "1"), ("3", "1"), ("1", "2"), ("2", "2")] {
        let arguments =
            ["identify", text(&job), "--json", "--workers", workers, "--threads", threads];
        results.insert(run(&arguments).succeeded().to_owned());
    }
    assert_eq!(results.len(), 1, "{results:?}");
    let result: Value = serde_json::from_str(results.first().unwrap()).unwrap();
    assert_eq!(result["digest"].as_str().unwrap().len(), 64);
    assert_eq!(result["evaluations"], 8);
    assert_eq!(result["status"], "max_evaluations");
    let errors = &result["solver"]["estimated_error"];
    let (median, largest) = (errors["median"].as_f64(), errors["largest"].as_f64());
    assert!(0.0 <= median.unwrap() && median <= largest, "{errors}");
    result
}

#[test]
fn propagate_has_the_bits_of_draw_and_simulate() {
    check_draws(&job(39, 1));
    check_draws(&sampled(39, 1));
}

fn check_draws(job: &str) {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", job);
    let out = scratch.path("out");
    let finished = run(&["propagate", text(&job), "--json", "--out", text(&out)]);
    // Workers that end with the run do not count as lost.
    assert!(warnings(&finished.stderr).is_empty(), "{finished:?}");
    let propagated = finished.json();
    assert_eq!(propagated["realizations"], 39);
    let file = fs::read_to_string(out.join("result.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&file).unwrap(), propagated);

    let csv = fs::read_to_string(out.join("realizations.csv")).unwrap();
    let rows: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!(rows.len(), 39);
    for index in [0, 1, 17, 38] {
        let case = run(&["draw", text(&job), "--index", &index.to_string()]);
        let at = ["draw", text(&job), "--index", &index.to_string(), "--at", text(&out)];
        assert_eq!(run(&at).succeeded(), case.succeeded());
        let case = scratch.write(&format!("{index}.toml"), case.succeeded());
        let velocity = run(&["simulate", text(&case), "--json"]).json()["velocity"].clone();
        let row: Vec<&str> = rows[index].split(',').collect();
        assert_eq!(row[0], index.to_string());
        let stored: f64 = row[1].parse().unwrap();
        assert_eq!(velocity.as_f64().unwrap().to_bits(), stored.to_bits(), "index {index}");
    }
}

#[test]
fn a_finished_directory_is_shown_again_and_another_job_refused() {
    let scratch = Scratch::new();
    let first = scratch.write("job.toml", &job(30, 4));
    let out = scratch.path("out");
    let arguments = ["identify", text(&first), "--json", "--out", text(&out)];
    let computed = run(&arguments);
    let names = |directory: &Path| {
        let entries = fs::read_dir(directory).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    };
    let expected =
        ["history.csv", "job.toml", "provenance.json", "realizations.csv", "result.json"];
    let listed: BTreeSet<String> = names(&out);
    assert_eq!(listed, expected.map(str::to_owned).into());

    let modified = || fs::metadata(out.join("result.json")).unwrap().modified().unwrap();
    let before = modified();
    assert_eq!(run(&arguments).succeeded(), computed.succeeded());
    assert_eq!(modified(), before);

    let other = scratch.write("other.toml", &job(31, 4));
    let refused = run(&["identify", text(&other), "--out", text(&out)]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("different specification"), "{refused:?}");
    assert!(refused.stderr.contains("realizations = 31"), "{refused:?}");
    let refused = run(&["propagate", text(&first), "--out", text(&out)]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert_eq!(modified(), before);

    // A realization of its best point requires its own job.
    let draw = |job: &Path| run(&["draw", text(job), "--index", "3", "--at", text(&out)]);
    let drawn = draw(&first);
    assert!(drawn.succeeded().contains("mandel"), "{drawn:?}");
    let refused = draw(&other);
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
    assert!(refused.stderr.contains("realizations = 31"), "{refused:?}");
}

#[test]
fn the_stored_job_is_complete_and_runs_to_the_same_bits() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &sampled(30, 4));
    let (first, second) = (scratch.path("first"), scratch.path("second"));
    run(&["identify", text(&job), "--out", text(&first)]).succeeded();
    run(&["identify", text(&first.join("job.toml")), "--out", text(&second)]).succeeded();
    for name in ["job.toml", "result.json", "history.csv", "realizations.csv"] {
        let bytes = |directory: &Path| fs::read(directory.join(name)).unwrap();
        assert_eq!(bytes(&first), bytes(&second), "{name}");
    }
}

/// Returns the same job in other words: sections and keys in another order, with comments.
fn in_other_words(job: &str) -> String {
    let sections: Vec<&str> = job.trim().split("\n[").collect();
    let mut text = "# The same job.\n".to_owned();
    for section in sections.iter().rev() {
        let mut lines = section.lines();
        let name = lines.next().unwrap().trim_start_matches('[');
        text.push_str(&format!("\n[{name} # a section\n"));
        let mut keys: Vec<&str> = lines.collect();
        keys.reverse();
        keys.iter().for_each(|key| text.push_str(&format!("  {key}   # a key\n")));
    }
    text
}

#[test]
fn a_job_in_other_words_over_a_touched_file_is_the_same_job() {
    let scratch = Scratch::new();
    let velocities: String = (0..30).map(|i| format!("{}\n", 3900 + 7 * i % 40)).collect();
    let csv = format!("velocity\n{velocities}");
    scratch.write("velocities.csv", &csv);
    let moments = "mean = 3906.0\ncoefficient_of_variation = 0.0271\n";
    let text_of = job(30, 4).replace(moments, "velocities = \"velocities.csv\"\n");
    let file = scratch.write("job.toml", &text_of);
    let out = scratch.path("out");
    let arguments = ["identify", text(&file), "--json", "--out", text(&out)];
    let first = run(&arguments).succeeded().to_owned();
    let modified = || fs::metadata(out.join("result.json")).unwrap().modified().unwrap();
    let before = modified();
    scratch.write("velocities.csv", &format!("# measured again? no\n{csv}"));
    scratch.write("job.toml", &in_other_words(&text_of));
    assert_eq!(run(&arguments).succeeded(), first);
    assert_eq!(modified(), before, "it was computed again");
    let anew = run(&["identify", text(&file), "--json"]).json();
    assert!(first.contains(anew["digest"].as_str().unwrap()), "{anew}");
}

#[test]
fn an_interrupted_run_is_continued_by_the_same_job_in_other_words() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let (LongRun { mut process, .. }, stored) = LongRun::under_way(&scratch, &out);
    process.signal("TERM");
    assert_eq!(process.code(), Some(143));
    let mut run = LongRun::start_as(&in_other_words(&long_job()), &scratch, &out);
    let mut first = None;
    eventually("the job goes on", || {
        first = only_evaluations(&run.url);
        first.is_some()
    });
    assert!(first >= Some(stored), "{first:?} of {stored} evaluations");
    assert_eq!(run.process.code(), Some(0));
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    assert_eq!(&serde_json::from_str::<Value>(&result).unwrap(), undisturbed());
}

/// A search of a few seconds.
fn long_job() -> String {
    job(60, 50)
}

/// Returns the result of [`long_job`] without any disturbance.
fn undisturbed() -> &'static Value {
    static RESULT: OnceLock<Value> = OnceLock::new();
    RESULT.get_or_init(|| {
        let scratch = Scratch::new();
        let job = scratch.write("job.toml", &long_job());
        run(&["identify", text(&job), "--json"]).json()
    })
}

/// A run of [`long_job`] in `out`.
struct LongRun {
    process: Owned,
    workers: Vec<u32>,
    /// URL of its coordinator.
    url: String,
}

impl LongRun {
    fn start(scratch: &Scratch, out: &Path) -> Self {
        Self::start_as(&long_job(), scratch, out)
    }

    /// Same as [`start`](Self::start), with another text of the job.
    fn start_as(job: &str, scratch: &Scratch, out: &Path) -> Self {
        let job = scratch.write("long.toml", job);
        let mut command = osteon();
        command.args(["identify", text(&job), "--json", "--out", text(out)]);
        let process = Owned::spawn_logging(&mut command, &scratch.path("run.log"));
        let (mut workers, mut url) = (Vec::new(), None);
        eventually("two workers run", || {
            workers = children(process.id());
            url = workers.first().and_then(|&worker| option(worker, "--coordinator"));
            workers.len() == 2 && url.is_some()
        });
        Self { process, workers, url: url.unwrap() }
    }

    /// Same as [`start`](Self::start), and waits until some evaluations are stored; returns their
    /// number.
    fn under_way(scratch: &Scratch, out: &Path) -> (Self, u64) {
        let run = Self::start(scratch, out);
        let mut stored = 0;
        eventually("some evaluations are stored", || {
            stored = only_evaluations(&run.url).unwrap_or(0);
            stored >= 3
        });
        (run, stored)
    }
}

/// Returns the number of stored evaluations of the only job at `url`; `None` if there is none yet.
fn only_evaluations(url: &str) -> Option<u64> {
    let listed = run(&["jobs", "--json", "--coordinator", url]);
    let listed: Value = serde_json::from_str(&listed.stdout).ok()?;
    let jobs = listed.as_array()?;
    assert!(jobs.len() <= 1, "{jobs:?}");
    jobs.first().map(|job| job["evaluations"].as_u64().unwrap())
}

/// Resumes the run in `out`: the stored evaluations are there without any worker, and the job is
/// the same.
fn continues(scratch: &Scratch, out: &Path, stored: u64) {
    assert!(!out.join("result.json").exists());
    let idle = Coordinator::start(&out.join("store"));
    let found = only_evaluations(&idle.url);
    assert!(found >= Some(stored), "{found:?} of {stored} evaluations");
    drop(idle);

    let mut run = LongRun::start(scratch, out);
    let mut first = None;
    eventually("the job goes on", || {
        first = only_evaluations(&run.url);
        first.is_some()
    });
    assert!(first >= found, "{first:?} of {found:?} evaluations");
    assert_eq!(run.process.code(), Some(0));
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    assert_eq!(&serde_json::from_str::<Value>(&result).unwrap(), undisturbed());
}

#[test]
fn an_interrupted_run_ends_its_workers_and_can_be_continued() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let (LongRun { mut process, workers, .. }, stored) = LongRun::under_way(&scratch, &out);
    process.signal("TERM");
    assert_eq!(process.code(), Some(143));
    // Their parent reaped them before it ended.
    assert!(workers.iter().all(|&worker| !is_alive(worker)), "{workers:?}");
    // They held batches, but this process ended them itself: they are not lost.
    let log = fs::read_to_string(scratch.path("run.log")).unwrap();
    assert!(warnings(&log).is_empty(), "{log}");
    continues(&scratch, &out, stored);
}

#[test]
fn workers_of_a_killed_run_go_away_and_it_can_be_continued() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let (LongRun { mut process, workers, .. }, stored) = LongRun::under_way(&scratch, &out);
    process.kill();
    eventually("the workers leave", || workers.iter().all(|&worker| !is_alive(worker)));
    continues(&scratch, &out, stored);
}

#[test]
fn a_run_whose_store_is_full_says_so_and_can_be_continued() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let job = scratch.write("long.toml", &long_job());
    // Files may not grow beyond 512 KiB, which is enough for some evaluations.
    let limited = "trap '' XFSZ; ulimit -f 512; exec \"$@\"";
    let program = osteon();
    let output = Command::new("bash")
        .args(["-c", limited, "bash"])
        .arg(program.get_program())
        .args(["identify", text(&job), "--json", "--out", text(&out)])
        .env_remove("OSTEON_COORDINATOR")
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{stderr}");
    assert!(stderr.contains("store has refused a record"), "{stderr}");
    continues(&scratch, &out, 3);
}

#[test]
fn a_killed_worker_is_replaced() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let (LongRun { mut process, workers, .. }, _) = LongRun::under_way(&scratch, &out);
    signal(workers[0], "KILL");
    eventually("another worker is started", || {
        let now = children(process.id());
        now.len() == 2 && !now.contains(&workers[0])
    });
    assert_eq!(process.code(), Some(0));
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    assert_eq!(&serde_json::from_str::<Value>(&result).unwrap(), undisturbed());
}

#[test]
fn two_runs_do_not_share_a_directory() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let _running = LongRun::under_way(&scratch, &out);
    let job = scratch.path("long.toml");
    let second = run(&["identify", text(&job), "--out", text(&out)]);
    assert_eq!(second.code, Some(1), "{second:?}");
    assert!(second.stderr.contains("another osteon is running"), "{second:?}");
}

#[test]
fn a_propagation_above_the_accepted_fraction_fails() {
    let scratch = Scratch::new();
    // The direct wave in such a fast coupling overtakes the wave through the bone.
    let slow = job(10, 1)
        + "[layers]\ncoupling = { thickness = 10e-3, density = 1000.0, sound_speed = 6000.0 }\n";
    let job = scratch.write("job.toml", &slow);
    let failed = run(&["propagate", text(&job), "--json"]);
    assert_eq!(failed.code, Some(1), "{failed:?}");
    let result: Value = serde_json::from_str(&failed.stdout).unwrap();
    assert_eq!(result["failures"]["direct_wave_first"], 10);
    assert_eq!(result["velocity"]["mean"], Value::Null);
}

/// A run on this machine shows itself in a browser.
#[test]
fn a_run_of_ones_own_has_a_page_until_it_ends() {
    let scratch = Scratch::new();
    let (file, log) = (scratch.write("job.toml", &job(1000, 300)), scratch.path("run.log"));
    let mut command = osteon();
    // The page is that of this machine, whatever the variable says.
    command.env("OSTEON_COORDINATOR", "http://127.0.0.1:1");
    command.args(["identify", text(&file), "--name", "mine", "--http", "127.0.0.1:0"]);
    let mut process = Owned::spawn_logging(&mut command, &log);
    let mut url = None;
    eventually("the run names its page", || {
        let log = fs::read_to_string(&log).unwrap();
        let line = log.lines().find_map(|line| line.split_once("live page: http://"));
        url = line.and_then(|(_, rest)| Some(rest.split_once("/ (")?.0.to_owned()));
        url.is_some()
    });
    let page = Page { address: url.unwrap() };
    let mut updates = page.events("job=1", &[]).unwrap();
    updates.until("figures", |it| it["figures"].as_array().is_some_and(|all| !all.is_empty()));
    assert_eq!(page.get("/data/jobs").json()["jobs"][0]["name"], "mine");
    process.signal("TERM");
    assert_eq!(process.code(), Some(143));
    for (options, advice) in [
        (&["--http", "0.0.0.0:0"][..], "on this machine only"),
        (&["--http", "127.0.0.1:0", "--coordinator", "http://127.0.0.1:1"], "cannot be used with"),
    ] {
        let mut words = vec!["identify", text(&file)];
        words.extend(options);
        let refused = run(&words);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(advice), "{refused:?}");
    }
}

/// Few open files are named before anything starts, with the number that is needed, with which it runs.
#[test]
fn too_few_open_files_are_named_at_once() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(8, 2));
    let out = scratch.path("out");
    let limited = |most: u64| {
        let program = osteon();
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -n $0; exec \"$@\"", &most.to_string()]);
        command.arg(program.get_program()).args(["identify", text(&file), "--workers", "2"]);
        support::remove_settings(&mut command);
        support::Finished::of(command.args(["--out", text(&out)]).output().unwrap())
    };
    let mut needed = None;
    for most in [16, 24, 28, 32] {
        let refused = limited(most);
        assert_eq!(refused.code, Some(1), "{most}: {refused:?}");
        let (_, told) = refused.stderr.split_once("this process may have ").unwrap();
        let (found, told) = told.split_once(" open files and needs ").unwrap();
        assert_eq!(found, most.to_string());
        needed = told.split_once(": raise the hard limit (`ulimit -n ").unwrap().0.parse().ok();
        assert!(!refused.stderr.contains("trying again"), "{most}: {refused:?}");
        assert!(!out.exists(), "{most}");
    }
    limited(needed.unwrap()).succeeded();
}
