//! Weights of further passes, from 0 (the present result suffices) to 1 (the next replaces it).

use osteon_common::sampling::{self, Grade};

use crate::exact::estimated::Estimated;
use crate::exact::pass::slow_decay_factor;
use crate::exact::prepared_setup::PreparedSetup;
use crate::picking::Pick;

/// Stated errors at refinement 1 between which the weight of further passes rises from 0 to 1. The whole
/// error decides about the plain grade and about wider bands of quick and plain passes; of a bone that
/// begins with the thorough grade, the band's error about wider bands, and the sampling's error about the
/// full grade.
pub(super) const LARGE_ERROR: (f64, f64) = (2.1e-4, 2.9e-4);
/// The same for the thorough and the full grade after quick and plain passes, by the sampling's error;
/// and for the plain grade, by the whole error, if its widest band is no wider than the quick one.
pub(super) const VERY_LARGE_ERROR: (f64, f64) = (2.3e-4, 3.4e-4);
/// Whole errors between which the weight of the thorough passes rises even if the band causes the error,
/// and all bands were tried: a short array needs times that are more accurate than usual.
const INTOLERABLE_ERROR: (f64, f64) = (5e-4, 8e-4);
/// Ratios of a pick to the largest wave in its window between which the weight of the plain passes
/// falls, for an array of [`USUAL_ARRAY`]: thinning, and leaving out slow waves, cause errors of up to
/// some 1e-5 of that wave.
const SMALL: (f64, f64) = (0.01, 0.015);
/// Time from the first to the last pick, in periods, of the usual array: in a shorter one the same error
/// of a time is a larger one of the velocity.
const USUAL_ARRAY: f64 = 2.5;
/// Delays of a pick of the paper's pulse after the earliest possible arrival, in periods of the centre
/// frequency, between which the weight of the thorough passes rises: a quick sampling has room for packets up to
/// [`sampling::QUICK_LATEST`].
const LATE: (f64, f64) = (1.2, 1.3);
/// Times from a pick to the direct wave, in periods, between which that weight falls.
const NEAR_DIRECT_WAVE: (f64, f64) = (0.02, 0.05);
/// Ratios of the packet's first extremum, picked or not, to the threshold between which that weight falls.
const WEAK: (f64, f64) = (1.05, 1.1);
/// Ratios of a skipped extremum to the threshold between which that weight rises.
const NEARLY_PICKED: (f64, f64) = (0.9, 0.95);
/// Distances of the times from the line, in periods, between which that weight rises.
const OFF_LINE: (f64, f64) = (0.02, 0.03);

/// Scales a stated error so that it compares with the constants above, which are meant for refinement 1
/// and a thick plate on light marrow: a user who sets a lower refinement accepts larger errors, and one
/// who sets a higher refinement expects smaller ones.
pub(super) fn comparable_error(prepared: &PreparedSetup, error: f64) -> f64 {
    let refinement = prepared.setup.solver.refinement;
    let power = if refinement < 1.0 { 3.0 } else { 1.5 };
    error * libm::pow(refinement, power) / slow_decay_factor(&prepared.setup).sqrt()
}

/// Returns the weight of the full grade after a thorough one with which a bone began, which rises with the
/// sampling's error; and what takes weight from a wider band of the plain grade, which would not help.
pub(super) fn large_sampling_error_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(comparable_error(prepared, found.sampling_error), LARGE_ERROR)
}

/// Returns the weight of a wider band of the quick or the plain grade, which rises with the whole error.
pub(super) fn large_error_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(comparable_error(prepared, found.error()), LARGE_ERROR)
}

/// Returns the weight of the plain passes after the quick ones. If the quick band was as wide as theirs,
/// they gain a finer sampling only, and are made for larger errors only.
pub(super) fn plain_grade_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    let exhausted = found.sampled.band >= sampling::widest_band(&prepared.setup, Grade::Plain);
    let limits = if exhausted { VERY_LARGE_ERROR } else { LARGE_ERROR };
    rise(comparable_error(prepared, found.error()), limits).max(small_pick_weight(prepared, found))
}

/// Returns the weight of the passes of the thorough or the full grade, which rises with the sampling's
/// error.
pub(super) fn very_large_sampling_error_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(comparable_error(prepared, found.sampling_error), VERY_LARGE_ERROR)
}

/// Returns the weight of the thorough passes if the whole error is large although all bands were tried.
pub(super) fn intolerable_error_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    rise(comparable_error(prepared, found.error()), INTOLERABLE_ERROR)
}

/// Returns the weight of the plain passes, with less thinning, which rises as the pick becomes small
/// compared with the largest wave in its window.
pub(super) fn small_pick_weight(prepared: &PreparedSetup, found: &Estimated) -> f64 {
    let Pick { times, prominence, .. } = &found.pick;
    let (first, last) = times
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(first, last), &t| (first.min(t), last.max(t)));
    let periods = (last - first) * prepared.setup.probe.center_frequency;
    1.0 - rise(prominence * periods / USUAL_ARRAY, SMALL)
}

/// Returns the weight of the thorough passes, a continuous function of how unreliable the pick is.
pub(super) fn unreliable_pick_weight(
    prepared: &PreparedSetup,
    found: &Estimated,
    speed: f64,
) -> f64 {
    let fc = prepared.setup.probe.center_frequency;
    let (mut delay, mut margin) = (0.0_f64, f64::INFINITY);
    for (&place, t) in prepared.places.iter().zip(&found.pick.times) {
        delay = delay.max(t - sampling::earliest_arrival(&prepared.setup, place, speed));
        margin = margin.min(sampling::direct_arrival(&prepared.setup, place) - t);
    }
    let threshold = prepared.criterion.threshold;
    let (ratio, skipped) = (found.pick.ratio / threshold, found.pick.skipped / threshold);
    rise(delay * fc - prepared.setup.probe.pulse.delay(fc), LATE)
        .max(rise(found.pick.residual * fc, OFF_LINE))
        .max(rise(skipped, NEARLY_PICKED))
        .max(1.0 - rise(margin * fc, NEAR_DIRECT_WAVE))
        .max(1.0 - rise(ratio, WEAK))
}

/// Returns 0 up to `from`, 1 from `to` on, and linear values between.
pub(super) fn rise(value: f64, (from, to): (f64, f64)) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}
