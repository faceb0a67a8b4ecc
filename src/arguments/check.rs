//! The arguments of `check`.

use clap::Args;

use super::JobFileArguments;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// Check the job as for `propagate`, even if it has data. Without this option it is checked as
    /// for `identify` if it has data
    #[arg(long)]
    pub(crate) propagate: bool,
    /// Print the estimate as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
