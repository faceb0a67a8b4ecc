//! Moments of velocities, their errors and tests, as plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Mean and coefficient of variation of a set of velocities (the paper's Secs. 2 and 5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// v = (1/N) Σ V_k, m/s.
    pub mean: f64,
    /// Δ = √((1/N) Σ (V_k - v)²) / v.
    pub coefficient_of_variation: f64,
}

impl Moments {
    /// Moments that are not known.
    pub const UNKNOWN: Self = Self { mean: f64::NAN, coefficient_of_variation: f64::NAN };
}

/// Returns the logarithms of the ratios of both moments to those of `base`.
pub(crate) fn log_ratios(moments: Moments, base: Moments) -> [f64; 2] {
    [
        libm::log(moments.mean / base.mean),
        libm::log(moments.coefficient_of_variation / base.coefficient_of_variation),
    ]
}

/// Moments of a Monte Carlo sample with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The moments.
    pub moments: Moments,
    /// Their standard errors: that of the mean in m/s, that of the coefficient of variation.
    pub standard_error: Moments,
    /// Whether they were computed with the control variate.
    pub controlled: bool,
}

impl Estimate {
    /// Returns the relative standard errors: of the mean, of the coefficient of variation.
    pub fn relative_errors(&self) -> [f64; 2] {
        let (moments, error) = (self.moments, self.standard_error);
        [
            error.mean / moments.mean,
            error.coefficient_of_variation / moments.coefficient_of_variation,
        ]
    }
}

/// Mean and scatter of decays along the array, with the error of the mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DecayEstimate {
    /// Mean, dB/cm.
    pub mean: f64,
    /// Standard deviation of the decays, with division by their number, dB/cm.
    pub standard_deviation: f64,
    /// Standard error of the mean, dB/cm.
    pub standard_error: f64,
}

/// Estimated relative errors, by discretisation, of the velocities of a set of realizations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedError {
    /// Median of the errors.
    pub median: f64,
    /// Largest error.
    pub largest: f64,
}

/// An interval that contains a value with some probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfidenceInterval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Confidence intervals of the moments of the law from which velocities were drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentIntervals {
    /// Interval of the mean, m/s.
    pub mean: ConfidenceInterval,
    /// Interval of the coefficient of variation.
    pub coefficient_of_variation: ConfidenceInterval,
    /// Probability with which each interval contains its moment.
    pub level: f64,
}

/// A measured velocity far from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outlier {
    /// Its number among the velocities of its set, from 0.
    pub index: u64,
    /// The velocity, m/s.
    pub velocity: f64,
    /// Number of robust standard deviations by which it lies above the median; negative below.
    pub deviations: f64,
}

/// Result of the two-sample Kolmogorov-Smirnov test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KolmogorovTest {
    /// Largest difference of the empirical distribution functions, 0 to 1; of rounded velocities, at
    /// the limits between rounded values.
    pub distance: f64,
    /// Probability of at least this distance if the data come from the model's law. Where the model
    /// was fitted to the data, so are the samples that it is computed from; at least 0.001.
    pub p_value: f64,
}
