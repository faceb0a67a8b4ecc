//! A job as an ask/tell state machine: which point next, and what its outcomes mean.
//!
//! An identification searches for one set of data after the other, a propagation evaluates one point.
//! Everything here is a function of the specification and of the outcomes told: telling the stored
//! evaluations again rebuilds the same state, to the bit.

use std::sync::Arc;

use osteon_common::data_statistics::kolmogorov_test;
use osteon_common::digest::PathDigest;
use osteon_common::inference::{Conclusions, below_noise_from, meaning};
use osteon_common::job::{Data, JobKind, JobSpecification, Objective};
use osteon_common::outcome::{FailureCounts, Outcome};
use osteon_common::parameters::Point;
use osteon_common::results::{
    BestPoint, DataSummary, EstimatedError, Evaluation, GroupEnding, GroupResult, JobFailure,
    JobResult, Role, Status,
};
use osteon_common::sampling::NominalSampling;
use osteon_common::statistics::{self, Verdict, likelihood_error};
use osteon_common::version::Program;
use thiserror::Error;

use self::identification::Identification;

pub use self::ahead::same_point;

mod advice;
mod ahead;
mod identification;
mod method;
mod one_set;
mod reasons;
#[cfg(test)]
mod tests;

/// What a search wants.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// The outcomes of this point.
    Evaluate(Point),
    /// Nothing more.
    Done(Ending),
}

/// How a job ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ending {
    /// The status.
    pub status: Status,
    /// Of which kind the failure is; `None` with any other status than failed.
    pub failure: Option<JobFailure>,
    /// Why, in a sentence, where the status needs one.
    pub reason: Option<String>,
}

impl Ending {
    /// As a search ends, which fails only where no point is feasible.
    pub fn of_search(status: Status, reason: Option<String>) -> Self {
        let failure = (status == Status::Failed).then_some(JobFailure::NoFeasiblePoint);
        Self { status, failure, reason }
    }
}

/// What the path of a search comes to, its outcomes aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// BLAKE3 digest of the evaluations of the path, 64 hexadecimal digits.
    pub digest: String,
    /// Number of the best evaluation, if a point was feasible; `None` where the data are groups.
    pub best: Option<u64>,
    /// Rows of all evaluations, in order.
    pub history: Vec<Evaluation>,
    /// How the search for each group of the data ended, as far as it went; empty where there are
    /// none.
    pub groups: Vec<GroupEnding>,
}

/// A stored evaluation of another search than this one.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "stored evaluation {number} is at {found:?}, but the search goes to {expected:?}: \
     the store was written by another version of osteon; submit the job again"
)]
pub struct ReplayError {
    /// Number of the evaluation.
    pub number: u64,
    /// The stored point.
    pub found: Box<[f64; 7]>,
    /// Where this search would go, unless it is done.
    pub expected: Option<Box<[f64; 7]>>,
}

#[derive(Debug, Clone)]
enum Plan {
    Identification(Box<Identification>),
    Propagation { told: Option<Verdict> },
}

/// A search under way.
#[derive(Debug, Clone)]
pub struct Search {
    specification: Arc<JobSpecification>,
    plan: Plan,
    digest: PathDigest,
    history: Vec<Evaluation>,
    /// Of the evaluation that a result needs the outcomes of.
    outcomes: Option<Arc<[Outcome]>>,
    /// Of the point asked for, if it was looked at before it is told.
    judged: Option<Judged>,
}

/// What the outcomes of a point say.
#[derive(Debug, Clone)]
struct Judged {
    outcomes: Arc<[Outcome]>,
    verdict: Verdict,
    /// `None` for a propagation.
    cost: Option<f64>,
}

impl Search {
    /// A search of which nothing is known. The specification has passed its check.
    pub fn new(specification: Arc<JobSpecification>) -> Self {
        let plan = match (specification.kind, &specification.data) {
            (JobKind::Identification, Some(_)) => {
                Plan::Identification(Box::new(Identification::new(&specification)))
            }
            // An identification without data has not passed the check.
            (JobKind::Propagation | JobKind::Identification, _) => Plan::Propagation { told: None },
        };
        Self {
            specification,
            plan,
            digest: PathDigest::new(),
            history: Vec::new(),
            outcomes: None,
            judged: None,
        }
    }

