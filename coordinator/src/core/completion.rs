//! Completion of an evaluation that takes so long that it is not done by the core.
//!
//! Outcomes are gathered, moments computed and the digest continued, over millions of realizations; or the search
//! draws a batch of a posterior, for seconds. Meanwhile the core would answer nobody. So it hands the evaluation and its search out
//! ([`Effect::Complete`](crate::core::effect::Effect::Complete)), and gets back first a record, which is
//! stored meanwhile, and then the search.

use std::panic::resume_unwind;
use std::thread;

use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::JobId;
use crate::store::EvaluationRecord;
use osteon_search::Search;

/// A settled evaluation that is to be completed.
#[derive(Debug, Clone)]
pub struct Completion {
    pub(crate) job: JobId,
    pub(crate) evaluation: Box<PendingEvaluation>,
    /// The search that asked for it.
    pub(crate) search: Box<Search>,
}

/// The outcomes of a settled evaluation, to be stored while the search takes them in.
#[derive(Debug, Clone)]
pub struct Gathered {
    pub(crate) job: JobId,
    /// Number of the attempt at it.
    pub(crate) attempt: u64,
    pub(crate) record: EvaluationRecord,
    /// See [`Store::put_evaluation`](crate::store::Store::put_evaluation).
    pub(crate) deletes_later: bool,
}

/// A completed evaluation.
#[derive(Debug, Clone)]
pub struct Completed {
    pub(crate) job: JobId,
    /// Number of the attempt at it.
    pub(crate) attempt: u64,
    /// The search, which has taken it in.
    pub(crate) search: Box<Search>,
}

impl Completion {
    /// Completes the evaluation, and calls `gathered` before the search has taken it in. Takes a while,
    /// and depends on nothing else.
    #[expect(clippy::expect_used, reason = "the reactor hands out settled evaluations only")]
    pub fn run(self, gathered: impl FnOnce(Gathered)) -> Completed {
        let Self { job, evaluation, mut search } = self;
        let (number, attempt, point) = (evaluation.number, evaluation.attempt, evaluation.point);
        let outcomes = evaluation.outcomes(search.observables()).expect("a settled evaluation");
        let (estimated_error, assessment) = thread::scope(|scope| {
            // The record needs the estimated errors but not the moments, so it is sent to the store first.
            let assessed = scope.spawn(|| search.assess(&point, &outcomes));
            let estimated_error = evaluation.estimated_error();
            let deletes_later = evaluation.diverges_from_store(&outcomes);
            let (outcomes, workers) = (outcomes.clone(), evaluation.workers.iter().cloned());
            let workers = workers.collect();
            let record =
                EvaluationRecord { job, number, point, outcomes, estimated_error, workers };
            gathered(Gathered { job, attempt, record, deletes_later });
            (estimated_error, assessed.join().unwrap_or_else(|panic| resume_unwind(panic)))
        });
        drop(evaluation);
        search.anticipate(assessment);
        search.tell(outcomes, estimated_error);
        Completed { job, attempt, search }
    }
}

/// Attempts are numbered over all jobs.
impl PartialEq for Completion {
    fn eq(&self, other: &Self) -> bool {
        self.evaluation.attempt == other.evaluation.attempt
    }
}

/// Attempts are numbered over all jobs, and each is gathered once.
impl PartialEq for Gathered {
    fn eq(&self, other: &Self) -> bool {
        self.attempt == other.attempt
    }
}

/// Attempts are numbered over all jobs, and each is completed once.
impl PartialEq for Completed {
    fn eq(&self, other: &Self) -> bool {
        self.attempt == other.attempt
    }
}
