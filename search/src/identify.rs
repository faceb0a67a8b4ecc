//! Runs a whole job in one call, for programs that compute the realizations themselves.

use std::collections::BTreeMap;
use std::sync::Arc;

use osteon_common::job::JobSpecification;
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::{FailureKind, RealizationResult, decode, encode};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::quantile;
use osteon_common::realization::Ensemble;
use osteon_common::results::{Evaluation, GroupResult, JobResult};
use osteon_common::version::Program;
use osteon_common::violations::Violations;
use thiserror::Error;

use crate::search::{Ending, Search, Step};

/// The realizations of one point that the caller must compute, with the indices 0 to `count` - 1.
///
/// A bone's bits depend on the specification, the point and its index alone, so realizations may be
/// computed in any order and on any number of threads.
#[derive(Debug, Clone)]
pub struct Realizations {
    /// The point to evaluate.
    pub point: Point,
    /// The random bones of the point. If the bone of an index cannot be drawn, the outcome of that
    /// index is the failure [`FailureKind::NotFinite`].
    pub ensemble: Ensemble,
    /// Number of realizations.
    pub count: u64,
    /// The observables that are needed of each realization; others are 0.
    pub observables: ObservableSet,
}

/// Result and history of a job.
#[derive(Debug, Clone, PartialEq)]
pub struct CompletedJob {
    /// Status, digest, best point (or the result of each group), and what the data determine.
    pub result: JobResult,
    /// Rows of all evaluations, in order.
    pub history: Vec<Evaluation>,
}

/// Reason why a job has no result.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum IdentifyError<E> {
    /// The specification violates its rules.
    #[error("the specification is not acceptable:\n{0}")]
    Specification(Violations),
    /// The caller could not compute the realizations of a point.
    #[error("the realizations of evaluation {number} at {point} were not computed: {cause:#}")]
    Evaluation {
        /// Number of the evaluation.
        number: u64,
        /// The point that was to be evaluated.
        point: Box<Point>,
        /// The caller's error.
        cause: E,
    },
    /// The caller returned a wrong number of outcomes.
    #[error(
        "evaluation {number} has {found} outcomes; it must have {expected}, one of each realization"
    )]
    Count {
        /// Number of the evaluation.
        number: u64,
        /// Number of outcomes returned.
        found: usize,
        /// Number of realizations requested.
        expected: u64,
    },
    /// The caller returned an outcome that no realization can have.
    #[error(
        "realization {index} of evaluation {number} is {solved:?}; a velocity must be finite and above 0, \
         its estimated error finite and at least 0, its observables finite (and not 0 where the data have some), \
         and all 0 where there is no velocity"
    )]
    Unsound {
        /// Number of the evaluation.
        number: u64,
        /// Index of the realization.
        index: usize,
        /// The outcome returned.
        solved: RealizationResult,
    },
}

