//! Options of the commands for those who run a coordinator.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{ClientArguments, probe_seconds};
use crate::wings::WorkersWing;

/// Arguments of `workers`.
#[derive(Debug, Args)]
pub(crate) struct WorkersArguments {
    /// The operation; without one they are listed.
    #[command(subcommand)]
    pub(crate) command: Option<WorkersCommand>,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Operations on workers.
#[derive(Debug, Subcommand)]
pub(crate) enum WorkersCommand {
    /// Drain a worker: it receives no new batches, completes or returns those it holds, and exits
    Drain(DrainArguments),
    /// Lift the ban of a host whose machine has been repaired, so that its workers may attach again
    Unban(UnbanArguments),
    /// Operations of wings.
    #[command(flatten)]
    Wing(WorkersWing),
}

/// Arguments of `workers unban`.
#[derive(Debug, Args)]
pub(crate) struct UnbanArguments {
    /// The host, as `osteon workers` lists it
    #[arg(value_name = "HOST")]
    pub(crate) host: String,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
}

/// Arguments of `workers drain`.
#[derive(Debug, Args)]
pub(crate) struct DrainArguments {
    /// Number of the worker, as `osteon workers` lists it
    #[arg(value_name = "NUMBER")]
    pub(crate) worker: u64,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `health`.
#[derive(Debug, Args)]
pub(crate) struct HealthArguments {
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Maximum time to wait for the answer (seconds, 0.1 to 60)
    #[arg(long, value_name = "S", default_value = "5", value_parser = probe_seconds)]
    pub(crate) timeout: f64,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `backup`.
#[derive(Debug, Args)]
pub(crate) struct BackupArguments {
    /// Directory in which the copy is written as osteon.sqlite; that file must not exist
    #[arg(value_name = "DIR")]
    pub(crate) directory: PathBuf,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
