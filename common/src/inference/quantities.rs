//! Quantities with their intervals, which stay within what the law of the elasticity allows.

use std::array;

use super::linear::{Linear, NoiseResponse};
use super::noise::{NORMAL, Noise};
use super::systematic::{Effects, contributions, quadratic};
use crate::conclusions::{
    BudgetQuantity, DerivedQuantity, ErrorScale, QuantityErrors, Uncertainty, VarianceBudget,
};
use crate::data_statistics::{FewIntervals, intervals_of_data};
use crate::ensemble::DISPERSION_MAX;
use crate::job::{Data, JobSpecification, Range};
use crate::moments::{ConfidenceInterval, MOMENTS, MomentMatrix, MomentVector};
use crate::parameters::{Parameter, ParameterScale, Point};
use crate::results::BestPoint;

/// How far the logarithm of a mean velocity may be off the closed form, ln √(c1111/ρ), between two
/// values of e_L.
const CLOSED_FORM_ERROR: f64 = 0.01;
/// Relative error of the e_L at which the closed form has its minimum.
const LEAST_STIFFNESS_ERROR: f64 = 0.1;
/// How far the middle of the 95 % interval of ln Δ is above its mean, in variances of ln Δ: (z² - 1)/6 times the
/// skewness of the logarithm of χ², which is twice the standard deviation of ln Δ (E. A. Cornish, R. A. Fisher,
/// Rev. Inst. Int. Stat. 5 (1938)), to 5e-3 from four degrees of freedom on.
const SKEWNESS: f64 = (NORMAL * NORMAL - 1.0) / 3.0;

/// Distances of the ends of the intervals of ln v and ln Δ, below and above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LogarithmicEnds {
    mean: [f64; 2],
    variation: [f64; 2],
}

impl LogarithmicEnds {
    /// Returns them for a set of independent velocities whose number is known.
    pub(super) fn of_data(data: &Data, set: usize) -> Option<Self> {
        let FewIntervals { mean, coefficient_of_variation } = intervals_of_data(data, set)?;
        let found = data.moments(set);
        let distances = |interval: ConfidenceInterval, value: f64| {
            [libm::log(value / interval.low), libm::log(interval.high / value)]
        };
        // The mean's interval is symmetric, and is meant for the logarithm as well.
        let half = 0.5 * (mean.high - mean.low) / found.mean;
        Some(Self {
            mean: [half; 2],
            variation: distances(coefficient_of_variation, found.coefficient_of_variation),
        })
    }
}

/// The quantities at a best point.
pub(super) struct Quantities<'a> {
    pub(super) specification: &'a JobSpecification,
    pub(super) best: &'a BestPoint,
    pub(super) linear: &'a Linear,
    pub(super) noise: &'a Noise,
    pub(super) quantile: f64,
    /// Differences of the compared moments that the search has left, data minus model.
    pub(super) residual: MomentVector,
    /// Ends of the intervals of the data's moments, if they are not symmetric.
    pub(super) ends: Option<LogarithmicEnds>,
    /// Whether intervals can be stated.
    pub(super) known: bool,
    /// How far each systematic error moves the moments; `None` if one of these changes was not measured.
    pub(super) effects: Option<&'a Effects>,
}

