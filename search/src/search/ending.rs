//! How a job ends.

use osteon_common::results::{JobFailure, Status};

/// Ending of a job.
#[derive(Debug, Clone, PartialEq)]
pub struct Ending {
    /// Final status of the job.
    pub status: Status,
    /// Kind of the failure; `None` unless the status is failed.
    pub failure: Option<JobFailure>,
    /// Reason as a sentence, where the status needs one.
    pub reason: Option<String>,
}

impl Ending {
    /// Creates the ending of a search, which fails only if no point is feasible.
    pub fn from_search(status: Status, reason: Option<String>) -> Self {
        let failure = (status == Status::Failed).then_some(JobFailure::NoFeasiblePoint);
        Self { status, failure, reason }
    }
}
