use super::*;

/// Returns the paper's geometry with changes.
fn setup(change: impl Fn(&mut Setup)) -> Setup {
    let mut setup = Setup::default();
    change(&mut setup);
    setup
}

#[test]
fn the_papers_outer_faces_are_not_heard_and_near_ones_are() {
    let echoes = |change: fn(&mut Setup)| {
        let setup = setup(change);
        let sampling = WaveSampling::for_speed_bin(
            &setup,
            speed_bin(&setup, 3960.1).unwrap(),
            Grade::Thorough,
            OuterFaces::Audible,
        );
        (sampling.upper_echoes, sampling.lower_echoes)
    };
    assert_eq!(echoes(|_| ()), (false, false));
    assert_eq!(echoes(|s| s.layers.coupling.thickness = 4e-3), (true, false));
    assert_eq!(echoes(|s| s.layers.marrow.thickness = 3e-3), (false, true));
    // The earliest is that of the nearer face.
    for (change, heard) in [
        ((|_: &mut Setup| ()) as fn(&mut Setup), false),
        (|s| s.layers.coupling.thickness = 4e-3, true),
        (|s| s.layers.marrow.thickness = 3e-3, true),
    ] {
        assert_eq!(echoes_are_audible(&setup(change), 3960.1), heard);
    }
}

#[test]
fn fluids_without_end_have_no_echoes() {
    let near = setup(|s| s.layers.coupling.thickness = 4e-3);
    let sampling = WaveSampling::for_speed_bin(&near, 18, Grade::Thorough, OuterFaces::None);
    assert!(!sampling.upper_echoes && !sampling.lower_echoes);
}

#[test]
fn arrivals_at_the_papers_probe() {
    let setup = Setup::default();
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-8, "{a} against {b}");
    // Computed by hand: 11 mm / 3960.1 m/s + 4 mm · √(1/1500² - 1/3960.1²).
    let at = |x| Place { x, x3: 2e-3 };
    close(earliest_arrival(&setup, at(11e-3), 3960.1), 2.7777e-6 + 2.4680e-6);
    close(direct_arrival(&setup, at(21.4e-3)), 14.2667e-6);
    // No wave along a slow bone overtakes the reflection from its face.
    close(earliest_arrival(&setup, at(3e-3), 1400.0), 5e-3 / 1500.0);
}

#[test]
fn a_speed_bin_is_fast_enough_and_not_much_faster() {
    let setup = Setup::default();
    for speed in [1000.0, 1687.5, 1687.6, 4000.0, 25_000.0] {
        let sampling = WaveSampling::for_speed_bin(
            &setup,
            speed_bin(&setup, speed).unwrap(),
            Grade::Quick,
            OuterFaces::Audible,
        );
        assert!(sampling.speed >= speed);
        assert!(sampling.speed <= speed.max(1500.0) * SPEED_BIN_RATIO * (1.0 + 1e-12));
    }
    assert_eq!(speed_bin(&setup, 1e9), None);
    assert_eq!(speed_bin(&setup, f64::NAN), None);
}

#[test]
fn the_repeated_source_is_heard_after_the_window() {
    let setup = Setup::default();
    let sampling = WaveSampling::for_speed_bin(
        &setup,
        speed_bin(&setup, 3960.1).unwrap(),
        Grade::Thorough,
        OuterFaces::Audible,
    );
    let length = 2.0 * PI / sampling.wavenumber_step;
    let at = |x| Place { x, x3: 2e-3 };
    let image = earliest_arrival(&setup, at(length - 21.4e-3), sampling.speed);
    assert!(image > direct_arrival(&setup, at(21.4e-3)));
}

#[test]
fn the_taper_falls_from_one_to_nothing() {
    let sampling =
        WaveSampling::for_speed_bin(&Setup::default(), 18, Grade::Quick, OuterFaces::Audible);
    let weights: Vec<f64> = (0..sampling.frequencies())
        .map(|n| sampling.taper(n, velocity_taper(sampling.whole_band())))
        .collect();
    assert_eq!(weights[0], 1.0);
    assert!(weights.windows(2).all(|pair| pair[0] >= pair[1]));
    assert!(*weights.last().unwrap() < 1e-3);
}

#[test]
fn the_count_is_estimated_from_above_where_it_is_not_counted() {
    for refinement in [1.0, 4.0] {
        let setup = setup(|s| s.solver.refinement = refinement);
        let sampling = WaveSampling::for_traces(&setup, 4000.0, 16e-6);
        let per_frequency = (PI * sampling.whole_band() / 1500.0 + sampling.evanescent_limit)
            / sampling.wavenumber_step;
        let ratio = sampling.whole_band() * sampling.period * per_frequency
            / sampling.pairs(sampling.whole_band());
        assert!((0.9..1.7).contains(&ratio), "{ratio}");
    }
    assert!(pair_count(&setup(|s| s.probe.receivers.pitch = 10.0)) > SAMPLING_PAIRS_MAX);
    assert!(pair_count(&setup(|s| s.probe.source.x3 = 1e-9)) < SAMPLING_PAIRS_MAX);
}

/// The bounds of arrivals between elements of a width, against the least over all places on them.
#[test]
fn wide_elements_are_heard_from_their_nearest_ends() {
    for tilt in [0.0, 0.04, -0.04] {
        let lines = setup(|s| s.probe.tilt = tilt);
        let mut wide = lines.clone();
        wide.probe.element_width = 0.7e-3;
        let (sin, cos) = libm::sincos(tilt);
        let ends = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let least = |place: Place, arrival: &dyn Fn(&Setup, Place) -> f64| {
            let between = ends.map(|(source, receiver)| {
                let mut moved = lines.clone();
                moved.probe.source.x3 += 0.35e-3 * source * sin;
                let x = place.x + 0.35e-3 * (receiver - source) * cos;
                arrival(&moved, Place { x, x3: place.x3 + 0.35e-3 * receiver * sin })
            });
            between.into_iter().fold(f64::INFINITY, f64::min)
        };
        for place in wide.probe.places() {
            let direct = direct_arrival(&wide, place);
            assert!((direct - least(place, &direct_arrival)).abs() < 1e-15, "{tilt}: {direct}");
            for (speed, steepness) in [(1400.0, 0.1), (3960.1, 0.0)] {
                let bound = earliest_arrival(&wide, place, speed);
                let earliest = least(place, &|s, place| earliest_arrival(s, place, speed));
                // The bound lets both ends of a tilted probe be the nearer one to the bone, and those of
                // slow bones lie on the way.
                let slack = 0.7e-3 * (steepness + sin.abs()) / 1500.0 + 1e-15;
                assert!((0.0..slack).contains(&(earliest - bound + 1e-18)), "{tilt}, {speed}");
                let echo = least(place, &|s, place| earliest_echo(s, place, speed));
                assert!(earliest_echo(&wide, place, speed) <= echo, "{tilt}, {speed}");
            }
        }
    }
}
