//! The wings of the program: commands and options that nothing else needs. This is the only file that
//! names them, and each is left out with its feature.

use clap::Subcommand;

use crate::arguments::ClientArguments;
use crate::exit_status::CommandFailure;
use crate::prepared_command::PreparedCommand;
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
pub(crate) use self::report::{ReportOption, dispersion_figure, wave_image_figure};
#[cfg(not(feature = "live"))]
pub(crate) use self::without::{PageOptions, RunPageOption};
#[cfg(not(feature = "report"))]
pub(crate) use self::without::{ReportOption, dispersion_figure, wave_image_figure};

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
    /// Prepares the command.
    ///
    /// # Errors
    /// When arguments and environment do not say enough.
    #[cfg_attr(not(feature = "umbridge"), expect(unused_variables, reason = "a report needs none"))]
    pub(crate) fn prepare(
        self,
        context: &ProcessContext,
    ) -> Result<PreparedCommand, CommandFailure> {
        match self {
            #[cfg(feature = "report")]
            Self::Report(arguments) => {
                Ok(PreparedCommand::brief(move || report::report(&arguments)))
            }
            #[cfg(feature = "umbridge")]
            Self::Umbridge(arguments) => umbridge::prepare(*arguments, context),
        }
    }
}

impl ClusterWing {
    /// Prepares the command.
    ///
    /// # Errors
    /// When arguments and environment do not say enough.
    #[cfg_attr(not(feature = "slurm"), expect(unused_variables, reason = "there is no command"))]
    pub(crate) fn prepare(
        self,
        context: &ProcessContext,
    ) -> Result<PreparedCommand, CommandFailure> {
        match self {
            #[cfg(feature = "slurm")]
            Self::Slurm(arguments) => slurm::prepare(arguments, context),
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

    /// Prepares the command.
    ///
    /// # Errors
    /// When arguments and environment do not say enough.
    #[cfg_attr(not(feature = "slurm"), expect(unused_variables, reason = "there is no command"))]
    pub(crate) fn prepare(
        self,
        context: &ProcessContext,
    ) -> Result<PreparedCommand, CommandFailure> {
        match self {
            #[cfg(feature = "slurm")]
            Self::Slurm(arguments) => slurm::prepare_scaling(*arguments, context),
        }
    }
}
