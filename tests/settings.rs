//! `--set`, `--seed` and jobs from standard input: what they change is as if it stood in the file.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::io::Write as _;
use std::process::Stdio;

use support::{Finished, Scratch, job, osteon, run, text};

/// Runs the program with this text on standard input.
fn run_on(input: &str, arguments: &[&str]) -> Finished {
    let mut command = osteon();
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // The program may refuse the text before it has read all of it.
    let _closed = child.stdin.take().unwrap().write_all(input.as_bytes());
    Finished::of(child.wait_with_output().unwrap())
}

#[test]
fn settings_are_as_if_they_stood_in_the_file() {
    let scratch = Scratch::new();
    let plain = scratch.write("plain.toml", &job(8, 1));
    let edited =
        job(8, 1).replace("seed = 7", "seed = 9").replace("realizations = 8", "realizations = 6");
    let edited = scratch.write("edited.toml", &edited);
    let out = |name: &str| scratch.path(name);
    let [set, file] = [out("set"), out("file")];
    let by_options = [
        "propagate",
        text(&plain),
        "--set",
        "monte_carlo.realizations=6",
        "--seed",
        "9",
        "-o",
        text(&set),
        "--json",
    ];
    let by_options = run(&by_options).json();
    let by_file = run(&["propagate", text(&edited), "--out", text(&file), "--json"]).json();
    assert_eq!(by_options, by_file);
    // The job that was run is beside its results, and gives the same again.
    let job_of =
        |directory: &std::path::Path| fs::read_to_string(directory.join("job.toml")).unwrap();
    assert_eq!(job_of(&set), job_of(&file));
    let again = run(&["propagate", text(&set.join("job.toml")), "--json"]).json();
    assert_eq!(again, by_options);
    // Another job in the same directory is refused, as with another file.
    let other = run(&["propagate", text(&plain), "--out", text(&set)]);
    assert_eq!(other.code, Some(2), "{other:?}");
    assert!(other.stderr.contains("realizations = 6"), "{other:?}");
}

#[test]
fn a_table_is_replaced_as_a_whole_and_the_last_setting_counts() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(8, 1));
    let drawn = |settings: &[&str]| {
        let mut words = vec!["draw", text(&file), "--index", "1"];
        settings.iter().for_each(|setting| words.extend(["--set", setting]));
        run(&words).succeeded().to_owned()
    };
    let fixed = "parameters.longitudinal_young_modulus={ fixed = 17e9 }";
    let started = "parameters.longitudinal_young_modulus.start=17e9";
    assert_eq!(drawn(&[fixed]), drawn(&[started]));
    assert_ne!(drawn(&[fixed]), drawn(&[]));
    let twice = ["layers.bone.thickness=3e-3", "layers.bone.thickness=4e-3"];
    assert_eq!(drawn(&twice), drawn(&[]));
}

#[test]
fn a_job_or_case_is_read_from_standard_input() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(8, 1));
    let of_file = run(&["draw", text(&file), "--index", "3"]);
    let drawn = run_on(&job(8, 1), &["draw", "-", "--index", "3"]);
    assert_eq!(drawn.succeeded(), of_file.succeeded());
    let case = drawn.succeeded();
    let velocity = run_on(case, &["simulate", "-", "--json"]).json()["velocity"].as_f64();
    assert!(velocity.unwrap() > 3000.0);
    // JSON is known by its brace.
    let json: toml::Value = toml::from_str(case).unwrap();
    let json = serde_json::to_string(&json).unwrap();
    assert_eq!(run_on(&json, &["simulate", "-", "--json"]).json()["velocity"].as_f64(), velocity);
    let check = |input: &str, expected: &str| {
        let refused = run_on(input, &["identify", "-"]);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
    };
    check("", "<stdin>: ");
    check("[data\n", "<stdin>:1:6: not valid TOML");
    check(
        &(job(8, 1) + "[solver]\nrefinement = 99\n"),
        "<stdin>:26:14: solver.refinement: is 99.0",
    );
    check("{\"data\": 1", "<stdin>:1:10: not valid JSON");
}

#[test]
fn a_text_without_end_is_refused() {
    let endless = fs::File::open("/dev/zero").unwrap();
    let refused = osteon().args(["simulate", "-"]).stdin(endless).output().unwrap();
    let refused = Finished::of(refused);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("<stdin> is longer than"), "{refused:?}");
}
