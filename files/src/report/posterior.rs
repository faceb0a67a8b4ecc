//! Types of the posterior.

use std::collections::BTreeMap;

use osteon_common::parameters::Parameter;
use osteon_common::posterior::{Posterior, PosteriorSummary};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finite_or_null;
use super::schema::keyed_by_parameter;

/// The posterior of one set of data: what is known of the free parameters after the data, by Bayes'
/// theorem from the likelihood of the data, the priors and the bounds. Its draws are in
/// `posterior.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PosteriorReport {
    /// Whether it is as accurate as it must be; otherwise the evaluations were used up first, or the
    /// draws are too few.
    pub converged: bool,
    /// Why it did not converge, in a sentence; null if it did.
    pub reason: Option<String>,
    /// Number of points evaluated for it; the evaluations of the search are not counted.
    pub evaluations: u64,
    /// Number of draws in `posterior.csv`.
    pub draws: u64,
    /// Effective number of independent draws behind the summaries.
    pub effective_draws: Option<f64>,
    /// Number of fresh draws that were evaluated to check the approximation of the model.
    pub checked_draws: u64,
    /// Root mean square error of the logarithm of the density at these, nats.
    pub model_error: Option<f64>,
    /// Share of the checked draws that counts after they have been weighted by the ratio of the
    /// evaluated density to the approximated one, 0 to 1; 1 if the approximation is exact.
    pub check_efficiency: Option<f64>,
    /// Shape k of the generalised Pareto law of the largest of these weights: above 0.7 they are
    /// unreliable; null with too few.
    pub pareto_k: Option<f64>,
    /// Errors of the model's moments due to sampling, relative to the data's: square root of the sum of
    /// both squares.
    pub sampling_error: Option<f64>,
    /// The free parameters, in their units.
    #[schemars(transform = keyed_by_parameter)]
    pub parameters: BTreeMap<Parameter, QuantityPosterior>,
    /// Correlation of each free parameter with each of them.
    #[schemars(transform = keyed_by_parameter)]
    pub correlation: BTreeMap<Parameter, BTreeMap<Parameter, Option<f64>>>,
    /// √(c1111/ρ), m/s.
    pub bulk_velocity: QuantityPosterior,
    /// Mean of the model's velocities, m/s.
    pub mean: QuantityPosterior,
    /// Coefficient of variation of the model's velocities.
    pub coefficient_of_variation: QuantityPosterior,
    /// The entries of the mean elasticity matrix (Kelvin-Mandel, Pa), named by row and column from `11`
    /// to `66`.
    pub mandel: BTreeMap<String, QuantityPosterior>,
    /// Probability of a Kolmogorov distance at least as large as that of the data from the law of the
    /// best point, moved to the posterior means of the moments, as `data.kolmogorov.p_value`; null where
    /// only moments are known, and with subjects or a repeatability.
    pub predictive_p_value: Option<f64>,
    /// Probability that a measured velocity is not from the model's law but wrong: its posterior mean,
    /// given the posterior means of the moments; null where all velocities are near the median, or only
    /// moments are known.
    #[serde(default)]
    pub outlier_share: Option<f64>,
}

impl From<&Posterior> for PosteriorReport {
    fn from(found: &Posterior) -> Self {
        let parameters = found.free.iter().copied().zip(&found.parameters);
        let correlations = |row: &Vec<f64>| -> BTreeMap<Parameter, Option<f64>> {
            found.free.iter().copied().zip(row.iter().copied().map(finite_or_null)).collect()
        };
        let rows = found.correlation.iter().map(correlations);
        let entry = |(row, column, summary): &(usize, usize, PosteriorSummary)| {
            (format!("{}{}", row + 1, column + 1), summary.into())
        };
        Self {
            converged: found.converged,
            reason: found.reason.clone(),
            evaluations: found.evaluations,
            draws: found.draws.len() as u64,
            effective_draws: finite_or_null(found.effective_draws),
            checked_draws: found.checked_draws,
            model_error: finite_or_null(found.model_error),
            check_efficiency: finite_or_null(found.check_efficiency),
            pareto_k: found.pareto_k.and_then(finite_or_null),
            sampling_error: finite_or_null(found.sampling_error),
            parameters: parameters.map(|(parameter, found)| (parameter, found.into())).collect(),
            correlation: found.free.iter().copied().zip(rows).collect(),
            bulk_velocity: (&found.bulk_velocity).into(),
            mean: (&found.mean).into(),
            coefficient_of_variation: (&found.coefficient_of_variation).into(),
            mandel: found.entries.iter().map(entry).collect(),
            predictive_p_value: found.predictive_p_value.and_then(finite_or_null),
            outlier_share: found.outlier_share.and_then(finite_or_null),
        }
    }
}

/// The posterior of one quantity, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QuantityPosterior {
    /// Mean.
    pub mean: Option<f64>,
    /// Standard deviation.
    pub standard_deviation: Option<f64>,
    /// Median.
    pub median: Option<f64>,
    /// Lower and upper end of the central interval that holds 50 % of the probability.
    pub interval_50: [Option<f64>; 2],
    /// Lower and upper end of the central interval that holds 90 % of the probability.
    pub interval_90: [Option<f64>; 2],
    /// Lower and upper end of the central interval that holds 95 % of the probability.
    pub interval_95: [Option<f64>; 2],
    /// Standard deviation under the prior alone.
    pub prior_standard_deviation: Option<f64>,
    /// Share of the variance under the prior that the data have removed, 0 to 1: near 0 the quantity is
    /// known from the prior only.
    pub explained: f64,
}

impl QuantityPosterior {
    /// Both ends of the 95 % interval, where they are known.
    pub fn ends(&self) -> Option<[f64; 2]> {
        let [lower, upper] = self.interval_95;
        Some([lower?, upper?])
    }
}

impl From<&PosteriorSummary> for QuantityPosterior {
    fn from(summary: &PosteriorSummary) -> Self {
        // The quantiles are symmetric around the median.
        let quantiles = summary.quantiles.map(finite_or_null);
        let interval = |place: usize| [quantiles[place], quantiles[6 - place]];
        Self {
            mean: finite_or_null(summary.mean),
            standard_deviation: finite_or_null(summary.standard_deviation),
            median: quantiles[3],
            interval_50: interval(2),
            interval_90: interval(1),
            interval_95: interval(0),
            prior_standard_deviation: finite_or_null(summary.prior_standard_deviation),
            explained: summary.explained(),
        }
    }
}
