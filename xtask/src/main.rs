//! All developer commands: `cargo xtask COMMAND [PART]`. CI calls `cargo xtask ci`.

#![forbid(unsafe_code)]

mod book;
mod chaos;
mod deny;
mod deploy;
mod digests;
mod fleet;
mod gallery;
mod manual;
mod metrics;
mod peers;
mod places;
mod process;
mod python;
mod random;
mod reference;
mod release;
mod report;
mod slurm;
mod tables;
mod terminal;
mod tools;
mod umbridge;
mod wings;

use std::env;
use std::process::ExitCode;

use anyhow::{Result, bail};

use crate::process::{cargo, cargo_command};

/// A cargo invocation.
type Cargo = &'static [&'static str];

/// What a command, or a part of one, does.
enum Action {
    /// Runs cargo.
    Cargo(&'static [Cargo]),
    /// Runs a function, which may take further words.
    Function(fn(&[String]) -> Result<()>),
}

/// A command: what it does by itself, and its parts, which run by their names.
struct Verb {
    name: &'static str,
    what: &'static str,
    action: Option<Action>,
    parts: &'static [Subcommand],
}

/// A part of a command: name, description and action.
type Subcommand = (&'static str, &'static str, Action);

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
    &["bench", "--package", "osteon-signals", "--bench", "picking"],
    &["bench", "--package", "osteon", "--bench", "end_to_end"],
    &["bench", "--package", "osteon", "--bench", "dispatch"],
    &["bench", "--package", "osteon", "--bench", "jobs"],
    &["bench", "--package", "osteon-coordinator", "--bench", "fleet"],
];

const VERBS: &[Verb] = &[
    Verb {
        name: "ci",
        what: "what CI runs: lint, test and what is marked *",
        action: Some(Action::Function(ci)),
        parts: &[],
    },
    Verb {
        name: "format",
        what: "format the code",
        action: Some(Action::Cargo(&[&["fmt", "--all"]])),
        parts: &[],
    },
    Verb {
        name: "lint",
        what: "formatting, lints and warnings of the documentation",
        action: Some(Action::Function(lint)),
        parts: &[(
            "deny",
            "* licences, versions, sources and advisories of the crates that osteon is built from",
            Action::Function(deny::check),
        )],
    },
    Verb {
        name: "test",
        what: "every test of cargo",
        action: Some(Action::Cargo(&[TEST])),
        parts: SUITES,
    },
    Verb {
        name: "bench",
        what: "what docs/performance.md states",
        action: Some(Action::Cargo(BENCH)),
        parts: BENCHES,
    },
    Verb {
        name: "docs",
        what: "* the documentation as a book, and its links",
        action: Some(Action::Function(book::build)),
        parts: &[("crates", "the documentation of all crates", Action::Cargo(&[DOCS]))],
    },
    Verb {
        name: "generate",
        what: "files of the repository that are made from others",
        action: None,
        parts: &[
            (
                "reference",
                "what docs/ takes from the program: tables of keys, schemas, pages of references",
                Action::Function(reference::write),
            ),
            (
                "gallery",
                "docs/gallery.md with its pictures, by the release (three minutes)",
                Action::Function(gallery::write),
            ),
            (
                "tables",
                "the tables of docs/validation.md: all, or those of the studies named",
                Action::Function(tables::rewrite),
            ),
        ],
    },
    Verb {
        name: "package",
        what: "what is published",
        action: None,
        parts: &[
            (
                "man",
                "the release with its manual pages and shell completions beside it",
                Action::Function(manual::write),
            ),
            (
                "wheels",
                "manylinux wheels: x86_64 and aarch64, or those named",
                Action::Function(python::wheels),
            ),
        ],
    },
    Verb {
        name: "release",
        what: "all files of a release, tried: wheels, archives, .deb, SBOM, sums; --help lists the options",
        action: Some(Action::Function(release::make)),
        parts: &[],
    },
];

