//! Guided waves of computed signals, against those that the model has.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::f64::consts::TAU;
use std::sync::LazyLock;

use osteon_common::case::Setup;
use osteon_common::signal_layout::Transmitter;
use osteon_files::probe_file::ProbeDescription;
use osteon_signals::{
    ArraySignals, DispersionImage, ImageGrid, SignalSeries, WaveEstimate, WaveFailure, WaveFinder,
};
use osteon_solver::{Isa, Solver};
use support::{CASE, with_noise};

/// Distances of the sources from the usual one, m.
const OFFSETS: [f64; 5] = [0.0, 3e-3, 6e-3, 9e-3, 12e-3];

/// A probe of 24 receivers near a thin plate in water, where A0 is slower than the waves in the water.
fn setup() -> Setup {
    let mut setup = CASE.setup.clone();
    setup.layers.bone_thickness = 1.5e-3;
    setup.probe.center_frequency = 0.5e6;
    setup.probe.source.x3 = 1e-3;
    setup.probe.receivers.x3 = 1e-3;
    setup.probe.receivers.count = 24;
    setup
}

fn described(setup: Setup, frequency: f64, a0: [f64; 2]) -> ProbeDescription {
    let mut description = ProbeDescription { setup, ..Default::default() };
    description.waves.frequencies = vec![frequency];
    description.waves.a0 = a0.to_vec();
    description
}

/// The signals of all sources on one side; samples every 50 ns.
fn signals(setup: &Setup, transmitter: Transmitter, offsets: &[f64]) -> Vec<ArraySignals> {
    let of_source = |offset: &f64| {
        let mut own = setup.clone();
        if transmitter == Transmitter::Second {
            own.probe = own.probe.from_other_side();
        }
        own.probe = own.probe.with_source_farther(*offset);
        let solver = Solver::with_isa(&own, Isa::fastest());
        let step = 5e-8;
        let mut receivers = solver.traces(&CASE.bone, 70e-6, step).unwrap().pressures;
        if transmitter == Transmitter::Second {
            receivers.reverse();
        }
        ArraySignals { transmitter, offset: *offset, start: 0.0, step, receivers }
    };
    offsets.iter().map(of_source).collect()
}

static CLEAN: LazyLock<SignalSeries> =
    LazyLock::new(|| SignalSeries { directions: signals(&setup(), Transmitter::First, &OFFSETS) });

/// Standard deviation of noise so many decibels below the largest pressure, in the mean over all signals.
fn deviation(series: &SignalSeries, decibels: f64) -> f64 {
    let all = || series.directions.iter().flat_map(|array| &array.receivers);
    let peaks = all().map(|signal| signal.iter().fold(0.0, |max: f64, p| max.max(p.abs())));
    peaks.sum::<f64>() / all().count() as f64 * libm::pow(10.0, -decibels / 20.0)
}

fn find(
    description: &ProbeDescription,
    series: &SignalSeries,
) -> Result<WaveEstimate, WaveFailure> {
    WaveFinder::new(description.clone()).find(series)[0].estimate
}

/// Phase velocity of the model's A0 between the fluids.
fn model(frequency: f64) -> f64 {
    let solver = Solver::with_isa(&setup(), Isa::fastest());
    let modes = solver.modes_in_fluids(&CASE.bone, frequency).unwrap().modes;
    modes.iter().find(|mode| mode.name.as_deref() == Some("A0")).unwrap().phase_velocity
}

#[test]
fn a0_of_computed_signals_is_that_of_the_model() {
    for (frequency, range) in [(0.2e6, [800.0, 1250.0]), (0.4e6, [800.0, 1280.0])] {
        let description = described(setup(), frequency, range);
        let found = find(&description, &CLEAN).unwrap().phase_velocity;
        let expected = model(frequency);
        assert!((found / expected - 1.0).abs() < 0.01, "{frequency} Hz: {found}, {expected}");
    }
}

/// Of many noisy series, the share of intervals of 95 % that hold what is found without noise.
fn check_intervals(decibels: f64) {
    let mut description = described(setup(), 0.3e6, [800.0, 1250.0]);
    description.waves.frequencies.push(0.4e6);
    let finder = WaveFinder::new(description);
    let deviation = deviation(&CLEAN, decibels);
    let exact = finder.find(&CLEAN);
    let mut held = [0; 2];
    const COUNT: u64 = 200;
    for seed in 0..COUNT {
        let found = finder.find(&with_noise(&CLEAN, deviation, seed));
        for ((held, found), exact) in held.iter_mut().zip(found).zip(&exact) {
            let (found, exact) = (found.estimate.unwrap(), exact.estimate.unwrap());
            let error = (found.phase_velocity - exact.phase_velocity).abs();
            *held += u64::from(error <= 1.96 * found.standard_error);
        }
    }
    // The share of 200 has a standard deviation of 1.5 %.
    for held in held {
        assert!((0.91..=0.99).contains(&(held as f64 / COUNT as f64)), "{decibels} dB: {held}");
    }
}

#[test]
fn intervals_hold_at_40_decibels() {
    check_intervals(40.0);
}

#[test]
fn intervals_hold_at_30_decibels() {
    check_intervals(30.0);
}

