//! A tilted probe: each receiver against a level probe at its height, and the second direction.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::probe::Place;
use osteon_common::realization::Ensemble;
use osteon_solver::{Arrival, Solver, Workspace};

const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
const DEGREE: f64 = 0.017_453_292_519_943_295;

fn random_bone() -> Bone {
    Ensemble::new(&OPTIMUM, 7).unwrap().bone(3).unwrap()
}

fn arrival(setup: &Setup, bone: &Bone) -> Arrival {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap()
}

/// A setup with a tilted probe; source and receivers have different heights also without the tilt.
fn tilted_setup(tilt: f64) -> Setup {
    let mut setup = Setup::default();
    setup.solver.refinement = 3.0;
    setup.probe.tilt = tilt;
    setup.probe.source.x3 = 1.5e-3;
    setup.probe.receivers.x3 = 2.5e-3;
    setup
}

/// Returns a level probe whose first receiver is at a place.
fn level(setup: &Setup, place: Place) -> Setup {
    let mut level = setup.clone();
    level.probe.tilt = 0.0;
    level.probe.bidirectional = false;
    level.probe.receivers.x3 = place.x3;
    level.probe.receivers.first_x1 = setup.probe.source.x1 + place.x;
    level
}

#[test]
fn places_are_those_of_a_rigid_probe_turned_about_the_source() {
    for degrees in [-3.0, 0.0, 2.0] {
        let probe = tilted_setup(degrees * DEGREE).probe;
        let places: Vec<Place> = probe.places().collect();
        for (place, distance) in places.iter().zip(probe.distances()) {
            let (across, height) = (place.x, place.x3 - probe.source.x3);
            let turned = libm::hypot(across, height) / libm::hypot(distance, 1e-3);
            assert!((turned - 1.0).abs() < 1e-14, "{place:?}");
            let angle = libm::atan2(height, across) - libm::atan2(1e-3, distance);
            assert!((angle - degrees * DEGREE).abs() < 1e-12, "{place:?}");
        }
    }
}

/// The time at each receiver is that of a level probe at its height: another sampling, and another
/// sum over wavenumbers. Outer faces at 20 mm are not heard, those at 5.5 mm above the bone are.
#[test]
fn each_receiver_hears_what_a_level_one_at_its_height_does() {
    let bone = random_bone();
    for (degrees, coupling) in [(1.5, 20e-3), (-3.0, 20e-3), (2.0, 5.5e-3)] {
        let mut setup = tilted_setup(degrees * DEGREE);
        setup.layers.coupling.thickness = coupling;
        let found = arrival(&setup, &bone);
        let places: Vec<Place> = setup.probe.places().collect();
        for r in [0, 5, 13] {
            let expected = arrival(&level(&setup, places[r]), &bone).times[0];
            let off = (found.times[r] - expected).abs();
            assert!(off < 3e-11, "{degrees}°, receiver {r}: {off:e} s");
        }
    }
}

/// So are its traces, with the direct wave and all reflections of the outer faces.
#[test]
fn traces_are_those_of_level_receivers() {
    let bone = random_bone();
    let mut setup = tilted_setup(2.0 * DEGREE);
    setup.solver.refinement = 1.0;
    setup.layers.coupling.thickness = 4e-3;
    let traces = |setup: &Setup| Solver::new(setup).traces(&bone, 12e-6, 50e-9).unwrap().pressures;
    let found = traces(&setup);
    let places: Vec<Place> = setup.probe.places().collect();
    for r in [0, 7, 13] {
        let expected = &traces(&level(&setup, places[r]))[0];
        let largest = expected.iter().fold(0.0_f64, |largest, p| largest.max(p.abs()));
        for (found, expected) in found[r].iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3 * largest, "{found} instead of {expected}");
        }
    }
}

/// From the second source the same waves arrive as if source and receivers were exchanged.
#[test]
fn the_second_direction_is_that_of_exchanged_source_and_receivers() {
    let bone = random_bone();
    let mut setup = tilted_setup(DEGREE);
    setup.probe.bidirectional = true;
    let both = arrival(&setup, &bone);
    let [one, two] = both.directions.unwrap();
    let other = setup.probe.from_other_side();
    let reversed = Setup { probe: other.clone(), ..setup };
    let times = arrival(&one_way(&reversed), &bone).times;
    let heights: Vec<f64> = setup.probe.places().map(|place| place.x3).collect();
    let places: Vec<Place> = other.places().collect();
    for r in [0, 6, 13] {
        // Seen from the second source, the receivers are in the opposite order.
        assert!((places[r].x3 - heights[13 - r]).abs() < 1e-15);
        let mut exchanged = level(&reversed, places[r]);
        exchanged.probe.source.x3 = places[r].x3;
        exchanged.probe.receivers.x3 = other.source.x3;
        let expected = arrival(&exchanged, &bone).times[0];
        assert!((times[r] - expected).abs() < 3e-11, "receiver {r}: {} {expected}", times[r]);
    }
    assert_eq!(both.velocity, 2.0 / (1.0 / one + 1.0 / two));
    assert!((one / two - 1.0).abs() > 0.05, "{one} {two}");
}

fn one_way(setup: &Setup) -> Setup {
    let mut setup = setup.clone();
    setup.probe.bidirectional = false;
    setup
}

/// The ways through the coupling cancel in both directions together. What remains is that the probe is
/// shorter along the bone, and nearer to it or farther.
#[test]
fn the_harmonic_mean_hardly_depends_on_the_tilt() {
    let bone = Bone { elasticity: OPTIMUM.constants().elasticity().unwrap(), density: 1598.8 };
    let mut setup = Setup::default();
    setup.solver.refinement = 2.0;
    setup.probe.bidirectional = true;
    let level = arrival(&setup, &bone);
    assert_eq!(level.directions, Some([level.velocity; 2]));
    for degrees in [-1.0, 1.0, 2.0] {
        setup.probe.tilt = degrees * DEGREE;
        let found = arrival(&setup, &bone);
        let off = found.velocity / level.velocity - 1.0;
        assert!(off.abs() < 6e-4 * degrees * degrees, "{degrees}°: {off:e}");
        // By an independent program −4.0 % and +4.4 % for one degree.
        let [up, down] = found.directions.unwrap().map(|v| 100.0 * (v / level.velocity - 1.0));
        let (slower, faster) = if degrees > 0.0 { (up, down) } else { (down, up) };
        if degrees.abs() == 1.0 {
            assert!((slower + 4.0).abs() < 0.07 && (faster - 4.4).abs() < 0.07, "{up} {down}");
        }
    }
}
