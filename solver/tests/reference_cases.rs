//! The solver against independent reference solutions (see `tests/reference/README.md`).

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::fs;
use std::path::PathBuf;

use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::settings::Extremum;
use osteon_solver::{Complex, Solver, Workspace, admittance};
use serde_json::Value;

struct Reference {
    setup: Setup,
    bone: Bone,
    velocity: f64,
    times: Vec<f64>,
    velocity_second: f64,
    times_second: Vec<f64>,
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(name)
}

fn json(name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(path(name)).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn reference(name: &str) -> Reference {
    let value = json(&format!("{name}.json"));
    let mut rows = [[0.0; 6]; 6];
    for (row, from) in rows.iter_mut().zip(value["mandel"].as_array().unwrap()) {
        row.copy_from_slice(&numbers(from));
    }
    let mut setup = Setup::default();
    setup.layers.bone_thickness = value["thickness"].as_f64().unwrap();
    let reference = &value["reference"];
    Reference {
        setup,
        bone: Bone {
            density: value["density"].as_f64().unwrap(),
            elasticity: Elasticity::new(rows).unwrap(),
        },
        velocity: reference["velocity"].as_f64().unwrap(),
        times: numbers(&reference["times"]),
        velocity_second: reference["velocity_second"].as_f64().unwrap(),
        times_second: numbers(&reference["times_second"]),
    }
}

fn check(name: &str, extremum: Extremum, refinement: f64, relative: f64, time: f64) {
    let reference = reference(name);
    let mut setup = reference.setup;
    setup.picking.extremum = extremum;
    setup.solver.refinement = refinement;
    let arrival = Solver::new(&setup).arrival(&reference.bone, &mut Workspace::default()).unwrap();
    let (velocity, times) = match extremum {
        Extremum::First => (reference.velocity, reference.times),
        Extremum::Second => (reference.velocity_second, reference.times_second),
    };
    let error = arrival.velocity / velocity - 1.0;
    let late = arrival.times.iter().zip(&times).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error.abs() <= relative, "{name}: {} against {velocity}: {error:e}", arrival.velocity);
    assert!(late <= time, "{name}: {late} s");
}

#[test]
fn default_sampling_gives_the_reference_velocities_and_times() {
    for name in ["A", "D", "G"] {
        check(name, Extremum::First, 1.0, 1e-4, 1e-9);
        check(name, Extremum::Second, 1.0, 1e-4, 1e-9);
    }
}

#[test]
fn refined_sampling_converges_to_the_reference() {
    // The references state 1e-6, 1.1e-5 and 1e-6: their change between bands of 16 and 24 MHz.
    check("A", Extremum::First, 5.0, 3e-6, 1e-10);
    check("D", Extremum::First, 5.0, 2.2e-5, 1e-10);
    check("G", Extremum::First, 5.0, 3e-6, 1e-10);
}

#[test]
fn admittance_of_the_random_draw() {
    let reference = reference("D");
    for value in json("D-admittance.json")["values"].as_array().unwrap() {
        let (s, expected) = (numbers(&value["s"]), numbers(&value["admittance"]));
        let k = value["k"].as_f64().unwrap();
        let found = admittance(&reference.setup, &reference.bone, k, Complex::new(s[0], s[1]));
        let expected = Complex::new(expected[0], expected[1]);
        let error = (found - expected).abs() / expected.abs();
        assert!(error < 1e-10, "k {k}, s {s:?}: {found:?} against {expected:?}: {error:e}");
    }
}

