//! Summaries of a population, and the result that they make up.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::data_likelihood::MODEL_ERROR_MAX;
use osteon_common::data_statistics::{FittedMoments, predictive_test};
use osteon_common::job::JobSpecification;
use osteon_common::moments::MomentVector;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorDraw, PosteriorSummary, QUANTILE_LEVELS};
use osteon_common::results::{BestPoint, Moments};

use super::batches::{PosteriorSearch, SearchOutcome};
use super::population::{Member, Population};
use super::problem::{PosteriorProblem, closed_form, moments as moments_of};

/// Sobol' points of the population that the result summarises, with up to two free parameters and
/// with more. The former are so many that quantiles, too, are exact to a thousandth of a standard
/// deviation.
const POINTS: [u64; 2] = [1 << 18, 1 << 14];
/// Points of the population that tells how many draws count.
const POINTS_COUNTED: u64 = 1 << 14;
/// Points drawn from the prior for its standard deviations.
const PRIOR_POINTS: u64 = 4096;
/// Smallest number of effective draws of a result that counts as converged.
const EFFECTIVE_MIN: f64 = 400.0;

impl PosteriorSearch {
    /// Returns the posterior, once all evaluations are made. `errors` are the relative standard
    /// errors of the model's moments due to sampling.
    pub(crate) fn result(
        &self,
        specification: &JobSpecification,
        errors: MomentVector,
    ) -> Option<Posterior> {
        let problem = self.problem.as_ref().filter(|_| self.point().is_none())?;
        let problem = &problem.with_model_errors(errors);
        let population = self.final_population(problem);
        if population.members.is_empty() {
            return None;
        }
        let effective = population.effective() * self.check.efficiency();
        let reason = self.reason(errors);
        let of_sampling = in_units_of_the_data(problem, errors).into_iter().map(|one| one * one);
        let prior = problem.prior_points(0..PRIOR_POINTS);
        let of = |quantity: &dyn Fn(&Point) -> f64| summary(&population, &prior, quantity);
        let free: Vec<Parameter> = problem.priors.iter().map(|prior| prior.parameter).collect();
        let [mean, variation] = [0, 1].map(|axis| {
            let values = population.members.iter().map(|member| libm::exp(member.moments[axis]));
            let of_prior = prior.iter().map(|point| self.moment(problem, point, axis));
            summary_of_values(&population, values.collect(), of_prior.collect())
        });
        let at = [mean.mean, variation.mean].map(libm::log);
        let settings = specification.posterior.unwrap_or_default();
        let count = usize::try_from(settings.draws).unwrap_or(usize::MAX);
        Some(Posterior {
            converged: reason.is_none(),
            reason,
            evaluations: self.evaluations,
            effective_draws: effective,
            checked_draws: self.check.draws() as u64,
            model_error: self.check.error(),
            check_efficiency: self.check.efficiency(),
            pareto_k: self.check.pareto_shape(),
            sampling_error: of_sampling.sum::<f64>().sqrt(),
            parameters: free.iter().map(|&one| of(&|point| point.get(one))).collect(),
            correlation: correlation(&population, &free),
            free,
            mean,
            coefficient_of_variation: variation,
            bulk_velocity: of(&|point| {
                closed_form(&problem.structure, point)
                    .map_or(f64::NAN, |closed| libm::exp(closed[0]))
            }),
            entries: entries(&population, &prior, &problem.structure),
            predictive_p_value: None,
            outlier_share: problem.likelihood.velocities.outlier_share(at).map(|share| share.mean),
            draws: draws(&population, problem, count),
        })
    }

    /// Returns how a job ends that asks for nothing but the posterior; `errors` as in `result`.
    pub(crate) fn ending(&self, errors: Option<MomentVector>) -> SearchOutcome {
        match (self.outcome(), errors) {
            (SearchOutcome::Converged, Some(errors)) => {
                self.reason(errors).map_or(SearchOutcome::Converged, SearchOutcome::Doubtful)
            }
            (outcome, _) => outcome,
        }
    }

