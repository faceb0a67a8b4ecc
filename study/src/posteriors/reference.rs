//! The posterior of the paper's example by brute force: importance sampling with the model itself,
//! without interpolation.
//!
//! The proposal is the posterior of half the data: wider by √2 in both moments, and otherwise the
//! same. Each of its draws is evaluated and weighted by the ratio of the exact density, with all
//! data, to that of the proposal. However the proposal was made, the weighted draws are those of the
//! exact posterior.

use osteon_common::data_likelihood::DataLikelihood;
use osteon_common::job::{Data, Measurements};
use osteon_common::parameters::Point;
use osteon_common::posterior::Posterior;
use osteon_common::results::Estimate;
use osteon_common::statistics::{PointStatistics, estimate};

use super::{QUANTITIES, model_germs, name, quantity, specification};
use crate::draws::{Draws, OPTIMUM};
use crate::generator::Generator;
use crate::identify::{RealizationCache, identify, outcomes, velocities};
use crate::table::MarkdownTable;
use crate::{RowCallback, StudyError};

/// Default number of evaluated draws.
pub const REALIZATIONS: u64 = 2000;
/// Number of realizations of the model.
const MODEL_REALIZATIONS: u64 = 128;
/// Number of velocities, and the seed that made those of the example.
const VELOCITIES: u64 = 2747;
const DATA_SEED: u64 = 20081;
/// The quantiles that are compared, by their places in a summary.
const ENDS: [usize; 2] = [0, 6];
const LEVELS: [f64; 2] = [0.025, 0.975];
/// Resamplings of the evaluated draws, for the standard errors of what they give.
const RESAMPLINGS: u64 = 400;
/// Rows are reported each time that this number of draws has been evaluated.
const REPORTED: usize = 100;

/// Compares the posterior of the example's data with that of exact importance sampling:
/// mean, standard deviation and the ends of the 95 % interval of each quantity by importance sampling,
/// and how far the posterior's are off with the standard error of importance sampling, both in
/// standard deviations of the posterior. `realizations` is the number of draws.
///
/// # Errors
/// If a point has no ensemble.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let velocities = velocities(&OPTIMUM, VELOCITIES, DATA_SEED, draws.isa)?;
    let half = halve_data(&velocities);
    let Some(posterior) =
        compute_posterior(Data::from_velocities(velocities.clone()), draws, None)?
    else {
        return Ok(MarkdownTable::new(&["there is no posterior"]));
    };
    progress(&describe("posterior", &posterior));
    let Some(proposal) = compute_posterior(half, draws, Some(draws.realizations))? else {
        return Ok(MarkdownTable::new(&["there is no proposal"]));
    };
    progress(&describe("proposal", &proposal));
    let Some(likelihood) = DataLikelihood::independent(&velocities, 0.0) else {
        return Ok(MarkdownTable::new(&["the data have no scatter"]));
    };
    let errors = evaluate(&OPTIMUM, draws)?.map(|estimate| estimate.relative_errors());
    let likelihood = likelihood.with_model_errors(errors.unwrap_or_default());
    let mut weighted = Vec::new();
    for draw in &proposal.draws {
        let found = evaluate(&draw.point, draws)?.map(|estimate| estimate.moments);
        let log = found.map_or(f64::NEG_INFINITY, |found| {
            likelihood.log([found.mean, found.coefficient_of_variation].map(libm::log))
        });
        weighted.push((draw.point, log - draw.log_density));
        if weighted.len().is_multiple_of(REPORTED) {
            let effective = effective(&normalise(&weighted));
            progress(&format!("{} draws, {effective:.0} effective", weighted.len()));
        }
    }
    Ok(comparison_table(&posterior, &normalise(&weighted)))
}

/// Returns half the data, as moments with a count.
fn halve_data(velocities: &[f64]) -> Data {
    let moments = Data::from_velocities(velocities.to_vec()).moments(0);
    let measurements = Measurements::Moments {
        mean: moments.mean,
        coefficient_of_variation: moments.coefficient_of_variation,
        count: Some(velocities.len() as u64 / 2),
    };
    Data { measurements, repeatability: 0.0, decay_error: 0.0 }
}

/// Computes a posterior with this number of draws, or the default one.
fn compute_posterior(
    data: Data,
    study: &Draws,
    draws: Option<u64>,
) -> Result<Option<Posterior>, StudyError> {
    let mut specification = specification(data, model_germs(MODEL_REALIZATIONS, study.seed));
    if let (Some(settings), Some(draws)) = (&mut specification.posterior, draws) {
        settings.draws = draws;
    }
    let found = identify(&specification, &mut RealizationCache::new(), study.isa)?;
    Ok(found.result.conclusions.posterior)
}

