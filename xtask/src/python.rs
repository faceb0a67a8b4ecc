//! Tests of the gRPC API with an external Python client, generated and run by
//! `tests/python/run.py`.

use std::env;
use std::ffi::OsString;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::{cargo, cargo_command, programs, root};

/// Builds the program and runs the tests of `tests/python`, or those in `words`. Uses `python3`, or
/// the interpreter named by the variable `PYTHON`; fails if there is none.
pub(crate) fn test(words: &[String]) -> Result<()> {
    cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
    let programs = programs()?;
    let python = env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let mut command = Command::new(python);
    command.current_dir(root()).arg("tests/python/run.py");
    command
        .arg("--osteon")
        .arg(programs.join("osteon"))
        .arg("--work")
        .arg(programs.with_file_name("python"));
    cargo(command.args(words)).context(
        "the client in Python needs Python 3.10 or later with its module venv (on Debian the \
         packages python3 and python3-venv), and the packages of tests/python/requirements.txt",
    )
}
