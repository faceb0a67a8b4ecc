//! The pick of a pass with the estimate of its error.

use crate::arrival::{Arrival, PassSummary, Sampled};
use crate::failure::Failure;
use crate::picking::Pick;

/// Ratio of the stated error in a wider band to that in a first band whose tapers change the velocity
/// as much: bones that need a wider band converge more slowly.
const WIDER_FACTOR: f64 = 1.35;
/// Ratio of the least stated error to the change of the velocity by doubling the band.
const CHANGE_FACTOR: f64 = 0.45;

/// A pick with the estimate of its velocity's relative error.
#[derive(Debug, Clone)]
pub(crate) struct Estimated {
    pub(crate) pick: Pick,
    /// The part that is due to the band's end.
    pub(crate) band_error: f64,
    /// The part that is due to the samples' distances, and to where their sums end.
    pub(crate) sampling_error: f64,
    pub(crate) sampled: Sampled,
}

impl Estimated {
    pub(crate) fn error(&self) -> f64 {
        limit_to_one(root_sum_square(self.band_error, self.sampling_error))
    }

    /// Enlarges the errors of a pass in a wider band by [`WIDER_FACTOR`]. The band's error is at least
    /// a part of the change since the pass in the next narrower band.
    pub(crate) fn widen_errors(self, narrower: &Result<Self, Failure>) -> Self {
        let change = narrower
            .as_ref()
            .map_or(0.0, |narrower| (self.pick.velocity / narrower.pick.velocity - 1.0).abs());
        Self {
            band_error: limit_to_one((WIDER_FACTOR * self.band_error).max(CHANGE_FACTOR * change)),
            sampling_error: limit_to_one(WIDER_FACTOR * self.sampling_error),
            ..self
        }
    }

    /// Returns the arrival, found in `count` passes with this total number of pairs; its stated error is the
    /// estimate times `factor`.
    pub(crate) fn arrival(self, count: u32, pairs_computed: u64, factor: f64) -> Arrival {
        let estimated_error = limit_to_one(factor * self.error());
        let Self { pick, sampled: last, .. } = self;
        Arrival {
            velocity: pick.velocity,
            directions: None,
            times: pick.times,
            amplitudes: pick.amplitudes,
            estimated_error,
            passes: Some(PassSummary { count, pairs_computed, last }),
        }
    }
}

/// Returns the root of the sum of the squares of two errors.
pub(super) fn root_sum_square(one: f64, other: f64) -> f64 {
    one.mul_add(one, other * other).sqrt()
}

/// Returns an error, at most 1, and 1 for NaN: a signal that changes beyond recognition has the largest
/// error, and does not fail.
pub(super) fn limit_to_one(error: f64) -> f64 {
    if error <= 1.0 { error } else { 1.0 }
}
