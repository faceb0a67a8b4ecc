//! Writes the parts of `docs/` that follow from the program.

use anyhow::{Result, bail};

use crate::process::{cargo, cargo_command};

/// Writes the tables of docs/job-files.md, docs/cli.md and the JSON Schemas, by the tests that compare
/// them.
pub(crate) fn write(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask generate reference");
    }
    let mut arguments = vec!["test", "--workspace"];
    for test in ["documentation", "result_files", "cli_help"] {
        arguments.extend(["--test", test]);
    }
    arguments.push("--");
    arguments.extend(["tables_of_keys", "schemas_are_the_committed", "the_page_of_commands"]);
    cargo(cargo_command(&arguments).env("OSTEON_WRITE_DOCS", "1"))
}
