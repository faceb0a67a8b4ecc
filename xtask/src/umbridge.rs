//! Tests `osteon umbridge` by the suite and the clients of UM-Bridge (`tests/umbridge/run.py`).

use anyhow::{Context as _, Result, bail};

use crate::places::programs;
use crate::process::{cargo, cargo_command};
use crate::python;

/// `cargo xtask test umbridge`.
pub(crate) fn test(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask test umbridge");
    }
    cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
    let mut command = python::python("tests/umbridge/run.py");
    command.arg("--osteon").arg(programs()?.join("osteon"));
    command.arg("--work").arg(programs()?.with_file_name("umbridge"));
    cargo(&mut command).context(
        "the tests of UM-Bridge need Python 3.10 or later with its module venv, and the packages of \
         tests/umbridge/requirements.txt",
    )
}
