//! Bad input: exit code 2, a message that names the field or the file and line, nothing on
//! stdout, nothing written.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::path::Path;

use support::{OPTIMUM, Scratch, job, run, text};

/// A case file with `bone` as its section.
fn case(bone: &str) -> String {
    format!("[bone]\ndensity = 1598.8\n{bone}")
}

/// The engineering constants of the optimum, one of them changed.
fn constants(name: &str, value: &str) -> String {
    let line = |&(key, number, ..): &(&str, f64, f64, f64)| {
        if key == name { format!("{key} = {value}\n") } else { format!("{key} = {number:?}\n") }
    };
    format!("[bone]\n{}", OPTIMUM[..6].iter().map(line).collect::<String>())
}

/// A Mandel matrix of 1e10 on the diagonal with one other entry.
fn mandel(row: usize, column: usize, value: f64) -> String {
    let entry = |i: usize, j: usize| match (i, j) {
        _ if (i, j) == (row, column) => value,
        _ if i == j => 1e10,
        _ => 0.0,
    };
    let rows: Vec<_> =
        (0..6).map(|i| format!("{:?}", (0..6).map(|j| entry(i, j)).collect::<Vec<_>>())).collect();
    case(&format!("mandel = [{}]\n", rows.join(", ")))
}

/// Runs `command` on `file` and asserts that it is refused with every text of `expected`, and
/// that --out was not touched.
fn refused(scratch: &Scratch, command: &str, file: &Path, expected: &[&str]) {
    let out = scratch.path("out");
    let finished = run(&[command, text(file), "--out", text(&out)]);
    assert_eq!(finished.code, Some(2), "{expected:?}: {finished:?}");
    assert_eq!(finished.stdout, "", "{expected:?}");
    for part in expected {
        assert!(finished.stderr.contains(part), "{part} is not in: {}", finished.stderr);
    }
    assert!(!out.exists(), "{expected:?}");
}

fn check_case(text: &str, expected: &[&str]) {
    let scratch = Scratch::new();
    let file = scratch.write("case.toml", text);
    refused(&scratch, "simulate", &file, expected);
}

/// Checks both commands that run a job.
fn check_job(text: &str, expected: &[&str]) {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", text);
    refused(&scratch, "identify", &file, expected);
    refused(&scratch, "propagate", &file, expected);
}

#[test]
fn missing_files_are_named() {
    let scratch = Scratch::new();
    for command in ["identify", "propagate", "simulate"] {
        refused(&scratch, command, &scratch.path("absent.toml"), &["absent.toml", "No such file"]);
    }
}

#[test]
fn malformed_toml_is_shown_by_line() {
    check_case("[bone]\ndensity = = 1\n", &["case.toml", "line 2"]);
    check_job(&(job(10, 1) + "[layers\n"), &["job.toml", "line"]);
}

#[test]
fn unknown_keys_get_the_nearest_known_one() {
    check_case(
        &constants("", "").replace("density", "densty"),
        &["bone.densty", "did you mean", "density"],
    );
    check_case(
        "[layers]\nmarow = { thickness = 1e-2 }\n[bone]\ndensity = 1.0\n",
        &["layers.marow", "marrow"],
    );
    check_job(&(job(10, 1) + "[picking]\ntreshold = 0.1\n"), &["picking.treshold", "threshold"]);
}

#[test]
fn numbers_out_of_range_name_their_field() {
    check_case(&constants("density", "0.0"), &["bone.density", "above 0"]);
    check_case(&constants("density", "-1598.8"), &["bone.density", "above 0"]);
    check_case(&constants("density", "nan"), &["bone.density"]);
    check_case(&constants("transverse_poisson_ratio", "1.2"), &["transverse_poisson_ratio", "1.2"]);
    check_case(&constants("longitudinal_young_modulus", "1e9"), &["bone", "not admissible"]);
    check_job(&job(0, 1), &["monte_carlo.realizations", "0"]);
    let start = job(10, 1).replace("start = 0.11319", "start = 0.31");
    check_job(&start, &["parameters.dispersion.start", "0.31", "0.3"]);
    let dispersion = job(10, 1).replace("[0.02, 0.3]", "[0.02, 0.8]");
    check_job(&dispersion, &["parameters.dispersion.bounds", "0.8", "0.797"]);
}

