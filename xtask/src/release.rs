//! Makes the files of a release. What is done and tried is in Python, in `deploy/release`.

use anyhow::{Context as _, Result};

use crate::deploy::cargo_deb;
use crate::places::programs;
use crate::process::cargo;
use crate::python::{WHEELS, python};

/// What CI makes: the files for one processor, built quickly.
pub(crate) const TRIAL: &[&str] = &["release", "x86_64", "--profile", "dev", "--dirty"];

/// Makes all files of a release, or those for the processors that `words` name, and tries them. Uses
/// `python3`, or the interpreter named by the variable `PYTHON`.
pub(crate) fn make(words: &[String]) -> Result<()> {
    let mut command = python("deploy/release/release.py");
    command.arg("--work").arg(programs()?.with_file_name("release-work"));
    command.arg("--wheels").arg(programs()?.with_file_name(WHEELS));
    command.arg("--cargo-deb").arg(cargo_deb()?);
    cargo(command.args(words)).context(
        "a release needs Python 3.10 or later with its module venv, dpkg-deb and dpkg-shlibdeps (on \
         Debian the packages python3, python3-venv and dpkg-dev), and the packages of \
         deploy/release/requirements.txt",
    )
}
