//! The commands about jobs.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use super::{ClientArguments, JobFileArguments, age, job_name, request_id};

/// The commands about jobs.
#[derive(Debug, Subcommand)]
pub(crate) enum JobCommand {
    /// Submit a job to a coordinator and print its id
    Submit(SubmitArguments),
    /// List the jobs of a coordinator
    List(JobListArguments),
    /// Follow a job until it ends
    ///
    /// The maximum number of evaluations shown includes the evaluations for the derivatives at the
    /// best point, one for each free parameter.
    Watch(WatchArguments),
    /// Explain why a job is not faster, and what would make it faster
    Explain(ExplainArguments),
    /// Cancel a job
    Cancel(JobArguments),
    /// Write the results of an ended job to a directory
    Fetch(FetchArguments),
    /// Compute an ended job again without a host that was banned later, and print whether a bit has changed
    Recheck(WatchArguments),
    /// Delete ended jobs (without options, all of them) and print their ids
    Prune(PruneArguments),
}

/// Arguments of `submit`.
#[derive(Debug, Args)]
pub(crate) struct SubmitArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Submit a propagation instead of an identification
    #[arg(long)]
    pub(crate) propagate: bool,
    /// Id of this submission: repeating it returns the same job and does not create a second one
    /// (at most 256 bytes)
    #[arg(long, value_name = "ID", value_parser = request_id)]
    pub(crate) request_id: Option<String>,
    /// Name of the job, shown by `osteon job list` and in logs (at most 256 bytes)
    #[arg(long, value_name = "TEXT", value_parser = job_name)]
    pub(crate) name: Option<String>,
    /// Priority among your own jobs, 0 to 9: jobs of higher priority run first
    #[arg(long, value_name = "P", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=i64::from(osteon_common::limits::PRIORITY_MAX)))]
    pub(crate) priority: u32,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `job list`.
#[derive(Debug, Args)]
pub(crate) struct JobListArguments {
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `job prune`.
#[derive(Debug, Args)]
pub(crate) struct PruneArguments {
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Delete only jobs that ended longer ago than this: number and unit, e.g. 90d (s, min, h or d)
    #[arg(long, value_name = "AGE", value_parser = age)]
    pub(crate) older_than: Option<Duration>,
    /// Keep the N jobs that ended last
    #[arg(long, value_name = "N")]
    pub(crate) keep_last: Option<u64>,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of commands about one job.
#[derive(Debug, Args)]
pub(crate) struct JobArguments {
    /// Id of the job
    #[arg(value_name = "ID")]
    pub(crate) job: String,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
}

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(crate) struct WatchArguments {
    /// The job and its coordinator.
    #[command(flatten)]
    pub(crate) job: JobArguments,
    /// Print one JSON object per line
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(crate) struct ExplainArguments {
    /// Id of the job
    #[arg(value_name = "ID")]
    pub(crate) job: String,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `fetch`.
#[derive(Debug, Args)]
pub(crate) struct FetchArguments {
    /// Id of the job
    #[arg(value_name = "ID")]
    pub(crate) job: String,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Directory for the results
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
}
