//! Settings of the posterior.

use crate::accepted::WholeRange;
use crate::fields::{self, Fields, Key, Section};
use crate::parameters::PARAMETERS;

fields::choices!(PriorDistribution);

/// Maximum number of draws of a posterior.
pub const DRAWS_MAX: u64 = 20_000;
/// Maximum number of points evaluated for the posterior of one set of data.
pub const POSTERIOR_EVALUATIONS_MAX: u64 = 2_000;

/// Settings of the posterior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosteriorSettings {
    /// Number of draws in the result.
    pub draws: u64,
    /// Maximum number of points evaluated for one set of data.
    pub max_evaluations: u64,
    /// Priors of [`Parameter::ALL`](crate::parameters::Parameter::ALL), in that order; those of
    /// fixed parameters have no effect.
    pub priors: [PosteriorPrior; PARAMETERS],
}

/// Prior law of one parameter within its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum PosteriorPrior {
    /// Uniform between the bounds.
    #[default]
    Uniform,
    /// Normal, truncated to the bounds.
    Normal {
        /// Its mean before truncation, in the parameter's unit.
        center: f64,
        /// Its standard deviation before truncation, above 0.
        spread: f64,
    },
    /// Log-normal, truncated to the bounds.
    LogNormal {
        /// Its median before truncation, above 0, in the parameter's unit.
        center: f64,
        /// The standard deviation of the natural logarithm, above 0.
        spread: f64,
    },
}

/// The law of a [`PosteriorPrior`], without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PriorDistribution {
    /// Uniform between the bounds.
    #[default]
    Uniform,
    /// Normal, truncated to the bounds.
    Normal,
    /// Log-normal, truncated to the bounds.
    LogNormal,
}

impl PriorDistribution {
    /// All laws, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Uniform, Self::Normal, Self::LogNormal];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Normal => "normal",
            Self::LogNormal => "log_normal",
        }
    }
}

impl PosteriorPrior {
    /// Returns the prior with this law; a uniform one has no use for the numbers.
    pub fn new(distribution: PriorDistribution, center: f64, spread: f64) -> Self {
        match distribution {
            PriorDistribution::Uniform => Self::Uniform,
            PriorDistribution::Normal => Self::Normal { center, spread },
            PriorDistribution::LogNormal => Self::LogNormal { center, spread },
        }
    }

    /// Returns its law.
    pub fn distribution(self) -> PriorDistribution {
        match self {
            Self::Uniform => PriorDistribution::Uniform,
            Self::Normal { .. } => PriorDistribution::Normal,
            Self::LogNormal { .. } => PriorDistribution::LogNormal,
        }
    }

    /// Returns center and spread; `None` of a uniform prior.
    pub fn numbers(self) -> Option<[f64; 2]> {
        match self {
            Self::Uniform => None,
            Self::Normal { center, spread } | Self::LogNormal { center, spread } => {
                Some([center, spread])
            }
        }
    }
}

impl PosteriorSettings {
    /// Its section of a job file.
    pub const KEY: Key = Key {
        name: "posterior",
        meaning: "if this section is there, even without keys, the posterior of the free parameters \
                  is computed after the search ([searches.md](searches.md#posterior)); it requires at least \
                  two realizations, and `identify`",
    };
}

impl Default for PosteriorSettings {
    fn default() -> Self {
        Self { draws: 2_000, max_evaluations: 400, priors: [PosteriorPrior::default(); PARAMETERS] }
    }
}

impl Section for PosteriorSettings {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let draws = "number of draws of equal weight in `posterior.csv`";
        fields.whole(
            Key { name: "draws", meaning: draws },
            &mut self.draws,
            WholeRange::new(100, DRAWS_MAX),
        );
        let evaluations = "maximum number of points evaluated for the posterior of one set of data; \
                           it usually needs fewer";
        fields.whole(
            Key { name: "max_evaluations", meaning: evaluations },
            &mut self.max_evaluations,
            WholeRange::new(20, POSTERIOR_EVALUATIONS_MAX),
        );
        let priors = "for each free parameter whose prior is not uniform within its bounds: \
                      `{ distribution = \"normal\", center = …, spread = … }`, with mean and standard \
                      deviation, or `\"log_normal\"`, with the median and the standard deviation of \
                      the natural logarithm; both are truncated to the bounds";
        fields.custom_table(Key { name: "priors", meaning: priors });
    }
}
