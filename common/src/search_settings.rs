//! Settings of the search: objective, method, limits, priors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accepted::{Interval, WholeRange};
use crate::fields::{self, Fields, Key, Number, Section};
use crate::limits::{EVALUATIONS_MAX, STARTS_MAX};
use crate::parameters::PARAMETERS;

fields::choices!(Objective, SearchMethod);

/// The function to be minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// The paper's cost: relative squared errors of mean and coefficient of variation.
    #[default]
    Moments,
    /// χ²: the squared differences of the logarithms of mean and coefficient of variation, weighted
    /// by the inverse covariance of the data's noise.
    ChiSquare,
    /// Minus the mean log likelihood of the measured velocities under the law of the model's
    /// velocities.
    Likelihood,
}

impl Objective {
    /// All objectives, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Moments, Self::Likelihood, Self::ChiSquare];

    /// Returns whether the cost depends on the two moments alone, and is 0 where both match.
    pub fn is_of_moments(self) -> bool {
        match self {
            Self::Moments | Self::ChiSquare => true,
            Self::Likelihood => false,
        }
    }

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Moments => "moments",
            Self::ChiSquare => "chi_square",
            Self::Likelihood => "likelihood",
        }
    }
}

/// Method of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SearchMethod {
    /// The Nelder-Mead simplex, the paper's method.
    #[default]
    Simplex,
    /// Minimum-norm Gauss-Newton steps with Broyden's updates.
    Newton,
    /// No search: the posterior alone.
    Posterior,
}

impl SearchMethod {
    /// All methods, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Simplex, Self::Newton, Self::Posterior];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simplex => "simplex",
            Self::Newton => "newton",
            Self::Posterior => "posterior",
        }
    }
}

/// A value of a free parameter that is expected from prior knowledge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Prior {
    /// The value, within the parameter's bounds, in its unit.
    pub value: f64,
    /// Increase of the cost if the parameter is off by the full width of its bounds, above 0; for
    /// smaller distances it decreases with their square.
    pub weight: f64,
}

/// Default of [`Search::cost_tolerance`] with [`Objective::ChiSquare`]: a hundredth of a standard
/// error of the data.
const CHI_SQUARE_TOLERANCE: f64 = 1e-4;

/// Settings of the search loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Method of the search.
    pub method: SearchMethod,
    /// Maximum number of evaluations (points whose realizations are computed).
    pub max_evaluations: u64,
    /// The search ends when the best cost is at most this; not used for a likelihood, whose lowest
    /// cost is unknown beforehand.
    pub cost_tolerance: f64,
    /// The search ends when the simplex, or a step without sufficient gain, is at most this large,
    /// as a fraction of the box.
    pub size_tolerance: f64,
    /// Edge of the first simplex, as a fraction of the box; not used by other methods.
    pub initial_step: f64,
    /// Number of searches of each set of data: the first begins at the start of the parameters, the
    /// others at random points of the box; 1 to [`crate::limits::STARTS_MAX`].
    pub starts: u64,
    /// Index of the first start: 0 is the point given by the parameters' `start`, k the k-th random
    /// point.
    pub first_start: u64,
    /// Whether the derivatives of both moments are measured at the end, by one evaluation for each
    /// free parameter.
    pub sensitivities: bool,
    /// Values that are expected for the free ones of
    /// [`Parameter::ALL`](crate::parameters::Parameter::ALL), in that order.
    pub priors: [Option<Prior>; PARAMETERS],
}

impl Search {
    /// Returns the default settings of a method.
    pub fn by(method: SearchMethod) -> Self {
        Self {
            method,
            max_evaluations: 400,
            cost_tolerance: Self::default_tolerance(method, Objective::Moments),
            size_tolerance: 1e-5,
            initial_step: 0.15,
            starts: 1,
            first_start: 0,
            sensitivities: true,
            priors: [None; PARAMETERS],
        }
    }

    /// Returns the cost that ends a search by default.
    pub fn default_tolerance(method: SearchMethod, objective: Objective) -> f64 {
        match (objective, method) {
            (Objective::ChiSquare, _) => CHI_SQUARE_TOLERANCE,
            (_, SearchMethod::Simplex | SearchMethod::Posterior) => 1e-10,
            (_, SearchMethod::Newton) => 1e-12,
        }
    }
}

