//! `osteon modes`: the guided waves of a case's bone over a band of frequencies.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use support::{Scratch, run, text};

/// The file of a case among the examples.
fn example(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cases").join(name);
    text(&path).to_owned()
}

/// Returns the fields of the rows of a file, without its heading.
fn rows(file: &Path) -> Vec<Vec<String>> {
    let fields = |line: &str| line.split(',').map(str::to_owned).collect();
    fs::read_to_string(file).unwrap().lines().skip(1).map(fields).collect()
}

/// At the centre frequency A0 and S0 are those of `simulate`.
#[test]
fn fundamental_waves_are_those_of_a_simulation() {
    for name in ["A.toml", "D.toml", "G.toml"] {
        let case = example(name);
        let simulated = run(&["simulate", &case, "--json"]).json();
        let found = run(&["modes", &case, "--json"]).json();
        let one = &found["modes"][0];
        assert_eq!(one["frequency"], simulated["guided_waves"]["frequency"]);
        for (wave, key) in [("A0", "a0"), ("S0", "s0")] {
            let waves = one["waves"].as_array().unwrap();
            let named: Vec<_> = waves.iter().filter(|one| one["wave"] == wave).collect();
            assert_eq!(named.len(), 1, "{name}: {found}");
            let [phase, expected] =
                [&named[0]["phase_velocity"], &simulated["guided_waves"][key]["phase_velocity"]]
                    .map(|value| value.as_f64().unwrap());
            assert!((phase / expected - 1.0).abs() < 1e-12, "{name}, {wave}: {phase}, {expected}");
        }
    }
}

#[test]
fn a_band_is_written_as_a_table_and_a_figure() {
    let scratch = Scratch::new();
    let out = scratch.path("modes");
    let arguments =
        ["modes", &example("A.toml"), "--frequencies", "1e5:9e5:5", "--out", text(&out)];
    let printed = run(&arguments).succeeded().to_owned();
    assert!(printed.contains("at 5 frequencies") && printed.contains("\nA0 "), "{printed}");
    let rows = rows(&out.join("modes.csv"));
    for frequency in ["100000.0", "300000.0", "500000.0", "700000.0", "900000.0"] {
        for wave in ["A0", "S0", "SH0"] {
            let there = |row: &&Vec<String>| row[0] == frequency && row[1] == wave;
            assert_eq!(rows.iter().filter(there).count(), 1, "{frequency} Hz, {wave}");
        }
    }
    for row in &rows {
        let [frequency, wavenumber, velocity] =
            [0, 4, 5].map(|place| row[place].parse::<f64>().unwrap());
        assert!((std::f64::consts::TAU * frequency / wavenumber / velocity - 1.0).abs() < 1e-15);
    }
    assert!(fs::read_to_string(out.join("modes.svg")).unwrap().contains(">antisymmetric<"));
    // Nothing is overwritten.
    let refused = run(&arguments);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("already exists and is not overwritten"), "{refused:?}");
}

/// In fluids A0 and S0 lose energy, and horizontally sheared waves, which do not move the faces across, none.
#[test]
fn waves_in_fluids_are_attenuated() {
    let scratch = Scratch::new();
    let out = scratch.path("modes");
    let arguments = ["modes", &example("A.toml"), "--in-fluids", "--out", text(&out)];
    let printed = run(&arguments).succeeded().to_owned();
    assert!(printed.contains("between coupling and marrow as"), "{printed}");
    let rows = rows(&out.join("modes.csv"));
    let attenuation = |wave: &str| -> f64 {
        let row = rows.iter().find(|row| row[1] == wave).unwrap();
        row[7].parse().unwrap()
    };
    assert!(attenuation("A0") > 1.0 && attenuation("S0") > 1.0, "{printed}");
    assert!(attenuation("SH0").abs() < 1e-6, "{printed}");
}

#[test]
fn threads_change_nothing() {
    let case = example("D.toml");
    let [one, three] = ["1", "3"].map(|threads| {
        let found =
            run(&["modes", &case, "--frequencies", "2e5:1e6:7", "--threads", threads, "--json"]);
        found.succeeded().to_owned()
    });
    assert_eq!(one, three);
}

