//! Guided waves of recorded signals, and the image that an array sees.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;

use serde_json::Value;
use support::{Scratch, run, text};

/// A thin plate in water, and a probe near it.
const PROBE: &str = "[layers.bone]\nthickness = 1.5e-3\n[probe]\ncenter_frequency = 0.5e6\n\
                     guided_wave_frequency = 0.2e6\n[probe.source]\nx1 = 0.0\nx3 = 1e-3\n[probe.receivers]\n\
                     first_x1 = 11e-3\npitch = 0.8e-3\ncount = 24\nx3 = 1e-3\n";
const WAVES: &str = "\n[waves]\nfrequencies = [0.2e6, 0.4e6]\na0 = [800.0, 1280.0]\n";
const MATERIAL: &str = "material = \"human-radius-desceliers\"\n";

/// Returns the phase velocity of A0 between the fluids at each of some frequencies.
fn model(scratch: &Scratch, band: &str) -> Vec<f64> {
    let case = scratch.write("case.toml", &format!("{PROBE}[bone]\n{MATERIAL}"));
    let found = run(&["modes", text(&case), "--in-fluids", "--frequencies", band, "--json"]).json();
    let a0 = |one: &Value| {
        let waves = one["waves"].as_array().unwrap();
        waves.iter().find(|wave| wave["wave"] == "A0").unwrap()["phase_velocity"].as_f64().unwrap()
    };
    found["modes"].as_array().unwrap().iter().map(a0).collect()
}

/// 24 receivers, five sources, noise 30 dB below the first packet: A0 is that of the model within 1 %.
#[test]
fn a0_of_a_twin_is_that_of_the_model() {
    let scratch = Scratch::new();
    let parameters = format!("[parameters]\n{MATERIAL}dispersion = {{ fixed = 0.001 }}\n");
    let job = scratch.write("job.toml", &format!("{PROBE}{parameters}"));
    let study = scratch.path("study");
    let words =
        ["synthesize", text(&job), "--series", "4", "--noise-db", "30", "--out", text(&study)];
    let sources = ["--further-sources", "4", "--source-pitch", "3e-3", "--duration", "70e-6"];
    run(&[&words[..], &sources].concat()).succeeded();
    let written = fs::read_to_string(study.join("probe.toml")).unwrap();
    let probe = scratch.write("probe.toml", &(written + WAVES));
    let (signals, picks) = (study.join("signals.npy"), scratch.path("picks.csv"));
    let image = scratch.path("image.svg");
    let model_case = format!("{PROBE}[bone]\n{MATERIAL}");
    let case = scratch.write("model.toml", &model_case);
    let words = ["pick", text(&signals), "--describe", text(&probe), "--out", text(&picks)];
    let image_words = ["--image", text(&image), "--model", text(&case), "--in-fluids"];
    run(&[&words[..], &image_words].concat()).succeeded();
    let table = fs::read_to_string(&picks).unwrap();
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    assert_eq!(
        lines.next().unwrap(),
        "velocity,standard_error,quality,failure,other_velocity,other_standard_error,decay,\
         decay_standard_error,center_frequency,center_frequency_standard_error,a0_velocity,\
         a0_standard_error,a0_failure,a0_velocity_400kHz,a0_standard_error_400kHz,a0_failure_400kHz"
    );
    let expected = model(&scratch, "0.2e6:0.4e6:2");
    let mut count = 0;
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        for (place, expected) in [10, 13].into_iter().zip(&expected) {
            let found: f64 = fields[place].parse().unwrap();
            assert!((found / expected - 1.0).abs() < 0.01, "{found}, {expected}: {table}");
            assert_eq!(fields[place + 2], "");
        }
        count += 1;
    }
    assert_eq!(count, 4);
    let svg = fs::read_to_string(&image).unwrap();
    assert!(svg.contains("model, antisymmetric") && svg.contains("found, in the mean"), "{svg}");
}

#[test]
fn the_image_of_a_case_shows_its_waves() {
    let scratch = Scratch::new();
    let case = scratch.write("case.toml", &format!("{PROBE}[bone]\n{MATERIAL}"));
    let out = scratch.path("out");
    let words =
        ["modes", text(&case), "--frequencies", "5e4:1e6:20", "--image", "--out", text(&out)];
    run(&[&words[..], &["--further-sources", "2", "--source-pitch", "3e-3"]].concat()).succeeded();
    let svg = fs::read_to_string(out.join("image.svg")).unwrap();
    assert!(svg.contains("model, antisymmetric") && svg.contains("wavenumber (rad/mm)"), "{svg}");
    let refused = run(&["modes", text(&case), "--image", "--out", text(&scratch.path("other"))]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("--frequencies"), "{refused:?}");
}

/// What a probe file says of sources and waves, and the refusal.
#[test]
fn impossible_sources_and_waves_are_refused() {
    let scratch = Scratch::new();
    let signals = scratch.write("signals.csv", "time,0.011,0.0118,0.0126\n0,0,0,0\n");
    for (probe, expected) in [
        ("[waves]\na0 = [1e3]", "waves.a0: has one number; it must be [LOWEST, HIGHEST], in m/s"),
        ("[waves]\na0 = [2e3, 1e3]", "its first velocity must be below its second"),
        ("[waves]\ns0 = [1.0, 1e3]", "waves.s0[0]: is 1.0"),
        ("[waves]\nfrequencies = [1e6]", "waves.frequencies: names no wave"),
        ("[waves]\na0 = [1e3, 2e3]\nfrequencies = [1e6, 1e6]", "has a frequency twice"),
        ("[waves]\nthreshold = 0.0", "waves.threshold: is 0"),
        (
            "[signals]\ntransmitters = [\"first\", \"first\"]",
            "it must name one source, or both, unless transmitter_offsets says where each is",
        ),
        (
            "[signals]\ntransmitters = [\"first\", \"first\"]\ntransmitter_offsets = [0.0]",
            "signals.transmitter_offsets: has 1 elements, and signals.transmitters 2",
        ),
        (
            "[signals]\ntransmitters = [\"first\", \"second\"]\ntransmitter_offsets = [0.0, 1e-3]",
            "has [0.001] for \"second\"; they must differ, and one must be 0",
        ),
        (
            "[signals]\ntransmitters = [\"first\", \"first\"]\ntransmitter_offsets = [0.0, -1e-3]",
            "signals.transmitter_offsets[1]: is -0.001",
        ),
    ] {
        let probe = scratch.write("probe.toml", probe);
        let finished = run(&["pick", text(&signals), "--describe", text(&probe)]);
        assert_eq!(finished.code, Some(2), "{finished:?}");
        assert!(finished.stderr.contains(expected), "{expected}: {finished:?}");
    }
}
