//! What is found in signals that are spoilt in one way.

#![expect(clippy::panic, clippy::unwrap_used, reason = "a test that cannot go on should say where")]

mod support;

use osteon_common::case::Setup;
use osteon_common::signal_layout::Transmitter;
use osteon_signals::{PickFailure, SignalSeries};
use osteon_solver::{Isa, Solver, Workspace};
use support::{CASE, CLEAN, description, packet_peak, pick, signals, with_noise};

/// Velocity of the clean signals, m/s.
fn clean_velocity() -> f64 {
    pick(&description(None), &CLEAN).estimate.unwrap().velocity
}

/// Spoils the receivers of the clean signals, with a little noise or without, and checks the failures of the
/// receivers and the velocity, in m/s from the clean one, or the failure of the series.
fn check(
    name: &str,
    spoil: impl Fn(&mut Vec<Vec<f64>>),
    receivers: &[(usize, PickFailure)],
    expected: Result<f64, PickFailure>,
) {
    for noise in [0.0, 1e-3 * packet_peak(&CLEAN)] {
        let mut series = match noise {
            0.0 => SignalSeries::clone(&CLEAN),
            noise => with_noise(&CLEAN, noise, 1),
        };
        spoil(&mut series.directions[0].receivers);
        let band = (noise > 0.0).then_some([0.0, 2.5e6]);
        let found = pick(&description(band), &series);
        let failures = found.receivers.iter().enumerate();
        let failures: Vec<_> = failures.filter_map(|(r, it)| Some((r, it.failure?))).collect();
        if expected.is_ok() {
            assert_eq!(failures, receivers, "{name}, noise {noise}: {found:?}");
        }
        match (&found.estimate, expected) {
            (Ok(estimate), Ok(most)) => {
                let error = (estimate.velocity - clean_velocity()).abs();
                assert!(
                    error <= most + 4.0 * estimate.standard_error,
                    "{name}, noise {noise}: {error}"
                );
                assert!((0.0..=1.0).contains(&estimate.quality));
            }
            (Err(refusal), Err(failure)) => {
                assert_eq!(refusal.failure, failure, "{name}, noise {noise}: {}", refusal.detail);
            }
            (found, expected) => panic!("{name}, noise {noise}: {found:?}, not {expected:?}"),
        }
    }
}

/// Moves a signal by whole samples.
fn delay(samples: &mut [f64], by: isize) {
    let moved: Vec<f64> = (0..samples.len() as isize)
        .map(|j| usize::try_from(j - by).ok().and_then(|j| samples.get(j)).copied().unwrap_or(0.0))
        .collect();
    samples.copy_from_slice(&moved);
}

#[test]
fn gains_and_offsets_do_not_move_a_velocity() {
    let gains = |receivers: &mut Vec<Vec<f64>>| {
        for (r, samples) in receivers.iter_mut().enumerate() {
            let gain = libm::pow(10.0, [0.05, -0.05, 0.02, -0.03][r % 4]);
            samples.iter_mut().for_each(|sample| *sample = *sample * gain + 3.0);
        }
    };
    check("gains", gains, &[], Ok(0.1));
}

#[test]
fn a_spoilt_receiver_is_named_and_left_out() {
    use PickFailure::{CycleSlip, DeadReceiver, Saturated, WrongPolarity};
    check("dead", |all| all[4].fill(0.0), &[(4, DeadReceiver)], Ok(0.3));
    check("dead end", |all| all[0].fill(7.0), &[(0, DeadReceiver)], Ok(1.0));
    check(
        "polarity",
        |all| all[9].iter_mut().for_each(|sample| *sample = -*sample),
        &[(9, WrongPolarity)],
        Ok(0.3),
    );
    // A period is 50 samples.
    check("late", |all| delay(&mut all[6], 50), &[(6, CycleSlip)], Ok(0.3));
    check("early", |all| delay(&mut all[6], -48), &[(6, CycleSlip)], Ok(0.3));
    check(
        "clipped",
        |all| all[2].iter_mut().for_each(|sample| *sample = sample.clamp(-12.0, 12.0)),
        &[(2, Saturated)],
        Ok(0.3),
    );
    check("off the line", |all| delay(&mut all[6], 4), &[(6, PickFailure::Inconsistent)], Ok(0.3));
    check(
        "several",
        |all| {
            all[3].fill(0.0);
            delay(&mut all[6], 50);
            all[11].iter_mut().for_each(|sample| *sample = -*sample);
        },
        &[(3, DeadReceiver), (6, CycleSlip), (11, WrongPolarity)],
        Ok(1.0),
    );
}

#[test]
fn an_array_with_too_many_spoilt_receivers_has_no_velocity() {
    use PickFailure::{CycleSlip, DeadReceiver, NoArrival, Saturated};
    let fill = |all: &mut Vec<Vec<f64>>| all[..5].iter_mut().for_each(|one| one.fill(0.0));
    check("dead", fill, &[], Err(DeadReceiver));
    let slip = |all: &mut Vec<Vec<f64>>| {
        [1, 4, 7, 10].into_iter().for_each(|r| delay(&mut all[r], 50));
    };
    check("slips", slip, &[], Err(CycleSlip));
    let clip = |all: &mut Vec<Vec<f64>>| {
        all.iter_mut().flatten().for_each(|sample| *sample = sample.clamp(-12.0, 12.0));
    };
    check("clipped", clip, &[], Err(Saturated));
    let silent = |all: &mut Vec<Vec<f64>>| {
        // Only noise before the direct wave, which is kept.
        for samples in all.iter_mut() {
            for (j, sample) in samples.iter_mut().enumerate() {
                *sample = 1e-3 * libm::sin(2.1 * (j * j % 7919) as f64)
                    + if j > 790 { *sample } else { 0.0 };
            }
        }
    };
    check("silent", silent, &[], Err(NoArrival));
}

