//! `simulate --out`: a directory belongs to one case.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use support::{Finished, Scratch, run, text};

const FILES: [&str; 4] = ["case.toml", "provenance.json", "result.json", "traces.csv"];

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cases").join(name)
}

fn simulate(case: &Path, out: &Path, options: &[&str]) -> Finished {
    run(&[&["simulate", text(case), "--out", text(out)], options].concat())
}

/// Returns every file of a directory with its bytes.
fn files(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    let read = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()));
    read.collect()
}

fn refused(finished: &Finished, expected: &[&str]) {
    assert_eq!(finished.code, Some(2), "{finished:?}");
    for expected in expected {
        assert!(finished.stderr.contains(expected), "{expected}: {finished:?}");
    }
}

const SHORT: [&str; 4] = ["--duration", "2e-6", "--time-step", "1e-7"];

#[test]
fn a_directory_belongs_to_one_case() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let printed = simulate(&case("D.toml"), &out, &[&SHORT[..], &["--json"]].concat());
    let first = files(&out);
    assert_eq!(first.keys().map(String::as_str).collect::<Vec<_>>(), FILES);
    assert_eq!(printed.succeeded().as_bytes(), first["result.json"]);
    let lines = String::from_utf8(first["case.toml"].clone()).unwrap();
    let changed = lines.replace("threshold = 0.05", "threshold = 0.0625");
    let other = scratch.write("other.toml", &changed);
    let to_another = ["belongs to a different case", "choose another --out directory"];
    for (case, options, expected) in [
        (&case("A.toml"), SHORT, "there, `"),
        (&other, SHORT, "`threshold = 0.05  # of the packet's peak` there, `threshold = 0.0625"),
        (
            &case("D.toml"),
            ["--duration", "4e-6", "--time-step", "1e-7"],
            "duration 2e-6 s there, 4e-6 s here",
        ),
        (
            &case("D.toml"),
            ["--duration", "2e-6", "--time-step", "2e-7"],
            "time step 1e-7 s there, 2e-7 s here",
        ),
    ] {
        let again = simulate(case, &out, &options);
        refused(&again, &[&to_another[..], &[expected]].concat());
        assert_eq!(files(&out), first, "{expected}");
    }
    // The same case may be written differently; here it is the file that was written.
    let same = scratch.write("same.toml", &lines);
    simulate(&same, &out, &[&SHORT[..], &["--check"]].concat()).succeeded();
    assert_eq!(files(&out), first);
}

#[test]
fn what_is_not_known_to_be_of_the_case_is_not_replaced() {
    for (name, expected) in [
        ("traces.csv", "has a traces.csv but no case.toml"),
        ("result.json", "has a result.json but no case.toml"),
        ("job.toml", "holds the results of a job"),
    ] {
        let scratch = Scratch::new();
        let file = scratch.write(&format!("out/{name}"), "mine");
        refused(&simulate(&case("D.toml"), &scratch.path("out"), &SHORT), &[expected]);
        assert_eq!(fs::read_to_string(file).unwrap(), "mine");
        assert_eq!(files(&scratch.path("out")).len(), 1);
    }
}

#[test]
fn a_job_does_not_take_the_directory_of_a_case() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    simulate(&case("D.toml"), &out, &SHORT).succeeded();
    let before = files(&out);
    let job = scratch.write("job.toml", &support::job(4, 2));
    for command in ["identify", "propagate"] {
        let taken = run(&[command, text(&job), "--out", text(&out)]);
        refused(&taken, &["holds the results of a simulation", "choose another --out directory"]);
        assert_eq!(files(&out), before);
    }
}
