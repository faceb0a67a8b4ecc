//! The results of an ended job, as a coordinator sends them.

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobResult};

/// Specification, result and history of an ended job.
#[derive(Debug, Clone, PartialEq)]
pub struct Fetched {
    /// The specification, with defaults filled in.
    pub specification: JobSpecification,
    /// The result, with the outcomes of the best point. For groups, it has the outcomes of each
    /// group's best point, unless together they exceed the number that one evaluation may have.
    pub result: JobResult,
    /// The evaluations, in order.
    pub history: Vec<Evaluation>,
}
