//! Moments of velocities, means of other observables, their errors and tests, as plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::observables::{OBSERVABLES, Observable, ObservableValues, PerObservable};

/// Number of the moments in which a model and data are compared.
pub const MOMENTS: usize = 2 + OBSERVABLES;
/// Differences of the compared moments, or other values of each: of ln v and ln Δ, and of the mean of each
/// observable relative to that of the data, in the order of [`Observable::ALL`]. 0 for an observable
/// that was not measured.
pub type MomentVector = [f64; MOMENTS];
/// A value for each pair of the compared moments.
pub type MomentMatrix = [[f64; MOMENTS]; MOMENTS];

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

/// The moments in which a model and data are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComparedMoments {
    /// Those of the velocities.
    pub velocities: Moments,
    /// Means of the other observables; of a model those that were measured, or all that are known.
    pub observables: ObservableValues,
}

impl ComparedMoments {
    /// Moments that are not known.
    pub const UNKNOWN: Self =
        Self { velocities: Moments::UNKNOWN, observables: PerObservable([None; OBSERVABLES]) };

    /// Returns those of a model, given the estimates of them.
    pub fn of_estimates(velocities: &Estimate, observables: &ObservableEstimates) -> Self {
        let observables = observables.map(|found| found.map(|found| found.mean));
        Self { velocities: velocities.moments, observables }
    }

    /// Returns ln v, ln Δ, and of each observable of the data the mean relative to that, less 1; NaN where
    /// the model's is not known.
    pub fn in_logarithms(&self, data: &Self) -> MomentVector {
        let Moments { mean, coefficient_of_variation } = self.velocities;
        let logarithms = [mean, coefficient_of_variation].map(libm::log);
        moment_vector(logarithms, |one| self.difference_of_means(data, one))
    }

    /// Returns the differences from the moments of data, in the observables that these have; NaN where
    /// the model's are not known.
    pub fn differences(&self, data: &Self) -> MomentVector {
        let of_velocities = log_ratios(self.velocities, data.velocities);
        moment_vector(of_velocities, |one| self.difference_of_means(data, one))
    }

    fn difference_of_means(&self, data: &Self, observable: Observable) -> f64 {
        match data.observables[observable] {
            Some(mean) => (self.observables[observable].unwrap_or(f64::NAN) - mean) / mean,
            None => 0.0,
        }
    }
}

/// Without other observables.
impl From<Moments> for ComparedMoments {
    fn from(velocities: Moments) -> Self {
        Self { velocities, ..Self::UNKNOWN }
    }
}

/// Returns the values for the moments of the velocities, and those of the observables by a function.
pub(crate) fn moment_vector(
    of_velocities: [f64; 2],
    of_observable: impl Fn(Observable) -> f64,
) -> MomentVector {
    std::array::from_fn(|axis| match axis.checked_sub(2) {
        Some(observable) => of_observable(Observable::ALL[observable]),
        None => of_velocities[axis],
    })
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

/// Mean and scatter of an observable, with the error of the mean, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ObservableEstimate {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the values, with division by their number.
    pub standard_deviation: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

/// Estimates of those observables that are known.
pub type ObservableEstimates = PerObservable<Option<ObservableEstimate>>;

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

/// Tests of the form of the distribution of velocities against the model's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FormTests {
    /// L-skewness, -1 to 1: above 0 where high velocities are farther off than low ones.
    pub skewness: FormTest,
    /// L-kurtosis, -0.25 to 1: 0.12 of a normal distribution, more with heavier tails.
    pub kurtosis: FormTest,
}

/// A number that describes the form of a distribution, of the data and of the model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FormTest {
    /// That of the data.
    pub data: f64,
    /// That of the model's velocities.
    pub model: f64,
    /// Probability of at least this difference, to either side, if the data come from the model's law; at least
    /// 0.002.
    pub p_value: f64,
}

/// Test of whether neighbouring velocities are more alike than in a random order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OrderTest {
    /// Von Neumann's ratio of their ranks: about 2 in a random order, less where neighbours are alike.
    pub ratio: f64,
    /// Probability of at most this ratio in a random order.
    pub p_value: f64,
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
