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
