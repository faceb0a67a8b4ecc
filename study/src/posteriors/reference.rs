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
/// Rows are reported each time that this number of draws has been evaluated.
const REPORTED: usize = 100;

/// Compares the posterior of the example's data with that of exact importance sampling:
/// mean, standard deviation and the ends of the 95 % interval of each quantity, and their differences
/// in standard deviations of the posterior. `realizations` is the number of draws.
///
/// # Errors
/// If a point has no ensemble.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let velocities = velocities(&OPTIMUM, VELOCITIES, DATA_SEED, draws.isa)?;
    let half = half_of(&velocities);
    let Some(posterior) = posterior_of(Data::from_velocities(velocities.clone()), draws, None)?
    else {
        return Ok(MarkdownTable::new(&["there is no posterior"]));
    };
    progress(&described("posterior", &posterior));
    let Some(proposal) = posterior_of(half, draws, Some(draws.realizations))? else {
        return Ok(MarkdownTable::new(&["there is no proposal"]));
    };
    progress(&described("proposal", &proposal));
    let Some(likelihood) = DataLikelihood::independent(&velocities, 0.0) else {
        return Ok(MarkdownTable::new(&["the data have no scatter"]));
    };
    let errors = evaluated(&OPTIMUM, draws)?.map(|estimate| estimate.relative_errors());
    let likelihood = likelihood.with_model_errors(errors.unwrap_or_default());
    let mut weighted = Vec::new();
    for draw in &proposal.draws {
        let found = evaluated(&draw.point, draws)?.map(|estimate| estimate.moments);
        let log = found.map_or(f64::NEG_INFINITY, |found| {
            likelihood.log([found.mean, found.coefficient_of_variation].map(libm::log))
        });
        weighted.push((draw.point, log - draw.log_density));
        if weighted.len().is_multiple_of(REPORTED) {
            let effective = effective(&normalised(&weighted));
            progress(&format!("{} draws, {effective:.0} effective", weighted.len()));
        }
    }
    Ok(compared(&posterior, &normalised(&weighted)))
}

/// Returns half the data, as moments with a count.
fn half_of(velocities: &[f64]) -> Data {
    let moments = Data::from_velocities(velocities.to_vec()).moments(0);
    let measurements = Measurements::Moments {
        mean: moments.mean,
        coefficient_of_variation: moments.coefficient_of_variation,
        count: Some(velocities.len() as u64 / 2),
    };
    Data { measurements, repeatability: 0.0 }
}

/// Computes a posterior with this number of draws, or the default one.
fn posterior_of(
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

fn described(name: &str, posterior: &Posterior) -> String {
    format!(
        "{name}: {} evaluations, {:.0} effective draws, efficiency {:.3}",
        posterior.evaluations, posterior.effective_draws, posterior.check_efficiency
    )
}

/// Evaluates the model.
fn evaluated(point: &Point, study: &Draws) -> Result<Option<Estimate>, StudyError> {
    let monte_carlo = model_germs(MODEL_REALIZATIONS, study.seed);
    let outcomes = outcomes(point, &monte_carlo, study.isa)?;
    let feasible = PointStatistics::from_outcomes(&monte_carlo, point, &outcomes).feasible;
    Ok(estimate(&monte_carlo, point, &outcomes).filter(|_| feasible))
}

/// Returns the points with their weights, which have the sum 1.
fn normalised(weighted: &[(Point, f64)]) -> Vec<(Point, f64)> {
    let largest = weighted.iter().map(|one| one.1).fold(f64::NEG_INFINITY, f64::max);
    let weight = |log: f64| libm::exp(log - largest);
    let total: f64 = weighted.iter().map(|one| weight(one.1)).sum();
    weighted.iter().map(|&(point, log)| (point, weight(log) / total)).collect()
}

fn effective(weighted: &[(Point, f64)]) -> f64 {
    1.0 / weighted.iter().map(|(_, weight)| weight * weight).sum::<f64>()
}

/// Returns the table of both posteriors.
fn compared(posterior: &Posterior, weighted: &[(Point, f64)]) -> MarkdownTable {
    let mut table = MarkdownTable::new(&[
        "quantity",
        "mean",
        "difference",
        "s.d.",
        "difference",
        "2.5 %",
        "difference",
        "97.5 %",
        "difference",
        "expected by chance",
    ]);
    let effective = effective(weighted);
    for k in 0..QUANTITIES {
        let found = posterior.parameters.get(k).unwrap_or(&posterior.bulk_velocity);
        let exact = exact(weighted, k);
        let found = [
            found.mean,
            found.standard_deviation,
            found.quantiles[ENDS[0]],
            found.quantiles[ENDS[1]],
        ];
        let mut row = vec![name(k)];
        for (exact_value, found) in exact.iter().zip(found) {
            row.push(format!("{exact_value:.5e}"));
            row.push(format!("{:+.3}", (found - exact_value) / exact[1]));
        }
        row.push(format!("{:.3}", 1.0 / effective.sqrt()));
        table.push(row);
    }
    table
}

/// Returns mean, standard deviation and the quantiles of quantity number `k`.
fn exact(weighted: &[(Point, f64)], k: usize) -> [f64; 4] {
    let mut values: Vec<(f64, f64)> =
        weighted.iter().map(|(point, weight)| (quantity(point, k), *weight)).collect();
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mean: f64 = values.iter().map(|(value, weight)| weight * value).sum();
    let square: f64 = values.iter().map(|(v, weight)| weight * ((v - mean) * (v - mean))).sum();
    let quantile = |level: f64| {
        let mut below = 0.0;
        let reached = values.iter().find(|(_, weight)| {
            below += weight;
            below >= level
        });
        reached.or(values.last()).map_or(f64::NAN, |one| one.0)
    };
    [mean, square.sqrt(), quantile(LEVELS[0]), quantile(LEVELS[1])]
}
