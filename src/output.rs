//! Output to stdout: one trait, with one implementation for people and one for programs.

pub(crate) mod json;
mod text;
mod times;

use std::io::{self, Write};
use std::path::Path;

use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_files::report::ResultFile;
use osteon_local::cost::JobCost;
use osteon_local::design::Design;
use osteon_local::modes::BandModes;
use osteon_local::observations::ObservationSummary;
use osteon_local::simulation::SolvedCase;
use osteon_proto::v1::{
    BackupEnd, BannedWorker, ExplainResponse, JobSnapshot, ListWorkersResponse, WorkerSnapshot,
};
use osteon_solver::Isa;

use crate::doctor::Diagnosis;
use crate::resolved::OutputFormat;
use crate::usual_shifts::UsualShift;

pub(crate) use self::text::wrapped;
pub(crate) use self::times::utc;

/// How much of a result is shown to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Detail {
    /// How the run ended, and its numbers.
    Summary,
    /// Also what they mean.
    #[default]
    Usual,
    /// Also how they were computed.
    Full,
}

/// A result to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownResult<'a> {
    /// The specification.
    pub(crate) specification: &'a JobSpecification,
    /// The result.
    pub(crate) result: &'a ResultFile,
    /// What usual errors of the setup would move, the largest first; empty if that is not shown.
    pub(crate) usual_shifts: &'a [UsualShift],
    /// Directory of the result files, if they are kept.
    pub(crate) directory: Option<&'a Path>,
    /// How much of it is shown; programs always receive all.
    pub(crate) detail: Detail,
}

/// A simulation to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownSimulation<'a> {
    /// The case, solved.
    pub(crate) solved: &'a SolvedCase,
    /// The file of the traces, if it was written.
    pub(crate) traces: Option<&'a Path>,
}

/// The estimated cost of a job to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownCost<'a> {
    /// The job.
    pub(crate) specification: &'a JobSpecification,
    /// Its cost.
    pub(crate) cost: &'a JobCost,
    /// The instruction set on which it was measured.
    pub(crate) isa: Isa,
}

/// The observables of a job's realizations to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownObservations<'a> {
    /// The point of the realizations.
    pub(crate) point: &'a Point,
    /// Their summary.
    pub(crate) summary: &'a ObservationSummary,
    /// The file with a row for each, if it was written.
    pub(crate) file: Option<&'a Path>,
}

/// The guided waves of a bone to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownModes<'a> {
    /// The waves at each frequency.
    pub(crate) modes: &'a BandModes,
    /// The directory with a row for each, if it was written.
    pub(crate) directory: Option<&'a Path>,
}

/// What further measurements would tell, to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownDesign<'a> {
    /// The design.
    pub(crate) design: &'a Design,
    /// Whether people are shown every measurement, or the best for each quantity.
    pub(crate) ranked: bool,
}

/// An output format. Every method writes whole lines.
pub(crate) trait Output {
    /// Prints the result of a job.
    fn result(&mut self, result: &ShownResult<'_>) -> io::Result<()>;
    /// Prints the outcome of one case.
    fn simulation(&mut self, simulation: &ShownSimulation<'_>) -> io::Result<()>;
    /// Prints the guided waves of a bone.
    fn modes(&mut self, modes: &ShownModes<'_>) -> io::Result<()>;
    /// Prints what a job will do and cost.
    fn cost(&mut self, cost: &ShownCost<'_>) -> io::Result<()>;
    /// Prints the observables of a job's realizations.
    fn observations(&mut self, observations: &ShownObservations<'_>) -> io::Result<()>;
    /// Prints what further measurements would tell.
    fn design(&mut self, design: &ShownDesign<'_>) -> io::Result<()>;
    /// Prints the id of an accepted job.
    fn submitted(&mut self, job: &str) -> io::Result<()>;
    /// Prints all jobs, and the workers that are banned.
    fn jobs(&mut self, jobs: &[JobSnapshot], banned: &[BannedWorker]) -> io::Result<()>;
    /// Prints the attached workers, those that left last, and those that are banned.
    fn workers(&mut self, workers: &ListWorkersResponse, banned: &[BannedWorker])
    -> io::Result<()>;
    /// Prints the current state of one worker.
    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()>;
    /// Prints what was found on this machine.
    fn diagnoses(&mut self, diagnoses: &[Diagnosis]) -> io::Result<()>;
    /// Prints that a coordinator serves, or why it does not.
    fn health(&mut self, not_serving: Option<&str>) -> io::Result<()>;
    /// Prints the file of a copy of a store.
    fn backup(&mut self, file: &Path, copy: &BackupEnd) -> io::Result<()>;
    /// Prints what decides how fast a job is.
    fn explanation(&mut self, explained: &ExplainResponse) -> io::Result<()>;
    /// Prints the ids of the deleted jobs.
    fn pruned(&mut self, jobs: &[String]) -> io::Result<()>;
    /// Prints the current state of one job.
    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()>;
    /// Prints a text that is the same for people and programs: a case file, a URL.
    fn verbatim(&mut self, text: &str) -> io::Result<()>;
}

/// Returns the output of `format` on stdout.
pub(crate) fn stdout(format: OutputFormat) -> Box<dyn Output> {
    to_writer(format, Box::new(io::stdout()))
}

/// Returns the output of `format` on `writer`.
pub(crate) fn to_writer<'a>(
    format: OutputFormat,
    writer: Box<dyn Write + 'a>,
) -> Box<dyn Output + 'a> {
    match format {
        OutputFormat::Text => Box::new(text::TextOutput::new(writer)),
        OutputFormat::Json => Box::new(json::JsonOutput::new(writer)),
    }
}

#[cfg(test)]
mod tests;