    /// Returns mean or coefficient of variation of the interpolated model.
    fn moment(&self, problem: &PosteriorProblem, point: &Point, axis: usize) -> f64 {
        moments_of(&self.surrogate, &problem.structure, point)
            .map_or(f64::NAN, |found| libm::exp(found[axis]))
    }

    /// Returns why the result is not accurate; `None` if it is.
    fn reason(&self, errors: MomentVector) -> Option<String> {
        if let SearchOutcome::Doubtful(reason) = self.outcome() {
            return Some(reason);
        }
        let problem = self.problem.as_ref()?;
        too_noisy(problem, errors).or_else(|| self.too_few_draws(problem))
    }

    /// Returns that too few draws count; `None` if they are enough.
    fn too_few_draws(&self, problem: &PosteriorProblem) -> Option<String> {
        // Without the errors of the model, which make draws count more, and take long if large. A part of
        // the points tells as well how many of all count.
        let all = Self::points(problem);
        let drawn = all.min(POINTS_COUNTED);
        let share = problem.population(&self.surrogate, drawn, self.populations).effective();
        let effective = share * (all / drawn) as f64 * self.check.efficiency();
        (effective < EFFECTIVE_MIN).then(|| {
            format!(
                "the draws count as {effective:.0} independent ones only, {EFFECTIVE_MIN} are \
                 needed: few points within the bounds match the data; widen the bounds or the priors"
            )
        })
    }

    /// Returns the draws of the final interpolation.
    fn final_population(&self, problem: &PosteriorProblem) -> Population {
        problem.population(&self.surrogate, Self::points(problem), self.populations)
    }

    /// Returns the number of Sobol' points of the final population.
    fn points(problem: &PosteriorProblem) -> u64 {
        POINTS[usize::from(!problem.is_of_few())]
    }
}

/// Returns the relative errors of the model's moments in units of the data's.
fn in_units_of_the_data(problem: &PosteriorProblem, errors: MomentVector) -> MomentVector {
    let noise = problem.likelihood.errors();
    std::array::from_fn(|k| errors[k] / noise[k])
}

/// Returns why a model with these relative errors of its moments has no accurate posterior; `None` if
/// it may have one.
fn too_noisy(problem: &PosteriorProblem, errors: MomentVector) -> Option<String> {
    let largest = in_units_of_the_data(problem, errors).into_iter().fold(0.0, f64::max);
    (largest > MODEL_ERROR_MAX).then(|| {
        format!(
            "the sampling errors of the model's moments are {largest:.0} times those of the data, \
             {MODEL_ERROR_MAX} are allowed; raise [monte_carlo] realizations, or use its \
             sampling = \"sobol\" with control_variate = true"
        )
    })
}

/// Returns the p-value of the data under the law of the best point's velocities, moved to the
/// posterior means of the moments; `None` without velocities, and where they are not independent, have
/// scatter of the instrument, or are of a setup that is not known exactly.
pub(super) fn predictive_p_value(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
    found: &Posterior,
) -> Option<f64> {
    let data = specification.data.as_ref()?.set(set)?;
    if data.subjects.is_some() || data.repeatability > 0.0 || !specification.systematic.is_empty() {
        return None;
    }
    let coefficient_of_variation = found.coefficient_of_variation.mean;
    let at = Moments { mean: found.mean.mean, coefficient_of_variation };
    let fitted = FittedMoments::from_specification(specification);
    let sampling = specification.monte_carlo.sampling;
    let test = predictive_test(data.velocities, &best.outcomes, sampling, fitted, at)?;
    Some(test.p_value)
}

/// Summarises a quantity of the population's points and of the prior's.
fn summary(
    population: &Population,
    prior: &[Point],
    quantity: &dyn Fn(&Point) -> f64,
) -> PosteriorSummary {
    let values = population.members.iter().map(|member| quantity(&member.point)).collect();
    summary_of_values(population, values, prior.iter().map(quantity).collect())
}

