//! Makes one result of those of two passes for one bone.

use osteon_common::outcome::FailureKind;

use crate::exact::estimated::Estimated;
use crate::exact::prepared_setup::PreparedSetup;
use crate::failure::Failure;
use crate::picking::{self, Pick};

/// Picks of two passes that differ by more than this, in periods, belong to different extrema.
const SAME_EXTREMUM: f64 = 0.05;

/// Blends the results of two passes for one bone; `weight` is that of the second.
pub(super) fn merge(
    prepared: &PreparedSetup,
    first: Result<Estimated, Failure>,
    second: Result<Estimated, Failure>,
    weight: f64,
) -> Result<Estimated, Failure> {
    match (first, second) {
        (Ok(first), Ok(second)) if weight < 1.0 && same_extremum(prepared, &first, &second) => {
            blend_picks(prepared, &first, &second, weight)
        }
        (_, second) => second,
    }
}

/// As [`merge`], but keeps the first result, with its error, if the second pass would exceed the limit
/// of the computation.
pub(super) fn merge_unless_too_costly(
    prepared: &PreparedSetup,
    first: Result<Estimated, Failure>,
    second: Result<Estimated, Failure>,
    weight: f64,
) -> Result<Estimated, Failure> {
    match second {
        Err(Failure { kind: FailureKind::NoConvergence, .. }) => first,
        second => merge(prepared, first, second, weight),
    }
}

fn same_extremum(prepared: &PreparedSetup, first: &Estimated, second: &Estimated) -> bool {
    let most = SAME_EXTREMUM / prepared.setup.probe.center_frequency;
    first.pick.times.iter().zip(&second.pick.times).all(|(a, b)| (a - b).abs() <= most)
}

fn blend_picks(
    prepared: &PreparedSetup,
    first: &Estimated,
    second: &Estimated,
    weight: f64,
) -> Result<Estimated, Failure> {
    let blend = |a: f64, b: f64| (b - a).mul_add(weight, a);
    let blend_all = |first: &[f64], second: &[f64]| -> Vec<f64> {
        first.iter().zip(second).map(|(&a, &b)| blend(a, b)).collect()
    };
    let times = blend_all(&first.pick.times, &second.pick.times);
    let amplitudes = blend_all(&first.pick.amplitudes, &second.pick.amplitudes);
    let fc = prepared.setup.probe.center_frequency;
    let (velocity, residual) = picking::line(&prepared.distances, &times, fc)?;
    let ratio = blend(first.pick.ratio, second.pick.ratio);
    let skipped = blend(first.pick.skipped, second.pick.skipped);
    let prominence = blend(first.pick.prominence, second.pick.prominence);
    let band_error = blend(first.band_error, second.band_error);
    let sampling_error = blend(first.sampling_error, second.sampling_error);
    let pick = Pick { velocity, times, amplitudes, ratio, skipped, residual, prominence };
    Ok(Estimated { pick, band_error, sampling_error, sampled: second.sampled })
}
