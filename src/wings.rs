//! The wings of the program: commands and options that nothing else needs. This is the only file that
//! names them, and each is left out with its feature.

use std::fmt::Debug;
use std::pin::Pin;

use clap::Subcommand;

use crate::arguments::ClientArguments;
use crate::exit_status::{CommandFailure, ExitStatus};
use crate::process_context::ProcessContext;

#[cfg(any(feature = "live", feature = "umbridge"))]
mod host_name;
#[cfg(feature = "live")]
mod live;
#[cfg(feature = "report")]
mod report;
#[cfg(feature = "slurm")]
mod slurm;
#[cfg(feature = "umbridge")]
mod umbridge;
#[cfg(not(all(feature = "live", feature = "report")))]
mod without;

#[cfg(feature = "live")]
pub(crate) use self::live::{PageOptions, RunPageOption};
#[cfg(feature = "report")]
pub(crate) use self::report::ReportOption;
#[cfg(not(feature = "report"))]
pub(crate) use self::without::ReportOption;
#[cfg(not(feature = "live"))]
pub(crate) use self::without::{PageOptions, RunPageOption};

/// A command of a wing, with environment and defaults resolved.
pub(crate) trait WingCommand: Debug {
    /// Returns the default log level.
    fn default_log_level(&self) -> &'static str {
        "warn"
    }

    /// Returns what is said of what an interrupted command leaves behind; `None` if it treats
    /// interruptions itself, or ends at once.
    fn left_by_interruption(&self) -> Option<&'static str> {
        None
    }

    /// Executes the command.
    fn perform(self: Box<Self>) -> Performance;
}

/// The execution of a command.
pub(crate) type Performance = Pin<Box<dyn Future<Output = Result<ExitStatus, CommandFailure>>>>;

type ResolvedWing = Result<Box<dyn WingCommand>, CommandFailure>;

/// Commands about a job and its results.
#[derive(Debug, Subcommand)]
pub(crate) enum JobWing {
    /// Write a report of results: a page for a browser, figures as SVG, their numbers as CSV
    #[cfg(feature = "report")]
    Report(report::ReportArguments),
    /// Serve a job's model to samplers and other programs by the UM-Bridge protocol, until interrupted
    #[cfg(feature = "umbridge")]
    Umbridge(Box<umbridge::UmbridgeArguments>),
}

/// Commands about a cluster.
#[derive(Debug, Subcommand)]
pub(crate) enum ClusterWing {
    /// Print batch scripts for Slurm
    #[cfg(feature = "slurm")]
    Slurm(slurm::SlurmArguments),
}

/// Commands about workers.
#[derive(Debug, Subcommand)]
pub(crate) enum WorkerWing {
    /// Submit workers to Slurm as long as jobs wait for them, until interrupted
    ///
    /// Workers end by themselves when they have had no work for the idle timeout. Those that wait in
    /// Slurm's queue while there is no work are cancelled after the same time.
    #[cfg(feature = "slurm")]
    Slurm(Box<slurm::ScalingArguments>),
}

impl JobWing {
    /// Resolves the arguments.
    #[cfg_attr(not(feature = "umbridge"), expect(unused_variables, reason = "a report needs none"))]
    pub(crate) fn resolve(self, context: &ProcessContext) -> ResolvedWing {
        match self {
            #[cfg(feature = "report")]
            Self::Report(arguments) => Ok(Box::new(arguments)),
            #[cfg(feature = "umbridge")]
            Self::Umbridge(arguments) => umbridge::resolve(*arguments, context),
        }
    }
}

impl ClusterWing {
    /// Resolves the arguments.
    #[cfg_attr(not(feature = "slurm"), expect(unused_variables, reason = "there is no command"))]
    pub(crate) fn resolve(self, context: &ProcessContext) -> ResolvedWing {
        match self {
            #[cfg(feature = "slurm")]
            Self::Slurm(arguments) => slurm::resolve(arguments, context),
        }
    }
}

impl WorkerWing {
    /// Returns what says where the coordinator is.
    pub(crate) fn client_mut(&mut self) -> &mut ClientArguments {
        match *self {
            #[cfg(feature = "slurm")]
            Self::Slurm(ref mut arguments) => &mut arguments.client,
        }
    }

    /// Resolves the arguments.
    #[cfg_attr(not(feature = "slurm"), expect(unused_variables, reason = "there is no command"))]
    pub(crate) fn resolve(self, context: &ProcessContext) -> ResolvedWing {
        match self {
            #[cfg(feature = "slurm")]
            Self::Slurm(arguments) => slurm::resolve_scaling(*arguments, context),
        }
    }
}
