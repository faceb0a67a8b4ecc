//! Weights of further passes, from 0 (the result is sufficient) to 1 (the next replaces it).

use osteon_common::sampling::{self, Grade};

use crate::exact::estimated::Estimated;
use crate::exact::pass::slow_decay;
use crate::exact::prepared_setup::PreparedSetup;
use crate::picking::Pick;

/// Stated errors due to the band, or to the sampling, at refinement 1, between which the weight of the
/// pass with the next wider band, or of the next sampling, rises from 0 to 1.
pub(super) const LARGE_ERROR: (f64, f64) = (2.1e-4, 2.9e-4);
/// The same of the errors due to the sampling, for the last two samplings, and of those due to the band
/// where the next sampling has no wider one.
pub(super) const VERY_LARGE_ERROR: (f64, f64) = (2.3e-4, 3.4e-4);
/// Stated errors between which the weight of the thorough passes rises, even where the error is due to
/// the band: a short array needs times that are more accurate than usual.
const USELESS_ERROR: (f64, f64) = (5e-4, 8e-4);
/// Ratios of a pick to the largest wave in its window between which the weight of the next pass
/// falls, for an array of [`USUAL_ARRAY`]: the errors of thinning and of leaving out slow
/// waves reach some 1e-5 of that wave.
const SMALL: (f64, f64) = (0.01, 0.015);
/// Time from the first to the last pick, in periods, of the usual array: in a shorter one the same error
/// of a time is a larger one of the velocity.
const USUAL_ARRAY: f64 = 2.5;
/// Delays of a pick after the earliest possible arrival, in periods of the centre frequency,
/// between which the weight of the next pass rises: a quick sampling has room for packets up to
/// [`sampling::QUICK_LATEST`].
const LATE: (f64, f64) = (1.2, 1.3);
/// Times from a pick to the direct wave, in periods, between which the weight of the next pass
/// falls.
const NEAR_DIRECT_WAVE: (f64, f64) = (0.02, 0.05);
/// Ratios to the threshold between which the weight of the next pass falls.
const WEAK: (f64, f64) = (1.05, 1.1);
/// Ratios of a skipped extremum to the threshold between which the weight of the next pass rises.
const NEARLY_PICKED: (f64, f64) = (0.9, 0.95);
/// Distances from the line, in periods, between which the weight of the next pass rises.
const OFF_LINE: (f64, f64) = (0.02, 0.03);

/// Returns a stated error as it compares with the constants above, which are meant for refinement
/// 1 and a thick plate on light marrow: a user who sets a lower refinement accepts larger
/// errors, and expects smaller ones of a higher refinement.
pub(super) fn counted(prepared: &PreparedSetup, error: f64) -> f64 {
    let refinement = prepared.setup.solver.refinement;
    let power = if refinement < 1.0 { 3.0 } else { 1.5 };
    error * libm::pow(refinement, power) / slow_decay(&prepared.setup).sqrt()
}

/// Returns the weight of a finer sampling.
pub(super) fn rough(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(counted(prepared, found.sampling_error), LARGE_ERROR)
}

/// Returns the weight of a wider band or another sampling.
pub(super) fn inexact(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(counted(prepared, found.error()), LARGE_ERROR)
}

/// Returns the weight of the plain grade's passes after those of the quick one. If the quick band was
/// as wide as theirs, only a finer sampling can be gained from them.
pub(super) fn replaced_by_plain(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    let exhausted = found.sampled.band >= sampling::widest_band(&prepared.setup, Grade::Plain);
    let limits = if exhausted { VERY_LARGE_ERROR } else { LARGE_ERROR };
    rise(counted(prepared, found.error()), limits).max(small(prepared, found))
}

/// Returns the weight of the thorough and of the last passes.
pub(super) fn coarse(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(counted(prepared, found.sampling_error), VERY_LARGE_ERROR)
}

/// Returns the weight of the thorough passes where other bands have not helped.
pub(super) fn useless(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(counted(prepared, found.error()), USELESS_ERROR)
}

/// Returns the weight of a pass without thinning, which rises as the pick becomes small compared with
/// the largest wave in its window.
pub(super) fn small(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    let Pick { times, prominence, .. } = &found.pick;
    let (first, last) = times
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(first, last), &t| (first.min(t), last.max(t)));
    let periods = (last - first) * prepared.setup.probe.center_frequency;
    1.0 - rise(prominence * periods / USUAL_ARRAY, SMALL)
}

/// Returns the weight of the thorough pass, a continuous function of how unreliable a pick is:
/// 0 keeps the pick, and 1 replaces it.
pub(super) fn unreliable(prepared: &PreparedSetup, found: &Estimated, speed: f64) -> f64 {
    let fc = prepared.setup.probe.center_frequency;
    let (mut delay, mut margin) = (0.0_f64, f64::INFINITY);
    for (&place, t) in prepared.places.iter().zip(&found.pick.times) {
        delay = delay.max(t - sampling::earliest_arrival(&prepared.setup, place, speed));
        margin = margin.min(sampling::direct_arrival(&prepared.setup, place) - t);
    }
    let ratio = found.pick.ratio / prepared.setup.picking.threshold;
    let skipped = found.pick.skipped / prepared.setup.picking.threshold;
    rise(delay * fc, LATE)
        .max(rise(found.pick.residual * fc, OFF_LINE))
        .max(rise(skipped, NEARLY_PICKED))
        .max(1.0 - rise(margin * fc, NEAR_DIRECT_WAVE))
        .max(1.0 - rise(ratio, WEAK))
}

/// Returns 0 up to `from`, 1 from `to` on, and linear values between.
pub(super) fn rise(value: f64, (from, to): (f64, f64)) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}
