//! Completion of a large evaluation, which takes so long that it is not done by the core.
//!
//! Outcomes are gathered, moments computed and the digest continued, over millions of realizations.
//! Meanwhile the core would answer nobody. So it hands the evaluation and its search out
//! ([`Effect::Complete`](crate::core::effect::Effect::Complete)), and gets a record to store back.

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

/// A completed evaluation.
#[derive(Debug, Clone)]
pub struct Completed {
    pub(crate) job: JobId,
    /// Number of the attempt at it.
    pub(crate) attempt: u64,
    /// The record, and whether the evaluations stored after it belong to another path; `None` if it was
    /// not settled.
    pub(crate) record: Option<(EvaluationRecord, bool)>,
    /// The search after it.
    pub(crate) after: Box<Search>,
}

impl Completion {
    /// Completes the evaluation. Takes a while, and depends on nothing else.
    pub fn run(self) -> Completed {
        let Self { job, evaluation, search: mut after } = self;
        let attempt = evaluation.attempt;
        let (outcomes, estimated_error) = thread::scope(|scope| {
            let errors = scope.spawn(|| evaluation.estimated_error());
            let outcomes = evaluation.outcomes(after.has_decays());
            (outcomes, errors.join().unwrap_or_else(|panic| resume_unwind(panic)))
        });
        let record = outcomes.map(|outcomes| {
            let is_last = evaluation.diverges_from_store(&outcomes);
            let (number, point) = (evaluation.number, evaluation.point);
            let workers = evaluation.workers.iter().cloned().collect();
            after.tell(outcomes.clone(), estimated_error);
            let record =
                EvaluationRecord { job, number, point, outcomes, estimated_error, workers };
            (record, is_last)
        });
        Completed { job, attempt, record, after }
    }
}

/// Attempts are numbered over all jobs.
impl PartialEq for Completion {
    fn eq(&self, other: &Self) -> bool {
        self.evaluation.attempt == other.evaluation.attempt
    }
}

/// Attempts are numbered over all jobs, and each is completed once.
impl PartialEq for Completed {
    fn eq(&self, other: &Self) -> bool {
        self.attempt == other.attempt
    }
}
