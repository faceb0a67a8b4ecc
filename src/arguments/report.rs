//! The command line of `report`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArguments {
    /// Directory of results. Several are laid over each other and compared with the first
    #[arg(value_name = "DIR", required = true, num_args = 1..=16)]
    pub(crate) directories: Vec<PathBuf>,
    /// Directory for the report [default: the folder report in the first DIR]
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
