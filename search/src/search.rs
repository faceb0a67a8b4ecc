//! A job as an ask/tell state machine: which point to evaluate next, and what its outcomes mean.
//!
//! An identification searches for one set of data after another; a propagation evaluates one point.
//! Everything here is a function of the specification and of the outcomes passed in: replaying the
//! stored evaluations rebuilds the same state, to the bit.

use std::sync::Arc;

use osteon_common::data_statistics::{FittedMoments, form_tests, kolmogorov_test};
use osteon_common::digest::PathDigest;
use osteon_common::inference::{
    Agreement, Conclusions, ModelAtPoint, agreement, below_noise_from, meaning,
};
use osteon_common::job::{Data, JobKind, JobSpecification, Objective};
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::FailureCounts;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::results::{
    BestPoint, DataSummary, EstimatedError, Evaluation, EvaluationRole, GroupEnding, GroupResult,
    JobResult, Status,
};
use osteon_common::sampling::NominalSampling;
use osteon_common::statistics::{self, PointStatistics, likelihood_error};
use osteon_common::version::Program;
use thiserror::Error;

use self::identification::IdentificationSearch;
use crate::posterior::posterior;

pub use self::branch::Branch;
pub use self::candidates::same_point;
pub use self::ending::Ending;

mod advice;
mod branch;
mod candidates;
mod dataset_search;
mod differences;
mod ending;
mod identification;
mod method;
mod reasons;
#[cfg(test)]
mod tests;

/// Answer of a search when it is asked for its next step.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Evaluate this point and pass its outcomes to [`Search::tell`].
    Evaluate(Point),
    /// The search has ended.
    Done(Ending),
}

/// Summary of a search path, without the outcomes.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// BLAKE3 digest of the evaluations of the path, 64 hexadecimal digits.
    pub digest: String,
    /// Number of the best evaluation, if a point was feasible; `None` if the data are groups.
    pub best: Option<u64>,
    /// Rows of all evaluations, in order.
    pub history: Vec<Evaluation>,
    /// Endings of the searches for the groups of the data that have ended; empty if there are no
    /// groups.
    pub groups: Vec<GroupEnding>,
}

/// A stored evaluation belongs to a different search.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "stored evaluation {number} is at {found}, but the search {}: the store was written by another \
     version of osteon; submit the job again",
    .expected.as_ref().map_or_else(|| "has ended".to_owned(), |point| format!("goes to {point}"))
)]
pub struct ReplayError {
    /// Number of the evaluation.
    pub number: u64,
    /// The stored point.
    pub found: Box<Point>,
    /// The point that this search asks for; `None` if it has ended.
    pub expected: Option<Box<Point>>,
}

#[derive(Debug, Clone)]
enum SearchPlan {
    Identification(Box<IdentificationSearch>),
    Propagation { statistics: Option<PointStatistics> },
}

/// The state of a job's search.
#[derive(Debug, Clone)]
pub struct Search {
    specification: Arc<JobSpecification>,
    plan: SearchPlan,
    digest: PathDigest,
    history: Vec<Evaluation>,
    /// Outcomes of the evaluation that a propagation's result needs.
    outcomes: Option<Outcomes>,
    /// Assessment of the pending point, if it was made before its outcomes were passed to
    /// [`Search::tell`].
    assessment: Option<Assessment>,
}

/// Moments and cost of a point, computed from its outcomes.
#[derive(Debug, Clone)]
pub struct Assessment {
    /// Number of the set of data that the cost is for.
    set: u32,
    outcomes: Outcomes,
    statistics: PointStatistics,
    /// Cost, infinite at an infeasible point; `None` for a propagation.
    pub cost: Option<f64>,
}

impl Search {
    /// Creates a search without evaluations. The specification must have passed its check.
    pub fn new(specification: Arc<JobSpecification>) -> Self {
        let plan = match (specification.kind, &specification.data) {
            (JobKind::Identification, Some(_)) => {
                SearchPlan::Identification(Box::new(IdentificationSearch::new(&specification)))
            }
            // An identification without data does not pass the check.
            (JobKind::Propagation | JobKind::Identification, _) => {
                SearchPlan::Propagation { statistics: None }
            }
        };
        Self {
            specification,
            plan,
            digest: PathDigest::new(),
            history: Vec::new(),
            outcomes: None,
            assessment: None,
        }
    }

