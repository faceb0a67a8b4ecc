//! Calibration of posteriors: how often their intervals contain the parameters that made the data,
//! and where these lie among the draws.

mod calibration;
mod data;
mod ranks;
pub mod reference;
#[cfg(test)]
mod tests;

use std::sync::mpsc;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, PosteriorSettings, Range, Sampling,
    Search, SearchMethod,
};
use osteon_common::parameters::{BONE_PARAMETERS, Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorSummary};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::statistics::PointStatistics;
use osteon_common::systematic::Systematic;
use rayon::prelude::*;

pub use self::calibration::{PosteriorCalibration, Scenario};
use self::data::simulate_data;
use self::ranks::Ranks;
use crate::identify::{RealizationCache, identify, outcomes};
use crate::models::{BOUNDS, mean_model};
use crate::table::MarkdownTable;
use crate::twins::bulk_velocity;
use crate::{RowCallback, StudyError};

/// Default number of parameter sets.
pub const REPETITIONS: u64 = 40;
/// Default number of velocities of each data set.
pub const VELOCITIES: u64 = 100;
/// Numbers of realizations of the model with few and with many velocities. With Sobol' points and
/// the control variate the model's sampling error is then a small part of the data's.
const REALIZATIONS: [u64; 2] = [32, 64];
/// Maximum fraction of failed realizations of the model. With the default, a single one of so few
/// would make a point infeasible.
const FAILED_MAX: f64 = 0.1;
/// Number of velocities from which on there are many.
const MANY: u64 = 500;
/// Quantities of a posterior: the seven parameters and √(c1111/ρ).
const QUANTITIES: usize = BONE_PARAMETERS + 1;

/// Counts of one quantity over data sets.
#[derive(Debug, Clone, Copy, Default)]
struct Calibration {
    within_95: u64,
    within_50: u64,
    ranks: Ranks,
}

/// Results of all data sets so far.
#[derive(Debug, Default)]
struct Tally {
    posteriors: u64,
    unconverged: u64,
    evaluations: u64,
    quantities: [Calibration; QUANTITIES],
}

/// What became of one parameter set.
enum TruthOutcome {
    /// Too many of its realizations fail, or it has no posterior.
    Unusable,
    /// Its posterior, and the parameters that made the data.
    Posterior(Box<Posterior>, Point),
}

/// Draws parameter sets from the prior, all seven within the bounds of the paper's example, and
/// velocities of each; counts how many posterior intervals contain the parameters, and in which
/// tenth of the draws they lie (simulation-based calibration: S. Talts et al., arXiv 1804.06788).
///
/// Parameter sets at which the job's own model is infeasible are left out, as the posterior does.
/// Posteriors that did not converge are counted like the others.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn table(
    study: &PosteriorCalibration,
    progress: RowCallback<'_>,
) -> Result<MarkdownTable, StudyError> {
    let mut tally = Tally::default();
    let numbers = study.first..study.first + study.repetitions;
    let (sender, drawn) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            // In any order: the counts do not depend on it. After an error nobody receives the rest.
            numbers.into_par_iter().for_each_with(sender, |sender, number| {
                drop(sender.send((number, compute_outcome(study, number))));
            });
        });
        for (number, drawn) in drawn {
            match drawn? {
                TruthOutcome::Unusable => {}
                TruthOutcome::Posterior(posterior, truth) => {
                    tally.add(&posterior, &truth);
                    progress(&tally.line(number, &posterior, &truth));
                }
            }
        }
        Ok(tally.table())
    })
}

impl Tally {
    fn add(&mut self, posterior: &Posterior, truth: &Point) {
        self.posteriors += 1;
        self.unconverged += u64::from(!posterior.converged);
        self.evaluations += posterior.evaluations;
        for (k, counts) in self.quantities.iter_mut().enumerate() {
            let summary = posterior.parameters.get(k).unwrap_or(&posterior.bulk_velocity);
            let value = quantity(truth, k);
            let PosteriorSummary { quantiles: [low, _, lower, _, upper, _, high], .. } = *summary;
            counts.within_95 += u64::from((low..=high).contains(&value));
            counts.within_50 += u64::from((lower..=upper).contains(&value));
            counts.ranks.add(count_draws_below(posterior, truth, k), posterior.draws.len());
        }
    }

