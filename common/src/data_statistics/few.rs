//! Confidence intervals of the moments of independent velocities, also of few of them.
//!
//! The bootstrap of few velocities gives intervals of the standard deviation that are too short,
//! because it does not know the tails of the law. Here the variance has a scaled χ² law, as that of a
//! normal sample, with as many degrees of freedom ν as reproduce the variance of its logarithm,
//! 2/ν = (γ - (n - 3)/(n - 1))/n, which is n - 1 for a normal law. The kurtosis γ of the law is that
//! of the sample pooled with the normal law's, as if [`PRIOR_COUNT`] velocities had shown the latter.

use super::CONFIDENCE;
use crate::data::{Data, Measurements, VelocitySet};
use crate::inference::student_quantile;
use crate::moments::{ConfidenceInterval, Moments};
use crate::special::chi_square_quantile;
use crate::statistics::{Sum, moments, without_repeatability};

/// Number of velocities of a normal law with which the kurtosis is pooled.
const PRIOR_COUNT: f64 = 30.0;
/// Kurtosis of a normal law.
const NORMAL_KURTOSIS: f64 = 3.0;

/// Confidence intervals of both moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FewIntervals {
    /// Interval of the mean, m/s.
    pub mean: ConfidenceInterval,
    /// Interval of the coefficient of variation, without the instrument's scatter; from 0 if that may
    /// be all.
    pub coefficient_of_variation: ConfidenceInterval,
}

/// Returns the intervals for set number `set` of the data, if its velocities, or their number, are
/// known, and it has no subjects.
pub fn intervals_of_data(data: &Data, set: usize) -> Option<FewIntervals> {
    if let Measurements::Moments { mean, coefficient_of_variation, count } = data.measurements {
        let measured = Moments { mean, coefficient_of_variation };
        return intervals(measured, count? as f64, NORMAL_KURTOSIS, data.repeatability);
    }
    let given = data.set(set).filter(|given| given.subjects.is_none())?;
    intervals_of_velocities(&given)
}

/// Returns the intervals for independent velocities; subjects are ignored.
pub(super) fn intervals_of_velocities(given: &VelocitySet<'_>) -> Option<FewIntervals> {
    let measured = moments(given.velocities)?;
    let count = given.velocities.len() as f64;
    let variance = {
        let deviation = measured.coefficient_of_variation * measured.mean;
        deviation * deviation
    };
    let mut fourth = Sum::default();
    for velocity in given.velocities {
        let square = (velocity - measured.mean) * (velocity - measured.mean) / variance;
        fourth.add(square * square);
    }
    let excess = unbiased_excess(count, fourth.total() / count);
    let pooled = NORMAL_KURTOSIS + excess * count / (PRIOR_COUNT + count);
    intervals(measured, count, pooled, given.repeatability)
}

/// Returns the excess kurtosis of a law by that of a sample, which is too small for few values: the
/// correction makes it unbiased for a normal law (R. A. Fisher's k₄/k₂²).
fn unbiased_excess(count: f64, kurtosis: f64) -> f64 {
    if count < 4.0 {
        return 0.0;
    }
    let factor = (count - 1.0) / ((count - 2.0) * (count - 3.0));
    factor * ((count + 1.0) * (kurtosis - NORMAL_KURTOSIS) + 6.0)
}

/// Returns the intervals, given the moments of the sample and the kurtosis of the law.
fn intervals(
    measured: Moments,
    count: f64,
    kurtosis: f64,
    repeatability: f64,
) -> Option<FewIntervals> {
    let Moments { mean, coefficient_of_variation: variation } = measured;
    if count < 2.0 || variation.is_nan() || variation <= 0.0 {
        return None;
    }
    let of_variance = (kurtosis - (count - 3.0) / (count - 1.0)) / count;
    // The error of the mean adds to that of the quotient.
    let freedom = 2.0 / (of_variance + 4.0 * variation * variation / count);
    // The unbiased variance is larger than that of the set.
    let unbiased = variation * (count / (count - 1.0)).sqrt();
    let tail = 0.5 * (1.0 - CONFIDENCE);
    let end = |u: f64| {
        let coefficient_of_variation =
            unbiased * (freedom / chi_square_quantile(freedom, u)).sqrt();
        let all = Moments { mean, coefficient_of_variation };
        without_repeatability(all, repeatability).coefficient_of_variation
    };
    // A count of 10⁹ is the largest.
    let half = student_quantile(count as u64 - 1) * unbiased * mean / count.sqrt();
    Some(FewIntervals {
        mean: ConfidenceInterval { low: mean - half, high: mean + half },
        coefficient_of_variation: ConfidenceInterval { low: end(1.0 - tail), high: end(tail) },
    })
}
