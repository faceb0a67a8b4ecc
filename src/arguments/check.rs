//! The arguments of `check`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// Job file (TOML or JSON). It is checked as for `identify` if it has data, otherwise as for
    /// `propagate`
    pub(crate) job: PathBuf,
    /// Check the job as for `propagate`, even if it has data
    #[arg(long)]
    pub(crate) propagate: bool,
    /// Print the estimate as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
