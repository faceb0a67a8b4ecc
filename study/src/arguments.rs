//! The command line.

use clap::{Args, Parser, Subcommand};

/// Measures the solvers, the samplings and the searches of osteon against each other; prints a table
/// in Markdown
#[derive(Debug, Parser)]
#[command(name = "osteon-study", version, max_term_width = 80)]
pub(crate) struct Arguments {
    /// What to measure.
    #[command(subcommand)]
    pub(crate) study: Study,
}

/// What to measure.
#[derive(Debug, Clone, Copy, Subcommand)]
pub(crate) enum Study {
    /// How often a realization has no velocity, by kind of failure, dispersion and plate
    Failures(DrawsArguments),
    /// Errors of the exact method against refinement 5, and its own estimates of them
    Accuracy(DrawsArguments),
    /// Both methods against the exact one at refinement 5
    Methods(DrawsArguments),
    /// How the exact method's error falls with refinement
    Refinement(DrawsArguments),
    /// Errors of the exact method with random mean models of bone
    Models(DrawsArguments),
    /// Errors of the exact method with random layers, probes and bones
    Setups(DrawsArguments),
    /// Jumps of the velocity between bones whose elasticity differs by 1e-9
    Continuity(DrawsArguments),
    /// Evaluations that the methods of search need from ten starts, all seven parameters free
    Searches(DrawsArguments),
    /// Digest of a batch on every instruction set of this machine
    Digest(DrawsArguments),
    /// How far moments scatter from seed to seed, by sampling and control variate, and how right
    /// their standard errors are
    Variance(RepetitionsArguments),
    /// Whether an identification finds again what made its data, over known parameter sets
    Twins(TwinsArguments),
    /// How many intervals hold the truth, over data sets of a hundred velocities
    Coverage(TwinsArguments),
    /// How the hybrid method's error falls with element size, order and time step
    Convergence,
}

/// The arguments of every study over draws.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct DrawsArguments {
    /// Realizations of each row [default: the study's own]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=osteon_common::limits::REALIZATIONS_MAX))]
    pub(crate) realizations: Option<u64>,
    /// Seed of the draws
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64).range(0..=osteon_common::limits::SEED_MAX))]
    pub(crate) seed: u64,
}

/// The arguments of a study over seeds.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct RepetitionsArguments {
    /// How many seeds
    #[arg(long, value_name = "N", default_value_t = osteon_study::variance::SEEDS,
          value_parser = clap::value_parser!(u64).range(2..=REPETITIONS_MAX))]
    pub(crate) seeds: u64,
    /// The first; the others follow it
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64)
              .range(0..=osteon_common::limits::SEED_MAX - REPETITIONS_MAX))]
    pub(crate) seed: u64,
}

/// The arguments of a study of data that are made.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct TwinsArguments {
    /// Parameter sets, or data sets [default: the study's own]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=REPETITIONS_MAX))]
    pub(crate) repetitions: Option<u64>,
    /// Seed of the parameter sets, the data and the random draws
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64)
              .range(0..=osteon_common::limits::SEED_MAX - 1_000_000_000))]
    pub(crate) seed: u64,
}

/// Most repetitions of a study.
const REPETITIONS_MAX: u64 = 10_000;

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_definition_is_sound() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for (line, expected) in [
            ("osteon-study", "Usage"),
            ("osteon-study nothing", "unrecognized subcommand"),
            ("osteon-study failures --realizations 0", "0 is not in 1..=10000000"),
            ("osteon-study methods --seed -1", "unexpected argument"),
        ] {
            let error = Arguments::try_parse_from(line.split_whitespace()).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{line}");
            assert!(error.to_string().contains(expected), "{line}: {error}");
        }
    }
}
