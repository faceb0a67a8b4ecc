//! Errors of the logarithms of both moments, for the data and for the model.

use crate::conclusions::NoiseErrors;
#[cfg(doc)]
use crate::data_statistics::CONFIDENCE;
use crate::job::Data;
use crate::results::{Estimate, Moments};
use crate::statistics;

/// Quantile of the standard normal law at (1 + [`CONFIDENCE`]) / 2.
const NORMAL: f64 = 1.959_963_984_540_054;

/// Covariances of (ln v, ln Δ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Covariance of the data's moments, with the number of velocities; `None` if only the moments
    /// are known, since their uncertainty is then unknown.
    pub data: Option<([[f64; 2]; 2], usize)>,
    /// Variances of the model's moments by sampling.
    pub model: [f64; 2],
}

/// Returns the noise of set number `set` of the data, and of a model's estimate.
pub fn noise(data: &Data, set: usize, model: &Estimate) -> Noise {
    let velocities = data.velocities(set);
    let covariance = velocities.and_then(statistics::covariance_of_logarithms);
    Noise {
        data: covariance.zip(velocities.map(<[f64]>::len)),
        model: model.relative_errors().map(|error| error * error),
    }
}

impl Noise {
    /// Returns the covariance of both together.
    pub fn covariance(&self) -> [[f64; 2]; 2] {
        let mut sum = self.data.map_or([[0.0; 2]; 2], |(covariance, _)| covariance);
        for (axis, variance) in self.model.into_iter().enumerate() {
            sum[axis][axis] += variance;
        }
        sum
    }

    /// Returns the standard errors.
    pub fn errors(&self) -> NoiseErrors {
        let errors = |variances: [f64; 2]| {
            let [mean, coefficient_of_variation] = variances.map(f64::sqrt);
            Moments { mean, coefficient_of_variation }
        };
        let data = self.data.map(|([[mean, _], [_, variation]], _)| errors([mean, variation]));
        NoiseErrors { data, sampling: errors(self.model) }
    }

    /// Returns how many standard errors an interval extends to each side.
    pub fn quantile(&self) -> f64 {
        self.data.map_or(NORMAL, |(_, count)| quantile(count))
    }
}

/// Returns the quantile of Student's law at (1 + [`CONFIDENCE`]) / 2 for a sample of `count`: the
/// first terms of its expansion about the normal law's (Abramowitz and Stegun 1964, 26.7.5),
/// accurate to 1e-3 from six degrees of freedom on, too small below three.
pub(super) fn quantile(count: usize) -> f64 {
    let freedom = count.saturating_sub(1).max(1) as f64;
    let square = NORMAL * NORMAL;
    let terms = [
        (square + 1.0) / 4.0,
        ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
    ];
    let series = terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom);
    NORMAL * (1.0 + series)
}
