//! `pick`: velocities from signals in files.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{Scratch, run, text};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Simulates case A into a directory of the scratch; returns the result.
fn simulate(scratch: &Scratch, name: &str, options: &[&str]) -> Value {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cases/A.toml");
    let out = scratch.path(name);
    let words = ["simulate", text(&case), "--json", "--out", text(&out)];
    serde_json::from_str(run(&[&words, options].concat()).succeeded()).unwrap()
}

#[test]
fn the_velocity_of_simulated_traces_is_that_of_the_simulation() {
    let scratch = Scratch::new();
    // The traces have a sampling of their own: with the default refinement both differ by 4e-6.
    let fine = ["--set", "solver.refinement=4"];
    for (name, options, error_max) in [("fine", &fine[..], 1e-6), ("usual", &[], 1e-5)] {
        let simulated = simulate(&scratch, name, options);
        let traces = scratch.path(name).join("traces.csv");
        let printed = run(&["pick", text(&traces), "--json"]);
        let picked: Value = serde_json::from_str(printed.succeeded()).unwrap();
        let series = &picked["series"][0];
        let error = number(&series["velocity"]) / number(&simulated["velocity"]) - 1.0;
        assert!(error.abs() < error_max, "{name}: {error:e}");
        let receivers = series["receivers"].as_array().unwrap();
        let simulated = simulated["receivers"].as_array().unwrap();
        assert_eq!(receivers.len(), simulated.len());
        for (one, other) in receivers.iter().zip(simulated) {
            assert!((number(&one["time"]) - number(&other["time"])).abs() < 1e-9, "{one} {other}");
        }
        assert_eq!(series["failure"], Value::Null);
        // A case describes its own traces.
        let case = scratch.path(name).join("case.toml");
        let described = run(&["pick", text(&traces), "--json", "--describe", text(&case)]);
        let described: Value = serde_json::from_str(described.succeeded()).unwrap();
        assert_eq!(described["series"], picked["series"]);
    }
}

#[test]
fn a_template_describes_its_file_and_nothing_is_overwritten() {
    let scratch = Scratch::new();
    simulate(&scratch, "out", &[]);
    let (traces, probe) = (scratch.path("out").join("traces.csv"), scratch.path("probe.toml"));
    let template = run(&["pick", "--init", text(&traces)]);
    run(&["pick", "--init", text(&traces), "--out", text(&probe)]).succeeded();
    assert_eq!(fs::read_to_string(&probe).unwrap(), template.succeeded());
    let again = run(&["pick", "--init", text(&traces), "--out", text(&probe)]);
    assert_eq!(again.code, Some(2));
    assert!(again.stderr.contains("already exists and is not overwritten"), "{again:?}");
    let velocities = scratch.path("velocities.csv");
    let words = ["pick", text(&traces), text(&traces), "--describe", text(&probe)];
    run(&[&words[..], &["--out", text(&velocities)]].concat()).succeeded();
    let table = fs::read_to_string(&velocities).unwrap();
    let (comments, lines): (Vec<&str>, Vec<&str>) =
        table.lines().partition(|line| line.starts_with('#'));
    assert_eq!(comments, ["# picking.extremum = \"first\"", "# picking.threshold = 0.05"]);
    assert_eq!(
        lines[0],
        "velocity,standard_error,quality,failure,other_velocity,other_standard_error,decay,\
         decay_standard_error,center_frequency,center_frequency_standard_error"
    );
    assert!(lines.len() == 3 && lines[1] == lines[2] && lines[1].starts_with("3908.7"), "{table}");
}

/// A file, a probe file, and what the refusal says.
fn refused(file: &str, probe: &str, expected: &str) {
    let scratch = Scratch::new();
    let (file, probe) = (scratch.write("signals.csv", file), scratch.write("probe.toml", probe));
    let finished = run(&["pick", text(&file), "--describe", text(&probe)]);
    assert_eq!(finished.code, Some(2), "{finished:?}");
    assert!(finished.stderr.contains(expected), "{expected}: {finished:?}");
    assert!(!finished.stderr.contains("panicked"), "{finished:?}");
}

/// A table of three receivers with 2000 rows every 10 ns: a triangle wave, and two constants.
fn table() -> String {
    let row = |j: i32| format!("{:e},{},0,0\n", 1e-8 * f64::from(j), (j % 100 - 50).abs());
    std::iter::once("time,0.011,0.0118,0.0126\n".to_owned()).chain((0..2000).map(row)).collect()
}

#[test]
fn bad_input_is_refused_with_what_is_allowed() {
    let three = "[probe.receivers]\ncount = 3\n";
    let with = |signals: &str| format!("{three}[signals]\n{signals}\n");
    for (file, probe, expected) in [
        (table(), "[signals]\nband = [1e6]".to_owned(), "signals.band: has one number"),
        (table(), "[signals]\naxes = [\"time\"]".to_owned(), "signals.axes: lacks \"receiver\""),
        (
            table(),
            "[signals]\naxes = [\"time\", \"depth\"]".to_owned(),
            "signals.axes[1]: is \"depth\"; it must be one of \"series\", \"transmitter\", \"receiver\", \"time\"",
        ),
        (table(), "[signals]\nbandd = [0, 1]".to_owned(), "unknown key; did you mean `band`?"),
        (
            table(),
            "[signals]\ntransmitters = [\"first\", \"first\"]".to_owned(),
            "it must name one source, or both",
        ),
        (table(), String::new(), "probe.receivers.count is 14, and the file has 3 columns"),
        (
            table(),
            format!("{three}pitch = 1e-3"),
            "probe.receivers has receiver 2 at 0.012 m, and the file has it at 0.0118 m in column 3",
        ),
        (
            table(),
            with("transmitters = [\"first\", \"second\"]"),
            "signals.transmitters names 2, and the file has the signals of 1",
        ),
        (
            table(),
            with("sampling_interval = 2e-8"),
            "signals.sampling_interval is 2e-8 s, and the file's column of times has steps of 1e-8 s if its \
             unit is \"s\"",
        ),
        (table(), with("time_unit = \"us\""), "signals.start or another key is wrong"),
        (table(), with("band = [0.0, 1e6]"), "signals.band is [0.0, 1000000.0]; with"),
        (
            table().replace("time,", "t,"),
            three.to_owned(),
            "line 1: its first field is \"t\"; the first column is `time`",
        ),
        (table() + "1,2\n", three.to_owned(), "line 2002: has 2 fields, and the header has 4"),
        (
            table().replacen(",0,0\n", ",nan,0\n", 1),
            three.to_owned(),
            "line 2: column 3 is \"nan\"; it must be a finite number",
        ),
        (
            "time,0.011,0.0118,0.0126\n".to_owned(),
            three.to_owned(),
            "is damaged: it has no rows below its header",
        ),
        (
            table().lines().take(200).collect::<Vec<_>>().join("\n"),
            three.to_owned(),
            "signals.start or another key is wrong: the record is from 0e0 s to",
        ),
    ] {
        refused(&file, &probe, expected);
    }
}
