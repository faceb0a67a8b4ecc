//! `osteon observe`: what else the first signals of a job's realizations tell.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{Scratch, job, run, text};

/// A job whose thickness is random, too.
fn random_thickness(realizations: u32) -> String {
    let random = "[random]\nbone_thickness = { standard_deviation = 2e-4 }\n";
    format!("{}\n{random}", job(realizations, 60))
}

/// Returns the fields of the rows of a file, without its heading.
fn rows(file: &Path) -> Vec<Vec<String>> {
    let fields = |line: &str| line.split(',').map(str::to_owned).collect();
    fs::read_to_string(file).unwrap().lines().skip(1).map(fields).collect()
}

/// The velocities are those of `propagate`, and the rest that of `simulate` of each case.
#[test]
fn observables_are_those_of_each_case() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &random_thickness(6));
    let [out, observed] = ["out", "observed.csv"].map(|name| scratch.path(name));
    run(&["propagate", text(&file), "--out", text(&out)]).succeeded();
    run(&["observe", text(&file), "--out", text(&observed)]).succeeded();
    let (propagated, observed) = (rows(&out.join("realizations.csv")), rows(&observed));
    assert_eq!(observed.len(), 6);
    for (index, (row, expected)) in observed.iter().zip(&propagated).enumerate() {
        assert_eq!([&row[0], &row[1], &row[7]], [&expected[0], &expected[1], &expected[2]]);
        let drawn = run(&["draw", text(&file), "--index", &index.to_string()]);
        let case = scratch.write(&format!("case-{index}.toml"), drawn.succeeded());
        let simulated = run(&["simulate", text(&case), "--json"]).json();
        let signal = &simulated["first_signal"];
        for (column, key) in [(2, "other_velocity"), (3, "decay"), (4, "center_frequency")] {
            let found: f64 = row[column].parse().unwrap();
            // A drawn case is written with all digits, so that nothing is lost.
            assert_eq!(found.to_bits(), signal[key].as_f64().unwrap().to_bits(), "{key}");
        }
        for (column, wave) in [(5, "a0"), (6, "s0")] {
            let found: f64 = row[column].parse().unwrap();
            let expected = simulated["guided_waves"][wave]["phase_velocity"].as_f64().unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{wave}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &random_thickness(40));
    let [one, three] = ["1", "3"].map(|threads| {
        let csv = scratch.path(&format!("{threads}.csv"));
        let found =
            run(&["observe", text(&file), "--threads", threads, "--out", text(&csv), "--json"]);
        (found.succeeded().to_owned(), fs::read(csv).unwrap())
    });
    assert_eq!(one, three);
}

#[test]
fn realizations_without_velocity_are_counted() {
    let scratch = Scratch::new();
    // So near to the source the direct wave comes before the one through the bone.
    let near = format!("{}\n[probe.receivers]\nfirst_x1 = 0.002\ncount = 3\n", job(5, 60));
    let file = scratch.write("job.toml", &near);
    let csv = scratch.path("observed.csv");
    let observed = run(&["observe", text(&file), "--out", text(&csv), "--json"]);
    assert_eq!(observed.code, Some(1), "{observed:?}");
    let summary: Value = serde_json::from_str(&observed.stdout).unwrap();
    assert_eq!(summary["failures"]["direct_wave_first"], 5);
    assert!(summary["velocity"]["mean"].is_null());
    assert!(rows(&csv).iter().all(|row| row[1..] == ["", "", "", "", "", "", "direct_wave_first"]));
}

#[test]
fn the_best_point_of_a_result_is_observed() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(16, 60));
    let [out, observed] = ["out", "observed.csv"].map(|name| scratch.path(name));
    run(&["identify", text(&file), "--out", text(&out)]).succeeded();
    run(&["observe", text(&file), "--at", text(&out), "--out", text(&observed)]).succeeded();
    let velocities = |file: &Path| rows(file).into_iter().map(|row| row[1].clone());
    assert!(velocities(&observed).eq(velocities(&out.join("realizations.csv"))));
}

/// Velocities leave one direction of porosity, thickness and dispersion free, which A0 at a low frequency
/// determines.
#[test]
fn a_measured_a0_tells_the_thickness() {
    let scratch = Scratch::new();
    let setup = |thickness: f64, porosity: f64| {
        format!(
            "[layers.bone]\nthickness = {thickness}\n[probe]\nguided_wave_frequency = 0.2e6\n\
             [bone]\nporosity = {porosity}\n"
        )
    };
    let bones = "[parameters]\ndispersion = { fixed = 0.08 }\n[monte_carlo]\nrealizations = 40\n";
    let truth = scratch.write("truth.toml", &format!("{}{bones}", setup(2.5e-3, 0.1)));
    run(&["observe", text(&truth), "--out", text(&scratch.path("bones.csv"))]).succeeded();
    let interval = |line: &str| {
        let job = format!(
            "[data]\nvelocities = \"bones.csv\"\n{line}\n{}[parameters]\n\
             porosity = {{ bounds = [0.01, 0.3] }}\nbone_thickness = {{ bounds = [1.5e-3, 4e-3] }}\n\
             dispersion = {{ start = 0.1, bounds = [0.02, 0.3] }}\n[monte_carlo]\nsampling = \"sobol\"\n\
             realizations = 64\ncontrol_variate = true\n[search]\nmethod = \"newton\"\n",
            setup(2.8e-3, 0.12)
        );
        let job = scratch.write("job.toml", &job);
        let found = run(&["identify", text(&job), "--json"]).json();
        let interval = &found["identified"]["parameters"]["bone_thickness"]["interval"];
        interval.as_array().map(|ends| [0, 1].map(|end| ends[end].as_f64().unwrap()))
    };
    assert_eq!(interval(""), None);
    let [lower, upper] = interval("a0_velocity = \"a0_velocity\"").unwrap();
    assert!((lower..upper).contains(&2.5e-3) && upper - lower < 0.3e-3, "{lower} to {upper}");
}

#[test]
fn no_file_is_overwritten() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(4, 60));
    let kept = scratch.write("kept.csv", "kept\n");
    let refused = run(&["observe", text(&file), "--out", text(&kept)]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("already exists and is not overwritten"), "{refused:?}");
    assert_eq!(fs::read_to_string(kept).unwrap(), "kept\n");
}
