//! `osteon report`: results as a page with figures.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{Scratch, job, run, text};

const CASE: &str = include_str!("../examples/cases/A.toml");

/// The files of a report by their names.
fn files(report: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(report).unwrap().map(|entry| entry.unwrap().path());
    let named = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        (name, fs::read_to_string(path).unwrap())
    };
    entries.map(named).collect()
}

fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    element.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap()
}

/// Compares every number of the page with the result, and returns how many there are.
fn numbers_are_those_of(page: &str, result: &Value) -> usize {
    let elements: Vec<&str> = page.split("<data ").skip(1).collect();
    for element in &elements {
        let (value, place) = (attribute(element, "value"), attribute(element, "data-at"));
        let value: f64 = value.parse().unwrap();
        assert_eq!(result.pointer(place).and_then(Value::as_f64), Some(value), "{place}");
        let shown = element.split('>').nth(1).unwrap().split('<').next().unwrap();
        if shown.contains('·') {
            continue;
        }
        let size: f64 = attribute(element, "data-size").parse().unwrap();
        let number: f64 = shown.parse().unwrap();
        let decimals = shown.split('.').nth(1).map_or(0, str::len);
        // Tens and hundreds may be rounded where there are no decimals.
        let last = if decimals > 0 {
            0.1_f64.powi(i32::try_from(decimals).unwrap())
        } else {
            0.01 * number.abs().max(100.0)
        };
        assert!((number - value / size).abs() <= 0.500_001 * last, "{place}: {shown} is {value}");
    }
    elements.len()
}

/// A user runs a job with `--report`, looks at it, and makes it again.
#[test]
fn a_report_shows_the_numbers_of_the_result() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(16, 60));
    let out = scratch.path("out");
    let ran = run(&["identify", text(&file), "--out", text(&out), "--report"]);
    assert!(ran.stderr.contains("report/index.html"), "{}", ran.stderr);
    let first = files(&out.join("report"));
    let page = &first["index.html"];
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    assert!(numbers_are_those_of(page, &serde_json::from_str(&result).unwrap()) > 10);
    for part in ["<html lang=\"en\">", "<main>", "<nav ", "In short", "Provenance", "role=\"img\""]
    {
        assert!(page.contains(part), "{part}");
    }
    // Nothing is fetched: namespaces are names, not addresses.
    let addresses = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!addresses.contains("http:") && !addresses.contains("https:"));
    for name in ["distribution.svg", "density.csv", "cost.svg", "setup.svg"] {
        assert!(first.contains_key(name), "{name}: {:?}", first.keys());
    }
    // The same results give the same bytes, and figures that are no longer made are removed.
    run(&["report", text(&out)]);
    assert!(first == files(&out.join("report")));
}

/// The page shows what pooled groups share, and each group with and without the others.
#[test]
fn pooled_groups_have_a_table_and_a_figure_of_both_values() {
    let scratch = Scratch::new();
    let group = |k: u32| -> String {
        let velocities = (0..6).map(|j| (3850 + 30 * k + (37 * j + 11 * k) % 120).to_string());
        format!("G{k} = [{}]\n", velocities.collect::<Vec<_>>().join(", "))
    };
    let groups: String = (0..4).map(group).collect();
    let job = format!(
        "[data.groups]\n{groups}[groups]\npooled = true\n[parameters]\nmaterial = \
         \"human-tibia-rho-1996\"\nlongitudinal_young_modulus = {{ bounds = [12e9, 25e9] }}\ndispersion = {{ start = 0.05, bounds = [0.005, 0.3] }}\n[monte_carlo]\n\
         realizations = 64\nsampling = \"sobol\"\n[search]\nmethod = \"newton\"\n"
    );
    let (file, out) = (scratch.write("job.toml", &job), scratch.path("out"));
    run(&["identify", text(&file), "--out", text(&out), "--report", "--no-budget"]).succeeded();
    let report = files(&out.join("report"));
    let page = &report["index.html"];
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    numbers_are_those_of(page, &result);
    assert!(page.contains("What the groups share"), "{}", result["pooling"]);
    let svg = &report["groups-bulk-velocity.svg"];
    assert!(svg.contains(">with the help of all groups</text>"), "{svg}");
}

#[test]
fn a_simulation_and_two_results_have_reports() {
    let scratch = Scratch::new();
    let case = scratch.write("case.toml", CASE);
    let out = scratch.path("a");
    run(&["simulate", text(&case), "--out", text(&out), "--report"]);
    let report = files(&out.join("report"));
    let result = fs::read_to_string(out.join("result.json")).unwrap();
    let result = serde_json::from_str(&result).unwrap();
    assert!(numbers_are_those_of(&report["index.html"], &result) > 30);
    assert!(report.contains_key("traces.svg") && report.contains_key("times.csv"));
    let both = scratch.path("both");
    run(&["report", text(&out), text(&out), "--out", text(&both)]);
    assert!(files(&both)["index.html"].contains("Velocities of the simulations"));
}

#[test]
fn what_is_not_a_result_or_not_a_report_is_refused() {
    let scratch = Scratch::new();
    let empty = scratch.path("empty");
    fs::create_dir(&empty).unwrap();
    let refused = run(&["report", text(&empty)]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("holds no complete results"), "{}", refused.stderr);
    let case = scratch.write("case.toml", CASE);
    let out = scratch.path("a");
    run(&["simulate", text(&case), "--out", text(&out)]);
    fs::write(empty.join("index.html"), "my own page").unwrap();
    let refused = run(&["report", text(&out), "--out", text(&empty)]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("is not the page of a report"), "{}", refused.stderr);
    assert_eq!(fs::read_to_string(empty.join("index.html")).unwrap(), "my own page");
}