impl Quantities<'_> {
    /// √(c1111/ρ). Its logarithm is close to normally distributed.
    pub(super) fn bulk_velocity(&self, free: &[Parameter]) -> Option<DerivedQuantity> {
        let (logarithm, gradient) = self.bulk_logarithm(free)?;
        Some(self.of_logarithm(libm::exp(logarithm), &gradient))
    }

    /// Returns ln √(c1111/ρ) with its gradient in units of the box.
    fn bulk_logarithm(&self, free: &[Parameter]) -> Option<(f64, Vec<f64>)> {
        let bulk = self.specification.setup.structure.bulk_velocity(&self.best.point).ok()?;
        let slope = |&parameter: &Parameter| {
            bulk.gradient[parameter as usize] * self.specification.range(parameter).edge()
        };
        Some((bulk.logarithm, free.iter().map(slope).collect()))
    }

    /// Returns the parts of the variances of √(c1111/ρ) and of the free parameters, as far as these are known;
    /// none if everything but the data is known exactly.
    pub(super) fn budget(&self, free: &[Parameter]) -> Vec<VarianceBudget> {
        let Some(effects) = self.effects.filter(|effects| self.known && !effects.is_empty()) else {
            return Vec::new();
        };
        let of = |quantity, gradient: &[f64]| VarianceBudget {
            quantity,
            contributions: contributions(gradient, self.linear, self.noise, effects),
        };
        let bulk = self.bulk_logarithm(free);
        let bulk = bulk.map(|(_, gradient)| of(BudgetQuantity::BulkVelocity, &gradient));
        let parameter = |&parameter: &Parameter| {
            of(BudgetQuantity::Parameter(parameter), &self.along(parameter, free, 1.0))
        };
        let all = bulk.into_iter().chain(free.iter().map(parameter));
        all.filter(|budget| !budget.contributions.is_empty()).collect()
    }

    /// Returns the errors of √(c1111/ρ) and of the free parameters, as far as these are known; none unless groups
    /// are pooled.
    pub(super) fn errors(&self, free: &[Parameter]) -> Vec<QuantityErrors> {
        if !self.specification.groups.pooled {
            return Vec::new();
        }
        let bulk = self.bulk_logarithm(free).and_then(|(logarithm, gradient)| {
            self.errors_of(
                BudgetQuantity::BulkVelocity,
                ErrorScale::Logarithm,
                logarithm,
                &gradient,
            )
        });
        let of_parameter = |(parameter, found): (Parameter, DerivedQuantity)| {
            let DerivedQuantity { value, known } = found;
            known?;
            let quantity = BudgetQuantity::Parameter(parameter);
            let (scale, place, slope) = match parameter.row().scale {
                ParameterScale::Linear => (ErrorScale::Value, value, 1.0),
                _ => (ErrorScale::Logarithm, libm::log(value), 1.0 / value),
            };
            self.errors_of(quantity, scale, place, &self.along(parameter, free, slope))
        };
        let parameters = self.parameters(free).into_iter().filter_map(of_parameter);
        bulk.into_iter().chain(parameters).collect()
    }

    /// Returns the errors of a quantity at a place of a scale, with its gradient on that scale.
    fn errors_of(
        &self,
        quantity: BudgetQuantity,
        scale: ErrorScale,
        place: f64,
        gradient: &[f64],
    ) -> Option<QuantityErrors> {
        let (NoiseResponse { transfer, .. }, data) = (self.response(gradient)?, self.noise.data?);
        let (bias, variance) = self.nearly_normal(&transfer, &data.covariance);
        let left: f64 = transfer.iter().zip(self.residual).map(|(by, left)| by * left).sum();
        let moved =
            |effect: &MomentVector| transfer.iter().zip(effect).map(|(by, to)| by * to).sum();
        let sampling = transfer.iter().zip(self.noise.model).map(|(by, of)| by * of.sqrt());
        let effects = self.effects.into_iter().flatten();
        let errors = QuantityErrors {
            quantity,
            scale,
            estimate: place + bias,
            data: left.mul_add(left, variance).sqrt(),
            freedom: data.freedom,
            sampling: sampling.collect(),
            systematic: effects.map(|(source, effect)| (*source, moved(effect))).collect(),
        };
        (errors.estimate.is_finite() && errors.data.is_finite()).then_some(errors)
    }

    /// Returns what the bias of the coefficient of variation of few data moves a quantity, and its variance by
    /// the data, from the intervals of the moments where these are not symmetric.
    fn nearly_normal(&self, transfer: &MomentVector, covariance: &MomentMatrix) -> (f64, f64) {
        let Some(ends) = &self.ends else {
            // A standard deviation is too low by half the relative variance of its square, which is twice that
            // of its logarithm.
            return (transfer[1] * covariance[1][1], quadratic(transfer, covariance));
        };
        let [below, above] = ends.variation;
        let of_variation = 0.5 * (below + above) / NORMAL;
        let bias = SKEWNESS.mul_add(-of_variation * of_variation, 0.5 * (above - below));
        let deviations: MomentVector = array::from_fn(|axis| match axis {
            0 => ends.mean[0] / self.quantile,
            1 => of_variation,
            _ => covariance[axis][axis].sqrt(),
        });
        let scaled = array::from_fn(|axis| transfer[axis] * deviations[axis]);
        (transfer[1] * bias, quadratic(&scaled, &correlations(covariance)))
    }

    /// The dispersion, whose interval ends where the law does.
    pub(super) fn dispersion(&self, free: &[Parameter]) -> DerivedQuantity {
        let dispersion = self.best.point.dispersion();
        let gradient = self.along(Parameter::Dispersion, free, 1.0 / dispersion);
        let DerivedQuantity { value, known } = self.of_logarithm(dispersion, &gradient);
        let within = |known: Uncertainty| Uncertainty {
            interval: known.interval.map(|end| end.min(DISPERSION_MAX)),
            ..known
        };
        DerivedQuantity { value, known: known.map(within) }
    }

    /// The free parameters. Those that are positive have intervals of their logarithm.
    pub(super) fn parameters(&self, free: &[Parameter]) -> Vec<(Parameter, DerivedQuantity)> {
        let quantity = |&parameter: &Parameter| {
            let value = self.best.point.get(parameter);
            let quantity = match parameter {
                Parameter::Dispersion => self.dispersion(free),
                _ if parameter.row().scale == ParameterScale::Linear => {
                    self.on_linear_scale(parameter, free)
                }
                _ if self.may_have_second_value(parameter) => {
                    DerivedQuantity { value, known: None }
                }
                _ => self.of_logarithm(value, &self.along(parameter, free, 1.0 / value)),
            };
            (parameter, quantity)
        };
        free.iter().map(quantity).collect()
    }

    /// Returns whether the bounds may contain a second value of this parameter with the same velocity,
    /// which the data cannot tell from the first. c1111 does not depend on the sign of ν_L, and has a
    /// minimum in e_L ([`modulus_of_least_stiffness`]).
    fn may_have_second_value(&self, parameter: Parameter) -> bool {
        let Range::Free { lower, upper, .. } = self.specification.range(parameter) else {
            return false;
        };
        let value = self.best.point.get(parameter);
        match parameter {
            Parameter::LongitudinalPoissonRatio => (lower..=upper).contains(&-value),
            Parameter::LongitudinalYoungModulus => {
                let least = modulus_of_least_stiffness(&self.best.point);
                let (beyond, other) = match value > least {
                    true => (lower < least * (1.0 + LEAST_STIFFNESS_ERROR), lower),
                    false => (upper > least * (1.0 - LEAST_STIFFNESS_ERROR), upper),
                };
                beyond
                    && self.logarithm_at(parameter, other)
                        > self.logarithm_at(parameter, value) - CLOSED_FORM_ERROR
            }
            _ => false,
        }
    }

    /// Returns ln √(c1111/ρ) at the best point, but with this value; infinite where it is not
    /// admissible, since c1111 grows without bound towards such values.
    fn logarithm_at(&self, parameter: Parameter, value: f64) -> f64 {
        let mut point = self.best.point;
        point.0[parameter as usize] = value;
        self.specification.setup.structure.bulk_logarithm(&point).unwrap_or(f64::INFINITY)
    }

    /// Returns a parameter whose interval ends where its law does, or its values.
    fn on_linear_scale(&self, parameter: Parameter, free: &[Parameter]) -> DerivedQuantity {
        let value = self.best.point.get(parameter);
        let known = self.response(&self.along(parameter, free, 1.0)).map(|response| {
            let [lowest, highest] = admissible(parameter, &self.best.point);
            let [below, above] = self.reaches(&response);
            let interval = [(value - below).max(lowest), (value + above).min(highest)];
            let NoiseResponse { deviation, free_share, .. } = response;
            Uncertainty { standard_error: deviation, interval, free_share }
        });
        DerivedQuantity { value, known }
    }

    /// Returns the gradient, in units of the box, of a quantity that depends on one parameter alone,
    /// with this derivative.
    fn along(&self, parameter: Parameter, free: &[Parameter], derivative: f64) -> Vec<f64> {
        let slope = |other: &Parameter| match *other == parameter {
            true => derivative * self.specification.range(parameter).edge(),
            false => 0.0,
        };
        free.iter().map(slope).collect()
    }

    /// Returns a quantity, given the gradient of its logarithm in units of the box.
    fn of_logarithm(&self, value: f64, gradient: &[f64]) -> DerivedQuantity {
        let known = self.response(gradient).map(|response| {
            let NoiseResponse { deviation, free_share, .. } = response;
            let [below, above] = self.reaches(&response).map(libm::exp);
            let interval = [value / below, value * above];
            Uncertainty { standard_error: value * deviation, interval, free_share }
        });
        DerivedQuantity { value, known }
    }

    /// Returns how far an interval reaches below and above the value: the effect of the noise, plus
    /// the distance by which the solution would move if the residual were removed.
    fn reaches(&self, response: &NoiseResponse) -> [f64; 2] {
        let left = response.transfer.iter().zip(self.residual).map(|(by, left)| by * left);
        let left: f64 = left.sum();
        let of_noise = match (&self.ends, &self.noise.data) {
            (Some(ends), Some(data)) => self.combined(response.transfer, ends, &data.covariance),
            _ => [self.quantile * response.deviation; 2],
        };
        of_noise.map(|reach| reach + left.abs())
    }

    /// Combines the intervals of the moments, which are not symmetric, by the squares of the distances
    /// of their ends (MOVER: G. Y. Zou, "Toward using confidence intervals to compare correlations",
    /// Psychol. Methods 12 (2007)), with what does not come from the data.
    fn combined(
        &self,
        transfer: MomentVector,
        ends: &LogarithmicEnds,
        covariance: &MomentMatrix,
    ) -> [f64; 2] {
        let correlation = correlations(covariance);
        let ends: [[f64; 2]; MOMENTS] = array::from_fn(|axis| match axis {
            0 => ends.mean,
            1 => ends.variation,
            _ => [self.quantile * covariance[axis][axis].sqrt(); 2],
        });
        let by_sampling = transfer.iter().zip(self.noise.model);
        let sampling: f64 = by_sampling.map(|(by, variance)| by * by * variance).sum();
        let beside_data = sampling + quadratic(&transfer, &self.noise.systematic);
        [0, 1].map(|side| {
            // An end of the quantity comes from the same end of a moment that raises it.
            let part = |axis: usize| match transfer[axis] {
                0.0 => 0.0,
                transfer if transfer > 0.0 => transfer * ends[axis][side],
                transfer => transfer * ends[axis][1 - side],
            };
            let parts: MomentVector = array::from_fn(part);
            if !parts.iter().all(|part| part.is_finite()) {
                return f64::INFINITY;
            }
            let pairs = (0..MOMENTS).flat_map(|i| (0..i).map(move |j| (i, j)));
            let both: f64 = pairs.map(|(i, j)| correlation[i][j] * parts[i] * parts[j]).sum();
            let own: f64 = parts.iter().map(|part| part * part).sum();
            ((own + 2.0 * both).max(0.0) + NORMAL * NORMAL * beside_data).sqrt()
        })
    }

    /// Returns the effect of noise on a quantity with this gradient; `None` if the model does not
    /// match, or is held by a bound, if the quantity does not depend on any free parameter, or if the
    /// data leave a direction free: even a quantity whose gradient is nearly orthogonal to it then
    /// depends on how far the parameters may move along it, which the posterior says.
    fn response(&self, gradient: &[f64]) -> Option<NoiseResponse> {
        if !self.known || gradient.iter().all(|slope| *slope == 0.0) {
            return None;
        }
        self.linear.response(gradient, &self.noise.covariance())
    }
}