fn describe(name: &str, posterior: &Posterior) -> String {
    format!(
        "{name}: {} evaluations, {:.0} effective draws, efficiency {:.3}",
        posterior.evaluations, posterior.effective_draws, posterior.check_efficiency
    )
}

fn evaluate(point: &Point, study: &Draws) -> Result<Option<Estimate>, StudyError> {
    let monte_carlo = model_germs(MODEL_REALIZATIONS, study.seed);
    let outcomes = outcomes(point, &monte_carlo, study.isa)?;
    let feasible = PointStatistics::from_outcomes(&monte_carlo, point, &outcomes).feasible;
    Ok(estimate(&monte_carlo, point, &outcomes).filter(|_| feasible))
}

/// Returns the points with their weights, which have the sum 1.
fn normalise(weighted: &[(Point, f64)]) -> Vec<(Point, f64)> {
    let largest = weighted.iter().map(|one| one.1).fold(f64::NEG_INFINITY, f64::max);
    let weight = |log: f64| libm::exp(log - largest);
    let total: f64 = weighted.iter().map(|one| weight(one.1)).sum();
    weighted.iter().map(|&(point, log)| (point, weight(log) / total)).collect()
}

fn effective(weighted: &[(Point, f64)]) -> f64 {
    1.0 / weighted.iter().map(|(_, weight)| weight * weight).sum::<f64>()
}

/// Returns the table of both posteriors.
fn comparison_table(posterior: &Posterior, weighted: &[(Point, f64)]) -> MarkdownTable {
    let mut table = MarkdownTable::new(&[
        "quantity", "mean", "off by", "s.d.", "off by", "2.5 %", "off by", "97.5 %", "off by",
    ]);
    for k in 0..QUANTITIES {
        let found = posterior.parameters.get(k).unwrap_or(&posterior.bulk_velocity);
        let values: Vec<(f64, f64)> =
            weighted.iter().map(|(point, weight)| (quantity(point, k), *weight)).collect();
        let errors = standard_errors(&values, k as u64);
        let exact = exact(values);
        let found = [
            found.mean,
            found.standard_deviation,
            found.quantiles[ENDS[0]],
            found.quantiles[ENDS[1]],
        ];
        let mut row = vec![name(k)];
        for ((exact_value, found), error) in exact.iter().zip(found).zip(errors) {
            let off = (found - exact_value) / exact[1];
            row.push(format!("{exact_value:.5e}"));
            row.push(format!("{off:+.3} ± {:.3}", error / exact[1]));
        }
        table.push(row);
    }
    table
}

/// Returns the standard errors of [`exact`], by resampling the draws with their weights.
fn standard_errors(values: &[(f64, f64)], number: u64) -> [f64; 4] {
    let mut sums = [[0.0; 2]; 4];
    for resampling in 0..RESAMPLINGS {
        let mut generator = Generator::for_index(number, resampling);
        let mut draw = || {
            let place = generator.between(0.0, values.len() as f64) as usize;
            values[place.min(values.len() - 1)]
        };
        let found = exact((0..values.len()).map(|_| draw()).collect());
        for (sums, value) in sums.iter_mut().zip(found) {
            *sums = [sums[0] + value, sums[1] + value * value];
        }
    }
    let count = RESAMPLINGS as f64;
    sums.map(|[sum, square]| ((square - sum * sum / count) / (count - 1.0)).max(0.0).sqrt())
}

/// Returns mean, standard deviation and the quantiles of weighted values.
fn exact(mut values: Vec<(f64, f64)>) -> [f64; 4] {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mean = values.iter().map(|(value, weight)| weight * value).sum::<f64>() / total;
    let square =
        values.iter().map(|(v, weight)| weight * ((v - mean) * (v - mean))).sum::<f64>() / total;
    let quantile = |level: f64| {
        let mut below = 0.0;
        let reached = values.iter().find(|(_, weight)| {
            below += weight;
            below >= level * total
        });
        reached.or(values.last()).map_or(f64::NAN, |one| one.0)
    };
    [mean, square.sqrt(), quantile(LEVELS[0]), quantile(LEVELS[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error of a mean of n equal weights is σ/√n, that of an end √(0.025 · 0.975/n)/density.
    #[test]
    fn standard_errors_are_those_of_independent_draws() {
        let mut generator = Generator::for_index(3, 0);
        let values: Vec<(f64, f64)> =
            (0..1000).map(|_| (generator.between(0.0, 1.0), 1e-3)).collect();
        let [mean, _, low, high] = standard_errors(&values, 1);
        let expected = (1.0 / 12.0_f64 / 1000.0).sqrt();
        assert!((mean / expected - 1.0).abs() < 0.2, "{mean}");
        let expected = (0.025 * 0.975 / 1000.0_f64).sqrt();
        for end in [low, high] {
            assert!((end / expected - 1.0).abs() < 0.4, "{end}");
        }
    }
}
