//! Bad input gives exit code 2, a message that names the field or the file and line, no output on
//! stdout, and no files.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use osteon_common::visible::is_hidden;
use support::{Finished, OPTIMUM, Scratch, job, osteon, run, text};

/// A case file with `bone` as its section.
fn case(bone: &str) -> String {
    format!("[bone]\ndensity = 1598.8\n{bone}")
}

/// The engineering constants of the optimum, with one of them changed.
fn constants(name: &str, value: &str) -> String {
    let line = |&(key, number, ..): &(&str, f64, f64, f64)| {
        if key == name { format!("{key} = {value}\n") } else { format!("{key} = {number:?}\n") }
    };
    format!("[bone]\n{}", OPTIMUM[..6].iter().map(line).collect::<String>())
}

/// A Mandel matrix with 1e10 on the diagonal and one other entry.
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

/// Runs `command` on `file` and checks that it is refused with every text of `expected`, and that
/// --out was not touched.
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
    check_case(
        "[bone]\ndensity = = 1\n",
        &["case.toml:2:11: not valid TOML", "\n2 | density = = 1\n  |           ^"],
    );
    check_job(&(job(10, 1) + "[layers\n"), &["job.toml:25:8: not valid TOML", "[layers"]);
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
fn numbers_in_other_units_are_asked_about() {
    let changed = |from: &str, to: &str| {
        let text = job(10, 1);
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    };
    let velocity = ["data.mean", "3.9", "did you mean 3.9 km/s (3.9e3)?"];
    check_job(&changed("mean = 3906.0", "mean = 3.9"), &velocity);
    let variation = ["data.coefficient_of_variation", "did you mean 2.7 % (0.027)?"];
    check_job(&changed("variation = 0.0271", "variation = 2.7"), &variation);
    let thickness = ["layers.bone.thickness: is 4.0", "did you mean 4 mm (4e-3)?"];
    check_job(&(job(10, 1) + "[layers]\nbone = { thickness = 4 }\n"), &thickness);
    let frequency = ["probe.center_frequency: is 1.0", "did you mean 1 MHz (1e6)?"];
    check_job(&(job(10, 1) + "[probe]\ncenter_frequency = 1\n"), &frequency);
    let gigapascal = changed("19488700000.0", "20")
        .replace("[12000000000.0, 25000000000.0]", "[12, 25]")
        .replace("4795000000.0", "4.795")
        .replace("9825400000.0", "9.8254");
    let moduli = [
        "4 errors",
        "parameters.longitudinal_young_modulus.start: is 20.0; values are in Pa: did you mean 20 GPa (20e9)?",
        "parameters.longitudinal_young_modulus.bounds: are 12.0 and 25.0",
        "parameters.longitudinal_shear_modulus.fixed: is 4.795",
        "parameters.transverse_young_modulus.fixed: is 9.8254",
    ];
    check_job(&gigapascal, &moduli);
    check_case(
        &constants("longitudinal_young_modulus", "17.717"),
        &["1 error", "bone.longitudinal_young_modulus", "did you mean 17.717 GPa (17.717e9)?"],
    );
    check_case(&constants("density", "1.6"), &["bone.density", "did you mean 1.6 g/cm³ (1.6e3)?"]);
}

#[test]
fn data_that_no_point_can_reach_are_refused() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(10, 1).replace("mean = 3906.0", "mean = 12000.0"));
    let expected = "data.mean: is 12000.0; the bounds of [parameters] allow mean velocities of about 2700 \
                    to 4700 m/s";
    refused(&scratch, "identify", &file, &[expected]);
}