impl Default for Search {
    fn default() -> Self {
        Self::by(SearchMethod::default())
    }
}

impl Section for Objective {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let kind = "`\"moments\"`: the paper's cost; `\"chi_square\"`: the same differences weighted by \
                    the noise of the data ([searches.md](searches.md#chi-square)), which is the \
                    default of a search where velocities or `data.count` are given; \
                    `\"likelihood\"`: minus the mean log likelihood \
                    of the measured velocities under the model's distribution \
                    ([searches.md](searches.md#likelihood)); it requires velocities, the search \
                    `\"simplex\"` and at least two realizations";
        fields.choice(Key { name: "kind", meaning: kind }, self);
    }
}

impl Section for Search {
    fn declare(&mut self, fields: &mut dyn Fields) {
        self.declare_method(fields);
        let max_evaluations = "maximum number of evaluations of each search (from one start, for one \
                               group); all searches of a job together may have at most 1 000 000";
        fields.whole(
            Key { name: "max_evaluations", meaning: max_evaluations },
            &mut self.max_evaluations,
            WholeRange::new(1, EVALUATIONS_MAX),
        );
        self.declare_tolerances(fields);
        let starts = "number of searches for each set of data: the first from the point given by \
                      the parameters' `start`, the others from random points of the box \
                      ([searches.md](searches.md#several-starts))";
        fields.whole(
            Key { name: "starts", meaning: starts },
            &mut self.starts,
            WholeRange::new(1, STARTS_MAX),
        );
        let first_start = "index of the first start: 0 is the point given by the parameters' `start`, k \
                           the k-th random point. `first_start = 10` continues a job that had \
                           `starts = 10`";
        fields.whole(
            Key { name: "first_start", meaning: first_start },
            &mut self.first_start,
            WholeRange::new(0, STARTS_MAX),
        );
        let sensitivities = "after the search the derivatives of both moments are computed at the \
                             best point, with one evaluation for each free parameter; `identified` in \
                             the result requires them \
                             ([searches.md](searches.md#identifiability-and-intervals))";
        fields.boolean(
            Key { name: "sensitivities", meaning: sensitivities },
            &mut self.sensitivities,
        );
        let priors = "for each free parameter that has one: `{ value = …, weight = … }`; the cost \
                      grows by weight × ((p - value)/(upper - lower))² \
                      ([searches.md](searches.md#priors)). The value must be within the bounds, the \
                      weight above 0; only with `\"simplex\"`";
        fields.custom_table(Key { name: "priors", meaning: priors });
    }
}

impl Search {
    fn declare_method(&mut self, fields: &mut dyn Fields) {
        let before = self.method;
        let method = "`\"simplex\"`: Nelder-Mead with the standard coefficients; `\"newton\"`: \
                      Gauss-Newton steps to the matching point nearest to the start \
                      ([searches.md](searches.md)), which requires at least two realizations; \
                      `\"posterior\"`: no search, the posterior alone, with the defaults of \
                      `[posterior]` if that is left out";
        fields.choice(Key { name: "method", meaning: method }, &mut self.method);
        if self.method != before {
            *self = Self::by(self.method);
        }
    }

    fn declare_tolerances(&mut self, fields: &mut dyn Fields) {
        let cost_tolerance = "the search ends at a cost of at most this (default with `\"newton\"`: \
                              1e-12, with the objective `\"chi_square\"`: 1e-4); with `\"likelihood\"` it has no effect: the search ends when \
                              `size_tolerance` is reached";
        fields.number(
            Key { name: "cost_tolerance", meaning: cost_tolerance },
            &mut self.cost_tolerance,
            Number::within(Interval::from(0.0, "")),
        );
        let size_tolerance = "the search also ends if it no longer improves and the simplex has shrunk \
                              to this fraction of the box, or the step of `\"newton\"` is at most \
                              this long";
        fields.number(
            Key { name: "size_tolerance", meaning: size_tolerance },
            &mut self.size_tolerance,
            Number::within(Interval::from_below(0.0, 1.0, "of the box")),
        );
        // A step of at most half the box fits from any start, upwards or downwards.
        fields.number(
            Key {
                name: "initial_step",
                meaning: "edge of the first simplex; other methods have no use for it",
            },
            &mut self.initial_step,
            Number::within(Interval::above_to(0.0, 0.5, "of the box")),
        );
    }
}
