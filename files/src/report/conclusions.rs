//! Types of the conclusions: quantities that the data determine, and directions they leave open.

use std::collections::BTreeMap;

use osteon_common::inference::{Conclusions, DerivedQuantity, Inference, Spread};
use osteon_common::parameters::Parameter;
use osteon_common::results;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::schema::keyed_by_parameter;
use super::{MeanModel, MomentSlopes, Moments, finite_or_null};

/// The quantities that the data determine, to first order around the best point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identified {
    /// Whether the model reproduces each moment of the data to within three standard errors (data and
    /// sampling noise combined), or to within a relative difference of 1e-4; if not, nothing is known.
    pub matched: bool,
    /// Level of all intervals.
    pub level: f64,
    /// Relative standard errors of both moments.
    pub noise: Noise,
    /// √(c1111/ρ), m/s, with the other parameters held as found.
    pub bulk_velocity: QuantityEstimate,
    /// Dispersion of the elasticity, with the other parameters held as found.
    pub dispersion: QuantityEstimate,
    /// The free parameters in their units; null where a direction is left free, because then no single
    /// parameter is known, and where the bounds may contain a second value with the same velocity.
    #[schemars(transform = keyed_by_parameter)]
    pub parameters: BTreeMap<Parameter, Option<QuantityEstimate>>,
    /// Directions of the box that the data fix.
    pub directions: Vec<Direction>,
    /// Orthonormal directions of the box that the data leave free: a component for each free parameter.
    pub free_directions: Vec<BTreeMap<Parameter, f64>>,
}

impl From<&Inference> for Identified {
    fn from(found: &Inference) -> Self {
        let components = |components: &[f64]| -> BTreeMap<Parameter, f64> {
            found.free.iter().copied().zip(components.iter().copied()).collect()
        };
        let direction = |direction: &osteon_common::inference::Direction| Direction {
            singular_value: direction.singular_value,
            components: components(&direction.components),
        };
        let parameter = |(parameter, quantity): &(Parameter, DerivedQuantity)| {
            (*parameter, quantity.known.map(|_| quantity.into()))
        };
        Self {
            matched: found.matched,
            level: found.level,
            noise: Noise {
                data: found.noise.data.map(Moments::from),
                sampling: found.noise.sampling.into(),
            },
            bulk_velocity: (&found.bulk_velocity).into(),
            dispersion: (&found.dispersion).into(),
            parameters: found.parameters.iter().map(parameter).collect(),
            directions: found.fixed.iter().map(direction).collect(),
            free_directions: found.undetermined.iter().map(|one| components(one)).collect(),
        }
    }
}

/// Relative standard errors of both moments, by their causes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Noise {
    /// Errors by the noise of the data; null where only their moments are known, and not `data.count`.
    pub data: Option<Moments>,
    /// Errors by the sampling of the model.
    pub sampling: Moments,
}

/// A quantity with what noise makes of it; null where the data say nothing of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QuantityEstimate {
    /// Value at the best point.
    pub value: Option<f64>,
    /// Standard error, in the unit of the value.
    pub standard_error: Option<f64>,
    /// Lower and upper end of the confidence interval.
    pub interval: Option<[Option<f64>; 2]>,
    /// Share of the gradient that lies in directions which the data leave free, 0 to 1.
    pub free_share: Option<f64>,
}

impl QuantityEstimate {
    /// Both ends of the interval, where they are known.
    pub fn ends(&self) -> Option<[f64; 2]> {
        let [lower, upper] = self.interval?;
        Some([lower?, upper?])
    }
}

impl From<&DerivedQuantity> for QuantityEstimate {
    fn from(quantity: &DerivedQuantity) -> Self {
        let known = quantity.known;
        Self {
            value: finite_or_null(quantity.value),
            standard_error: known.and_then(|known| finite_or_null(known.standard_error)),
            interval: known.map(|known| known.interval.map(finite_or_null)),
            free_share: known.and_then(|known| finite_or_null(known.free_share)),
        }
    }
}

/// What makes the variance of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QuantityBudget {
    /// `bulk_velocity`, or a free parameter.
    pub quantity: String,
    /// The parts, which add up to 1.
    pub contributions: Vec<Contribution>,
}

/// A part of a variance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contribution {
    /// `data`, `sampling`, or a key of the job's `systematic`.
    pub source: String,
    /// Part of the whole variance, 0 to 1.
    pub variance_share: f64,
}