    /// Takes the outcomes of a stored evaluation.
    ///
    /// # Errors
    /// When it is at another point than the search asks for; nothing is changed then.
    pub fn replay(
        &mut self,
        point: Point,
        outcomes: Arc<[Outcome]>,
        estimated_error: Option<EstimatedError>,
    ) -> Result<(), ReplayError> {
        self.expects(point)?;
        self.tell(outcomes, estimated_error);
        Ok(())
    }

    /// Whether the search asks for the outcomes of `point`.
    ///
    /// # Errors
    /// When it asks for others, or none.
    pub fn expects(&self, point: Point) -> Result<(), ReplayError> {
        let found = point.0;
        let expected = match self.ask() {
            Step::Evaluate(point) => Some(point.0),
            Step::Done(_) => None,
        };
        if expected.map(|at| at.map(f64::to_bits)) == Some(found.map(f64::to_bits)) {
            return Ok(());
        }
        Err(ReplayError {
            number: self.evaluations(),
            found: found.into(),
            expected: expected.map(Box::new),
        })
    }

    /// The next point, or how the job ends. Asking changes nothing.
    pub fn ask(&self) -> Step {
        match &self.plan {
            Plan::Identification(identification) => match identification.point() {
                Some(point) => Step::Evaluate(point),
                None => Step::Done(identification.ending(&self.specification)),
            },
            Plan::Propagation { told: None } => Step::Evaluate(self.specification.start()),
            Plan::Propagation { told: Some(verdict) } => Step::Done(self.propagated(verdict)),
        }
    }

    /// Takes the outcomes, in index order, of the point asked for, and the estimated errors of the
    /// successes, which decide nothing. Ignored once done.
    pub fn tell(&mut self, outcomes: Arc<[Outcome]>, estimated_error: Option<EstimatedError>) {
        let Step::Evaluate(point) = self.ask() else {
            return;
        };
        let judged = match self.judged.take() {
            Some(judged) if Arc::ptr_eq(&judged.outcomes, &outcomes) => judged,
            _ => self.judge(&point, &outcomes),
        };
        let mut row = Evaluation { estimated_error, ..self.row(point, &judged) };
        let Judged { verdict, outcomes: told, .. } = judged;
        match &mut self.plan {
            Plan::Identification(identification) => {
                row = identification.tell(&self.specification, row, verdict, outcomes);
            }
            Plan::Propagation { told } => {
                *told = Some(verdict);
                self.outcomes = Some(outcomes);
            }
        }
        // What measures a derivative is beside the path.
        if row.role.varied.is_none() {
            self.digest.add_evaluation(&point, &told);
        }
        self.history.push(row);
    }

    /// What the outcomes of the point asked for say.
    fn judge(&self, point: &Point, outcomes: &Arc<[Outcome]>) -> Judged {
        let verdict = Verdict::of(&self.specification.monte_carlo, point, outcomes);
        let cost = match &self.plan {
            Plan::Identification(identification) => {
                Some(identification.cost(&self.specification, &verdict, point, outcomes))
            }
            Plan::Propagation { .. } => None,
        };
        Judged { outcomes: Arc::clone(outcomes), verdict, cost }
    }

    /// What is known of the point asked for before its role is.
    fn row(&self, point: Point, judged: &Judged) -> Evaluation {
        Evaluation {
            number: self.evaluations(),
            role: Role::default(),
            point,
            moments: judged.verdict.moments,
            cost: judged.cost,
            failures: FailureCounts::of(&judged.outcomes),
            estimated_error: None,
        }
    }

    /// Points whose outcomes were told.
    pub fn evaluations(&self) -> u64 {
        self.history.len() as u64
    }

    /// Rows of all evaluations, in order.
    pub fn history(&self) -> &[Evaluation] {
        &self.history
    }

    /// The best feasible evaluation, if there is one: that of the set of data that the search is at.
    /// Of a propagation the only one.
    pub fn best(&self) -> Option<&Evaluation> {
        match &self.plan {
            Plan::Identification(identification) => identification.best(),
            Plan::Propagation { .. } => self.history.first(),
        }
    }

    /// Number of the best evaluation of set number `set` of the data, if the search has come to it and a
    /// point was feasible.
    pub fn best_of(&self, set: usize) -> Option<u64> {
        match &self.plan {
            Plan::Identification(identification) => identification.best_of(set),
            Plan::Propagation { .. } => None,
        }
    }

