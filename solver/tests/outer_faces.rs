//! Outer faces of the fluids: out of reach they change nothing, within reach they are heard.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_common::sampling;
use osteon_solver::{Arrival, Failure, Solver, Workspace, fastest_wave};

/// Thicknesses of coupling and marrow, m, that no reflection crosses in time.
const FAR: [f64; 2] = [30e-3, 30e-3];

fn bone(dispersion: f64, index: u64) -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, 5).unwrap().bone(index).unwrap()
}

fn setup([coupling, marrow]: [f64; 2]) -> Setup {
    let mut setup = Setup::default();
    setup.layers.coupling.thickness = coupling;
    setup.layers.marrow.thickness = marrow;
    setup
}

fn arrival(thicknesses: [f64; 2], bone: &Bone) -> Result<Arrival, Failure> {
    Solver::new(&setup(thicknesses)).arrival(bone, &mut Workspace::default())
}

/// Returns the least time from a pick to the earliest possible echo, in periods.
fn time_to_echo(setup: &Setup, bone: &Bone, times: &[f64]) -> f64 {
    let speed = fastest_wave(bone).max(setup.layers.marrow.sound_speed);
    let places = setup.probe.places();
    let echoes = places.map(|place| sampling::earliest_echo(setup, place, speed));
    let least = echoes.zip(times).map(|(echo, t)| echo - t).fold(f64::INFINITY, f64::min);
    least * setup.probe.center_frequency
}

/// With the faces in the sampling the first of these was wrong by 2.1e-4, at every refinement.
#[test]
fn faces_out_of_reach_do_not_change_a_bit() {
    let mut audible = 0;
    for near in [[5e-3, 1.5e-3], [3.5e-3, 10e-3], [6e-3, 10e-3], [10e-3, 2e-3]] {
        for (dispersion, index) in [(0.1, 0), (0.1, 1), (0.1, 2), (0.3, 3), (0.3, 4), (0.3, 5)] {
            let bone = bone(dispersion, index);
            let (found, far) = (arrival(near, &bone).unwrap(), arrival(FAR, &bone).unwrap());
            assert!(time_to_echo(&setup(near), &bone, &found.times) > 0.1, "{near:?} {index}");
            let bits = |one: &Arrival| (one.velocity.to_bits(), one.estimated_error.to_bits());
            assert_eq!(bits(&found), bits(&far), "{near:?}, dispersion {dispersion}, {index}");
            let speed = fastest_wave(&bone);
            audible += usize::from(sampling::echoes_are_audible(&setup(near), speed));
        }
    }
    assert!(audible >= 18, "only {audible} of 24 have echoes before the direct wave");
}

/// Below a coupling that hardly covers the probe, the echo is part of the packet.
#[test]
fn a_face_within_reach_is_heard() {
    for index in 0..3 {
        let bone = bone(0.1, index);
        let near = [2.1e-3, 10e-3];
        let found = arrival(near, &bone).unwrap();
        assert!(time_to_echo(&setup(near), &bone, &found.times) < 0.1);
        let far = arrival(FAR, &bone).unwrap();
        assert!((found.velocity / far.velocity - 1.0).abs() > 1e-3, "{index}");
        let mut refined = setup(near);
        refined.solver.refinement = 4.0;
        let refined = Solver::new(&refined).arrival(&bone, &mut Workspace::default()).unwrap();
        assert!((found.velocity / refined.velocity - 1.0).abs() < 1e-4, "{index}");
    }
}
