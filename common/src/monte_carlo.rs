//! Settings of the Monte Carlo loop.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accepted::{Interval, WholeRange};
use crate::fields::{self, Fields, Key, Number, Section};
use crate::germ_source::{GermScheme, GermSource};
use crate::limits::{REALIZATIONS_MAX, SCRAMBLES_MAX, SEED_MAX};

fields::choices!(Sampling);

/// Method of drawing realizations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Independent germs, one ChaCha stream per realization.
    #[default]
    MonteCarlo,
    /// Scrambled Sobol' points.
    Sobol,
}

impl Sampling {
    /// All methods, in the order in which messages and documentation list them.
    pub const ALL: [Self; 2] = [Self::MonteCarlo, Self::Sobol];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::MonteCarlo => "monte_carlo",
            Self::Sobol => "sobol",
        }
    }
}

/// Settings of the Monte Carlo loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonteCarlo {
    /// Realizations of each evaluation, 1 to 10⁷.
    pub realizations: u64,
    /// Seed of the germs, 0 to 2⁶³-1.
    pub seed: u64,
    /// Method of drawing the germs.
    pub sampling: Sampling,
    /// Number of independent scrambles of the Sobol' points, 1 to
    /// [`crate::limits::SCRAMBLES_MAX`]. It divides `realizations`, and is 1 with [`Sampling::MonteCarlo`].
    pub scrambles: u64,
    /// Whether the moments are corrected by the control variate √(c1111/ρ), whose moments under the
    /// law are known.
    pub control_variate: bool,
    /// Largest fraction of failures of a feasible point, judged by the number of realizations; 0 to 1.
    pub max_failed_fraction: f64,
}

impl Default for MonteCarlo {
    fn default() -> Self {
        Self {
            realizations: 2747,
            seed: 1,
            sampling: Sampling::MonteCarlo,
            scrambles: 1,
            control_variate: false,
            max_failed_fraction: 0.01,
        }
    }
}

impl MonteCarlo {
    /// Returns the source of the germs.
    pub fn germs(&self) -> GermSource {
        let scheme = match self.sampling {
            Sampling::MonteCarlo => GermScheme::Streams,
            Sampling::Sobol => GermScheme::Sobol { points: self.points() },
        };
        GermSource { seed: self.seed, scheme }
    }

    /// Returns the number of realizations of each scramble.
    pub fn points(&self) -> u64 {
        self.realizations / self.scrambles.max(1)
    }
}

impl Section for MonteCarlo {
    fn declare(&mut self, fields: &mut dyn Fields) {
        fields.whole(
            Key { name: "realizations", meaning: "number of realizations of each evaluation" },
            &mut self.realizations,
            WholeRange::new(1, REALIZATIONS_MAX),
        );
        fields.whole(
            Key { name: "seed", meaning: "seed of the random numbers ([germs](glossary.md))" },
            &mut self.seed,
            WholeRange::new(0, SEED_MAX),
        );
        let sampling = "`\"monte_carlo\"`: independent germs, one ChaCha20 stream per realization; \
                        `\"sobol\"`: scrambled Sobol' points; about a thousand are as accurate as \
                        millions of independent germs ([physics.md](physics.md#scrambled-sobol-points))";
        fields.choice(Key { name: "sampling", meaning: sampling }, &mut self.sampling);
        let scrambles = "with `\"sobol\"`: number of independent scrambles over which the \
                         realizations are divided evenly; with several, standard errors come from \
                         their scatter. Must divide `realizations`; must be 1 with `\"monte_carlo\"`";
        fields.whole(
            Key { name: "scrambles", meaning: scrambles },
            &mut self.scrambles,
            WholeRange::new(1, SCRAMBLES_MAX),
        );
        let control_variate = "`true`: the moments are corrected by those of √(c1111/ρ), which are \
                               known exactly ([physics.md](physics.md#the-control-variate)); not used \
                               at a point at which any realization failed";
        fields.boolean(
            Key { name: "control_variate", meaning: control_variate },
            &mut self.control_variate,
        );
        let max_failed = "a point of a search is infeasible if its failed realizations are evidence (5 % level) that \
                          more than this share of all fail; a propagation fails if more than this share of its own do";
        fields.number(
            Key { name: "max_failed_fraction", meaning: max_failed },
            &mut self.max_failed_fraction,
            Number::within(Interval::from_to(0.0, 1.0, "")),
        );
    }
}