#[test]
fn traces_of_the_random_draw() {
    let reference = reference("D");
    let text = fs::read_to_string(path("D-traces.csv")).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    let traces = Solver::new(&reference.setup).traces(&reference.bone, 14e-6, 20e-9).unwrap();
    assert_eq!(traces.times.len(), rows.len());
    for (r, trace) in traces.pressures.iter().enumerate() {
        let onset = (11e-3 + 0.8e-3 * r as f64) / 1500.0;
        let (mut largest, mut error, mut early, mut early_error) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for (row, &p) in rows.iter().zip(trace) {
            let expected = row[r + 1];
            largest = largest.max(expected.abs());
            error = error.max((p - expected).abs());
            if row[0] < onset {
                early = early.max(expected.abs());
                early_error = early_error.max((p - expected).abs());
            }
        }
        assert!(error <= 1e-3 * largest, "receiver {r}: {error} of {largest}");
        assert!(early_error <= 1e-3 * early, "receiver {r}: {early_error} of {early}");
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_second_extremum_and_the_frequency_are_those_of_the_references() {
    for name in ["A", "D", "G"] {
        let reference = reference(name);
        let half = reference.times.iter().zip(&reference.times_second).map(|(one, two)| two - one);
        let frequency = 0.5 / mean(half);
        let (mut workspace, mut signals) = (Workspace::default(), Vec::new());
        for extremum in [Extremum::First, Extremum::Second] {
            let mut setup = reference.setup.clone();
            setup.picking.extremum = extremum;
            let solver = Solver::new(&setup);
            let arrival = solver.arrival(&reference.bone, &mut workspace).unwrap();
            let signal = solver.first_signal(&reference.bone, &arrival, &mut workspace);
            assert_ne!(signal.other_extremum, extremum);
            signals.push((arrival.velocity, signal));
        }
        let [(first, of_first), (second, of_second)] = &signals[..] else { unreachable!() };
        let error = second / reference.velocity_second - 1.0;
        assert!(error.abs() <= 1e-4, "{name}: {second}: {error:e}");
        // To the bit: one is the solution of the case with the other extremum.
        assert_eq!(of_first.other_velocity, Ok(*second), "{name}");
        assert_eq!(of_second.other_velocity, Ok(*first), "{name}");
        assert_eq!(of_first.center_frequency, of_second.center_frequency, "{name}");
        let error = of_first.center_frequency.unwrap() / frequency - 1.0;
        // Times are accurate to 1e-9 s at most, of half periods of 0.4 µs.
        assert!(error.abs() <= 5e-4, "{name}: {frequency} Hz: {error:e}");
    }
}

/// Least-squares slope of 20 log10 |p| of the reference's traces at the reference's times.
#[test]
#[expect(clippy::disallowed_methods, reason = "an independent formula")]
fn the_decay_is_that_of_the_reference_traces() {
    let reference = reference("D");
    let text = fs::read_to_string(path("D-traces.csv")).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    for extremum in [Extremum::First, Extremum::Second] {
        let mut setup = reference.setup.clone();
        setup.picking.extremum = extremum;
        let times = match extremum {
            Extremum::First => &reference.times,
            Extremum::Second => &reference.times_second,
        };
        let step = rows[1][0] - rows[0][0];
        let levels = times.iter().enumerate().map(|(r, t)| {
            // The parabola through the three nearest samples.
            let at = (t / step).round() as usize;
            let [a, b, c] = [-1, 0, 1].map(|side| rows[at.strict_add_signed(side)][r + 1]);
            let peak = b - (c - a).powi(2) / (8.0 * (a - 2.0 * b + c));
            20.0 * peak.abs().log10()
        });
        let levels: Vec<f64> = levels.collect();
        let places: Vec<f64> = setup.probe.distances().map(|x| 100.0 * x).collect();
        let (x, y) = (mean(places.iter().copied()), mean(levels.iter().copied()));
        let cross: f64 = places.iter().zip(&levels).map(|(a, b)| (a - x) * (b - y)).sum();
        let square: f64 = places.iter().map(|a| (a - x).powi(2)).sum();
        let solver = Solver::new(&setup);
        let mut workspace = Workspace::default();
        let arrival = solver.arrival(&reference.bone, &mut workspace).unwrap();
        let found = solver.first_signal(&reference.bone, &arrival, &mut workspace).decay;
        let expected = -cross / square;
        // Traces end their band elsewhere, and are sampled every 20 ns.
        assert!((found - expected).abs() < 0.02, "{found} against {expected} dB/cm");
    }
}