#[test]
fn a_matrix_must_be_an_elasticity() {
    check_case(&mandel(0, 3, 1e9), &["bone.mandel", "symmetric"]);
    check_case(&mandel(4, 4, -1e10), &["bone.mandel", "positive definite"]);
    check_case(&case("mandel = [[1.0]]\n"), &["bone.mandel", "6 rows"]);
    check_case(&(constants("", "") + "mandel = []\n"), &["bone.mandel", "not both"]);
}

#[test]
fn source_and_receivers_must_be_in_the_coupling() {
    let with = |probe: &str| constants("", "") + "[probe]\n" + probe;
    let receivers = "receivers = { first_x1 = 11e-3, pitch = 0.8e-3, count = 14, x3 = 12e-3 }\n";
    check_case(&with(receivers), &["probe.receivers.x3", "0.012"]);
    check_case(&with("source = { x1 = 0.0, x3 = -1e-3 }\n"), &["probe.source.x3", "-0.001"]);
    let few = "receivers = { first_x1 = 11e-3, pitch = 0.8e-3, count = 2, x3 = 2e-3 }\n";
    check_case(&with(few), &["probe.receivers.count", "2", "3"]);
}

#[test]
fn bad_velocities_are_shown_by_file_and_line() {
    let check = |csv: Option<&str>, expected: &[&str]| {
        let scratch = Scratch::new();
        let text = job(10, 1).replace(
            "mean = 3906.0\ncoefficient_of_variation = 0.0271\n",
            "velocities = \"v.csv\"\n",
        );
        let file = scratch.write("job.toml", &text);
        if let Some(csv) = csv {
            scratch.write("v.csv", csv);
        }
        refused(&scratch, "identify", &file, expected);
    };
    check(None, &["v.csv", "No such file"]);
    check(Some("velocity\n3900.0\nfast\n"), &["v.csv", "line 3", "fast"]);
    check(Some("velocity\n"), &["v.csv"]);
    check(Some(""), &["v.csv"]);
    check(Some("velocity\n3900.0\n-3900.0\n"), &["v.csv", "line 3", "-3900"]);
    check(Some("velocity\n3900.0\nNaN\n"), &["v.csv", "line 3"]);
    check(Some("speed\n3900.0\n3901.0\n"), &["v.csv", "velocity"]);
}

#[test]
fn all_mistakes_are_reported_at_once() {
    let text = job(0, 0) + "[solver]\nrefinement = 100.0\n[picking]\nthreshold = 2.0\n";
    check_job(
        &text,
        &[
            "monte_carlo.realizations",
            "search.max_evaluations",
            "solver.refinement",
            "picking.threshold",
        ],
    );
}

#[test]
fn a_realization_that_does_not_exist_is_refused() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(10, 1));
    let drawn = run(&["draw", file.to_str().unwrap(), "--index", "10"]);
    assert_eq!(drawn.code, Some(2), "{drawn:?}");
    assert!(drawn.stderr.contains("0 to 9"), "{drawn:?}");
    let at = ["draw", file.to_str().unwrap(), "--index", "1", "--at", "/nonexistent"];
    let drawn = run(&at);
    assert_eq!(drawn.code, Some(2), "{drawn:?}");
    assert!(drawn.stderr.contains("result.json"), "{drawn:?}");
}

#[test]
fn a_directory_of_results_that_cannot_be_one_is_bad_input() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(10, 1));
    let case = scratch.write("case.toml", &constants("density", "1598.8"));
    let file = scratch.write("file", "a file");
    let below = file.join("out");
    // No file system lets anybody, root included, make directories there.
    let forbidden = Path::new("/proc/osteon");
    for out in [file.as_path(), &below, forbidden] {
        for (command, input) in [("identify", &job), ("propagate", &job), ("simulate", &case)] {
            let finished = run(&[command, text(input), "--out", text(out)]);
            let context = format!("{command} --out {}: {finished:?}", out.display());
            assert_eq!((finished.code, finished.stdout.as_str()), (Some(2), ""), "{context}");
            assert!(finished.stderr.contains(text(out)), "{context}");
        }
    }
}

#[test]
fn usage_errors_are_bad_input() {
    for arguments in [
        &["identify"] as &[&str],
        &["identify", "a.toml", "--unknown"],
        &["identify", "a.toml", "--workers", "0"],
        &["frobnicate"],
        &[],
    ] {
        let finished = run(arguments);
        assert_eq!((finished.code, finished.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(
            finished.stderr.contains("--help") || finished.stderr.contains("Usage"),
            "{finished:?}"
        );
    }
}
