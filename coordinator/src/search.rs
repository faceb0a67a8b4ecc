//! A job as an ask/tell state machine: which point next, and what its outcomes mean.
//!
//! An identification asks its method of search, a propagation evaluates one point. Everything here
//! is a function of the specification and of the outcomes told: telling the stored evaluations
//! again rebuilds the same state, to the bit.

use std::sync::Arc;

use osteon_common::digest::PathDigest;
use osteon_common::job::{Data, JobKind, JobSpecification, SearchMethod};
use osteon_common::outcome::{FailureCounts, Outcome};
use osteon_common::parameters::Point;
use osteon_common::results::{BestPoint, EstimatedError, Evaluation, JobResult, Moments, Status};
use osteon_common::statistics::{self, Verdict};
use thiserror::Error;

use crate::ask::{Ask, Stop};
use crate::search_box::{SearchBox, Side};
use crate::simplex::RESTARTS_MAX;

use self::method::Method;

pub(crate) use self::ahead::same_point;

mod ahead;
mod method;
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
    /// Why, in a sentence, where the status needs one.
    pub reason: Option<String>,
}

/// What the path of a search comes to, its outcomes aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// BLAKE3 digest of the evaluations of the path, 64 hexadecimal digits.
    pub digest: String,
    /// Number of the best evaluation, if a point was feasible.
    pub best: Option<u64>,
    /// Rows of the history, in order.
    pub history: Vec<Evaluation>,
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

/// The lowest finite cost so far; of a propagation its only evaluation.
#[derive(Debug, Clone)]
struct Best {
    row: Evaluation,
    outcomes: Arc<[Outcome]>,
}

#[derive(Debug, Clone)]
enum Plan {
    Identification { method: Method, data: Moments },
    Propagation { told: Option<Verdict> },
}

/// A search under way.
#[derive(Debug, Clone)]
pub struct Search {
    specification: Arc<JobSpecification>,
    space: SearchBox,
    plan: Plan,
    digest: PathDigest,
    history: Vec<Evaluation>,
    best: Option<Best>,
}

impl Search {
    /// A search of which nothing is known. The specification has passed its check.
    pub fn new(specification: Arc<JobSpecification>) -> Self {
        let space = SearchBox::new(specification.parameters);
        let plan = match (specification.kind, &specification.data) {
            (JobKind::Identification, Some(data)) => {
                let data = data_moments(data);
                Plan::Identification {
                    method: Method::new(&specification.search, space, data),
                    data,
                }
            }
            // An identification without data has not passed the check.
            (JobKind::Propagation | JobKind::Identification, _) => Plan::Propagation { told: None },
        };
        let mut search = Self {
            specification,
            space,
            plan,
            digest: PathDigest::new(),
            history: Vec::new(),
            best: None,
        };
        search.refuse_inadmissible();
        search
    }

