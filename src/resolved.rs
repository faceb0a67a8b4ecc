//! The options of runs with environment and defaults resolved; files have not been read yet.

use std::net::SocketAddr;
use std::path::PathBuf;

use osteon_common::job::JobKind;

use crate::arguments::{JobFileArguments, ProgressFormat, RunArguments, VerbosityArguments};
use crate::exit_status::CommandFailure;
use crate::process_context::{Locating, ProcessContext, RunLocation, WORKERS_DEFAULT};
use crate::wings::ReportOption;

/// Format of the output on stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputFormat {
    /// Text for people.
    Text,
    /// JSON for programs.
    Json,
}

/// One run of a job, from its job file to its result.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// Kind of the job.
    pub(crate) kind: JobKind,
    /// The job file.
    pub(crate) job: JobFileArguments,
    /// Where the job is computed.
    pub(crate) location: RunLocation,
    /// Name of the job for display; may be empty.
    pub(crate) name: String,
    /// Directory for the results, if they are kept.
    pub(crate) out: Option<PathBuf>,
    /// Whether a report is written beside them.
    pub(crate) report: ReportOption,
    /// Address of its live page, if it has one.
    pub(crate) page: Option<SocketAddr>,
    /// Whether a text says what usual errors of the setup would move.
    pub(crate) budget: bool,
    /// Output format.
    pub(crate) format: OutputFormat,
    /// Format of the progress.
    pub(crate) progress: ProgressFormat,
    /// How much is shown.
    pub(crate) verbosity: VerbosityArguments,
}

impl Run {
    /// Resolves the arguments.
    ///
    /// # Errors
    /// When arguments and environment do not say where the job is computed.
    pub(crate) fn resolve(
        kind: JobKind,
        arguments: RunArguments,
        context: &ProcessContext,
    ) -> Result<Self, CommandFailure> {
        let RunArguments { job, threads, coordinator, credentials, out, report, .. } = arguments;
        let page = arguments.page.address();
        // A run with a page is computed on this machine.
        let workers = arguments.workers.or(page.map(|_| WORKERS_DEFAULT));
        Ok(Self {
            kind,
            job,
            location: context.locate(Locating { workers, threads, coordinator, credentials })?,
            name: arguments.name.unwrap_or_default(),
            out,
            report,
            page,
            budget: !arguments.no_budget && !arguments.json,
            format: format(arguments.json),
            progress: arguments.progress,
            verbosity: arguments.verbosity,
        })
    }
}

/// Returns JSON or text.
pub(crate) fn format(json: bool) -> OutputFormat {
    if json { OutputFormat::Json } else { OutputFormat::Text }
}

#[cfg(test)]
mod tests;