const SUITES: &[Subcommand] = &[
    (
        "wings",
        "* that the program is built without each of its wings, and without all of them",
        Action::Function(wings::check),
    ),
    (
        "tracing",
        "* with the feature otel, and its lints",
        Action::Cargo(&[TEST_TRACING, LINT_TRACING]),
    ),
    (
        "metrics",
        "* metrics, dashboard and alert rules; promtool if there is one",
        Action::Function(metrics::check),
    ),
    (
        "python",
        "* the Python package, and the gRPC API by a client; takes names of tests",
        Action::Function(python::test),
    ),
    (
        "umbridge",
        "* `osteon umbridge` by the conformity suite and the clients of UM-Bridge",
        Action::Function(umbridge::test),
    ),
    (
        "deploy",
        "* Helm chart, units, Debian package, image; takes names of test files",
        Action::Function(deploy::check),
    ),
    (
        "slurm",
        "* the commands for Slurm on a real one on this machine; takes names of tests",
        Action::Function(slurm::test),
    ),
    (
        "pools",
        "workers inside of a real Dask and a real Ray; takes names of tests",
        Action::Function(python::pools),
    ),
    (
        "notebooks",
        "examples/notebooks with small sizes; takes names of tests",
        Action::Function(python::notebooks),
    ),
    (
        "report",
        "reports in Chromium with the network off: rules of axe, script errors, widths",
        Action::Function(report::check),
    ),
    (
        "random",
        "properties on new random cases: --minutes M (10) --seed S (the clock's)",
        Action::Function(random::rounds),
    ),
    (
        "chaos",
        "kills coordinator and workers while jobs run: --kills N (200 each) --seed S (1)",
        Action::Function(chaos::storm),
    ),
    (
        "digests",
        "compares the digest of a batch over instruction sets and builds; checks AArch64",
        Action::Function(digests::compare),
    ),
];

const BENCHES: &[Subcommand] = &[
    (
        "fleet",
        "jobs on fleets of simulated workers; --help lists the options",
        Action::Function(fleet::bench),
    ),
    (
        "python",
        "what Python adds to the time of velocities: --rounds N (20)",
        Action::Function(python::bench),
    ),
    (
        "peers",
        "the overhead of xargs, Dask, Ray and HyperQueue beside osteon's: --rounds N (3)",
        Action::Function(peers::bench),
    ),
];

/// The commands that CI runs, in this order.
const CI: &[&[&str]] = &[
    &["lint"],
    &["lint", "deny"],
    &["test"],
    &["test", "wings"],
    &["test", "tracing"],
    &["test", "metrics"],
    &["docs"],
    &["test", "python"],
    &["test", "umbridge"],
    &["test", "deploy"],
    &["test", "slurm", slurm::IF_INSTALLED],
    release::TRIAL,
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
    let words: Vec<String> = env::args().skip(1).collect();
    perform(&words)
}

fn ci(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask ci");
    }
    CI.iter().try_for_each(|words| {
        perform(&words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>())
    })
}

/// Checks formatting, code and documentation, without running any of it.
fn lint(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask lint [deny]");
    }
    cargo(&mut cargo_command(FORMAT))?;
    cargo(&mut cargo_command(LINT))?;
    cargo(&mut cargo_command(LINT_SHIPPED))?;
    cargo(cargo_command(DOCS).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Runs the command that the words name, or a part of it.
fn perform(words: &[String]) -> Result<()> {
    let found = words.split_first().and_then(|(name, rest)| {
        let verb = VERBS.iter().find(|verb| verb.name == name)?;
        let part = rest.first().and_then(|word| verb.parts.iter().find(|(name, ..)| name == word));
        match part {
            Some((.., action)) => Some((action, &rest[1..])),
            None => Some((verb.action.as_ref()?, rest)),
        }
    });
    match found {
        Some((Action::Cargo(commands), [])) => {
            commands.iter().try_for_each(|arguments| cargo(&mut cargo_command(arguments)))
        }
        Some((Action::Function(function), rest)) => function(rest),
        _ => bail!("usage: cargo xtask COMMAND, one of:\n{}", list()),
    }
}

/// Lists the commands, each above its parts.
fn list() -> String {
    let mut list = String::new();
    for Verb { name, what, parts, .. } in VERBS {
        list += &format!("  {name:20} {what}\n");
        for (part, what, _) in *parts {
            list += &format!("  {:20} {what}\n", format!("{name} {part}"));
        }
    }
    list
}
