//! Writes the parts of `docs/` that follow from the program.

use anyhow::{Result, bail};

use crate::{cargo, cargo_command};

/// Writes the tables of docs/job-files.md, the JSON Schemas, and the types of the sections in Python, by
/// the tests that compare them.
pub(crate) fn write(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask reference");
    }
    let tests = ["--test", "documentation", "--test", "result_files", "--test", "python_sections"];
    let names = ["tables_of_keys", "schemas_are_the_committed", "sections_of_python"];
    let arguments = [&["test", "--workspace"][..], &tests, &["--"], &names].concat();
    cargo(cargo_command(&arguments).env("OSTEON_WRITE_DOCS", "1"))
}