    /// Replays a stored evaluation.
    ///
    /// # Errors
    /// If it is at a different point from the one that the search asks for; nothing is changed
    /// then.
    pub fn replay(
        &mut self,
        point: Point,
        outcomes: Outcomes,
        estimated_error: Option<EstimatedError>,
    ) -> Result<(), ReplayError> {
        self.expects(point)?;
        self.tell(outcomes, estimated_error);
        Ok(())
    }

    /// Checks that `point` is the one that the search asks for.
    ///
    /// # Errors
    /// If the search asks for a different point, or for none.
    pub fn expects(&self, point: Point) -> Result<(), ReplayError> {
        let expected = match self.ask() {
            Step::Evaluate(point) => Some(point),
            Step::Done(_) => None,
        };
        if expected.map(|at| at.bits()) == Some(point.bits()) {
            return Ok(());
        }
        Err(ReplayError {
            number: self.evaluations(),
            found: Box::new(point),
            expected: expected.map(Box::new),
        })
    }

    /// Returns the next point, or how the job ended. Does not change the state.
    pub fn ask(&self) -> Step {
        match &self.plan {
            SearchPlan::Identification(identification) => match identification.point() {
                Some(point) => Step::Evaluate(point),
                None => Step::Done(identification.ending(&self.specification)),
            },
            SearchPlan::Propagation { statistics: None } => {
                Step::Evaluate(self.specification.start())
            }
            SearchPlan::Propagation { statistics: Some(statistics) } => {
                Step::Done(self.propagated(statistics))
            }
        }
    }

    /// Takes the outcomes, in index order, of the pending point, and the estimated errors of the
    /// successes, which do not influence the search. Ignored once done.
    pub fn tell(&mut self, outcomes: Outcomes, estimated_error: Option<EstimatedError>) {
        let Step::Evaluate(point) = self.ask() else {
            return;
        };
        let assessment = match self.assessment.take() {
            Some(known) if known.is_of(&outcomes) => self.of_this_set(&point, known),
            _ => self.assess(&point, &outcomes),
        };
        let mut row = Evaluation { estimated_error, ..self.row(point, &assessment) };
        let Assessment { statistics, outcomes: assessed, .. } = assessment;
        match &mut self.plan {
            SearchPlan::Identification(identification) => {
                row = identification.tell(&self.specification, row, statistics, outcomes);
            }
            SearchPlan::Propagation { statistics: known } => {
                *known = Some(statistics);
                self.outcomes = Some(outcomes);
            }
        }
        // Points that only measure what a change moves are not part of the path.
        if !row.role.is_beside_best() {
            self.digest.add(&point, &assessed);
        }
        self.history.push(row);
    }

    /// Computes moments and cost of any point, for the set of data that is searched, from its outcomes.
    pub fn assess(&self, point: &Point, outcomes: &Outcomes) -> Assessment {
        let statistics = PointStatistics::new(&self.specification.monte_carlo, point, outcomes);
        let cost = match &self.plan {
            SearchPlan::Identification(identification) => {
                Some(identification.cost(&self.specification, &statistics, point, outcomes))
            }
            SearchPlan::Propagation { .. } => None,
        };
        Assessment { set: self.set(), outcomes: outcomes.clone(), statistics, cost }
    }

    /// Returns the assessment of the pending point from one for any set of data.
    fn of_this_set(&self, point: &Point, known: Assessment) -> Assessment {
        let Assessment { set, outcomes, statistics, .. } = &known;
        match &self.plan {
            SearchPlan::Identification(identification) if *set != self.set() => {
                let cost = identification.cost(&self.specification, statistics, point, outcomes);
                Assessment { set: self.set(), cost: Some(cost), ..known }
            }
            _ => known,
        }
    }

    /// Returns the number of the set of data that the pending point is for.
    fn set(&self) -> u32 {
        match &self.plan {
            SearchPlan::Identification(identification) => identification.present().set(),
            SearchPlan::Propagation { .. } => 0,
        }
    }

