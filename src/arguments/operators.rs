//! Options of the commands for those who run a coordinator.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{ClientArguments, probe_seconds};
use crate::wings::WorkerWing;

/// The commands about workers.
#[derive(Debug, Subcommand)]
pub(crate) enum WorkerCommand {
    /// List the workers of a coordinator
    List(WorkerListArguments),
    /// Drain a worker: it receives no new batches, completes or returns those it holds, and exits
    Drain(DrainArguments),
    /// Lift the ban of a host whose machine has been repaired, so that its workers may attach again
    Unban(UnbanArguments),
    /// Commands of wings.
    #[command(flatten)]
    Wing(WorkerWing),
}

/// The commands about a running coordinator.
#[derive(Debug, Subcommand)]
pub(crate) enum CoordinatorCommand {
    /// Check whether a coordinator is serving: exit code 0 if it is, otherwise 1
    Health(HealthArguments),
    /// Copy the store of a coordinator while it runs
    Backup(BackupArguments),
}

impl WorkerCommand {
    /// Returns what says where the coordinator is.
    pub(super) fn client_mut(&mut self) -> &mut ClientArguments {
        match self {
            Self::List(WorkerListArguments { client, .. })
            | Self::Drain(DrainArguments { client, .. })
            | Self::Unban(UnbanArguments { client, .. }) => client,
            Self::Wing(command) => command.client_mut(),
        }
    }
}

/// Arguments of `worker list`.
#[derive(Debug, Args)]
pub(crate) struct WorkerListArguments {
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `worker unban`.
#[derive(Debug, Args)]
pub(crate) struct UnbanArguments {
    /// The host, as `osteon worker list` lists it
    #[arg(value_name = "HOST")]
    pub(crate) host: String,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
}

/// Arguments of `worker drain`.
#[derive(Debug, Args)]
pub(crate) struct DrainArguments {
    /// Number of the worker, as `osteon worker list` lists it
    #[arg(value_name = "NUMBER")]
    pub(crate) worker: u64,
    /// The coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the output as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `coordinator health`.
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

/// Arguments of `coordinator backup`.
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
