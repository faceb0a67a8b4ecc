//! `osteon check`: what a job will do and cost, told before it is run.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use serde_json::{Value, json};
use support::{Finished, Owned, Scratch, eventually, job, osteon, run, text};

/// Runs `check` on a job file of this text.
fn check(job: &str, options: &[&str]) -> Finished {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", job);
    run(&[&["check", text(&file)], options].concat())
}

/// Returns the text of a command without the numbers that differ from run to run.
fn without_times(printed: &str) -> String {
    let from_table = printed.split("\n\n").next().unwrap();
    from_table.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// A user checks a job, runs it, and finds what was said.
#[test]
fn what_is_said_of_a_job_is_what_it_does() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(16, 60));
    let said = run(&["check", text(&file), "--json"]).json();
    assert_eq!(said["kind"], "identification");
    assert_eq!(said["method"], "simplex");
    assert_eq!(said["free"], json!(["longitudinal_young_modulus", "dispersion"]));
    assert_eq!(
        (&said["sets"], &said["starts"], &said["realizations"]),
        (&json!(1), &json!(1), &json!(16))
    );
    assert_eq!(said["max_evaluations"], 62, "two of them for derivatives");
    let ran = run(&["identify", text(&file), "--json"]).json();
    assert!(ran["evaluations"].as_u64().unwrap() <= said["max_evaluations"].as_u64().unwrap());
    // The processor was busy for some time at every point that could be measured.
    let [least, most] = [0, 1].map(|end| number(&said["processor_s"][end]));
    assert!(0.0 < least && least <= most, "{said}");
    let wall = number(&said["wall_s"][1]);
    assert!(wall <= most && wall * number(&said["cores"]) >= most * (1.0 - 1e-9), "{said}");
    assert!(number(&said["start"]["mean_ms"]) > 0.0);
    assert_eq!(said["start"]["failures"], 0);
    let points = number(&said["box"]["points"]) + number(&said["box"]["unmeasured"]);
    assert_eq!(points, 13.0);
    if let Some(worst) = said["box"]["worst"].as_object() {
        assert!(number(&worst["mean_ms"]) >= number(&said["box"]["median_ms"]));
        let dispersion = number(&worst["parameters"]["dispersion"]);
        assert!((0.02..=0.3).contains(&dispersion), "{said}");
    }
}

#[test]
fn people_read_what_a_job_does_and_takes() {
    let checked = check(&job(16, 60), &[]);
    let printed = checked.succeeded();
    assert_eq!(
        without_times(printed),
        "the job is valid: an identification from the moments of the velocities; a search by simplex \
         for 2 free parameters (longitudinal_young_modulus, dispersion) at most 62 evaluations, each of \
         16 realizations"
    );
    for part in [
        "ms per realization",
        "at the start",
        "worst of these points",
        "expected: 58 to 62 evaluations",
    ] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    assert!(printed.lines().all(|line| line.chars().count() <= 80), "{printed}");
    assert_eq!(checked.stderr, "");
}

#[test]
fn every_kind_of_job_is_described() {
    let described = |job: &str, options: &[&str], expected: &str| {
        let said = without_times(check(job, options).succeeded());
        assert!(said.contains(expected), "{expected}: {said}");
    };
    let evaluation = "a propagation, the moments at the fixed and start values, without a search one \
                      evaluation of 16 realizations";
    described(&job(16, 60), &["--propagate"], evaluation);
    let data = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n";
    described(&job(16, 60).replace(data, ""), &[], evaluation);
    let by =
        |method: &str| job(16, 60).replace("[search]", &format!("[search]\nmethod = \"{method}\""));
    described(&(by("newton") + "starts = 3\n"), &[], "a search by newton for 2 free parameters");
    described(&(by("newton") + "starts = 3\n"), &[], "at most 182 evaluations from 3 starts");
    let counted = |job: String| job.replace(data, &format!("{data}count = 50\n"));
    let posterior = "the posterior, without a search, for 2 free parameters";
    described(&counted(by("posterior")), &[], posterior);
    let both = "(longitudinal_young_modulus, dispersion), and their posterior";
    described(&counted(job(16, 60) + "[posterior]\n"), &[], both);
    let groups = "[data]\ngroups = { a = [3900.0, 3950.0, 4000.0], b = [3800.0] }\n";
    let expected = "4 velocities of 2 groups, of which 1 can be searched";
    described(&job(16, 60).replace(data, groups), &[], expected);
}

/// Errors and warnings are those of the commands that run the job.
#[test]
fn what_a_run_refuses_or_warns_of_is_told() {
    let scratch = Scratch::new();
    for (from, to) in [
        ("realizations = 16", "realizations = 0"),
        ("mean = 3906.0", "mean = 12000.0"),
        ("[search]", "[serch]"),
        ("seed = 7", "seed = = 7"),
    ] {
        let file = scratch.write("bad.toml", &job(16, 60).replace(from, to));
        let (checked, ran) = (run(&["check", text(&file)]), run(&["identify", text(&file)]));
        assert_eq!((checked.code, checked.stdout.as_str()), (Some(2), ""), "{checked:?}");
        assert_eq!(checked.stderr, ran.stderr);
    }
    let absent = run(&["check", text(&scratch.path("absent.toml"))]);
    assert!(absent.code == Some(2) && absent.stderr.contains("No such file"), "{absent:?}");
    let unusual = check(&job(16, 60).replace("mean = 3906.0", "mean = 4700.0"), &[]);
    assert!(unusual.stderr.starts_with("warning: the mean is 4700, above"), "{unusual:?}");
    unusual.succeeded();
}

#[test]
fn a_case_file_is_sent_to_the_command_for_it() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/cases/A.toml");
    let refused = run(&["check", file]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let expected = "A.toml is not a job file but a case file, which describes one bone; `osteon simulate` solves it";
    assert!(refused.stderr.contains(expected), "{refused:?}");
}

/// A hundred evaluations of a million realizations take hours, whatever the machine.
#[test]
fn a_run_that_takes_long_is_announced() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(1_000_000, 400));
    let (mut command, log) = (osteon(), scratch.path("log"));
    let mut running = Owned::spawn_logging(command.args(["identify", text(&file)]), &log);
    let said = || std::fs::read_to_string(&log).unwrap_or_default();
    eventually("the note is on stderr", || said().contains("; see `osteon check`\n"));
    assert!(said().starts_with("note: "), "{}", said());
    // What the job has begun ends with it.
    running.signal("TERM");
    assert!(matches!(running.code(), Some(143) | None), "{}", said());
}

/// The page on searches lists every key.
#[test]
fn every_key_is_documented() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/searches.md");
    let page = std::fs::read_to_string(page).unwrap();
    let section = page.split("\n## Cost of a job\n").nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let said = check(&job(16, 60), &["--json"]).json();
    let keys = [&said, &said["start"], &said["box"]].map(|part| part.as_object().unwrap().keys());
    for key in keys.into_iter().flatten() {
        assert!(section.contains(&format!("`{key}`")), "{key}");
    }
}
