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

impl JobCommand {
    /// Returns what says where the coordinator is.
    pub(crate) fn client(&self) -> ClientArguments {
        let client = match self {
            Self::Submit(SubmitArguments { client, .. })
            | Self::List(JobListArguments { client, .. })
            | Self::Watch(WatchArguments { job: JobArguments { client, .. }, .. })
            | Self::Explain(ExplainArguments { client, .. })
            | Self::Cancel(JobArguments { client, .. })
            | Self::Fetch(FetchArguments { client, .. })
            | Self::Recheck(WatchArguments { job: JobArguments { client, .. }, .. })
            | Self::Prune(PruneArguments { client, .. }) => client,
        };
        client.clone()
    }
}

/// The commands about jobs by the names that they had before; they do the same.
#[derive(Debug, Subcommand)]
pub(crate) enum EarlierCommand {
    /// Same as `osteon job submit`
    #[command(hide = true)]
    Submit(SubmitArguments),
    /// Same as `osteon job list`
    #[command(hide = true)]
    Jobs(JobsArguments),
    /// Same as `osteon job watch`
    #[command(hide = true)]
    Watch(WatchArguments),
    /// Same as `osteon job explain`
    #[command(hide = true)]
    Explain(ExplainArguments),
    /// Same as `osteon job cancel`
    #[command(hide = true)]
    Cancel(JobArguments),
    /// Same as `osteon job fetch`
    #[command(hide = true)]
    Fetch(FetchArguments),
    /// Same as `osteon job recheck`
    #[command(hide = true)]
    Recheck(WatchArguments),
}

impl From<EarlierCommand> for JobCommand {
    fn from(earlier: EarlierCommand) -> Self {
        match earlier {
            EarlierCommand::Submit(arguments) => Self::Submit(arguments),
            EarlierCommand::Jobs(JobsArguments { command: None, list }) => Self::List(list),
            EarlierCommand::Jobs(JobsArguments { command: Some(command), list }) => {
                let JobsCommand::Prune(prune) = command;
                let (client, json) = (prune.client.or(list.client), prune.json || list.json);
                Self::Prune(PruneArguments { client, json, ..prune })
            }
            EarlierCommand::Watch(arguments) => Self::Watch(arguments),
            EarlierCommand::Explain(arguments) => Self::Explain(arguments),
            EarlierCommand::Cancel(arguments) => Self::Cancel(arguments),
            EarlierCommand::Fetch(arguments) => Self::Fetch(arguments),
            EarlierCommand::Recheck(arguments) => Self::Recheck(arguments),
        }
    }
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

/// Arguments of `jobs`, the earlier name of `job list`.
#[derive(Debug, Args)]
pub(crate) struct JobsArguments {
    /// The operation; without one they are listed.
    #[command(subcommand)]
    pub(crate) command: Option<JobsCommand>,
    /// What is listed.
    #[command(flatten)]
    pub(crate) list: JobListArguments,
}

/// Operations of `jobs`.
#[derive(Debug, Subcommand)]
pub(crate) enum JobsCommand {
    /// Delete ended jobs (without options, all of them) and print their ids
    Prune(PruneArguments),
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
