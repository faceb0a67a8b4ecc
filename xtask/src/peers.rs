//! Compares the overhead of osteon with that of other systems for many short tasks.

use std::env;
use std::ffi::OsString;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command, output};

/// Builds the benchmark of fleets, and runs `benches/peers/run.py` with `words`. Uses `python3`, or
/// the interpreter named by the variable `PYTHON`.
pub(crate) fn bench(words: &[String]) -> Result<()> {
    cargo(&mut cargo_command(&["bench", "--package", "osteon", "--bench", "fleet", "--no-run"]))?;
    let version = ["run", "--quiet", "--release", "--package", "osteon", "--", "--version"];
    let version = output(&mut cargo_command(&version))?;
    let python = env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let mut command = Command::new(python);
    command.current_dir(root()).arg("benches/peers/run.py").args(words);
    command.arg("--environment").arg(programs()?.with_file_name("peers"));
    command.args(["--version", version.trim(), "--", env!("CARGO")]);
    command.args(["bench", "--quiet", "--package", "osteon", "--bench", "fleet", "--"]);
    cargo(&mut command).context(
        "the comparison needs Python 3.10 or later with its module venv, the packages of \
         benches/peers/requirements.txt, and xargs",
    )
}
