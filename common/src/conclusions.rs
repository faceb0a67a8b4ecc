//! The conclusions from data that results contain, as plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::moments::Moments;
use crate::observables::ObservableValues;
use crate::parameters::{Parameter, Point};
use crate::posterior::Posterior;
use crate::shift::SystematicQuantity;

/// Conclusions from one set of data: the parameters that it determines, and the points that match
/// it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conclusions {
    /// Identified quantities; `None` if the derivatives were not measured, or cannot be computed.
    pub inference: Option<Inference>,
    /// Profiles of the cost, one for each free parameter; empty for a likelihood, and if there are
    /// priors or other observables.
    pub profiles: Vec<Profile>,
    /// The solutions from all starts; `None` for a single start.
    pub solutions: Option<Solutions>,
    /// The posterior; `None` unless the job asks for it.
    pub posterior: Option<Posterior>,
}

/// Conclusions from the data about the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Inference {
    /// Whether the model matches the data within the noise.
    pub matched: bool,
    /// Confidence level of all intervals.
    pub level: f64,
    /// Errors of both moments.
    pub noise: NoiseErrors,
    /// The free parameters, in the order of the directions' components.
    pub free: Vec<Parameter>,
    /// Derivatives of both moments.
    pub sensitivities: Vec<Sensitivity>,
    /// Directions that the data determine, by decreasing singular value.
    pub fixed: Vec<Direction>,
    /// Orthonormal directions that the data leave free.
    pub undetermined: Vec<Vec<f64>>,
    /// √(c1111/ρ), m/s.
    pub bulk_velocity: DerivedQuantity,
    /// The dispersion.
    pub dispersion: DerivedQuantity,
    /// The free parameters themselves; their uncertainty is known only if no direction is left
    /// free.
    pub parameters: Vec<(Parameter, DerivedQuantity)>,
    /// For each quantity with an interval, the share of each source of error in its variance. Empty if the job has
    /// no systematic errors.
    pub budget: Vec<VarianceBudget>,
    /// Errors of each quantity with an interval, by their sources. Empty unless groups are pooled.
    pub errors: Vec<QuantityErrors>,
}

/// A quantity with its errors, on a scale on which they are nearly normal. An error is positive where it moves the
/// quantity up.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantityErrors {
    /// The quantity.
    pub quantity: BudgetQuantity,
    /// The scale.
    pub scale: ErrorScale,
    /// The value on that scale, corrected for the bias that a coefficient of variation of few velocities has.
    pub estimate: f64,
    /// Standard error by the noise of the data.
    pub data: f64,
    /// Degrees of freedom behind it: one less than there are independent velocities, or subjects.
    pub freedom: u64,
    /// Change of the estimate by one standard error of each compared moment of the model, which sampling makes.
    pub sampling: Vec<f64>,
    /// Change of the estimate by one standard deviation of each uncertain quantity of the setup.
    pub systematic: Vec<(SystematicQuantity, f64)>,
}

/// A scale of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorScale {
    /// The natural logarithm of the quantity in its unit.
    Logarithm,
    /// The quantity itself.
    Value,
}

impl ErrorScale {
    /// Returns the quantity, given its place on the scale.
    pub fn quantity_at(self, place: f64) -> f64 {
        match self {
            Self::Logarithm => libm::exp(place),
            Self::Value => place,
        }
    }
}

/// The parts of the variance of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceBudget {
    /// The quantity.
    pub quantity: BudgetQuantity,
    /// The parts, which add up to 1.
    pub contributions: Vec<VariancePart>,
}

/// A quantity whose variance is told by its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BudgetQuantity {
    /// √(c1111/ρ).
    BulkVelocity,
    /// A free parameter.
    Parameter(Parameter),
}

/// A part of a variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VariancePart {
    /// Where it comes from.
    pub source: BudgetSource,
    /// Its part of the whole variance, 0 to 1.
    pub variance_share: f64,
}

/// Where a part of a variance comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BudgetSource {
    /// The noise of the data.
    Data,
    /// The finite number of realizations of the model.
    Sampling,
    /// A systematic error: a quantity of the setup that is not known exactly.
    Systematic(SystematicQuantity),
}

impl BudgetQuantity {
    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::BulkVelocity => "bulk_velocity",
            Self::Parameter(parameter) => parameter.name(),
        }
    }
}

impl BudgetSource {
    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Sampling => "sampling",
            Self::Systematic(source) => source.name(),
        }
    }
}

/// A direction of the box that the data determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Singular value: change of ln v, ln Δ and, of the observables that were measured, of their means
    /// relative to those of the data, together, for a step across the box.
    pub singular_value: f64,
    /// Unit vector with a component for each free parameter, in units of the box.
    pub components: Vec<f64>,
}

/// A quantity derived from the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DerivedQuantity {
    /// Its value at the best point, in its unit.
    pub value: f64,
    /// Its uncertainty; `None` if the data do not determine it.
    pub known: Option<Uncertainty>,
}

/// Uncertainty of a quantity, as far as the data determine it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Standard error.
    pub standard_error: f64,
    /// Confidence interval.
    pub interval: [f64; 2],
    /// Fraction of its gradient, in units of the box, that lies in directions which the data leave
    /// free: sine of the angle between the gradient and the directions that they determine.
    pub free_share: f64,
}

/// Derivatives of both moments along one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: Parameter,
    /// Relative change of the mean for a relative change of the parameter, ∂ ln v / ∂ ln p.
    pub mean: f64,
    /// The same for the coefficient of variation, ∂ ln Δ / ∂ ln p.
    pub coefficient_of_variation: f64,
    /// The same for the means of the measured observables, relative to those of the data.
    pub observables: ObservableValues,
}

/// Relative standard errors of both moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseErrors {
    /// Errors due to the noise of the data; `None` if only their moments are known, and not the number
    /// of velocities behind them.
    pub data: Option<Moments>,
    /// Errors due to sampling.
    pub sampling: Moments,
}

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The parameter.
    pub parameter: Parameter,
    /// Its values, equidistant from the lower bound to the upper, in its unit.
    pub values: Vec<f64>,
    /// The lowest cost with the parameter at each value and the other free ones anywhere within
    /// their bounds; infinite if no such point is admissible.
    pub costs: Vec<f64>,
}

/// The solutions of searches from several starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Solutions {
    /// The best point of each start that found a feasible one.
    pub points: Vec<Solution>,
    /// Number of them that match the data as well as the best one, or within the tolerance of the
    /// search.
    pub matching: u64,
    /// Spreads over these points; `None` if there are none.
    pub spread: Option<Spreads>,
}

/// The best point of the search from one start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Number of the start, from 0.
    pub start: u32,
    /// The evaluated point.
    pub point: Point,
    /// Its cost.
    pub cost: f64,
    /// Number of evaluations of this search.
    pub evaluations: u64,
}

/// Smallest, largest and mean value of a quantity over several solutions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spread {
    /// Smallest value.
    pub smallest: f64,
    /// Largest value.
    pub largest: f64,
    /// Mean value.
    pub mean: f64,
}

/// Spreads over a set of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Spreads {
    /// Spread of each parameter that the points have ([`Point::given`]), in their order.
    pub parameters: Vec<(Parameter, Spread)>,
    /// Spreads of the entries of the elasticity matrix on and above the diagonal, row by row, with
    /// row and column from 0 (Pa, Kelvin-Mandel).
    pub entries: Vec<(usize, usize, Spread)>,
}