/// Returns the budgets of all quantities that have one.
pub(super) fn budget(found: &Inference) -> Vec<QuantityBudget> {
    let contribution = |one: &osteon_common::inference::VariancePart| Contribution {
        source: one.source.name().to_owned(),
        variance_share: one.variance_share,
    };
    let budget = |one: &osteon_common::inference::VarianceBudget| QuantityBudget {
        quantity: one.quantity.name().to_owned(),
        contributions: one.contributions.iter().map(contribution).collect(),
    };
    found.budget.iter().map(budget).collect()
}

/// A direction of the box that the data fix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Direction {
    /// Change of the logarithms of both moments, together, for a step over the box.
    pub singular_value: f64,
    /// Component of the unit vector for each free parameter, in units of the bounds.
    #[schemars(transform = keyed_by_parameter)]
    pub components: BTreeMap<Parameter, f64>,
}

/// The derivatives ∂ ln v/∂ ln p and ∂ ln Δ/∂ ln p for each free parameter p.
pub(super) fn sensitivities(found: &Inference) -> BTreeMap<Parameter, MomentSlopes> {
    let slopes = found.sensitivities.iter().map(|one| {
        let coefficient_of_variation = one.coefficient_of_variation;
        let moments = results::Moments { mean: one.mean, coefficient_of_variation }.into();
        (one.parameter, MomentSlopes { moments, observables: one.observables })
    });
    slopes.collect()
}

/// The lowest cost with one parameter held, the others anywhere in their bounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterProfile {
    /// Values of the parameter from bound to bound, in its unit.
    pub values: Vec<f64>,
    /// Lowest cost at each value; null where no admissible point has the parameter there.
    pub costs: Vec<Option<f64>>,
}

/// The profiles by their parameters.
pub(super) fn profiles(conclusions: &Conclusions) -> BTreeMap<Parameter, ParameterProfile> {
    let profiles = conclusions.profiles.iter().map(|profile| {
        let costs = profile.costs.iter().copied().map(finite_or_null).collect();
        (profile.parameter, ParameterProfile { values: profile.values.clone(), costs })
    });
    profiles.collect()
}

/// The solutions of the searches from several starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Solutions {
    /// Number of solutions that match the data as well as the best one, or to the tolerance of the search.
    pub matching: u64,
    /// Ranges over the matching solutions; null if there are none.
    pub spread: Option<Spreads>,
    /// The best point of each start that found a feasible one.
    pub points: Vec<Solution>,
}

impl From<&osteon_common::inference::Solutions> for Solutions {
    fn from(solutions: &osteon_common::inference::Solutions) -> Self {
        Self {
            matching: solutions.matching,
            spread: solutions.spread.as_ref().map(Spreads::from),
            points: solutions.points.iter().map(Solution::from).collect(),
        }
    }
}

/// Ranges over the solutions that match the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spreads {
    /// Ranges of the parameters, in their units.
    #[schemars(transform = keyed_by_parameter)]
    pub parameters: BTreeMap<Parameter, Spread>,
    /// Ranges of the entries of the elasticity matrix (Kelvin-Mandel, Pa), named by row and column from
    /// `11` to `66`.
    pub mandel: BTreeMap<String, Spread>,
}

impl From<&osteon_common::inference::Spreads> for Spreads {
    fn from(spreads: &osteon_common::inference::Spreads) -> Self {
        let entry = |(row, column, spread): &(usize, usize, Spread)| {
            (format!("{}{}", row + 1, column + 1), *spread)
        };
        Self {
            parameters: spreads.parameters.iter().copied().collect(),
            mandel: spreads.entries.iter().map(entry).collect(),
        }
    }
}

/// The best point of the search from one start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Solution {
    /// Number of the start, from 0.
    pub start: u32,
    /// Cost of the point.
    pub cost: Option<f64>,
    /// Number of evaluations of this search.
    pub evaluations: u64,
    /// The mean model at the point.
    pub parameters: MeanModel,
    /// Dispersion of the elasticity at the point.
    pub dispersion: Option<f64>,
}

impl From<&osteon_common::inference::Solution> for Solution {
    fn from(solution: &osteon_common::inference::Solution) -> Self {
        Self {
            start: solution.start,
            cost: finite_or_null(solution.cost),
            evaluations: solution.evaluations,
            parameters: (&solution.point).into(),
            dispersion: finite_or_null(solution.point.dispersion()),
        }
    }
}
