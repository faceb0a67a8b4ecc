//! `completions` and `man`: what shells and `man` know of the program, from its own definition.

use crate::arguments::{CompletionArguments, ManArguments};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::manual;
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Prints the script of a shell.
pub(super) fn completions(arguments: &CompletionArguments) -> Ended {
    let script = manual::completions(arguments.shell);
    output::stdout(OutputFormat::Text).verbatim(&script).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Writes the manual pages.
pub(super) fn write(arguments: &ManArguments) -> Ended {
    let directory = &arguments.directory;
    manual::write(directory).map_err(|error| {
        let context = format!("cannot write manual pages to {}", directory.display());
        CommandFailure::unusable_path(error, context)
    })?;
    Ok(ExitStatus::Done)
}