/// Summarises a quantity of which these are the values at the population's points and at the prior's.
fn summary_of_values(
    population: &Population,
    values: Vec<f64>,
    of_prior: Vec<f64>,
) -> PosteriorSummary {
    let equal = vec![1.0 / of_prior.len() as f64; of_prior.len()];
    let (_, prior_standard_deviation) = moments(&of_prior, &equal);
    PosteriorSummary { prior_standard_deviation, ..weighted(values, &population.weights) }
}

fn weighted(values: Vec<f64>, weights: &[f64]) -> PosteriorSummary {
    let (mean, standard_deviation) = moments(&values, weights);
    let mut sorted: Vec<(f64, f64)> = values.into_iter().zip(weights.iter().copied()).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let quantiles = QUANTILE_LEVELS.map(|level| quantile(&sorted, level));
    PosteriorSummary { mean, standard_deviation, quantiles, prior_standard_deviation: f64::NAN }
}

fn moments(values: &[f64], weights: &[f64]) -> (f64, f64) {
    let mean: f64 = values.iter().zip(weights).map(|(value, weight)| weight * value).sum();
    let squares = values.iter().zip(weights).map(|(v, w)| w * ((v - mean) * (v - mean)));
    (mean, squares.sum::<f64>().sqrt())
}

/// Returns the quantile of values in ascending order with their weights, interpolated between the
/// middles of the weights.
fn quantile(sorted: &[(f64, f64)], level: f64) -> f64 {
    let mut below = 0.0;
    let mut before: Option<(f64, f64)> = None;
    for &(value, weight) in sorted {
        let middle = below + 0.5 * weight;
        if middle >= level {
            return match before {
                Some((last, at)) if middle > at => {
                    last + (value - last) * ((level - at) / (middle - at))
                }
                _ => value,
            };
        }
        before = Some((value, middle));
        below += weight;
    }
    sorted.last().map_or(f64::NAN, |last| last.0)
}

fn correlation(population: &Population, free: &[Parameter]) -> Vec<Vec<f64>> {
    let columns: Vec<Vec<f64>> = free
        .iter()
        .map(|&one| {
            let values: Vec<f64> =
                population.members.iter().map(|member| member.point.get(one)).collect();
            let (mean, deviation) = moments(&values, &population.weights);
            values.iter().map(|value| (value - mean) / deviation).collect()
        })
        .collect();
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let products = a.iter().zip(b).zip(&population.weights);
        products.map(|((a, b), weight)| weight * (a * b)).sum()
    };
    let row = |a: &Vec<f64>| columns.iter().map(|b| product(a, b)).collect();
    columns.iter().map(row).collect()
}

fn entries(
    population: &Population,
    prior: &[Point],
    structure: &BoneStructure,
) -> Vec<(usize, usize, PosteriorSummary)> {
    let rows = |point: &Point| {
        let solid = structure.mean_solid(point);
        solid.map_or([[f64::NAN; 6]; 6], |solid| *solid.elasticity.rows())
    };
    // A solid with pores takes long to compute, so each point's is computed once for all entries.
    let drawn: Vec<_> = population.members.iter().map(|member| rows(&member.point)).collect();
    let of_prior: Vec<_> = prior.iter().map(rows).collect();
    let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    places
        .map(|(row, column)| {
            let of = |solids: &[[[f64; 6]; 6]]| solids.iter().map(|one| one[row][column]).collect();
            (row, column, summary_of_values(population, of(&drawn), of(&of_prior)))
        })
        .collect()
}

fn draws(population: &Population, problem: &PosteriorProblem, count: usize) -> Vec<PosteriorDraw> {
    let draw = |member: &Member| {
        let log_prior = problem.priors.iter().map(|prior| {
            prior.log_density(member.point.get(prior.parameter)).unwrap_or(f64::NEG_INFINITY)
        });
        PosteriorDraw {
            point: member.point,
            log_density: problem.likelihood.log(&member.moments) + log_prior.sum::<f64>(),
            mean: libm::exp(member.moments[0]),
            coefficient_of_variation: libm::exp(member.moments[1]),
        }
    };
    population.resampled(count, 0.5).into_iter().map(draw).collect()
}
