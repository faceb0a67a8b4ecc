//! Every developer command in one place: `cargo xtask COMMAND`. CI calls `cargo xtask ci`.

use std::env;
use std::process::{Command, ExitCode};

use anyhow::{Context as _, Result, bail};

/// Name, what it does, and the cargo invocations behind it.
type Task = (&'static str, &'static str, &'static [&'static [&'static str]]);

const FORMAT: &[&str] = &["fmt", "--all", "--check"];
const LINT: &[&str] = &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"];
const TEST: &[&str] = &["test", "--workspace"];

const TABLES: &[&[&str]] = &[
    &["run", "--release", "--", "study", "failures"],
    &["run", "--release", "--", "study", "accuracy"],
    &["run", "--release", "--", "study", "methods"],
    &["run", "--release", "--", "study", "continuity"],
    &["run", "--release", "--", "study", "convergence"],
];

const TASKS: &[Task] = &[
    ("format", "format the code", &[&["fmt", "--all"]]),
    ("lint", "formatting and lints, as CI wants them", &[FORMAT, LINT]),
    ("test", "every test", &[TEST]),
    ("ci", "what CI runs: formatting, lints, every test", &[FORMAT, LINT, TEST]),
    ("tables", "the tables of docs/validation.md, on stdout", TABLES),
    ("docs", "the documentation of all crates", &[&["doc", "--workspace", "--no-deps"]]),
];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let task = match arguments.as_slice() {
        [name] => TASKS.iter().find(|task| task.0 == name),
        _ => None,
    };
    let Some((_, _, commands)) = task else {
        bail!("usage: cargo xtask COMMAND, one of:\n{}", list());
    };
    for arguments in *commands {
        eprintln!("+ cargo {}", arguments.join(" "));
        let status = Command::new(env!("CARGO"))
            .args(*arguments)
            .status()
            .with_context(|| format!("cannot run cargo {}", arguments.join(" ")))?;
        if !status.success() {
            bail!("cargo {} failed", arguments.join(" "));
        }
    }
    Ok(())
}

fn list() -> String {
    TASKS.iter().map(|(name, what, _)| format!("  {name:8} {what}\n")).collect()
}