/// Runs the job of `specification` in this process: passes one point after another to `evaluate`,
/// which returns the outcomes in index order, until the search ends.
///
/// The result equals that of the same job submitted to a coordinator, to the bit, if `evaluate`
/// computes what a worker computes; to do so, solve each bone with
/// `osteon_solver::Solver::realization_with` and [`Realizations::observables`]. Only the commit of the program is unknown here. An
/// identification follows the path of its search; a propagation is one evaluation at the start.
///
/// ```
/// use std::convert::Infallible;
///
/// use osteon_common::case::Setup;
/// use osteon_common::group_settings::GroupSettings;
/// use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
/// use osteon_common::outcome::RealizationResult;
/// use osteon_common::random_quantities::RandomQuantities;
/// use osteon_common::results::Status;
/// use osteon_common::systematic::Systematic;
///
/// let mut parameters = Range::of_bone([1598.8, 0.0, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.0].map(Range::Fixed));
/// parameters[1] = Range::Free { start: 15e9, lower: 12e9, upper: 25e9 };
/// parameters[6] = Range::Free { start: 0.12, lower: 0.02, upper: 0.3 };
/// let specification = JobSpecification {
///     kind: JobKind::Identification,
///     setup: Setup::default(),
///     data: Some(Data::from_moments(3900.0, 0.03)),
///     parameters,
///     random: RandomQuantities::default(),
///     systematic: Systematic::default(),
///     groups: GroupSettings::default(),
///     monte_carlo: MonteCarlo { realizations: 100, ..MonteCarlo::default() },
///     objective: Objective::Moments,
///     search: Search::default(),
///     posterior: None,
/// };
/// // In place of a solver: the speed of the bulk wave along the bone.
/// let found = osteon_search::identify(&specification, |realizations| {
///     let speed = |index| {
///         let bone = realizations.ensemble.bone(index).expect("this dispersion is small");
///         (bone.elasticity.rows()[0][0] / bone.density).sqrt()
///     };
///     let solved = |index| RealizationResult::solved(speed(index), 0.0);
///     Ok::<_, Infallible>((0..realizations.count).map(solved).collect())
/// })?;
/// assert_eq!(found.result.status, Status::Converged);
/// let best = found.result.best.expect("a search that converges has a best point");
/// assert!((best.velocity.expect("it is feasible").moments.mean - 3900.0).abs() < 0.1);
/// # Ok::<_, osteon_search::IdentifyError<Infallible>>(())
/// ```
///
/// # Errors
/// When the specification breaks rules, `evaluate` fails, or what it computed cannot be meant.
pub fn identify<E>(
    specification: &JobSpecification,
    mut evaluate: impl FnMut(&Realizations) -> Result<Vec<RealizationResult>, E>,
) -> Result<CompletedJob, IdentifyError<E>> {
    let violations = specification.check();
    if !violations.is_empty() {
        return Err(IdentifyError::Specification(violations));
    }
    let mut search = Search::new(Arc::new(specification.clone()));
    let mut best = BestOfGroups::default();
    loop {
        match search.ask() {
            Step::Evaluate(point) => {
                let number = search.evaluations();
                let solved = solve(specification, number, point, &mut evaluate)?;
                let observables = specification.observables();
                let outcomes = Outcomes::of_results(solved.iter().copied(), observables);
                let successes = solved.iter().filter(|one| one.outcome.is_ok());
                let errors = successes.map(|one| one.estimated_error);
                search.tell(outcomes.clone(), quantile::estimated_error(errors));
                best.keep(&search, outcomes);
            }
            Step::Done(ending) => return Ok(identified(specification, &search, &ending, &best)),
        }
    }
}

/// Computes the realizations of a point by `evaluate`. If no bone can be drawn at the point, all of
/// them are failures, as they are on a worker.
fn solve<E>(
    specification: &JobSpecification,
    number: u64,
    point: Point,
    evaluate: &mut impl FnMut(&Realizations) -> Result<Vec<RealizationResult>, E>,
) -> Result<Vec<RealizationResult>, IdentifyError<E>> {
    let count = specification.monte_carlo.realizations;
    let observables = specification.observables();
    let Ok(ensemble) = specification.ensemble(&point) else {
        return Ok((0..count).map(|_| RealizationResult::failed(FailureKind::NotFinite)).collect());
    };
    let solved = evaluate(&Realizations { point, ensemble, count, observables })
        .map_err(|cause| IdentifyError::Evaluation { number, point: Box::new(point), cause })?;
    if solved.len() as u64 != count {
        return Err(IdentifyError::Count { number, found: solved.len(), expected: count });
    }
    match solved.iter().position(|one| !is_sound(one) || one.lacks_one(observables)) {
        Some(index) => Err(IdentifyError::Unsound { number, index, solved: solved[index] }),
        None => Ok(solved),
    }
}

fn is_sound(solved: &RealizationResult) -> bool {
    let (code, velocity) = encode(solved.outcome);
    decode(code, velocity).is_some() && solved.is_consistent()
}

/// The outcomes of the best point of each group so far. A search keeps only those of its current
/// set of data.
#[derive(Debug, Default)]
struct BestOfGroups(BTreeMap<usize, Outcomes>);

impl BestOfGroups {
    /// Keeps the outcomes of the last evaluation passed to `search`, if it is the best of its
    /// group.
    fn keep(&mut self, search: &Search, outcomes: Outcomes) {
        let last = search.history().last().filter(|_| search.is_grouped());
        if let Some(row) = last {
            let set = row.role.group as usize;
            if search.best_of(set) == Some(row.number) {
                self.0.insert(set, outcomes);
            }
        }
    }
}

fn identified(
    specification: &JobSpecification,
    search: &Search,
    ending: &Ending,
    best: &BestOfGroups,
) -> CompletedJob {
    let mut result = search.result(ending, &Program::current(None));
    let summary = search.summary();
    let group = |set: usize| -> Option<GroupResult> {
        let found = summary.groups[set].best.zip(best.0.get(&set));
        let best = found
            .and_then(|(number, outcomes)| summary.best_point(specification, number, outcomes));
        summary.group(specification, set, best)
    };
    result.groups = (0..summary.groups.len()).filter_map(group).collect();
    CompletedJob { result, history: summary.history }
}

#[cfg(test)]
mod tests;
