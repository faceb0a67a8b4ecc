//! What goes to stdout: one trait, one implementation for people and one for programs.

pub(crate) mod json;
mod text;
mod times;

use std::io::{self, Write};
use std::path::Path;

use osteon_common::case::Setup;
use osteon_common::job::JobSpecification;
use osteon_common::report::{ResultFile, Solver};
use osteon_common::sampling::NominalSampling;
use osteon_proto::v1::{
    BackupEnd, ExpelledWorker, JobSnapshot, ListWorkersResponse, WorkerSnapshot,
};
use osteon_solver::check::Check;
use osteon_solver::{Arrival, Failure};

use crate::resolved::Format;

/// A result to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownResult<'a> {
    /// The specification.
    pub(crate) specification: &'a JobSpecification,
    /// The result.
    pub(crate) result: &'a ResultFile,
    /// Where the files are, if they are kept.
    pub(crate) directory: Option<&'a Path>,
}

/// A simulation to show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShownSimulation<'a> {
    /// What was simulated.
    pub(crate) setup: &'a Setup,
    /// What was picked.
    pub(crate) arrival: &'a Result<Arrival, Failure>,
    /// The file of the traces, if there is one.
    pub(crate) traces: Option<&'a Path>,
    /// The same case solved in other ways, if that was asked for.
    pub(crate) check: Option<&'a Check>,
}

/// The object `solver` of one solved case: the sampling that decided, where it is known.
fn solver_of(setup: &Setup, arrival: Option<&Arrival>) -> Solver<Option<f64>> {
    let error = arrival.map(|arrival| arrival.estimated_error);
    let mut solver = Solver::new(&setup.solver, NominalSampling::of(setup), error);
    if let (Some(used), Solver::Exact { band, period, pairs, pairs_computed, looks, .. }) =
        (arrival.and_then(|arrival| arrival.looks), &mut solver)
    {
        (*band, *period) = (Some(used.last.band), Some(used.last.period));
        (*pairs, *pairs_computed) = (Some(used.last.pairs), Some(used.pairs_computed));
        *looks = Some(used.count);
    }
    solver
}

/// One way to print. Every method writes whole lines.
pub(crate) trait Output {
    /// The result of a job.
    fn result(&mut self, result: &ShownResult<'_>) -> io::Result<()>;
    /// The outcome of one case.
    fn simulation(&mut self, simulation: &ShownSimulation<'_>) -> io::Result<()>;
    /// The id of an accepted job.
    fn submitted(&mut self, job: &str) -> io::Result<()>;
    /// All jobs, and the workers that are expelled.
    fn jobs(&mut self, jobs: &[JobSnapshot], expelled: &[ExpelledWorker]) -> io::Result<()>;
    /// The attached workers, those that went last, and those that are expelled.
    fn workers(
        &mut self,
        workers: &ListWorkersResponse,
        expelled: &[ExpelledWorker],
    ) -> io::Result<()>;
    /// One worker as of now.
    fn worker(&mut self, worker: &WorkerSnapshot) -> io::Result<()>;
    /// That a coordinator serves, or why it does not.
    fn health(&mut self, not_serving: Option<&str>) -> io::Result<()>;
    /// The copy of a store in a file.
    fn backup(&mut self, file: &Path, copy: &BackupEnd) -> io::Result<()>;
    /// The jobs that are forgotten.
    fn pruned(&mut self, jobs: &[String]) -> io::Result<()>;
    /// One job as of now.
    fn snapshot(&mut self, snapshot: &JobSnapshot) -> io::Result<()>;
    /// A text that is the same for people and programs: a case file, a URL.
    fn verbatim(&mut self, text: &str) -> io::Result<()>;
}

/// The output of `format` on stdout.
pub(crate) fn stdout(format: Format) -> Box<dyn Output> {
    on(format, Box::new(io::stdout()))
}

/// The output of `format` on `writer`.
pub(crate) fn on<'a>(format: Format, writer: Box<dyn Write + 'a>) -> Box<dyn Output + 'a> {
    match format {
        Format::Text => Box::new(text::TextOutput::new(writer)),
        Format::Json => Box::new(json::JsonOutput::new(writer)),
    }
}

#[cfg(test)]
mod tests;
