//! `schema`: the JSON Schema of a file, for other programs.

use osteon_common::{job_file, report};

use crate::arguments::{SchemaArguments, SchemaFile};
use crate::ending::{Ending, Failure, stdout_failure};
use crate::output;
use crate::resolved::Format;

/// Prints the schema.
pub(super) fn print(arguments: &SchemaArguments) -> Result<Ending, Failure> {
    let text = match arguments.file {
        SchemaFile::Job => job_file::schema(),
        SchemaFile::Result => report::schema(),
    };
    output::stdout(Format::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(Ending::Done)
}
