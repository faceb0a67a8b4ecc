//! Identification of this program, for users and for results.

use std::path::PathBuf;
use std::sync::LazyLock;

use anyhow::Context as _;
use osteon_common::version::{NUMERICS_REVISION, Program, RESULT_SCHEMA, VERSION};

use crate::exit_status::CommandFailure;

/// The commit from which it was built; `None` if it was built outside a repository.
pub(crate) const COMMIT: Option<&str> = option_env!("OSTEON_BUILD_COMMIT");

/// Returns version, numerics and commit of this program.
pub(crate) fn current() -> Program {
    Program::current(COMMIT)
}

/// Returns the text that `--version` prints after the name.
pub(crate) fn version_line() -> &'static str {
    static LINE: LazyLock<String> = LazyLock::new(|| {
        let commit = COMMIT.unwrap_or("unknown");
        format!(
            "{VERSION} (commit {commit}, numerics {NUMERICS_REVISION}, result schema {RESULT_SCHEMA})"
        )
    });
    &LINE
}

/// Returns the path of this program, from which workers are started.
///
/// # Errors
/// If the system does not tell it.
pub(crate) fn executable() -> Result<PathBuf, CommandFailure> {
    std::env::current_exe()
        .context("cannot find this program to start workers")
        .map_err(CommandFailure::Failed)
}
