//! Tests of the commands for Slurm on a real Slurm, by `slurm/test/run.py`.

use std::env;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command};
use crate::terminal::say;

/// Word by which the tests are skipped where there is no Slurm.
pub(crate) const IF_INSTALLED: &str = "--if-installed";
/// What the tests need.
const INSTALL: &str = "Slurm is not installed; on Debian: apt-get install \
                       --no-install-recommends slurm-wlm munge";

/// Builds the program and runs the tests, or those in `words`. Uses `python3`, or the interpreter
/// named by the variable `PYTHON`.
pub(crate) fn test(words: &[String]) -> Result<()> {
    let optional = words.iter().any(|word| word == IF_INSTALLED);
    if !is_installed("slurmctld") {
        match optional {
            true => return say(&format!("not tested: {INSTALL}")),
            false => anyhow::bail!("{INSTALL}"),
        }
    }
    cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
    let python = env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let mut command = Command::new(python);
    command.current_dir(root()).env("PYTHONDONTWRITEBYTECODE", "1");
    command.arg("slurm/test/run.py").arg("--osteon").arg(programs()?.join("osteon"));
    command.args(words.iter().filter(|word| *word != IF_INSTALLED));
    cargo(&mut command).context("the tests on Slurm did not pass (they need Python 3.10 or later)")
}

/// Returns whether a program is on the path, or where Debian keeps daemons.
fn is_installed(program: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    let mut places: Vec<_> = env::split_paths(&path).collect();
    places.push(Path::new("/usr/sbin").to_owned());
    places.iter().any(|place| place.join(program).is_file())
}