#[test]
fn frequencies_that_cannot_be_meant_are_refused() {
    let case = example("A.toml");
    for (frequencies, reason) in [
        ("0", "it must be a frequency above 0 (Hz), or START:STOP:COUNT"),
        ("2e6:1e6:10", "with 0 < START < STOP"),
        ("1.5", "frequency: 1.5 Hz is too low for a bone that is so thin; it must be at least"),
        ("1e10", "at most 1000 are allowed"),
    ] {
        let refused = run(&["modes", &case, "--frequencies", frequencies]);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        let words: Vec<&str> = refused.stderr.split_whitespace().collect();
        assert!(words.join(" ").contains(reason), "{refused:?}");
    }
}

/// A stack of fluids is no half-space: the waves are those in a vacuum, or none.
#[test]
fn a_stack_of_fluids_is_refused_with_what_to_do() {
    let scratch = Scratch::new();
    let marrow = "layers.marrow={ sublayers = [{ thickness = 3e-3, density = 980.0, sound_speed = 1450.0 }, \
                  { thickness = 8e-3, density = 1050.0, sound_speed = 1540.0 }] }";
    let case = example("A.toml");
    let out = scratch.path("modes");
    let arguments = ["modes", &case, "--set", marrow, "--out", text(&out)];
    let refused = run(&[&arguments[..], &["--in-fluids"]].concat());
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let words: Vec<&str> = refused.stderr.split_whitespace().collect();
    let reason =
        "layers.marrow.sublayers: guided waves are known between half-spaces of one fluid each";
    assert!(words.join(" ").contains(reason), "{refused:?}");
    assert!(!out.exists());
    run(&arguments).succeeded();
}

/// The faces of a bone in a vacuum are free, and those in fluids are not pressed sideways.
#[test]
fn shapes_are_a_row_for_each_depth() {
    let scratch = Scratch::new();
    let case = example("A.toml");
    let made = |name: &str, more: &[&str]| {
        let out = scratch.path(name);
        let all = [&["modes", &case, "--out", text(&out), "--frequencies", "2e5:4e5:2"], more];
        run(&all.concat()).succeeded();
        let numbers = |row: Vec<String>| {
            let parsed = row[4..].iter().map(|field| field.parse::<f64>().unwrap());
            (row[1].clone(), parsed.collect::<Vec<f64>>())
        };
        let waves = rows(&out.join("modes.csv")).len();
        let rows = rows(&out.join("shapes.csv")).into_iter().map(numbers);
        (waves, rows.collect::<Vec<_>>())
    };
    let (waves, shapes) = made("free", &["--shapes=5"]);
    assert_eq!(shapes.len(), 5 * waves);
    for wave in shapes.chunks(5) {
        let depths: Vec<f64> = wave.iter().map(|(_, numbers)| numbers[1]).collect();
        assert_eq!(depths, [0.0, 1e-3, 2e-3, 3e-3, 4e-3]);
        let [upper, lower] = [0, 4].map(|place| &wave[place].1);
        assert!(upper[8..].iter().chain(&lower[8..]).all(|stress| *stress == 0.0), "{wave:?}");
        // u3 is the same on both faces where the wave bends the bone.
        let sign = if wave[0].0.starts_with('A') { 1.0 } else { -1.0 };
        assert_eq!([upper[6], upper[7]], [sign * lower[6], sign * lower[7]], "{wave:?}");
    }
    let (waves, shapes) = made("fluids", &["--shapes", "--in-fluids"]);
    assert_eq!(shapes.len(), 41 * waves);
    for wave in shapes.chunks(41).filter(|wave| wave[0].0 == "A0") {
        let upper = &wave[0].1;
        let [across, along] = [12, 8].map(|at| upper[at].hypot(upper[at + 1]));
        assert!(across > 1e6 && along < 1e-9 * across, "{upper:?}");
    }
}

#[test]
fn shapes_that_cannot_be_meant_are_refused() {
    let scratch = Scratch::new();
    let (case, out) = (example("A.toml"), scratch.path("modes"));
    let check = |more: &[&str], reason: &str| {
        let refused = run(&[&["modes", &case], more].concat());
        assert_eq!(refused.code, Some(2), "{refused:?}");
        let words: Vec<&str> = refused.stderr.split_whitespace().collect();
        assert!(words.join(" ").contains(reason), "{refused:?}");
        assert!(!out.exists());
    };
    check(&["--shapes"], "--out <DIR>");
    let out_too = ["--out", text(&out)];
    check(&[&out_too[..], &["--shapes=1"]].concat(), "1 is not in 2..=1001");
    let many = ["--shapes=1001", "--frequencies", "5e5:1e6:300"];
    check(&[&out_too[..], &many].concat(), "give fewer frequencies or depths");
}
