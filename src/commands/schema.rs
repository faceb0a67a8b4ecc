//! `schema`: the JSON Schema of a file, for other programs.

use osteon_files::{job_file, report};

use crate::arguments::{SchemaArguments, SchemaFile};
use crate::exit_status::{ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Prints the schema.
pub(super) fn print(arguments: &SchemaArguments) -> Ended {
    let text = match arguments.file {
        SchemaFile::Job => job_file::schema(),
        SchemaFile::Result => report::schema(),
    };
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
