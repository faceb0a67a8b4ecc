//! Attenuation: velocities against an independent solution, and waves in a fluid against their closed
//! form.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::disallowed_methods, reason = "an independent formula")]

use std::f64::consts::{PI, TAU};

use osteon_common::attenuation::Attenuation;
use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Arrival, Solver, Workspace};

const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

fn quality(quality: f64) -> Attenuation {
    Attenuation { quality_factor: Some(quality), ..Attenuation::default() }
}

fn mean_bone() -> Bone {
    Bone { density: OPTIMUM.density(), elasticity: OPTIMUM.constants().elasticity().unwrap() }
}

fn arrival(setup: &Setup, bone: &Bone) -> Arrival {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap()
}

/// Velocities of case A by an independent program, in whole m/s.
#[test]
fn attenuation_makes_the_first_arrival_faster() {
    for (quality_factor, expected) in [(30.0, 3944.0), (15.0, 3978.0), (10.0, 4011.0)] {
        let mut setup = Setup::default();
        setup.layers.bone_attenuation = quality(quality_factor);
        let found = arrival(&setup, &mean_bone()).velocity;
        assert!((found - expected).abs() < 0.6, "Q = {quality_factor}: {found}");
    }
}

#[test]
fn a_very_large_quality_factor_changes_nothing() {
    let mut setup = Setup::default();
    setup.solver.refinement = 2.0;
    let lossless = arrival(&setup, &mean_bone()).velocity;
    let layers = &mut setup.layers;
    for attenuation in [
        &mut layers.bone_attenuation,
        &mut layers.coupling.attenuation,
        &mut layers.marrow.attenuation,
    ] {
        *attenuation = quality(1e9);
    }
    let found = arrival(&setup, &mean_bone()).velocity;
    assert!((found / lossless - 1.0).abs() < 2e-8, "{found} instead of {lossless}");
}

/// The moduli at the reference frequency are given: an eighth of it makes waves slower.
#[test]
fn the_reference_frequency_is_where_the_moduli_hold() {
    let velocity = |reference_frequency| {
        let mut setup = Setup::default();
        setup.layers.bone_attenuation = Attenuation { reference_frequency, ..quality(20.0) };
        arrival(&setup, &mean_bone()).velocity
    };
    // All velocities in the bone rise as ω^γ; those of the fluids, which count little, do not.
    let ratio = velocity(0.5e6) / velocity(1e6);
    let expected = 2f64.powf((1.0 / 20.0_f64).atan() / PI);
    assert!((ratio - expected).abs() < 1.5e-3, "{ratio} instead of {expected}");
}

#[test]
fn attenuated_errors_are_within_what_is_stated() {
    let ensemble = Ensemble::new(&OPTIMUM, 3).unwrap();
    let cases = [([10.0, 1e9, 1e9], 1e6), ([15.0, 300.0, 200.0], 0.5e6), ([25.0, 20.0, 10.0], 2e6)];
    for ([bone, coupling, marrow], center_frequency) in cases {
        let mut setup = Setup::default();
        setup.probe.center_frequency = center_frequency;
        setup.layers.bone_attenuation = quality(bone);
        setup.layers.coupling.attenuation = quality(coupling);
        setup.layers.marrow.attenuation = quality(marrow);
        let mut refined = setup.clone();
        refined.solver.refinement = 3.0;
        for index in 0..6 {
            let bone = ensemble.bone(index).unwrap();
            let (found, expected) = (arrival(&setup, &bone), arrival(&refined, &bone));
            let error = (found.velocity / expected.velocity - 1.0).abs();
            let stated = found.estimated_error + expected.estimated_error;
            assert!(error < stated.min(1e-4), "{setup:?}, {index}: {error:e}, stated {stated:e}");
        }
    }
}

/// The direct wave of a line source, far from the bone: between two receivers its amplitude falls as
/// exp(-π f x/(c Q))/√x, and its phase moves with the speed of that frequency.
#[test]
fn a_wave_in_a_fluid_decays_and_is_delayed_as_in_closed_form() {
    let mut setup = Setup::default();
    setup.layers.coupling.thickness = 400e-3;
    setup.layers.coupling.attenuation = quality(20.0);
    setup.probe.source.x3 = 200e-3;
    setup.probe.receivers.x3 = 200e-3;
    setup.probe.receivers.first_x1 = 20e-3;
    setup.probe.receivers.pitch = 20e-3;
    setup.probe.receivers.count = 2;
    let (speed, center) = (setup.layers.coupling.sound_speed, setup.probe.center_frequency);
    let (duration, step) = (40e-6, 5e-8);
    let traces = Solver::new(&setup).traces(&mean_bone(), duration, step).unwrap();
    // Before a wave of ten times the centre frequency there is nothing.
    for (pressures, x) in traces.pressures.iter().zip([20e-3, 40e-3]) {
        let largest = pressures.iter().fold(0.0_f64, |largest, p| largest.max(p.abs()));
        let first = x / (speed * 10f64.powf((1.0 / 20.0_f64).atan() / PI));
        let early = traces.times.iter().zip(pressures).filter(|(time, _)| **time < first);
        let precursor = early.fold(0.0_f64, |largest, (_, p)| largest.max(p.abs()));
        assert!(precursor < 1e-3 * largest, "{precursor} before a wave of {largest}");
    }
    for frequency in [0.7 * center, center, 1.3 * center] {
        // Line sources leave a long tail, which is faded out.
        let spectrum = |receiver: usize| {
            let direct = 20e-3 * (receiver + 1) as f64 / speed;
            let pressures = &traces.pressures[receiver];
            traces.times.iter().zip(pressures).fold([0.0; 2], |[re, im], (time, p)| {
                let faded = ((time - direct - 4e-6) / 8e-6).clamp(0.0, 1.0);
                let (sin, cos) = (TAU * frequency * time).sin_cos();
                let p = p * (0.5 + 0.5 * (PI * faded).cos());
                [re + p * cos, im - p * sin]
            })
        };
        let [near, far] = [spectrum(0), spectrum(1)];
        let ratio = far[0].hypot(far[1]) / near[0].hypot(near[1]);
        let turn = far[1].atan2(far[0]) - near[1].atan2(near[0]);
        // k = ω/(c (iω/ω0)^γ) over the distance of 20 mm; cylindrical waves fall as 1/√x. What is
        // left of them, 1/(8 k x)², is below 1e-5.
        let exponent = (1.0 / 20.0_f64).atan() / PI;
        let k = TAU * frequency / speed * (frequency / 1e6).powf(-exponent);
        let decay = (-k * (0.5 * PI * exponent).sin() * 20e-3).exp() / 2f64.sqrt();
        assert!((ratio / decay - 1.0).abs() < 1e-3, "{frequency}: {ratio} instead of {decay}");
        let delay = (turn + k * (0.5 * PI * exponent).cos() * 20e-3) / TAU;
        assert!((delay - delay.round()).abs() < 4e-4, "{frequency}: phase off by {delay} turns");
    }
}