    /// Returns the history row of the pending point with everything but its role and estimated
    /// error.
    fn row(&self, point: Point, assessment: &Assessment) -> Evaluation {
        Evaluation {
            number: self.evaluations(),
            role: EvaluationRole::default(),
            point,
            moments: assessment.statistics.moments,
            observables: assessment.statistics.observables,
            cost: assessment.cost,
            failures: FailureCounts::from_outcomes(&assessment.outcomes),
            estimated_error: None,
        }
    }

    /// Returns the number of points evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.history.len() as u64
    }

    /// Returns the rows of all evaluations, in order.
    pub fn history(&self) -> &[Evaluation] {
        &self.history
    }

    /// Returns the best feasible evaluation for the current set of data, if there is one; of a
    /// propagation, its only evaluation.
    pub fn best(&self) -> Option<&Evaluation> {
        match &self.plan {
            SearchPlan::Identification(identification) => identification.best(),
            SearchPlan::Propagation { .. } => self.history.first(),
        }
    }

    /// Returns the number of the best evaluation for set number `set` of the data, if the search
    /// has reached that set and a point was feasible.
    pub fn best_of(&self, set: usize) -> Option<u64> {
        match &self.plan {
            SearchPlan::Identification(identification) => identification.best_of(set),
            SearchPlan::Propagation { .. } => None,
        }
    }

    /// Summarizes the path so far.
    pub fn summary(&self) -> Summary {
        let groups = match &self.plan {
            SearchPlan::Identification(identification) if self.is_grouped() => {
                identification.endings()
            }
            _ => Vec::new(),
        };
        let best = self.best().filter(|_| !self.is_grouped());
        Summary {
            digest: self.digest.finish(),
            best: best.map(|row| row.number),
            history: self.history.clone(),
            groups,
        }
    }

    /// Returns the result of the job, given how it ended, computed by `program`. Results of groups
    /// are left out: their outcomes are only in the store.
    pub fn result(&self, ending: &Ending, program: &Program) -> JobResult {
        let summary = self.summary();
        let outcomes = match &self.plan {
            SearchPlan::Identification(identification) => identification.best_outcomes(),
            SearchPlan::Propagation { .. } => self.outcomes.as_ref(),
        };
        let best = summary.best.zip(outcomes).and_then(|(number, outcomes)| {
            summary.best_point(&self.specification, number, outcomes)
        });
        summary.result(&self.specification, ending, program, best, Vec::new())
    }

    /// Returns the observables that are needed of each realization.
    pub fn observables(&self) -> ObservableSet {
        self.specification.observables()
    }

    /// Returns whether the data are groups.
    pub fn is_grouped(&self) -> bool {
        self.specification.data.as_ref().is_some_and(Data::is_grouped)
    }

    fn propagated(&self, statistics: &PointStatistics) -> Ending {
        if statistics.feasible {
            return Ending::from_search(Status::Converged, None);
        }
        let reason = self.history.first();
        let reason = reason.map(|row| reasons::failed(row, &self.specification));
        Ending::from_search(Status::Failed, Some(reason.unwrap_or_default()))
    }
}

impl Assessment {
    /// Returns whether it is that of these very outcomes.
    fn is_of(&self, outcomes: &Outcomes) -> bool {
        self.outcomes.are_copies_of(outcomes)
    }
}

