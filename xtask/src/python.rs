//! What is tested in Python: the package `osteon` (`python/check.py`), and the gRPC API with an external
//! client (`tests/python/run.py`).

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command, output};

/// What both need, for the message of a failure.
const NEEDS: &str = "the tests in Python need Python 3.10 or later (notebooks and pools: 3.11) with its module \
                     venv (on Debian the packages python3 and python3-venv), and the packages of their \
                     requirements.txt";

/// Where wheels are built, below the target directory.
pub(crate) const WHEELS: &str = "python-wheels";

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
        check("package", &package)?;
    }
    Ok(())
}

/// Executes the notebooks of `examples/notebooks`, or those whose tests `words` name.
pub(crate) fn notebooks(words: &[String]) -> Result<()> {
    check("notebooks", words)
}

/// Tests workers inside of a real Dask and a real Ray cluster, or the tests that `words` name.
pub(crate) fn pools(words: &[String]) -> Result<()> {
    check("pools", words)
}

/// Measures what Python adds to the time of velocities, and how long an import takes, in release mode.
pub(crate) fn bench(words: &[String]) -> Result<()> {
    let build = ["bench", "--package", "osteon-python", "--bench", "bulk", "--no-run"];
    let built = output(cargo_command(&build).arg("--message-format=json"))?;
    let program = executable(&built).context("cargo built no benchmark")?;
    let mut command = suite("bench")?;
    command.args(["--profile", "release", "--"]).args(words).arg("--").arg(program);
    cargo(&mut command).context(NEEDS)
}

/// Builds wheels that run on every Linux with glibc 2.17 or later, for both processors or those that
/// `words` name.
pub(crate) fn wheels(words: &[String]) -> Result<()> {
    let mut command = python("python/wheels.py");
    command.arg("--work").arg(programs()?.with_file_name(WHEELS)).args(words);
    cargo(&mut command).context(NEEDS)
}

/// Runs a suite of `python/check.py`, or those of its tests that `words` name.
fn check(name: &str, words: &[impl AsRef<str>]) -> Result<()> {
    let mut command = suite(name)?;
    cargo(command.args(words.iter().map(AsRef::as_ref))).context(NEEDS)
}

/// Returns the command that runs a suite.
fn suite(name: &str) -> Result<Command> {
    let mut command = python("python/check.py");
    let work = programs()?.with_file_name(format!("python-{name}"));
    command.args(["--suite", name]).arg("--work").arg(work);
    Ok(command)
}

/// Returns the program that cargo says it has built.
fn executable(messages: &str) -> Option<PathBuf> {
    let (_, rest) = messages.rsplit_once(r#""executable":""#)?;
    rest.split_once('"').map(|(path, _)| PathBuf::from(path))
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
