//! All developer commands: `cargo xtask COMMAND`. CI calls `cargo xtask ci`.

#![forbid(unsafe_code)]

mod book;
mod chaos;
mod deny;
mod deploy;
mod digests;
mod fleet;
mod manual;
mod metrics;
mod peers;
mod places;
mod process;
mod python;
mod random;
mod reference;
mod report;
mod slurm;
mod tables;
mod terminal;
mod tools;
mod umbridge;

use std::env;
use std::process::ExitCode;

use anyhow::{Context as _, Result, bail};

use crate::process::{cargo, cargo_command};

/// A cargo invocation.
type Cargo = &'static [&'static str];

/// Action of a command.
enum Action {
    /// Runs cargo.
    Cargo(&'static [Cargo]),
    /// Runs a function, which may take further words.
    Function(fn(&[String]) -> Result<()>),
    /// Runs other commands: name and words of each.
    Commands(&'static [&'static [&'static str]]),
}

const FORMAT: Cargo = &["fmt", "--all", "--check"];
const LINT: Cargo = &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"];
/// The program as it is shipped: without the features that tests, benchmarks and `osteon-study` turn on.
const LINT_SHIPPED: Cargo = &["clippy", "--package", "osteon", "--", "-D", "warnings"];
const DOCS: Cargo = &["doc", "--workspace", "--no-deps"];
const TEST: Cargo = &["test", "--workspace"];
/// Beside [`TEST`] only the root package is built again, and the crates of OpenTelemetry.
const TEST_TRACING: Cargo =
    &["test", "--workspace", "--features", "osteon/otel", "--test", "tracing"];
const LINT_TRACING: Cargo = &[
    "clippy",
    "--package",
    "osteon",
    "--features",
    "otel",
    "--test",
    "tracing",
    "--bin",
    "osteon",
    "--",
    "-D",
    "warnings",
];

const BENCH: &[Cargo] = &[
    &["bench", "--package", "osteon-solver", "--bench", "table"],
    &["bench", "--package", "osteon", "--bench", "end_to_end"],
    &["bench", "--package", "osteon", "--bench", "dispatch"],
    &["bench", "--package", "osteon", "--bench", "jobs"],
    &["bench", "--package", "osteon-coordinator", "--bench", "fleet"],
];

/// Name, description and action.
const TASKS: &[(&str, &str, Action)] = &[
    ("format", "format the code", Action::Cargo(&[&["fmt", "--all"]])),
    (
        "lint",
        "formatting, lints and warnings of the documentation, as CI wants them",
        Action::Function(lint),
    ),
    ("test", "every test", Action::Cargo(&[TEST])),
    (
        "random",
        "the tests of properties on new random cases: --minutes M (10) --seed S (the clock's)",
        Action::Function(random::rounds),
    ),
    (
        "python",
        "builds and tests the Python package, tests the gRPC API by a client; takes names of tests",
        Action::Function(python::test),
    ),
    (
        "pools",
        "tests workers inside of a real Dask and a real Ray; takes names of tests",
        Action::Function(python::pools),
    ),
    (
        "notebooks",
        "executes examples/notebooks with small sizes; takes names of tests",
        Action::Function(python::notebooks),
    ),
    (
        "stubs",
        "makes the messages and stubs of the Python package from the .proto files",
        Action::Function(python::stubs),
    ),
    (
        "wheels",
        "builds manylinux wheels: x86_64 and aarch64, or those named",
        Action::Function(python::wheels),
    ),
    (
        "umbridge",
        "tests `osteon umbridge` by the conformity suite and the clients of UM-Bridge",
        Action::Function(umbridge::test),
    ),
    (
        "deny",
        "licences, versions, sources and advisories of the crates that osteon is built from",
        Action::Function(deny::check),
    ),
    (
        "metrics",
        "metrics, dashboard and alert rules: their tests, and promtool if there is one",
        Action::Function(metrics::check),
    ),
    (
        "man",
        "builds the release and writes its manual pages and shell completions beside it, for packages",
        Action::Function(manual::write),
    ),
    (
        "deploy",
        "checks deploy/: Helm chart, units, Debian package, image; takes names of test files",
        Action::Function(deploy::check),
    ),
    (
        "tracing",
        "the tests of tracing, on a program with the feature otel, and its lints",
        Action::Cargo(&[TEST_TRACING, LINT_TRACING]),
    ),
    (
        "ci",
        "what CI runs: lint, deny, every test, tracing, metrics, book, Python, UM-Bridge, deploy, Slurm \
         if installed",
        Action::Commands(&[
            &["lint"],
            &["deny"],
            &["test"],
            &["tracing"],
            &["metrics"],
            &["book"],
            &["python"],
            &["umbridge"],
            &["deploy"],
            &["slurm", slurm::IF_INSTALLED],
        ]),
    ),
    (
        "report",
        "looks at reports in Chromium with the network off: rules of axe, script errors, widths",
        Action::Function(report::check),
    ),
    (
        "slurm",
        "tests the commands for Slurm on a real one on this machine; takes names of tests",
        Action::Function(slurm::test),
    ),
    (
        "book",
        "builds the documentation as a book, and checks its links",
        Action::Function(book::build),
    ),
    (
        "tables",
        "makes the tables of docs/validation.md again: all, or those of the studies named",
        Action::Function(tables::rewrite),
    ),
    (
        "reference",
        "writes what docs/ and python/ take from the program: tables of keys, schemas, types",
        Action::Function(reference::write),
    ),
    (
        "digests",
        "compares the digest of a batch over instruction sets and builds; checks AArch64",
        Action::Function(digests::compare),
    ),
    (
        "chaos",
        "kills coordinator and workers while jobs run: --kills N (200 each) --seed S (1)",
        Action::Function(chaos::storm),
    ),
    ("bench", "measures what docs/performance.md states", Action::Cargo(BENCH)),
    (
        "bench-fleet",
        "measures jobs on fleets of simulated workers; --help lists the options",
        Action::Function(fleet::bench),
    ),
    (
        "bench-python",
        "measures what Python adds to the time of velocities: --rounds N (20)",
        Action::Function(python::bench),
    ),
    (
        "bench-peers",
        "compares the overhead with that of xargs, Dask, Ray and HyperQueue: --rounds N (3)",
        Action::Function(peers::bench),
    ),
    ("docs", "the documentation of all crates", Action::Cargo(&[DOCS])),
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
    let (name, words) =
        arguments.split_first().map_or(("", &[][..]), |(name, words)| (name.as_str(), words));
    perform(name, words)
}

/// Checks formatting, code and documentation, without running any of it.
fn lint(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask lint");
    }
    cargo(&mut cargo_command(FORMAT))?;
    cargo(&mut cargo_command(LINT))?;
    cargo(&mut cargo_command(LINT_SHIPPED))?;
    cargo(cargo_command(DOCS).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Executes the command `name`.
fn perform(name: &str, words: &[String]) -> Result<()> {
    let action = TASKS.iter().find(|(task, _, _)| *task == name).map(|(_, _, action)| action);
    match (action, words) {
        (Some(Action::Cargo(commands)), []) => {
            commands.iter().try_for_each(|arguments| cargo(&mut cargo_command(arguments)))
        }
        (Some(Action::Function(function)), words) => function(words),
        (Some(Action::Commands(commands)), []) => commands.iter().try_for_each(|command| {
            let (name, words) = command.split_first().context("a command without a name")?;
            let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
            perform(name, &words)
        }),
        _ => bail!("usage: cargo xtask COMMAND, one of:\n{}", list()),
    }
}

fn list() -> String {
    TASKS.iter().map(|(name, what, _)| format!("  {name:11} {what}\n")).collect()
}