    /// What the path comes to so far.
    pub fn summary(&self) -> Summary {
        let groups = match &self.plan {
            Plan::Identification(identification) if self.is_grouped() => identification.endings(),
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

    /// What the job leaves, given how it ended, computed by `program`. Of groups,
    /// whose outcomes are in the store only, nothing is known here.
    pub fn result(&self, ending: &Ending, program: &Program) -> JobResult {
        let summary = self.summary();
        let outcomes = match &self.plan {
            Plan::Identification(identification) => identification.best_outcomes(),
            Plan::Propagation { .. } => self.outcomes.as_deref(),
        };
        let best = summary.best.zip(outcomes).and_then(|(number, outcomes)| {
            summary.best_point(&self.specification, number, outcomes)
        });
        summary.result(&self.specification, ending, program, best, Vec::new())
    }

    /// Whether the data are groups.
    pub fn is_grouped(&self) -> bool {
        matches!(self.specification.data, Some(Data::Groups(_)))
    }

    fn propagated(&self, verdict: &Verdict) -> Ending {
        if verdict.feasible {
            return Ending::of_search(Status::Converged, None);
        }
        let reason = self.history.first();
        let reason = reason.map(|row| reasons::failed(row, &self.specification));
        Ending::of_search(Status::Failed, Some(reason.unwrap_or_default()))
    }
}

impl Summary {
    /// The summary of a path without an evaluation.
    pub fn empty() -> Self {
        Self {
            digest: PathDigest::new().finish(),
            best: None,
            history: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Evaluation `number` as a best point, given its outcomes.
    pub fn best_point(
        &self,
        specification: &JobSpecification,
        number: u64,
        outcomes: &[Outcome],
    ) -> Option<BestPoint> {
        let row = self.history.iter().find(|row| row.number == number)?;
        let JobSpecification { monte_carlo, objective, .. } = specification;
        let data = specification.data.as_ref();
        let measured = data.and_then(|data| data.velocities(row.role.group as usize));
        let by_likelihood = measured.filter(|_| *objective == Objective::Likelihood);
        let mut best = BestPoint {
            point: row.point,
            meaning: row.cost.map(|cost| meaning(specification, cost)),
            cost: row.cost,
            penalty: specification.has_priors().then(|| specification.penalty(&row.point)),
            below_noise_from: None,
            cost_error: by_likelihood
                .and_then(|measured| likelihood_error(monte_carlo, &row.point, outcomes, measured)),
            velocity: statistics::estimate(monte_carlo, &row.point, outcomes),
            failure_bias: statistics::failure_bias(monte_carlo, &row.point, outcomes),
            kolmogorov: measured
                .and_then(|measured| kolmogorov_test(measured, outcomes, monte_carlo.sampling)),
            failures: row.failures,
            estimated_error: row.estimated_error,
            outcomes: outcomes.to_vec(),
        };
        let set = row.role.group as usize;
        best.below_noise_from = below_noise_from(specification, set, &best, &self.history);
        Some(best)
    }

    /// What a job with this path leaves, given how it ended, the program that computed it, its best
    /// point, or what was found for its groups.
    pub fn result(
        &self,
        specification: &JobSpecification,
        ending: &Ending,
        program: &Program,
        best: Option<BestPoint>,
        groups: Vec<GroupResult>,
    ) -> JobResult {
        let of_one_set = !matches!(specification.data, Some(Data::Groups(_)));
        let data = specification.data.as_ref().filter(|_| of_one_set);
        let conclusions =
            data.map(|_| Conclusions::of(specification, 0, best.as_ref(), &self.history));
        let searched = self.history.iter().filter(|row| row.role.varied.is_none());
        JobResult {
            status: ending.status,
            failure: ending.failure,
            reason: ending.reason.clone(),
            digest: self.digest.clone(),
            best,
            data: data.map(|data| DataSummary::of(data, 0)),
            conclusions: conclusions.unwrap_or_default(),
            groups,
            objective: specification.objective,
            search: specification.search,
            evaluations: searched.count() as u64,
            realizations: specification.monte_carlo.realizations,
            seed: specification.monte_carlo.seed,
            sampling: specification.monte_carlo.sampling,
            scrambles: specification.monte_carlo.scrambles,
            control_variate: specification.monte_carlo.control_variate,
            solver: specification.setup.solver,
            nominal: NominalSampling::of(&specification.setup),
            picking: specification.setup.picking,
            program: program.clone(),
        }
    }

    /// What was found for group number `set` of the data, given its best point; `None` if its search
    /// has not ended.
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
            data: DataSummary::of(data, set),
            conclusions: Conclusions::of(specification, set, best.as_ref(), &self.history),
            best,
        })
    }
}
