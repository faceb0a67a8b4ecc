//! Calibration of posteriors: how often their intervals contain the parameters that made the data,
//! and where these lie among the draws.

use osteon_common::bulk_velocity::bulk_velocity;
use osteon_common::case::Setup;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, PosteriorSettings, Range, Sampling,
    Search, SearchMethod,
};
use osteon_common::outcome::Outcome;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorSummary};

use crate::identify::{RealizationCache, identify, outcomes};
use crate::models::{BOUNDS, mean_model};
use crate::table::MarkdownTable;
use crate::twins::Twins;
use crate::{RowCallback, StudyError};

/// Default number of data sets of each size.
pub const REPETITIONS: u64 = 40;
/// Numbers of velocities of the data sets.
const SIZES: [u64; 3] = [20, 100, 2747];
/// Number of realizations of the model.
const REALIZATIONS: u64 = 128;
/// Maximum fraction of failed realizations of the data.
const FAILED_MAX: f64 = 0.01;
/// Bins of the histogram of ranks.
const BINS: usize = 10;

/// Counts of one quantity over data sets.
#[derive(Debug, Clone, Copy, Default)]
struct Calibration {
    within_95: u64,
    within_50: u64,
    ranks: [u64; BINS],
}

/// Draws parameter sets from the prior, all seven within the bounds of the paper's example, and
/// velocities of each; counts how many posterior intervals contain the parameters, and in which
/// tenth of the draws they lie (simulation-based calibration: S. Talts et al., arXiv 1804.06788).
///
/// Parameter sets for which more than one realization in a hundred fails are drawn again.
///
/// # Errors
/// If a point has no ensemble.
pub fn table(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "velocities",
        "quantity",
        "posteriors",
        "95 % intervals that hold it (%)",
        "50 % intervals that hold it (%)",
        "truths in each tenth of the draws",
    ]);
    for size in SIZES {
        let mut counts = [Calibration::default(); 8];
        let (mut done, mut candidates) = (0, 0..);
        while done < twins.repetitions {
            let Some((truth, data)) = drawn(twins, size, candidates.next().unwrap_or(0))? else {
                continue;
            };
            let specification = specification(data, twins.seed);
            let found = identify(&specification, &mut RealizationCache::new(), twins.isa)?;
            done += 1;
            match found.result.conclusions.posterior {
                Some(posterior) => {
                    count(&posterior, &truth, &mut counts);
                    progress(&format!("{size}: {}", line(done, &posterior, &counts)));
                }
                None => progress(&format!("{size}: {done} has no posterior")),
            }
        }
        for (k, counts) in counts.iter().enumerate() {
            let percent = |count: u64| format!("{:.1}", 100.0 * count as f64 / done as f64);
            let ranks: Vec<String> = counts.ranks.iter().map(u64::to_string).collect();
            table.push(vec![
                size.to_string(),
                name(k),
                done.to_string(),
                percent(counts.within_95),
                percent(counts.within_50),
                ranks.join(" "),
            ]);
        }
    }
    Ok(table)
}

fn line(done: u64, posterior: &Posterior, counts: &[Calibration; 8]) -> String {
    let held: Vec<u64> = counts.iter().map(|counts| counts.within_95).collect();
    format!(
        "{done} posteriors, held {held:?}; {} evaluations, {:.0} effective, converged {}",
        posterior.evaluations, posterior.effective_draws, posterior.converged
    )
}

fn name(quantity: usize) -> String {
    let parameter = Parameter::ALL.get(quantity);
    parameter.map_or("√(c1111/ρ)".to_owned(), |parameter| parameter.name().replace('_', " "))
}

/// Returns quantity number `k` of a point: the seven parameters, then √(c1111/ρ).
fn quantity(point: &Point, k: usize) -> f64 {
    let speed = || bulk_velocity(point).map_or(f64::NAN, |found| libm::exp(found.logarithm));
    point.0.get(k).copied().unwrap_or_else(speed)
}

fn count(posterior: &Posterior, truth: &Point, counts: &mut [Calibration; 8]) {
    for (k, counts) in counts.iter_mut().enumerate() {
        let summary = posterior.parameters.get(k).unwrap_or(&posterior.bulk_velocity);
        let truth = quantity(truth, k);
        let PosteriorSummary { quantiles: [low, _, lower, _, upper, _, high], .. } = *summary;
        counts.within_95 += u64::from((low..=high).contains(&truth));
        counts.within_50 += u64::from((lower..=upper).contains(&truth));
        let below = posterior.draws.iter().filter(|draw| quantity(&draw.point, k) < truth);
        let rank = BINS * below.count() / (posterior.draws.len() + 1);
        counts.ranks[rank.min(BINS - 1)] += 1;
    }
}

/// Returns parameter set `number` with velocities; `None` if too many realizations fail.
fn drawn(twins: &Twins, size: u64, number: u64) -> Result<Option<(Point, Vec<f64>)>, StudyError> {
    let truth = mean_model(twins.seed, number);
    let seed = twins.seed + 1 + number;
    let drawn = MonteCarlo { realizations: size, seed, ..MonteCarlo::default() };
    let data: Vec<f64> =
        outcomes(&truth, &drawn, twins.isa)?.into_iter().filter_map(Outcome::ok).collect();
    let enough = data.len() as f64 >= (1.0 - FAILED_MAX) * size as f64;
    Ok(enough.then_some((truth, data)))
}

fn specification(velocities: Vec<f64>, seed: u64) -> JobSpecification {
    let range =
        |(lower, upper): (f64, f64)| Range::Free { start: 0.5 * (lower + upper), lower, upper };
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_velocities(velocities)),
        parameters: BOUNDS.map(range),
        monte_carlo: MonteCarlo {
            realizations: REALIZATIONS,
            seed,
            sampling: Sampling::Sobol,
            control_variate: true,
            ..MonteCarlo::default()
        },
        objective: Objective::default(),
        search: Search::by(SearchMethod::Posterior),
        posterior: Some(PosteriorSettings::default()),
    }
}
