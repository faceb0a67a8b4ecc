//! Computed signals, and what spoils them.

use std::path::Path;
use std::sync::LazyLock;

use osteon_common::case::{Case, Setup};
use osteon_common::signal_layout::Transmitter;
use osteon_files::case_file;
use osteon_files::probe_file::ProbeDescription;
use osteon_signals::{ArraySignals, SeriesPick, SeriesPicker, SignalSeries};
use osteon_solver::{Isa, Solver};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Case A: the paper's mean bone in the geometry of its experiment.
pub(crate) static CASE: LazyLock<Case> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/cases/A.toml");
    case_file::read(&path).unwrap()
});
/// Its signals.
pub(crate) static CLEAN: LazyLock<SignalSeries> = LazyLock::new(|| SignalSeries {
    directions: vec![signals(&CASE.setup, Transmitter::First, 2e-8)],
});

/// Solves the case's bone for one source of a setup; samples every `step`, s.
pub(crate) fn signals(setup: &Setup, transmitter: Transmitter, step: f64) -> ArraySignals {
    let mut setup = setup.clone();
    if transmitter == Transmitter::Second {
        setup.probe = setup.probe.from_other_side();
    }
    let solver = Solver::with_isa(&setup, Isa::fastest());
    let mut receivers = solver.traces(&CASE.bone, 16e-6, step).unwrap().pressures;
    if transmitter == Transmitter::Second {
        receivers.reverse();
    }
    ArraySignals { transmitter, offset: 0.0, start: 0.0, step, receivers }
}

/// The case's probe, with a filter if the signals have noise.
pub(crate) fn description(band: Option<[f64; 2]>) -> ProbeDescription {
    let mut description = ProbeDescription { setup: CASE.setup.clone(), ..Default::default() };
    description.signals.band = band.map_or(Vec::new(), Vec::from);
    description
}

pub(crate) fn pick(description: &ProbeDescription, series: &SignalSeries) -> SeriesPick {
    SeriesPicker::new(description.clone()).pick(series)
}

/// Returns the largest |p| of the first packet, in the mean over the receivers.
pub(crate) fn packet_peak(series: &SignalSeries) -> f64 {
    let array = &series.directions[0];
    let found = pick(&description(None), series);
    let peak = |(samples, time): (&Vec<f64>, f64)| {
        let index = |t: f64| (t / array.step) as usize;
        samples[index(time)..index(time + 1.2e-6)].iter().fold(0.0, |max: f64, p| max.max(p.abs()))
    };
    let times = found.receivers.iter().map(|receiver| receiver.time.unwrap());
    array.receivers.iter().zip(times).map(peak).sum::<f64>() / array.receivers.len() as f64
}

/// Adds white noise of a standard deviation.
pub(crate) fn with_noise(series: &SignalSeries, deviation: f64, seed: u64) -> SignalSeries {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = move || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let mut normal = move || {
        let size = (-2.0 * libm::log(1.0 - uniform())).sqrt();
        size * libm::cos(2.0 * std::f64::consts::PI * uniform())
    };
    let mut series = series.clone();
    for sample in series.directions.iter_mut().flat_map(|array| &mut array.receivers).flatten() {
        *sample += deviation * normal();
    }
    series
}
