//! Prints a table that shows the performance of solvers or searches over many draws.
//!
//! The table goes to stdout, each of its rows to stderr when it is finished. Exit codes: 0 done, 1
//! failed, 2 bad usage.

#![forbid(unsafe_code)]

mod arguments;

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser as _;
use osteon_common::version;
use osteon_solver::Isa;
use osteon_study::posteriors::{self, PosteriorCalibration, reference};
use osteon_study::twins::{self, Twins};
use osteon_study::variance::Repetitions;
use osteon_study::{
    Draws, MarkdownTable, RowCallback, StudyError, accuracy, continuity, convergence, designs,
    digest, failures, hierarchies, methods, models, porosities, refinement, searches, setup_errors,
    setups, signals, stacks, variance,
};

use crate::arguments::{
    Arguments, DrawsArguments, PosteriorsArguments, RepetitionsArguments, Study, TwinsArguments,
};

/// A study over draws.
struct OverDraws {
    name: &'static str,
    realizations: u64,
    table: fn(&Draws, RowCallback<'_>) -> Result<MarkdownTable, StudyError>,
}

const FAILURES: OverDraws =
    OverDraws { name: "failures", realizations: failures::REALIZATIONS, table: failures::table };
const ACCURACY: OverDraws =
    OverDraws { name: "accuracy", realizations: accuracy::REALIZATIONS, table: accuracy::table };
const METHODS: OverDraws =
    OverDraws { name: "methods", realizations: methods::REALIZATIONS, table: methods::table };
const MODELS: OverDraws =
    OverDraws { name: "models", realizations: models::REALIZATIONS, table: models::table };
const REFINEMENT: OverDraws = OverDraws {
    name: "refinement",
    realizations: refinement::REALIZATIONS,
    table: refinement::table,
};
const SEARCHES: OverDraws =
    OverDraws { name: "searches", realizations: searches::REALIZATIONS, table: searches::table };
const SETUPS: OverDraws =
    OverDraws { name: "setups", realizations: setups::REALIZATIONS, table: setups::table };
const STACKS: OverDraws =
    OverDraws { name: "stacks", realizations: stacks::REALIZATIONS, table: stacks::table };
const DIGEST: OverDraws =
    OverDraws { name: "digest", realizations: digest::REALIZATIONS, table: digest::table };
const CONTINUITY: OverDraws = OverDraws {
    name: "continuity",
    realizations: continuity::REALIZATIONS,
    table: continuity::table,
};

const POSTERIOR_REFERENCE: OverDraws = OverDraws {
    name: "posterior-reference",
    realizations: reference::REALIZATIONS,
    table: reference::table,
};

/// A study of identifications from simulated data.
struct OverTwins {
    name: &'static str,
    repetitions: u64,
    table: fn(&Twins, RowCallback<'_>) -> Result<MarkdownTable, StudyError>,
}

const TWINS: OverTwins = OverTwins { name: "twins", repetitions: twins::SETS, table: twins::table };
const COVERAGE: OverTwins =
    OverTwins { name: "coverage", repetitions: twins::REPETITIONS, table: twins::coverage };
const POPULATIONS: OverTwins =
    OverTwins { name: "populations", repetitions: twins::REPETITIONS, table: twins::populations };
const POROSITIES: OverTwins =
    OverTwins { name: "porosities", repetitions: porosities::BONES, table: porosities::coverage };
const POROSITY_PROFILES: OverTwins = OverTwins {
    name: "porosity-profiles",
    repetitions: porosities::PROFILES,
    table: porosities::profiles,
};
const SETUP_ERRORS: OverTwins = OverTwins {
    name: "setup-errors",
    repetitions: setup_errors::BONES,
    table: setup_errors::coverage,
};
const DESIGNS: OverTwins =
    OverTwins { name: "designs", repetitions: designs::STUDIES, table: designs::table };
const PICKS: OverTwins =
    OverTwins { name: "picks", repetitions: signals::MEASUREMENTS, table: signals::picks };
const SIGNALS: OverTwins =
    OverTwins { name: "signals", repetitions: signals::STUDIES, table: signals::studies };
const HIERARCHIES: OverTwins =
    OverTwins { name: "hierarchies", repetitions: hierarchies::STUDIES, table: hierarchies::table };
const UNMODELLED_PROFILES: OverTwins =
    OverTwins { name: "unmodelled-profiles", repetitions: 1, table: porosities::unmodelled };

fn main() -> ExitCode {
    let Arguments { study } = Arguments::parse();
    let isa = match Isa::chosen(std::env::var_os(Isa::VARIABLE)) {
        Ok(isa) => isa,
        Err(error) => return report_failure(&error, 2),
    };
    let text = match run_study(study, isa) {
        Ok(text) => text,
        Err(error) => return report_failure(&error, 1),
    };
    match std::io::stdout().write_all(text.as_bytes()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report_failure(&error, 1),
    }
}

/// Prints the reason why there is no table; returns the exit code.
fn report_failure(error: &dyn std::error::Error, code: u8) -> ExitCode {
    say(&format!("osteon-study: {error}"));
    ExitCode::from(code)
}

/// Prints one line on stderr.
fn say(line: &str) {
    // If stderr is closed, nothing more can be done.
    drop(writeln!(std::io::stderr(), "{line}"));
}

/// Returns the table of a study below the command line that reproduces it.
fn run_study(study: Study, isa: Isa) -> Result<String, StudyError> {
    match study {
        Study::Failures(arguments) => run_over_draws(&FAILURES, arguments, isa),
        Study::Accuracy(arguments) => run_over_draws(&ACCURACY, arguments, isa),
        Study::Methods(arguments) => run_over_draws(&METHODS, arguments, isa),
        Study::Models(arguments) => run_over_draws(&MODELS, arguments, isa),
        Study::Digest(arguments) => run_over_draws(&DIGEST, arguments, isa),
        Study::Refinement(arguments) => run_over_draws(&REFINEMENT, arguments, isa),
        Study::Setups(arguments) => run_over_draws(&SETUPS, arguments, isa),
        Study::Stacks(arguments) => run_over_draws(&STACKS, arguments, isa),
        Study::Searches(arguments) => run_over_draws(&SEARCHES, arguments, isa),
        Study::Continuity(arguments) => run_over_draws(&CONTINUITY, arguments, isa),
        Study::Variance(arguments) => run_over_seeds(arguments, isa),
        Study::Twins(arguments) => run_over_twins(&TWINS, arguments, isa),
        Study::Coverage(arguments) => run_over_twins(&COVERAGE, arguments, isa),
        Study::Populations(arguments) => run_over_twins(&POPULATIONS, arguments, isa),
        Study::Porosities(arguments) => run_over_twins(&POROSITIES, arguments, isa),
        Study::PorosityProfiles(arguments) => run_over_twins(&POROSITY_PROFILES, arguments, isa),
        Study::SetupErrors(arguments) => run_over_twins(&SETUP_ERRORS, arguments, isa),
        Study::Hierarchies(arguments) => run_over_twins(&HIERARCHIES, arguments, isa),
        Study::Designs(arguments) => run_over_twins(&DESIGNS, arguments, isa),
        Study::Picks(arguments) => run_over_twins(&PICKS, arguments, isa),
        Study::Signals(arguments) => run_over_twins(&SIGNALS, arguments, isa),
        Study::UnmodelledProfiles(arguments) => {
            run_over_twins(&UNMODELLED_PROFILES, arguments, isa)
        }
        Study::Posteriors(arguments) => run_over_posteriors(arguments, isa),
        Study::PosteriorReference(arguments) => {
            run_over_draws(&POSTERIOR_REFERENCE, arguments, isa)
        }
        Study::Convergence => Ok(add_title("convergence", &convergence::table(isa, &say)?)),
    }
}

fn run_over_draws(
    study: &OverDraws,
    arguments: DrawsArguments,
    isa: Isa,
) -> Result<String, StudyError> {
    let realizations = arguments.realizations.unwrap_or(study.realizations);
    let draws = Draws { realizations, seed: arguments.seed, isa };
    let table = (study.table)(&draws, &say)?;
    let (name, seed) = (study.name, arguments.seed);
    Ok(add_title(&format!("{name} --realizations {realizations} --seed {seed}"), &table))
}

fn run_over_seeds(arguments: RepetitionsArguments, isa: Isa) -> Result<String, StudyError> {
    let RepetitionsArguments { seeds, seed: first } = arguments;
    let table = variance::table(&Repetitions { seeds, first, isa }, &say)?;
    Ok(add_title(&format!("variance --seeds {seeds} --seed {first}"), &table))
}

fn run_over_twins(
    study: &OverTwins,
    arguments: TwinsArguments,
    isa: Isa,
) -> Result<String, StudyError> {
    let repetitions = arguments.repetitions.unwrap_or(study.repetitions);
    let seed = arguments.seed;
    let table = (study.table)(&Twins { repetitions, seed, isa }, &say)?;
    Ok(add_title(&format!("{} --repetitions {repetitions} --seed {seed}", study.name), &table))
}

fn run_over_posteriors(arguments: PosteriorsArguments, isa: Isa) -> Result<String, StudyError> {
    let PosteriorsArguments { scenario, velocities, first, twins } = arguments;
    let repetitions = twins.repetitions.unwrap_or(posteriors::REPETITIONS);
    let seed = twins.seed;
    let study = PosteriorCalibration { scenario, velocities, first, repetitions, seed, isa };
    let command = format!(
        "posteriors --scenario {} --velocities {velocities} --first {first} --repetitions \
         {repetitions} --seed {seed}",
        scenario.name()
    );
    Ok(add_title(&command, &posteriors::table(&study, &say)?))
}

/// Returns a table below the command that reproduces it.
fn add_title(arguments: &str, table: &MarkdownTable) -> String {
    format!("`osteon-study {arguments}` ({})\n\n{table}", version::fingerprint())
}
