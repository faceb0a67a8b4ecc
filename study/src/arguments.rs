//! The command line.

use clap::{Args, Parser, Subcommand};
use osteon_study::posteriors::Scenario;

/// Compares the solvers, samplings and searches of osteon, and prints a table in Markdown
#[derive(Debug, Parser)]
#[command(name = "osteon-study", version, max_term_width = 80)]
pub(crate) struct Arguments {
    /// The study to run.
    #[command(subcommand)]
    pub(crate) study: Study,
}

/// The study to run.
#[derive(Debug, Clone, Copy, Subcommand)]
pub(crate) enum Study {
    /// Measure how often a realization has no velocity, for each kind of failure, dispersion and bone
    /// thickness
    Failures(DrawsArguments),
    /// Measure the errors of the exact method at refinement 1 against refinement 5, and compare them
    /// with its estimated errors
    Accuracy(DrawsArguments),
    /// Measure the errors of the exact and the hybrid method against the exact method at refinement 5
    Methods(DrawsArguments),
    /// Measure how the error of the exact method falls with refinement
    Refinement(DrawsArguments),
    /// Measure the errors of the exact method for random mean models of bone
    Models(DrawsArguments),
    /// Measure the errors of the exact method for random layers, probes and bones
    Setups(DrawsArguments),
    /// Compare both methods on bones of random sublayers, with random fluids, probes and pulses
    Stacks(DrawsArguments),
    /// Measure jumps of the velocity between bones whose elasticity differs by 1e-9
    Continuity(DrawsArguments),
    /// Count the evaluations that each search method needs from ten starts with all seven
    /// parameters free
    Searches(DrawsArguments),
    /// Print the digest of a set of realizations for each instruction set that this machine supports
    Digest(DrawsArguments),
    /// Measure how moments scatter between seeds, for each sampling method, with and without control
    /// variate, and how accurate their standard errors are
    Variance(RepetitionsArguments),
    /// Twin experiments: check whether identifications from simulated data recover the parameters
    /// used for the simulation
    Twins(TwinsArguments),
    /// Count how many confidence intervals contain the true value, over data sets of 100 velocities
    Coverage(TwinsArguments),
    /// Count them for bones that differ in thickness, attenuation, coupling and tilt, with a model that
    /// knows the laws of these differences and with one that does not
    Populations(TwinsArguments),
    /// Count how many confidence intervals of porosity and dispersion contain the true value, from 20, 100
    /// and 2747 velocities
    Porosities(TwinsArguments),
    /// Count them for posteriors of a porosity that changes through the thickness, both ends free
    PorosityProfiles(TwinsArguments),
    /// Count how many confidence intervals contain the true value where the data are of another setup than the
    /// job's, with and without `[systematic] usual = true`
    SetupErrors(TwinsArguments),
    /// Count how many intervals of 3 to 12 bones of eight velocities each contain the true value, each bone alone and
    /// pooled, and compare the errors
    Hierarchies(TwinsArguments),
    /// Compare the standard deviations that `osteon design` predicts for five measurements with those of simulated
    /// studies
    Designs(TwinsArguments),
    /// Compare velocities picked in noisy signals of tilted probes with those of the model
    Picks(TwinsArguments),
    /// Count how many confidence intervals of porosity and dispersion contain the true value, from signals
    Signals(TwinsArguments),
    /// Identify one porosity from bones whose porosity changes through the thickness
    UnmodelledProfiles(TwinsArguments),
    /// Count how many intervals of posteriors contain the true value, over parameter sets drawn from
    /// the prior with all seven parameters free
    Posteriors(PosteriorsArguments),
    /// Compare the posterior of the example's data with importance sampling of the model itself, by
    /// as many evaluated draws as there are realizations asked for
    PosteriorReference(DrawsArguments),
    /// Measure how the error of the hybrid method falls with element size, order and time step
    Convergence,
}

/// The arguments of the studies that draw random realizations.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct DrawsArguments {
    /// Number of realizations for each row of the table [default: depends on the study]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=osteon_common::limits::REALIZATIONS_MAX))]
    pub(crate) realizations: Option<u64>,
    /// Seed of the draws
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64).range(0..=osteon_common::limits::SEED_MAX))]
    pub(crate) seed: u64,
}

/// The arguments of the study that repeats a computation with different seeds.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct RepetitionsArguments {
    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = osteon_study::variance::SEEDS,
          value_parser = clap::value_parser!(u64).range(2..=REPETITIONS_MAX))]
    pub(crate) seeds: u64,
    /// First seed; the others follow it
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64)
              .range(0..=osteon_common::limits::SEED_MAX - REPETITIONS_MAX))]
    pub(crate) seed: u64,
}

/// The arguments of the studies with simulated data.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct TwinsArguments {
    /// Number of parameter sets or data sets [default: depends on the study]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=REPETITIONS_MAX))]
    pub(crate) repetitions: Option<u64>,
    /// Seed of the parameter sets, the data and the random draws
    #[arg(long, value_name = "S", default_value_t = 1,
          value_parser = clap::value_parser!(u64)
              .range(0..=osteon_common::limits::SEED_MAX - 1_000_000_000))]
    pub(crate) seed: u64,
}

/// The arguments of the calibration of posteriors.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct PosteriorsArguments {
    /// How the velocities are made
    #[arg(long, value_name = "NAME", default_value = Scenario::Independent.name(),
          value_parser = scenario)]
    pub(crate) scenario: Scenario,
    /// Number of velocities of each data set
    #[arg(long, value_name = "N", default_value_t = osteon_study::posteriors::VELOCITIES,
          value_parser = clap::value_parser!(u64).range(5..=100_000))]
    pub(crate) velocities: u64,
    /// Number of the first parameter set, to continue an earlier table
    #[arg(long, value_name = "K", default_value_t = 0,
          value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    pub(crate) first: u64,
    #[command(flatten)]
    pub(crate) twins: TwinsArguments,
}

/// Reads the name of a scenario.
fn scenario(text: &str) -> Result<Scenario, String> {
    let found = Scenario::ALL.into_iter().find(|scenario| scenario.name() == text);
    found.ok_or_else(|| format!("expected one of {}", Scenario::ALL.map(Scenario::name).join(", ")))
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
    fn invalid_arguments_are_refused() {
        for (line, expected) in [
            ("osteon-study", "Usage"),
            ("osteon-study nothing", "unrecognized subcommand"),
            ("osteon-study failures --realizations 0", "0 is not in 1..=10000000"),
            ("osteon-study methods --seed -1", "unexpected argument"),
            ("osteon-study posteriors --scenario odd", "independent, subjects, rounded"),
        ] {
            let error = Arguments::try_parse_from(line.split_whitespace()).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{line}");
            assert!(error.to_string().contains(expected), "{line}: {error}");
        }
    }
}
