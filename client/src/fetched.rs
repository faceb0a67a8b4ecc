//! The results of an ended job, as a coordinator sends them.

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, SetSamples, Status};
use osteon_files::report::ResultFile;

/// Specification, result and history of an ended job.
#[derive(Debug, Clone, PartialEq)]
pub struct Fetched {
    /// The specification, with defaults filled in.
    pub specification: JobSpecification,
    /// How the job ended.
    pub status: Status,
    /// Why it ended so, as a sentence, where the status needs one.
    pub reason: Option<String>,
    /// The result.
    pub result: ResultFile,
    /// The evaluations, in order.
    pub history: Vec<Evaluation>,
    /// The samples of each set of data: one, or one for each group.
    pub samples: Vec<SetSamples>,
}