    fn line(&self, number: u64, posterior: &Posterior, truth: &Point) -> String {
        let held: Vec<u64> = self.quantities.iter().map(|counts| counts.within_95).collect();
        let places: Vec<String> = (0..QUANTITIES)
            .map(|k| {
                format!(
                    "{:.1}",
                    100.0 * count_draws_below(posterior, truth, k) as f64
                        / posterior.draws.len() as f64
                )
            })
            .collect();
        format!(
            "set {number}: {} evaluations, {:.0} effective, efficiency {:.3}, {}; truths above {} % of the draws; held {held:?} of {}",
            posterior.evaluations,
            posterior.effective_draws,
            posterior.check_efficiency,
            if posterior.converged { "converged" } else { "not converged" },
            places.join(" "),
            self.posteriors
        )
    }

    fn table(&self) -> MarkdownTable {
        let mut table = MarkdownTable::new(&[
            "quantity",
            "posteriors",
            "not converged",
            "evaluations each",
            "95 % intervals that hold it (%)",
            "50 % intervals that hold it (%)",
            "truths in each tenth of the draws",
            "largest deviation of a tenth (s.d.)",
        ]);
        let percent =
            |count: u64| format!("{:.1}", 100.0 * count as f64 / self.posteriors.max(1) as f64);
        for (k, counts) in self.quantities.iter().enumerate() {
            table.push(vec![
                name(k),
                self.posteriors.to_string(),
                self.unconverged.to_string(),
                format!("{:.0}", self.evaluations as f64 / self.posteriors.max(1) as f64),
                percent(counts.within_95),
                percent(counts.within_50),
                counts.ranks.to_string(),
                format!("{:.1}", counts.ranks.largest_deviation()),
            ]);
        }
        table
    }
}

fn compute_outcome(study: &PosteriorCalibration, number: u64) -> Result<TruthOutcome, StudyError> {
    let truth = mean_model(study.seed, number);
    let monte_carlo =
        model_germs(REALIZATIONS[usize::from(study.velocities >= MANY)], study.seed + number);
    let modelled = outcomes(&truth, &monte_carlo, study.isa)?;
    if !PointStatistics::from_outcomes(&monte_carlo, &truth, &modelled).feasible {
        return Ok(TruthOutcome::Unusable);
    }
    let Some(data) = simulate_data(study, &truth, number)? else {
        return Ok(TruthOutcome::Unusable);
    };
    let specification = specification(data, monte_carlo);
    let found = identify(&specification, &mut RealizationCache::new(), study.isa)?;
    let posterior = found.result.conclusions.posterior;
    Ok(posterior
        .map_or(TruthOutcome::Unusable, |found| TruthOutcome::Posterior(Box::new(found), truth)))
}

/// Returns the name of quantity number `k`.
fn name(k: usize) -> String {
    let parameter = Parameter::OF_BONE.get(k);
    parameter.map_or("√(c1111/ρ)".to_owned(), |parameter| parameter.name().replace('_', " "))
}

/// Returns quantity number `k` of a point: the seven parameters of the bone, then √(c1111/ρ).
fn quantity(point: &Point, k: usize) -> f64 {
    Parameter::OF_BONE.get(k).map_or_else(|| bulk_velocity(point), |&one| point.get(one))
}

/// Returns the number of draws below the truth in quantity number `k`.
fn count_draws_below(posterior: &Posterior, truth: &Point, k: usize) -> usize {
    let truth = quantity(truth, k);
    posterior.draws.iter().filter(|draw| quantity(&draw.point, k) < truth).count()
}

/// Returns a job that computes nothing but the posterior of these data, with all parameters free.
fn specification(data: Data, monte_carlo: MonteCarlo) -> JobSpecification {
    let range =
        |(lower, upper): (f64, f64)| Range::Free { start: 0.5 * (lower + upper), lower, upper };
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(data),
        parameters: Range::of_bone(BOUNDS.map(range)),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo,
        objective: Objective::default(),
        search: Search::by(SearchMethod::Posterior),
        posterior: Some(PosteriorSettings::default()),
    }
}

/// Returns the settings of a model by Sobol' points with this seed.
fn model_germs(realizations: u64, seed: u64) -> MonteCarlo {
    MonteCarlo {
        realizations,
        seed,
        sampling: Sampling::Sobol,
        control_variate: true,
        max_failed_fraction: FAILED_MAX,
        ..MonteCarlo::default()
    }
}