#[test]
fn noise_that_hides_the_first_extremum_is_refused() {
    let noisy = with_noise(&CLEAN, 0.3 * packet_peak(&CLEAN), 3);
    let found = pick(&description(Some([0.0, 2.5e6])), &noisy);
    let failure = found.estimate.unwrap_err().failure;
    assert!(
        [PickFailure::TooNoisy, PickFailure::NoArrival, PickFailure::Inconsistent]
            .contains(&failure)
    );
}

/// Without a filter noise of high frequency has extrema of its own on the top of each wave.
#[test]
fn noise_that_should_be_filtered_is_refused_with_the_filter() {
    let noisy = with_noise(&CLEAN, 0.01 * packet_peak(&CLEAN), 3);
    let refusal = pick(&description(None), &noisy).estimate.unwrap_err();
    assert_eq!(refusal.failure, PickFailure::TooNoisy);
    assert!(
        refusal.detail.ends_with("[signals] band = [0.0, 2500000.0] filters noise"),
        "{refusal:?}"
    );
}

/// The pulse couples into the receivers before any wave arrives.
#[test]
fn crosstalk_is_no_noise() {
    let mut noisy = with_noise(&CLEAN, 0.01 * packet_peak(&CLEAN), 3);
    let probe = description(Some([0.0, 2.5e6]));
    let before = pick(&probe, &noisy).estimate.unwrap();
    for samples in &mut noisy.directions[0].receivers {
        for (j, sample) in samples.iter_mut().enumerate().take(60) {
            *sample += 300.0 * libm::sin(0.25 * j as f64);
        }
    }
    let after = pick(&probe, &noisy).estimate.unwrap();
    assert!((after.velocity - before.velocity).abs() < 0.5 * before.standard_error);
    let ratio = after.standard_error / before.standard_error;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

/// Both directions of a tilted probe: each is off by four per cent, and their harmonic mean is the solver's.
#[test]
fn two_directions_cancel_a_tilt() {
    let mut setup = Setup::clone(&CASE.setup);
    setup.probe.tilt = 0.0175;
    setup.probe.bidirectional = true;
    let both = [Transmitter::First, Transmitter::Second];
    let series = SignalSeries { directions: both.map(|one| signals(&setup, one, 2e-8)).to_vec() };
    let mut probe = description(None);
    probe.setup = setup.clone();
    probe.signals.transmitters = both.to_vec();
    let found = pick(&probe, &series);
    let velocity = found.estimate.unwrap().velocity;
    let solver = Solver::with_isa(&setup, Isa::fastest());
    let expected = solver.arrival(&CASE.bone, &mut Workspace::default()).unwrap();
    assert!((velocity / expected.velocity - 1.0).abs() < expected.estimated_error.max(1e-5));
    for (one, other) in found.directions.unwrap().into_iter().zip(expected.directions.unwrap()) {
        assert!((one / other - 1.0).abs() < 3e-4, "{one} {other}");
        assert!((one / velocity - 1.0).abs() > 0.02);
    }
    // Noise of one direction is not that of the other.
    let noisy = with_noise(&series, 0.01 * packet_peak(&CLEAN), 5);
    probe.signals.band = vec![0.0, 2.5e6];
    let found = pick(&probe, &noisy).estimate.unwrap();
    assert!((found.velocity - velocity).abs() < 3.0 * found.standard_error);
}

/// The velocity of computed signals is the solver's.
#[test]
fn without_noise_the_velocity_is_the_models() {
    let mut setup = Setup::clone(&CASE.setup);
    setup.solver.refinement = 4.0;
    let expected = Solver::with_isa(&setup, Isa::fastest())
        .arrival(&CASE.bone, &mut Workspace::default())
        .unwrap()
        .velocity;
    let series = SignalSeries { directions: vec![signals(&setup, Transmitter::First, 2e-8)] };
    let found = pick(&description(None), &series).estimate.unwrap();
    assert!((found.velocity / expected - 1.0).abs() < 1e-6, "{} {expected}", found.velocity);
    assert!(found.quality > 0.99);
    // The second extremum, too, as closely as the solver states.
    let mut second = description(None);
    second.setup.picking.extremum = osteon_common::settings::Extremum::Second;
    setup.picking.extremum = osteon_common::settings::Extremum::Second;
    let solver = Solver::with_isa(&setup, Isa::fastest());
    let expected = solver.arrival(&CASE.bone, &mut Workspace::default()).unwrap();
    let found = pick(&second, &series).estimate.unwrap();
    let error = (found.velocity / expected.velocity - 1.0).abs();
    assert!(error < expected.estimated_error.min(1e-5), "{error:e} {expected:?}");
}
