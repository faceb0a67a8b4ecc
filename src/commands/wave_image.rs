//! The image of guided waves that an array sees, with the model's waves over it.

use osteon_common::case::Case;
use osteon_common::signal_layout::{SignalLayout, Transmitter};
use osteon_files::probe_file::ProbeDescription;
use osteon_local::modes::{BandModes, BandModesError, BoneSurroundings};
use osteon_local::source_traces::{source_traces, sources};
use osteon_signals::{ArraySignals, DispersionImage, SignalSeries, WavePick};
use osteon_solver::{Isa, ModesError, TraceError};

use crate::exit_status::CommandFailure;
use crate::wings::wave_image_figure;

/// Phase velocity, m/s, of the slowest waves that computed signals hold, and the periods after them.
const SLOWEST: f64 = 900.0;
const PERIODS_AFTER: f64 = 10.0;
/// Samples of computed signals in a period of the centre frequency.
const SAMPLES_OF_PERIOD: f64 = 25.0;

/// Sources beyond each of a case's own: their number, and the distance of neighbours, m.
pub(super) type FurtherSources = (u32, f64);

/// Computes what the probe of a case records with further sources, without noise.
///
/// # Errors
/// If it would be too large.
pub(super) fn recorded(
    case: &Case,
    (further, pitch): FurtherSources,
    isa: Isa,
) -> Result<(ProbeDescription, SignalSeries), CommandFailure> {
    let probe = &case.setup.probe;
    let sources = sources(probe, further, pitch);
    let step = 1.0 / (SAMPLES_OF_PERIOD * probe.center_frequency);
    let farthest = probe.distances().fold(0.0, f64::max) + f64::from(further) * pitch;
    let duration = farthest / SLOWEST + PERIODS_AFTER / probe.center_frequency;
    let of_source = |&(transmitter, offset): &(Transmitter, f64)| {
        let receivers = source_traces(case, (transmitter, offset), (duration, step), isa)?;
        Ok(ArraySignals { transmitter, offset, start: 0.0, step, receivers })
    };
    let directions: Result<Vec<_>, TraceError> = sources.iter().map(of_source).collect();
    let directions = directions.map_err(CommandFailure::bad_input)?;
    let (transmitters, transmitter_offsets) = sources.into_iter().unzip();
    let signals = SignalLayout { transmitters, transmitter_offsets, ..SignalLayout::default() };
    let setup = case.setup.clone();
    let description = ProbeDescription { setup, signals, ..ProbeDescription::default() };
    Ok((description, SignalSeries { directions }))
}

/// Computes the waves of a case's bone at the frequencies of an image.
///
/// # Errors
/// If it has none that can be stated at a frequency.
pub(super) fn model(
    case: &Case,
    surroundings: BoneSurroundings,
    image: &DispersionImage,
    (isa, threads): (Isa, usize),
) -> Result<BandModes, CommandFailure> {
    let frequencies = &image.grid().frequencies;
    BandModes::compute(case, surroundings, frequencies, isa, threads).map_err(modes_failure)
}

/// Returns the failure of a command for want of waves.
pub(super) fn modes_failure(error: BandModesError) -> CommandFailure {
    match error {
        BandModesError::Modes(
            ModesError::TooLow { .. }
            | ModesError::TooMany { .. }
            | ModesError::SeveralFluids { .. },
        ) => CommandFailure::bad_input(error),
        _ => CommandFailure::failed(error),
    }
}

/// Returns the figure as SVG, with the model's waves and the mean of those that were found; `None` if the program
/// has no figures, or if no signals could be used.
pub(super) fn svg<'a>(
    image: &DispersionImage,
    modes: Option<&BandModes>,
    found: impl Iterator<Item = &'a [WavePick]>,
) -> Option<String> {
    let grid = image.grid();
    let families = modes.map(BandModes::points).unwrap_or_default();
    let values = image.values()?;
    wave_image_figure((&grid.frequencies, &grid.wavenumbers, values), &families, &means(found))
}

/// Returns frequency (Hz) and mean phase velocity (m/s) of each wave that was found.
fn means<'a>(found: impl Iterator<Item = &'a [WavePick]>) -> Vec<[f64; 2]> {
    let mut sums: Vec<(f64, f64, f64)> = Vec::new();
    for picks in found {
        sums.resize(sums.len().max(picks.len()), (0.0, 0.0, 0.0));
        for (sum, pick) in sums.iter_mut().zip(picks) {
            sum.0 = pick.target.frequency;
            if let Ok(estimate) = pick.estimate {
                sum.1 += estimate.phase_velocity;
                sum.2 += 1.0;
            }
        }
    }
    let with_any = sums.into_iter().filter(|(_, _, count)| *count > 0.0);
    with_any.map(|(frequency, sum, count)| [frequency, sum / count]).collect()
}