impl Summary {
    /// Returns the summary of a path without evaluations.
    pub fn empty() -> Self {
        Self {
            digest: PathDigest::new().finish(),
            best: None,
            history: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Returns evaluation `number` as a best point, given its outcomes.
    pub fn best_point(
        &self,
        specification: &JobSpecification,
        number: u64,
        outcomes: &Outcomes,
    ) -> Option<BestPoint> {
        let row = self.history.iter().find(|row| row.number == number)?;
        let JobSpecification { monte_carlo, objective, .. } = specification;
        let data = specification.data.as_ref();
        let given = data.and_then(|data| data.set(row.role.group as usize));
        let measured = given.map(|set| set.velocities);
        // The test holds for independent velocities with no scatter but the model's, and for a
        // model that was fitted to them; without a search, the best point is a mere draw.
        let tested = given.filter(|set| {
            specification.is_searched() && set.subjects.is_none() && set.repeatability == 0.0
        });
        let by_likelihood = measured.filter(|_| *objective == Objective::Likelihood);
        let velocity = statistics::estimate(monte_carlo, &row.point, outcomes);
        let observables = statistics::observable_estimates(monte_carlo, outcomes);
        let set = row.role.group as usize;
        let agreement = velocity.as_ref().and_then(|velocity| {
            let observables = &observables;
            let model = ModelAtPoint { point: &row.point, velocity, observables, outcomes };
            agreement(specification, set, model)
        });
        // Moments that the search could not match are not fitted.
        let fitted = match (objective, agreement) {
            (Objective::Likelihood, _) | (_, Some(Agreement { matched: true, .. })) => {
                FittedMoments::from_specification(specification)
            }
            _ => FittedMoments::Neither,
        };
        let mut best = BestPoint {
            point: row.point,
            meaning: row.cost.map(|cost| meaning(specification, cost)),
            cost: row.cost,
            penalty: specification.has_priors().then(|| specification.penalty(&row.point)),
            below_noise_from: None,
            cost_error: by_likelihood
                .and_then(|measured| likelihood_error(monte_carlo, &row.point, outcomes, measured)),
            velocity,
            observables,
            failure_bias: statistics::failure_bias(monte_carlo, &row.point, outcomes),
            kolmogorov: tested.and_then(|set| {
                kolmogorov_test(set.velocities, outcomes, monte_carlo.sampling, fitted)
            }),
            form: tested.and_then(|set| form_tests(set.velocities, outcomes, monte_carlo.sampling)),
            failures: row.failures,
            estimated_error: row.estimated_error,
            outcomes: outcomes.to_vec(),
        };
        best.below_noise_from = below_noise_from(specification, set, &best, &self.history);
        Some(best)
    }

    /// Returns the result of a job with this path, given how it ended, the program that computed
    /// it, and its best point or the results of its groups.
    pub fn result(
        &self,
        specification: &JobSpecification,
        ending: &Ending,
        program: &Program,
        best: Option<BestPoint>,
        groups: Vec<GroupResult>,
    ) -> JobResult {
        let is_grouped = specification.data.as_ref().is_some_and(Data::is_grouped);
        let data = specification.data.as_ref().filter(|_| !is_grouped);
        let conclusions = data.map(|_| self.conclusions(specification, 0, best.as_ref()));
        let searched = self.history.iter().filter(|row| row.role.is_of_search());
        JobResult {
            status: ending.status,
            failure: ending.failure,
            reason: ending.reason.clone(),
            digest: self.digest.clone(),
            best,
            data: data.map(|data| DataSummary::from_data(data, 0)),
            conclusions: conclusions.unwrap_or_default(),
            groups,
            pooled: is_grouped && specification.groups.pooled,
            objective: specification.objective,
            search: specification.search,
            evaluations: searched.count() as u64,
            realizations: specification.monte_carlo.realizations,
            seed: specification.monte_carlo.seed,
            sampling: specification.monte_carlo.sampling,
            scrambles: specification.monte_carlo.scrambles,
            control_variate: specification.monte_carlo.control_variate,
            solver: specification.setup.solver,
            nominal: NominalSampling::from_setup(&specification.setup),
            picking: specification.setup.picking,
            program: program.clone(),
            integrity: None,
        }
    }

    /// Returns the result for group number `set` of the data, given its best point; `None` if its
    /// search has not ended.
    pub fn group(
        &self,
        specification: &JobSpecification,
        set: usize,
        best: Option<BestPoint>,
    ) -> Option<GroupResult> {
        let data = specification.data.as_ref()?;
        let ending = self.groups.get(set)?;
        Some(GroupResult {
            name: data.names().nth(set)?.to_owned(),
            status: ending.status,
            reason: ending.reason.clone(),
            data: DataSummary::from_data(data, set),
            conclusions: self.conclusions(specification, set, best.as_ref()),
            best,
        })
    }

    fn conclusions(
        &self,
        specification: &JobSpecification,
        set: usize,
        best: Option<&BestPoint>,
    ) -> Conclusions {
        Conclusions {
            posterior: posterior(specification, set, best, &self.history),
            ..Conclusions::new(specification, set, best, &self.history)
        }
    }
}
