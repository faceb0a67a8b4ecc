//! The posterior of one set of data, as plain data.
//!
//! The posterior is the probability of the free parameters given the data, the priors and the
//! bounds, in Bayes' sense. It is given by weighted draws; how they are made is in `osteon-search`.

#[cfg(doc)]
use crate::moments::KolmogorovTest;
use crate::parameters::{Parameter, Point};

/// Probabilities of the quantiles in a [`PosteriorSummary`]: the median and both ends of the
/// central intervals of 50, 90 and 95 %.
pub const QUANTILE_LEVELS: [f64; 7] = [0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975];

/// The posterior of one set of data.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// Whether the accuracy that was asked for is reached; otherwise the evaluations were used up
    /// first, or the draws are too few, and `reason` says which.
    pub converged: bool,
    /// Why it did not converge; `None` if it did.
    pub reason: Option<String>,
    /// Number of points evaluated for it.
    pub evaluations: u64,
    /// Effective number of independent draws behind the summaries.
    pub effective_draws: f64,
    /// Fresh draws that were evaluated to check the approximation of the model.
    pub checked_draws: u64,
    /// Root mean square error of the logarithm of the density at these, nats.
    pub model_error: f64,
    /// Share of the checked draws that counts after they have been weighted by the ratio of the
    /// evaluated density to the approximated one, 0 to 1; 1 if the approximation is exact.
    pub check_efficiency: f64,
    /// Shape k of the generalised Pareto law of the largest of these weights (A. Vehtari et al.,
    /// J. Mach. Learn. Res. 25 (2024)): above 0.7 they are unreliable. `None` with too few.
    pub pareto_k: Option<f64>,
    /// Errors of the model's moments due to sampling, relative to the data's: square root of the sum of
    /// both squares.
    pub sampling_error: f64,
    /// The free parameters, in the order of the correlations.
    pub free: Vec<Parameter>,
    /// Summaries of the free parameters, in the same order.
    pub parameters: Vec<PosteriorSummary>,
    /// Their correlations, row by row.
    pub correlation: Vec<Vec<f64>>,
    /// Mean of the model's velocities, m/s.
    pub mean: PosteriorSummary,
    /// Their coefficient of variation.
    pub coefficient_of_variation: PosteriorSummary,
    /// √(c1111/ρ), m/s.
    pub bulk_velocity: PosteriorSummary,
    /// The entries of the mean elasticity matrix on and above the diagonal, row by row, with row
    /// and column from 0 (Pa, Kelvin-Mandel).
    pub entries: Vec<(usize, usize, PosteriorSummary)>,
    /// Probability of a Kolmogorov distance at least as large as that of the data from the law of the
    /// best point, moved to the posterior means of the moments, as for [`KolmogorovTest`]; `None`
    /// without velocities, and where they have subjects or scatter of the instrument.
    pub predictive_p_value: Option<f64>,
    /// Probability that a measured velocity is not from the model's law: its posterior mean, given
    /// the posterior means of the two moments. `None` where all velocities are near the median, or
    /// only moments are known.
    pub outlier_share: Option<f64>,
    /// Draws of equal weight.
    pub draws: Vec<PosteriorDraw>,
}

/// Summary of one quantity's posterior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosteriorSummary {
    /// Mean, in the quantity's unit.
    pub mean: f64,
    /// Standard deviation.
    pub standard_deviation: f64,
    /// Quantiles at [`QUANTILE_LEVELS`].
    pub quantiles: [f64; 7],
    /// Standard deviation under the prior alone.
    pub prior_standard_deviation: f64,
}

impl PosteriorSummary {
    /// Returns the central 95 % interval.
    pub fn interval(&self) -> [f64; 2] {
        [self.quantiles[0], self.quantiles[6]]
    }

    /// Returns the share of the prior variance that the data have removed, 0 to 1: near 0 the
    /// quantity is known from the prior only.
    pub fn explained(&self) -> f64 {
        let ratio = self.standard_deviation / self.prior_standard_deviation;
        let explained = 1.0 - ratio * ratio;
        if explained.is_nan() { 0.0 } else { explained.clamp(0.0, 1.0) }
    }
}

/// One draw from the posterior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosteriorDraw {
    /// The parameters.
    pub point: Point,
    /// Logarithm of the posterior density (likelihood times prior, not normalised), nats.
    pub log_density: f64,
    /// Mean of the model's velocities there, m/s.
    pub mean: f64,
    /// Their coefficient of variation.
    pub coefficient_of_variation: f64,
}