/// Returns the correlations of moments with this covariance; 0 where a variance is.
fn correlations(covariance: &MomentMatrix) -> MomentMatrix {
    let correlation = |i: usize, j: usize| {
        let both = covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt();
        if both.is_finite() { both } else { 0.0 }
    };
    array::from_fn(|i| array::from_fn(|j| correlation(i, j)))
}

/// Returns the e_L at which c1111 is least, with the other parameters as in `point`: with a = 1 - ν_T and
/// b = 2 e_T ν_L², c1111 = e_L² a / (e_L a - b) falls with e_L below 2 b/a and grows above it.
fn modulus_of_least_stiffness(point: &Point) -> f64 {
    let ratio = point.get(Parameter::LongitudinalPoissonRatio);
    let a = 1.0 - point.get(Parameter::TransversePoissonRatio);
    4.0 * point.get(Parameter::TransverseYoungModulus) * ratio * ratio / a
}

/// Returns the ends of the values with which the mean model is admissible, with the other parameters as in
/// `point`: between those of a Poisson ratio, e_L (1 - ν_T) - 2 e_T ν_L² is positive.
fn admissible(parameter: Parameter, point: &Point) -> [f64; 2] {
    let young = point.get(Parameter::LongitudinalYoungModulus);
    let transverse = point.get(Parameter::TransverseYoungModulus);
    match parameter {
        Parameter::TransversePoissonRatio => {
            let ratio = point.get(Parameter::LongitudinalPoissonRatio);
            [-1.0, 1.0 - 2.0 * transverse * ratio * ratio / young]
        }
        Parameter::LongitudinalPoissonRatio => {
            let ratio = point.get(Parameter::TransversePoissonRatio);
            let most = (young * (1.0 - ratio) / (2.0 * transverse)).sqrt();
            [-most, most]
        }
        _ => parameter.row().accepted.limits(),
    }
}