/// Unusual values are accepted after a warning on stderr.
#[test]
fn unusual_numbers_are_warned_of_and_computed_with() {
    let warned = |command: &str, name: &str, text: &str, expected: &[&str]| {
        let scratch = Scratch::new();
        let finished = run(&[command, scratch.write(name, text).to_str().unwrap()]);
        assert_eq!(finished.code, Some(0), "{finished:?}");
        let warnings: Vec<&str> =
            finished.stderr.lines().filter(|line| line.starts_with("warning: ")).collect();
        assert_eq!(warnings.len(), expected.len(), "{warnings:?}");
        for (warning, expected) in warnings.iter().zip(expected) {
            assert!(warning.contains(expected), "{expected} is not in: {warning}");
        }
    };
    warned("identify", "job.toml", &job(8, 2), &[]);
    warned("propagate", "job.toml", &job(8, 1), &[]);
    let deep = "[layers]\nmarrow = { thickness = 11 }\n";
    let unusual =
        "layers.marrow.thickness: is 11 m; usual is up to 0.3 m; did you mean 11 mm (11e-3)?";
    warned("simulate", "case.toml", &(constants("", "") + deep), &[unusual]);
    warned("propagate", "job.toml", &(job(8, 1) + deep), &[unusual]);
    let wide = job(8, 2).replace("variation = 0.0271", "variation = 0.12");
    warned(
        "identify",
        "job.toml",
        &wide,
        &["the coefficient of variation is 1.200e-1, above what points"],
    );
    let fast = job(8, 2).replace("mean = 3906.0", "mean = 5500");
    warned(
        "identify",
        "job.toml",
        &fast,
        &["the mean is 5500, above what points within the bounds reach"],
    );
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
    check(
        Some("velocity\n3.9\n3.95\n3.8\n"),
        &["their median is 3.9", "did you mean 3.9 km/s (3.9e3)?"],
    );
    check(
        Some("velocity\n3900.0\n3950.0\n39000\n"),
        &["v.csv, line 4", "39000", "no velocity of sound in bone is outside 100 to 20000"],
    );
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

/// Runs the program to its end, which must come within a minute.
fn run_within_a_minute(arguments: &[&str]) -> Finished {
    let mut command = Command::new("timeout");
    command.arg("60").arg(osteon().get_program()).args(arguments).env("RUST_LOG", "warn");
    Finished::of(command.output().unwrap())
}

/// Opening a pipe without a writer would otherwise block forever.
#[test]
fn what_is_no_regular_file_is_refused_at_once() {
    let scratch = Scratch::new();
    let pipe = |name: &str| {
        let path = scratch.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        path.to_str().unwrap().to_owned()
    };
    let check = |path: &str, kind: &str, arguments: &[&str]| {
        let refused = run_within_a_minute(arguments);
        assert!(matches!(refused.code, Some(1 | 2)), "{arguments:?}: {refused:?}");
        let expected = format!("it is {kind}, and must be a regular file");
        for part in [path, &expected] {
            assert!(refused.stderr.contains(part), "{part} in {refused:?}");
        }
        assert_eq!(refused.stdout, "", "{arguments:?}");
    };
    let good = scratch.write("good.toml", &job(10, 1));
    let (good, case) = (text(&good), scratch.write("case.toml", &constants("", "")));
    let piped = pipe("pipe.toml");
    for command in ["identify", "propagate", "simulate"] {
        check(&piped, "a pipe", &[command, &piped]);
    }
    check(&piped, "a pipe", &["draw", &piped, "--index", "1"]);
    let device = scratch.path("device.json");
    symlink("/dev/zero", &device).unwrap();
    check(text(&device), "a device", &["identify", text(&device)]);
    std::fs::create_dir(scratch.path("directory.toml")).unwrap();
    let directory = scratch.path("directory.toml");
    check(text(&directory), "a directory", &["identify", text(&directory)]);

    let data = pipe("data.csv");
    let moments = "mean = 3906.0\ncoefficient_of_variation = 0.0271\n";
    let with_data = job(10, 1).replace(moments, "velocities = \"data.csv\"\n");
    let with_data = scratch.write("with_data.toml", &with_data);
    check(&data, "a pipe", &["identify", text(&with_data)]);

    let result = pipe("at/result.json");
    let at = scratch.path("at");
    check(&result, "a pipe", &["draw", good, "--index", "1", "--at", text(&at)]);
    check(&result, "a pipe", &["identify", good, "--out", text(&at)]);
    let lock = pipe("out/.lock");
    check(&lock, "a pipe", &["identify", good, "--out", text(&scratch.path("out"))]);
    pipe("traces/traces.csv.part");
    let traces = scratch.path("traces");
    check(text(&traces), "a pipe", &["simulate", text(&case), "--out", text(&traces)]);

    let secret = pipe("secret");
    let out = scratch.path("ann.token");
    let token = ["token", "ann", "--role", "read", "--out", text(&out), "--tokens", &secret];
    check(&secret, "a pipe", &token);
    pipe("locked/osteon.lock");
    let locked = scratch.path("locked");
    let serve = ["coordinator", "--listen", "127.0.0.1:0", "--store", text(&locked)];
    check(text(&locked), "a pipe", &serve);
}

/// Escape sequences and marks that change the direction of writing are escaped.
#[test]
fn what_a_user_does_not_see_is_shown() {
    let scratch = Scratch::new();
    let check = |arguments: &[&str], expected: &[&str]| {
        let refused = run_within_a_minute(arguments);
        assert!(matches!(refused.code, Some(1 | 2)), "{refused:?}");
        for part in expected {
            assert!(refused.stderr.contains(part), "{part} is not in: {refused:?}");
        }
        let raw = refused.stderr.contains(|c| c != '\n' && is_hidden(c));
        assert!(!raw, "{refused:?}");
    };
    // In file names.
    let name = "job\u{202e}\u{1b}[31m\n.toml";
    let shown = r"job\u{202e}\u{1b}[31m\n.toml";
    let absent = scratch.path(name);
    check(&["identify", text(&absent)], &[shown, "No such file"]);
    let file = scratch.write(name, "[bone]\n\"a\\u001bb\\u202e\" = 1\nb = \"\\u009b2J\"\n");
    check(&["simulate", text(&file)], &[shown, r"a\u{1b}b\u{202e}"]);
    // In keys and values of a job file, and in the parser's messages about them.
    let with = |section: &str| scratch.write("job.toml", &(job(10, 1) + section));
    let file = with("[solver]\nmethod = \"exa\\u001b[2Jct\"\n");
    check(&["identify", text(&file)], &[r"exa\u{1b}[2Jct"]);
    for line in ["a\u{1b}[2J = 1\n", "a = \u{202e}\n", "\u{200b}\n", "a = 1\na = \u{9b}\n"] {
        let file = with(line);
        check(&["identify", text(&file)], &["job.toml:2", ": not valid TOML"]);
    }
    let file = scratch.write("job.json", "{\"a\u{202e}\": 1, \"a\u{202e}\": 1}");
    check(&["identify", text(&file)], &[r"a\u{202e}"]);
    // In the header and the groups of a file of velocities.
    let moments = "mean = 3906.0\ncoefficient_of_variation = 0.0271\n";
    let data = "velocities = \"v.csv\"\ngroup = \"bone\"\n";
    let file = scratch.write("groups.toml", &job(10, 1).replace(moments, data));
    scratch.write("v.csv", "velocity,b\u{1b}[2J\u{2066}one\n3900,a\n");
    check(&["identify", text(&file)], &[r"b\u{1b}[2J\u{2066}one"]);
    // What has no width is no part of a name, which is said.
    let file = scratch.write("v.csv", "velocity,bone\n3900,a\n3901,a\n3900,a\u{200b}\n3901,a\n");
    let read = run_within_a_minute(&["init", text(&file), "--out", "-"]);
    assert!(read.stderr.contains("without width are not read"), "{read:?}");
    // In the log, where it would also begin a new line.
    let url = format!("unix:{}", text(&scratch.path("a\u{1b}[2J\n\u{202e}ERROR")));
    let worker = ["worker", "--coordinator", &url, "--give-up-after", "1"];
    check(&worker, &["WARN", r"a\u{1b}[2J\n\u{202e}ERROR"]);
}

#[test]
fn a_directory_of_results_that_cannot_be_one_is_bad_input() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(10, 1));
    let case = scratch.write("case.toml", &constants("density", "1598.8"));
    let file = scratch.write("file", "a file");
    let below = file.join("out");
    // No file system allows anybody, even root, to create directories there.
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
