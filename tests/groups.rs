//! Groups of measured velocities: one job, one identification for each, nothing lost.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use support::{Owned, Scratch, children, eventually, job, option, osteon, run, text};

/// Files that a run of groups leaves.
const FILES: [&str; 6] =
    ["job.toml", "result.json", "history.csv", "groups.csv", "comparison.csv", "realizations.csv"];

/// Velocities of a group around `mean`, about normal, with a coefficient of variation of 0.027.
fn velocities(mean: f64) -> Vec<f64> {
    let scores = [-1.63, -1.04, -0.67, -0.39, -0.13, 0.13, 0.39, 0.67, 1.04, 1.63];
    scores.iter().map(|score| mean * (1.0 + 0.03 * score)).collect()
}

/// A job of `count` groups, whose means differ, by `newton`, with its file of velocities.
fn grouped(scratch: &Scratch, count: u32) -> PathBuf {
    let mut csv = "velocity,bone\n".to_owned();
    for score in 0..10 {
        for group in 0..count {
            let velocity = velocities(3850.0 + 10.0 * f64::from(group))[score];
            csv.push_str(&format!("{velocity},bone {group}\n"));
        }
    }
    scratch.write("velocities.csv", &csv);
    let data = "[data]\nvelocities = \"velocities.csv\"\ngroup = \"bone\"\n";
    let text = by_newton().replace(DATA, data);
    scratch.write("job.toml", &text)
}

const DATA: &str = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n";

fn by_newton() -> String {
    job(32, 20).replace("[search]\n", "[search]\nmethod = \"newton\"\n")
}

/// Evaluations so far of the only job at `url`.
fn evaluations(url: &str) -> Option<u64> {
    let listed = run(&["jobs", "--json", "--coordinator", url]);
    let listed: Value = serde_json::from_str(&listed.stdout).ok()?;
    listed["jobs"].as_array()?.first()?["evaluations"].as_u64()
}

fn read(directory: &Path, name: &str) -> String {
    fs::read_to_string(directory.join(name)).unwrap()
}

#[test]
fn a_group_is_identified_as_it_would_be_alone() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 2);
    let out = scratch.path("out");
    let table = run(&["identify", text(&job), "--out", text(&out)]);
    assert!(table.succeeded().contains("bone 1"), "{table:?}");
    let result: Value = serde_json::from_str(&read(&out, "result.json")).unwrap();
    assert_eq!(result["status"], "converged");
    for (group, mean) in [3850.0, 3860.0].into_iter().enumerate() {
        let alone = format!("[data]\nvelocities = {:?}\n", velocities(mean));
        let alone = scratch.write("alone.toml", &by_newton().replace(DATA, &alone));
        let alone = run(&["identify", text(&alone), "--json"]).json();
        let found = &result["groups"][group];
        assert_eq!(found["name"], format!("bone {group}"));
        assert_eq!(found["data"]["count"], 10);
        for key in ["cost", "parameters", "dispersion", "velocity", "sensitivities", "identified"] {
            assert_eq!(found[key], alone[key], "{key} of group {group}");
        }
        let interval = &found["identified"]["bulk_velocity"]["interval"];
        assert!(interval[0].as_f64() < interval[1].as_f64(), "{found}");
    }
    // What was found is on each line of the tables.
    assert_eq!(read(&out, "groups.csv").lines().count(), 3);
    let comparison = read(&out, "comparison.csv");
    let row: Vec<&str> = comparison.lines().nth(1).unwrap().split(',').collect();
    assert_eq!(row[..2], ["bone 0", "bone 1"]);
    let numbers: Vec<f64> = row[2..].iter().map(|field| field.parse().unwrap()).collect();
    assert!(numbers[1] < numbers[0] && numbers[0] < numbers[2] && numbers[0] < 0.0, "{row:?}");
    assert!(read(&out, "history.csv").lines().nth(1).unwrap().ends_with(",bone 0"));
}

#[test]
fn a_job_of_groups_whose_coordinator_is_killed_loses_nothing() {
    let scratch = Scratch::new();
    let job = grouped(&scratch, 12);
    let (undisturbed, out) = (scratch.path("undisturbed"), scratch.path("out"));
    run(&["identify", text(&job), "--out", text(&undisturbed)]).succeeded();
    // Twice, the second time further on.
    let mut stored = 0;
    for _ in 0..2 {
        let mut command = osteon();
        command.args(["identify", text(&job), "--out", text(&out)]);
        let mut process = Owned::spawn(&mut command);
        eventually("more evaluations are stored", || {
            let worker = children(process.id()).into_iter().next();
            let url = worker.and_then(|worker| option(worker, "--coordinator"));
            let now = url.and_then(|url| evaluations(&url)).unwrap_or(0);
            let more = now >= stored + 15;
            stored = if more { now } else { stored };
            more
        });
        process.kill();
        assert!(!out.join("result.json").exists(), "it was too quick for this test");
    }
    run(&["identify", text(&job), "--out", text(&out)]).succeeded();
    for name in FILES {
        assert!(read(&out, name) == read(&undisturbed, name), "{name} differs");
    }
}