    /// Takes the outcomes of a stored evaluation.
    ///
    /// # Errors
    /// When it is at another point than the search asks for; nothing is changed then.
    pub fn retell(
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
            Plan::Identification { method, .. } => match method.ask() {
                Ask::At(at) => Step::Evaluate(self.space.point(at)),
                Ask::Stopped(stop) => Step::Done(self.ending(stop)),
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
        let verdict = Verdict::of(&self.specification.monte_carlo, &point, &outcomes);
        let cost = match &mut self.plan {
            Plan::Identification { method, data } => {
                let cost = verdict.cost(*data);
                method.tell(cost, verdict.moments);
                Some(cost)
            }
            Plan::Propagation { told } => {
                *told = Some(verdict);
                None
            }
        };
        self.digest.add_evaluation(&point, &outcomes);
        let row = Evaluation {
            number: self.evaluations(),
            point,
            moments: verdict.moments,
            cost,
            failures: FailureCounts::of(&outcomes),
            estimated_error,
        };
        self.history.push(row);
        let feasible = row.cost.is_none_or(f64::is_finite);
        if feasible && self.best.as_ref().is_none_or(|best| row.cost < best.row.cost) {
            self.best = Some(Best { row, outcomes });
        }
        self.refuse_inadmissible();
    }

    /// Points whose outcomes were told.
    pub fn evaluations(&self) -> u64 {
        self.history.len() as u64
    }

    /// Rows of the history, in order.
    pub fn history(&self) -> &[Evaluation] {
        &self.history
    }

    /// The row with the lowest finite cost, if a point was feasible; of equal ones the first. Of
    /// a propagation the only one.
    pub fn best(&self) -> Option<&Evaluation> {
        self.best.as_ref().map(|best| &best.row)
    }

    /// What the path comes to so far.
    pub fn summary(&self) -> Summary {
        Summary {
            digest: self.digest.finish(),
            best: self.best().map(|row| row.number),
            history: self.history.clone(),
        }
    }

    /// What the job leaves, given how it ended, computed by `version` of the program.
    pub fn result(&self, ending: &Ending, version: &str) -> JobResult {
        let outcomes = self.best.as_ref().map(|best| &*best.outcomes);
        self.summary().result(&self.specification, ending, version, outcomes)
    }

    /// Refuses points until the method is done or asks for an admissible one.
    fn refuse_inadmissible(&mut self) {
        if let Plan::Identification { method, .. } = &mut self.plan {
            method.refuse_inadmissible(&self.space);
        }
    }

    fn ending(&self, stop: Stop) -> Ending {
        let (status, reason) = match stop {
            Stop::CostReached => (Status::Converged, None),
            Stop::Settled => (Status::Converged, self.out_of_reach()),
            Stop::EvaluationsUsedUp if self.best().is_none() => {
                (Status::Failed, Some(self.no_feasible_point()))
            }
            Stop::EvaluationsUsedUp => (Status::MaxEvaluations, None),
            Stop::RestartsUsedUp => {
                let reason = format!(
                    "the simplex collapsed, was restarted {RESTARTS_MAX} times and was still \
                     finding better points; run on from the best point"
                );
                (Status::MaxEvaluations, Some(reason))
            }
            Stop::Infeasible => (Status::Failed, Some(self.no_feasible_point())),
        };
        Ending { status, reason }
    }

    fn propagated(&self, verdict: &Verdict) -> Ending {
        if verdict.feasible {
            return Ending { status: Status::Converged, reason: None };
        }
        let reason = self.history.first().map_or_else(String::new, |row| self.failed(row));
        Ending { status: Status::Failed, reason: Some(reason) }
    }

    /// Why a search that settled has no lower cost, where its method knows.
    fn out_of_reach(&self) -> Option<String> {
        let best =
            self.best().filter(|_| self.specification.search.method == SearchMethod::Newton)?;
        let on_bounds = self.space.on_bounds(&best.point);
        let on_bounds: Vec<String> = on_bounds
            .iter()
            .map(|(parameter, side)| match side {
                Side::Lower => format!("{} on its lower bound", parameter.name()),
                Side::Upper => format!("{} on its upper bound", parameter.name()),
            })
            .collect();
        let (where_it_is, cure) = if on_bounds.is_empty() {
            (String::new(), "free more parameters")
        } else {
            (format!(" ({})", on_bounds.join(", ")), "widen the bounds, or free more parameters")
        };
        Some(format!(
            "settled at a cost of {:.3e}, above cost_tolerance {:?}: no point near the best one{} \
             matches the data better; {}",
            best.cost.unwrap_or(f64::NAN),
            self.specification.search.cost_tolerance,
            where_it_is,
            cure
        ))
    }

    fn no_feasible_point(&self) -> String {
        if self.best().is_some() {
            return "every velocity of the points evaluated is the same: their coefficient of \
                    variation has no logarithm; raise [monte_carlo] realizations"
                .to_owned();
        }
        match self.history.first() {
            None => "no feasible point: every point tried is inadmissible; \
                     change the starts or the bounds of [parameters]"
                .to_owned(),
            Some(row) => format!(
                "no feasible point among the {} evaluated; at the first {}; change the starts of \
                 [parameters], raise [solver] refinement, or allow a larger \
                 [monte_carlo] max_failed_fraction",
                self.evaluations(),
                self.failed(row)
            ),
        }
    }

    fn failed(&self, row: &Evaluation) -> String {
        let kinds: Vec<String> =
            row.failures.iter().map(|(kind, count)| format!("{count} {}", kind.name())).collect();
        format!(
            "{} of {} realizations failed ({}); max_failed_fraction is {}",
            row.failures.total(),
            self.specification.monte_carlo.realizations,
            kinds.join(", "),
            self.specification.monte_carlo.max_failed_fraction
        )
    }
}

impl Summary {
    /// The summary of a path without an evaluation.
    pub fn empty() -> Self {
        Self { digest: PathDigest::new().finish(), best: None, history: Vec::new() }
    }

    /// What a job with this path leaves, given how it ended, the version of the program that
    /// computed it, and the outcomes of the best evaluation.
    pub fn result(
        &self,
        specification: &JobSpecification,
        ending: &Ending,
        version: &str,
        outcomes: Option<&[Outcome]>,
    ) -> JobResult {
        let row = self.history.iter().find(|row| Some(row.number) == self.best);
        JobResult {
            status: ending.status,
            reason: ending.reason.clone(),
            digest: self.digest.clone(),
            best: row.zip(outcomes).map(|(row, outcomes)| BestPoint {
                point: row.point,
                cost: row.cost,
                velocity: statistics::estimate(&specification.monte_carlo, &row.point, outcomes),
                failures: row.failures,
                estimated_error: row.estimated_error,
                outcomes: outcomes.to_vec(),
            }),
            data: match (specification.kind, &specification.data) {
                (JobKind::Identification, Some(data)) => Some(data_moments(data)),
                (JobKind::Propagation | JobKind::Identification, _) => None,
            },
            evaluations: self.history.len() as u64,
            realizations: specification.monte_carlo.realizations,
            seed: specification.monte_carlo.seed,
            sampling: specification.monte_carlo.sampling,
            scrambles: specification.monte_carlo.scrambles,
            control_variate: specification.monte_carlo.control_variate,
            solver: specification.setup.solver,
            picking: specification.setup.picking,
            version: version.to_owned(),
        }
    }
}

fn data_moments(data: &Data) -> Moments {
    match data {
        Data::Velocities(velocities) => statistics::moments(velocities)
            .unwrap_or(Moments { mean: f64::NAN, coefficient_of_variation: f64::NAN }),
        Data::Moments { mean, coefficient_of_variation } => {
            Moments { mean: *mean, coefficient_of_variation: *coefficient_of_variation }
        }
    }
}
