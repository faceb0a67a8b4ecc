//! Arguments of commands about the program and its machine.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use clap_complete::Shell;

use super::ClientArguments;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArguments {
    /// Also examine this directory as that of a coordinator's store: free space, and the time of a
    /// durable write
    #[arg(long, value_name = "DIR")]
    pub(crate) store: Option<PathBuf>,
    /// Also ask this coordinator.
    #[command(flatten)]
    pub(crate) client: ClientArguments,
    /// Print the findings as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(crate) struct DemoArguments {
    /// Directory for the example's job and velocities, the results and the report
    #[arg(value_name = "DIR", default_value = "osteon-demo")]
    pub(crate) directory: PathBuf,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionArguments {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    pub(crate) shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManArguments {
    /// Directory for the pages; it is created if it is absent
    #[arg(value_name = "DIR")]
    pub(crate) directory: PathBuf,
}

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArguments {
    /// `job`: job files; `result`: result.json and the output of a run with --json
    #[arg(value_enum, value_name = "FILE")]
    pub(crate) file: SchemaFile,
}

/// Arguments of `materials`.
#[derive(Debug, Args)]
pub(crate) struct MaterialsArguments {
    /// Print values and reference of this material alone
    #[arg(value_name = "NAME")]
    pub(crate) name: Option<String>,
    /// Print values and references as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `cite`.
#[derive(Debug, Args)]
pub(crate) struct CiteArguments {
    /// Job or case file, or the directory of a job's results or result.json in it: adds the sources of its
    /// materials; a result also the version that computed it
    #[arg(value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,
}

/// A file that has a schema.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum SchemaFile {
    /// A job file.
    #[value(help = None)]
    Job,
    /// `result.json`.
    #[value(help = None)]
    Result,
}

/// How much a run shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Args)]
pub(crate) struct VerbosityArguments {
    /// Show a short summary of the result, and no progress. Warnings and errors are still shown
    #[arg(long, short)]
    pub(crate) quiet: bool,
    /// Show each evaluation on stderr, and with the result how it was computed
    #[arg(long, short, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
}
