//! The results of an ended job, as a coordinator sends them.

use osteon_common::job::JobSpecification;
use osteon_common::outcome::Outcome;
use osteon_common::posterior::PosteriorDraw;
use osteon_common::results::{Evaluation, Status};
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

/// What was sampled for one set of data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SetSamples {
    /// Outcomes at its best point; empty if there is none, and for groups whose outcomes together with those
    /// before exceed the number that one evaluation may have.
    pub outcomes: Vec<Outcome>,
    /// Draws from its posterior.
    pub draws: Vec<PosteriorDraw>,
}
