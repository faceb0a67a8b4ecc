//! Velocities and their standard errors from noisy signals.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

mod support;

use osteon_common::case::Setup;
use osteon_common::signal_layout::Transmitter;
use osteon_files::probe_file::ProbeDescription;
use osteon_signals::{MeasuredValue, SignalSeries};
use osteon_solver::{Isa, Solver, Workspace};
use support::{CASE, CLEAN, description, packet_peak, pick, signals, with_noise};

/// What many noisy series give.
#[derive(Debug)]
struct Account {
    /// Mean error of the velocity, m/s.
    bias: f64,
    /// Mean standard error, m/s.
    standard_error: f64,
    /// Share of the intervals of 95 % that contain the exact velocity.
    coverage: f64,
    /// Series without a velocity, and velocities off by more than six standard errors.
    refused: usize,
    wrong: usize,
}

fn account(clean: &SignalSeries, decibels: f64, count: u64) -> Account {
    let exact = pick(&description(None), clean).estimate.unwrap().velocity;
    let deviation = packet_peak(clean) * libm::pow(10.0, -decibels / 20.0);
    let probe = description(Some([0.0, 2.5e6]));
    let (mut found, mut account) =
        (0.0, Account { bias: 0.0, standard_error: 0.0, coverage: 0.0, refused: 0, wrong: 0 });
    for seed in 0..count {
        let Ok(estimate) = pick(&probe, &with_noise(clean, deviation, seed)).estimate else {
            account.refused += 1;
            continue;
        };
        let error = estimate.velocity - exact;
        found += 1.0;
        account.bias += error;
        account.standard_error += estimate.standard_error;
        account.coverage += f64::from(error.abs() <= 1.96 * estimate.standard_error);
        account.wrong += usize::from(error.abs() > 6.0 * estimate.standard_error);
    }
    for mean in [&mut account.bias, &mut account.standard_error, &mut account.coverage] {
        *mean /= found;
    }
    account
}

fn check(clean: &SignalSeries, decibels: f64, bias_max: f64, refused_max: usize) {
    let account = account(clean, decibels, 400);
    assert!(account.bias.abs() <= bias_max, "{decibels} dB: {account:?}");
    assert!((0.93..=0.97).contains(&account.coverage), "{decibels} dB: {account:?}");
    assert!(account.refused <= refused_max && account.wrong == 0, "{decibels} dB: {account:?}");
}

#[test]
fn at_40_decibels_intervals_hold() {
    check(&CLEAN, 40.0, 1.0, 0);
}

#[test]
fn at_30_decibels_the_bias_is_small_and_intervals_hold() {
    check(&CLEAN, 30.0, 2.0, 0);
}

/// The first extremum is a sixth of the packet's peak, here not much more than the noise.
#[test]
fn at_20_decibels_intervals_hold() {
    check(&CLEAN, 20.0, 8.0, 40);
}

/// Of signals that are sampled this finely the filter keeps every eighth value. Their noise has the same size in
/// each sample, most of it above the band.
#[test]
fn finely_sampled_signals_lose_nothing() {
    let fine = signals(&CASE.setup, Transmitter::First, 4e-9);
    check(&SignalSeries { directions: vec![fine] }, 20.0, 2.0, 0);
}

/// Returns other velocity, decay and centre frequency of a series.
fn others(probe: &ProbeDescription, series: &SignalSeries) -> [MeasuredValue; 3] {
    let found = pick(probe, series).first_signal;
    [found.other_velocity, found.decay, found.center_frequency].map(Option::unwrap)
}

#[test]
fn what_else_the_first_signal_tells_is_the_models() {
    let mut setup = Setup::clone(&CASE.setup);
    setup.solver.refinement = 4.0;
    let (solver, mut workspace) = (Solver::with_isa(&setup, Isa::fastest()), Workspace::default());
    let arrival = solver.arrival(&CASE.bone, &mut workspace).unwrap();
    let series = SignalSeries { directions: vec![signals(&setup, Transmitter::First, 2e-8)] };
    let model = solver.first_signal(&CASE.bone, &arrival, &mut workspace);
    let expected = [model.other_velocity.unwrap(), model.decay, model.center_frequency.unwrap()];
    // Amplitudes of both are less accurate than times.
    let tolerances = [1e-5, 1e-4, 1e-5];
    for ((found, expected), tolerance) in
        others(&description(None), &series).iter().zip(expected).zip(tolerances)
    {
        assert!((found.value / expected - 1.0).abs() < tolerance, "{} {expected}", found.value);
    }
}

/// A record that begins with the arrivals tells no noise, but receivers that differ.
#[test]
fn without_a_quiet_beginning_scatter_makes_the_errors() {
    let mut series = with_noise(&CLEAN, 1e-4 * packet_peak(&CLEAN), 3);
    for array in &mut series.directions {
        let dropped = (4e-6 / array.step) as usize;
        array.start += dropped as f64 * array.step;
        array.receivers.iter_mut().for_each(|samples| drop(samples.drain(..dropped)));
    }
    let found = pick(&description(None), &series);
    assert!(found.estimate.is_ok(), "{:?}", found.estimate);
    assert!(found.receivers.iter().any(|receiver| receiver.standard_error == 0.0));
    for found in others(&description(None), &series) {
        assert!(
            found.standard_error > 0.0 && found.standard_error < 0.1 * found.value,
            "{found:?}"
        );
    }
}

#[test]
fn intervals_of_the_others_hold() {
    let probe = description(Some([0.0, 2.5e6]));
    // The filter moves them a little.
    let exact = others(&probe, &CLEAN).map(|found| found.value);
    let deviation = packet_peak(&CLEAN) * libm::pow(10.0, -30.0 / 20.0);
    let mut held = [0.0; 3];
    for seed in 0..400 {
        let found = others(&probe, &with_noise(&CLEAN, deviation, seed));
        for ((held, found), exact) in held.iter_mut().zip(found).zip(exact) {
            let within = (found.value - exact).abs() <= 1.96 * found.standard_error;
            *held += f64::from(within) / 400.0;
        }
    }
    assert!(held.iter().all(|share| (0.92..=0.98).contains(share)), "{held:?}");
}