/// A burst of the centre frequency that travels with one velocity, as each of two sources sees it, with a later
/// echo of another velocity.
fn bursts(setup: &Setup, velocities: [f64; 2], echo: Option<f64>) -> SignalSeries {
    let (step, samples) = (5e-8, 1000);
    let burst = |t: f64| {
        let u = (t - 5e-6) * setup.probe.center_frequency;
        libm::cos(TAU * u) * libm::exp(-u * u)
    };
    let directions = Transmitter::ALL.into_iter().zip(velocities).map(|(transmitter, velocity)| {
        let signal = |distance: f64| -> Vec<f64> {
            (0..samples)
                .map(|j| {
                    let t = f64::from(j) * step;
                    let later = echo.map_or(0.0, |echo| 0.5 * burst(t - distance / echo));
                    burst(t - distance / velocity) + later
                })
                .collect()
        };
        let mut receivers: Vec<_> = setup.probe.distances().map(signal).collect();
        if transmitter == Transmitter::Second {
            receivers.reverse();
        }
        ArraySignals { transmitter, offset: 0.0, start: 0.0, step, receivers }
    });
    SignalSeries { directions: directions.collect() }
}

#[test]
fn both_sides_have_the_harmonic_mean() {
    let description = described(setup(), 0.5e6, [900.0, 1300.0]);
    let (one, other): (f64, f64) = (1100.0, 1060.0);
    let found = find(&description, &bursts(&setup(), [one, other], None)).unwrap();
    let expected = 2.0 / (1.0 / one + 1.0 / other);
    assert!((found.phase_velocity / expected - 1.0).abs() < 1e-4, "{found:?}, {expected}");
    let mut first = bursts(&setup(), [one, other], None);
    first.directions.truncate(1);
    let found = find(&description, &first).unwrap().phase_velocity;
    assert!((found / one - 1.0).abs() < 1e-4, "{found}");
}

#[test]
fn a_phase_velocity_that_is_not_known_says_why() {
    let usual = described(setup(), 0.5e6, [900.0, 1300.0]);
    let clean = bursts(&setup(), [1100.0; 2], None);
    let refused = |description: &ProbeDescription, series: &SignalSeries, expected| {
        assert_eq!(find(description, series).map(|found| found.phase_velocity), Err(expected));
    };
    refused(&described(setup(), 0.5e6, [1200.0, 1300.0]), &clean, WaveFailure::NoWave);
    refused(&described(setup(), 0.5e6, [350.0, 1300.0]), &clean, WaveFailure::TooCoarse);
    refused(&described(setup(), 0.5e6, [500.0, 1300.0]), &clean, WaveFailure::TooShort);
    let mut dead = clean.clone();
    for receiver in &mut dead.directions[0].receivers[..7] {
        receiver.fill(0.0);
    }
    refused(&usual, &dead, WaveFailure::DeadReceiver);
    let mut clipped = clean.clone();
    for sample in &mut clipped.directions[1].receivers[3] {
        *sample = sample.min(0.5);
    }
    refused(&usual, &clipped, WaveFailure::Saturated);
    refused(&usual, &with_noise(&clean, 10.0, 1), WaveFailure::TooNoisy);
    // Two velocities in turn for two sources on one side, which then have two vectors.
    let mut several = SignalSeries {
        directions: vec![
            bursts(&setup(), [1000.0; 2], Some(2000.0)).directions[0].clone(),
            bursts(&setup(), [2000.0; 2], None).directions[0].clone(),
        ],
    };
    several.directions[1].offset = 1e-3;
    refused(&described(setup(), 0.5e6, [900.0, 2500.0]), &several, WaveFailure::SeveralWaves);
}

/// A receiver that is dead for one source is left out for all.
#[test]
fn few_dead_receivers_are_left_out() {
    let description = described(setup(), 0.5e6, [900.0, 1300.0]);
    let mut series = bursts(&setup(), [1100.0; 2], None);
    series.directions[0].receivers[5].fill(0.0);
    series.directions[1].receivers[0].fill(0.0);
    let found = find(&description, &series).unwrap().phase_velocity;
    assert!((found / 1100.0 - 1.0).abs() < 1e-4, "{found}");
}

#[test]
fn of_one_source_the_image_is_the_spatial_transform() {
    let setup = setup();
    let mut series = bursts(&setup, [1400.0; 2], None);
    series.directions.truncate(1);
    let grid = ImageGrid::of_frequencies(&setup, vec![0.4e6, 0.5e6]);
    let mut image = DispersionImage::new(grid.clone());
    assert_eq!(image.values(), None);
    image.add(&ProbeDescription { setup: setup.clone(), ..Default::default() }, &series).unwrap();
    let values = image.values().unwrap();
    for (frequency, values) in grid.frequencies.iter().zip(&values) {
        let most = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap();
        let found = TAU * frequency / grid.wavenumbers[most];
        assert!((found / 1400.0 - 1.0).abs() < 0.02, "{found}");
        // A wave that is the same at all receivers is the transform of the window alone.
        for (k, value) in grid.wavenumbers.iter().zip(values) {
            let (mut re, mut im) = (0.0, 0.0);
            for distance in setup.probe.distances() {
                let (sin, cos) = libm::sincos((k - TAU * frequency / 1400.0) * distance);
                re += cos / 24.0;
                im += sin / 24.0;
            }
            assert!((value - (re * re + im * im)).abs() < 1e-6, "{k}: {value}");
        }
    }
}
