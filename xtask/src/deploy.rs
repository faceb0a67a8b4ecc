//! Checks of what is in `deploy/`: the Helm chart, the units of systemd, the Debian package, the
//! image. The tests themselves are in Python, beside what they test, and run by `deploy/check.py`.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command};
use crate::tools::install;

/// The version of cargo-deb that builds the package.
const CARGO_DEB: &str = "3.8.0";

/// Builds the program and runs the tests of `deploy/`, or those in the files that `words` name. Uses
/// `python3`, or the interpreter named by the variable `PYTHON`.
pub(crate) fn check(words: &[String]) -> Result<()> {
    cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
    let cargo_deb = cargo_deb()?;
    let programs = programs()?;
    let python = env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let mut command = Command::new(python);
    command.current_dir(root()).arg("deploy/check.py");
    command.arg("--osteon").arg(programs.join("osteon"));
    command.arg("--work").arg(programs.with_file_name("deploy"));
    command.arg("--cargo-deb").arg(cargo_deb);
    cargo(command.args(words)).context(
        "the checks of deploy/ need Python 3.10 or later with its module venv (on Debian the \
         packages python3 and python3-venv), and the packages of deploy/requirements.txt",
    )
}

/// Installs the program that builds Debian packages, and returns its path.
pub(crate) fn cargo_deb() -> Result<PathBuf> {
    // Without optimisation it builds in a third of the time, and one package is made soon enough.
    install("cargo-deb", CARGO_DEB, &["--debug", "--no-default-features"])
}
