//! What is tested in Python: the package `osteon` (`python/check.py`), and the gRPC API with an external
//! client (`tests/python/run.py`).

use std::env;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::{cargo, cargo_command, programs, root};

/// What both need, for the message of a failure.
const NEEDS: &str = "the tests in Python need Python 3.10 or later with its module venv (on Debian the packages \
                     python3 and python3-venv), and the packages of their requirements.txt";

/// Runs the tests of both, or those that `words` name. Uses `python3`, or the interpreter named by the
/// variable `PYTHON`; fails if there is none.
pub(crate) fn test(words: &[String]) -> Result<()> {
    let (package, client): (Vec<_>, Vec<_>) = words.iter().partition(|word| is_of_package(word));
    if words.is_empty() || !client.is_empty() {
        cargo(&mut cargo_command(&["build", "--bin", "osteon"]))?;
        let mut command = python("tests/python/run.py");
        command.arg("--osteon").arg(programs()?.join("osteon"));
        command.arg("--work").arg(programs()?.with_file_name("python"));
        cargo(command.args(client)).context(NEEDS)?;
    }
    if words.is_empty() || !package.is_empty() {
        let mut command = python("python/check.py");
        command.arg("--work").arg(programs()?.with_file_name("python-package"));
        cargo(command.args(package)).context(NEEDS)?;
    }
    Ok(())
}

/// Returns whether a test, such as `test_jobs.Run`, is one of the package.
fn is_of_package(word: &str) -> bool {
    let file = word.split('.').next().unwrap_or(word);
    Path::new(root()).join("python/tests").join(file).with_extension("py").is_file()
}

/// Returns the command that runs a script.
pub(crate) fn python(script: &str) -> Command {
    let interpreter = env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let mut command = Command::new(interpreter);
    command.current_dir(root()).arg(script);
    command
}
