//! What is concluded from data, as results carry it: plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::moments::Moments;
use crate::parameters::{Parameter, Point};

/// What one set of data says, and which points match it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conclusions {
    /// What is identified; `None` where the derivatives were not measured, or cannot be told.
    pub inference: Option<Inference>,
    /// Profiles of the cost, one for each free parameter; none of a likelihood, and none with priors.
    pub profiles: Vec<Profile>,
    /// The answers from all starts; `None` of a single start.
    pub solutions: Option<Solutions>,
}

/// What the data say.
#[derive(Debug, Clone, PartialEq)]
pub struct Inference {
    /// Whether the model matches the data to within noise.
    pub matched: bool,
    /// Level of all intervals.
    pub level: f64,
    /// Errors of both moments.
    pub noise: NoiseErrors,
    /// The free parameters, in the order of the components of directions.
    pub free: Vec<Parameter>,
    /// Derivatives of both moments.
    pub sensitivities: Vec<Sensitivity>,
    /// Directions that the data fix, that of the largest singular value first.
    pub fixed: Vec<Direction>,
    /// Orthonormal directions that the data leave free.
    pub undetermined: Vec<Vec<f64>>,
    /// √(c1111/ρ), m/s.
    pub bulk_velocity: Quantity,
    /// The dispersion.
    pub dispersion: Quantity,
    /// The free parameters themselves, known only where no direction is left free.
    pub parameters: Vec<(Parameter, Quantity)>,
}

/// A direction of the box that the data fix.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Singular value: change of ln v and ln Δ, together, for a step over the box.
    pub singular_value: f64,
    /// Unit vector, a component for each free parameter, in units of the box.
    pub components: Vec<f64>,
}

/// A quantity that follows from the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Its value at the best point, in its unit.
    pub value: f64,
    /// What noise makes of it.
    pub known: Option<Known>,
}

/// How well a quantity is known, as far as the data say anything of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Standard error.
    pub standard_error: f64,
    /// Ends of its confidence interval.
    pub interval: [f64; 2],
    /// Share of its gradient, in units of the box, that lies in directions which the data leave
    /// free: sine of the angle between it and those that they fix.
    pub free_share: f64,
}

/// Derivatives of both moments along one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: Parameter,
    /// Relative change of the mean for a relative change of the parameter, ∂ ln v / ∂ ln p.
    pub mean: f64,
    /// That of the coefficient of variation, ∂ ln Δ / ∂ ln p.
    pub coefficient_of_variation: f64,
}

/// Relative standard errors of both moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseErrors {
    /// By the noise of the data; `None` where only their moments are known.
    pub data: Option<Moments>,
    /// By sampling.
    pub sampling: Moments,
}

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The parameter.
    pub parameter: Parameter,
    /// Its values, evenly from the lower bound to the upper, in its unit.
    pub values: Vec<f64>,
    /// The lowest cost with the parameter there and the other free ones anywhere in their bounds;
    /// infinite where no such point is admissible.
    pub costs: Vec<f64>,
}

/// The answers of searches from several starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Solutions {
    /// The best point of each start that found a feasible one.
    pub points: Vec<Solution>,
    /// How many of them match the data as well as the best one, or to the tolerance of the search.
    pub matching: u64,
    /// Spreads over these; `None` if there are none.
    pub spread: Option<Spreads>,
}

/// The best point of the search from one start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Number of the start, from 0.
    pub start: u32,
    /// The point.
    pub point: Point,
    /// Its cost.
    pub cost: f64,
    /// Evaluations of this search.
    pub evaluations: u64,
}

/// Smallest, largest and mean value of something over solutions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spread {
    /// Smallest.
    pub smallest: f64,
    /// Largest.
    pub largest: f64,
    /// Mean.
    pub mean: f64,
}

/// Spreads over a set of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Spreads {
    /// Of each parameter.
    pub parameters: [Spread; 7],
    /// Of the entries of the elasticity matrix in and above the diagonal, row by row, with row and
    /// column from 0 (Pa, Kelvin-Mandel).
    pub entries: Vec<(usize, usize, Spread)>,
}
