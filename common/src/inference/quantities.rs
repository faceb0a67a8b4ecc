//! Quantities with their intervals, which stay within what the law of the elasticity allows.

use super::linear::{Linear, NoiseResponse};
use super::noise::Noise;
use crate::bulk_velocity::bulk_velocity;
use crate::conclusions::{DerivedQuantity, Uncertainty};
use crate::ensemble::DISPERSION_MAX;
use crate::job::JobSpecification;
use crate::parameters::{Parameter, Point};
use crate::results::BestPoint;

/// The quantities at a best point.
pub(super) struct Quantities<'a> {
    pub(super) specification: &'a JobSpecification,
    pub(super) best: &'a BestPoint,
    pub(super) linear: &'a Linear,
    pub(super) noise: &'a Noise,
    pub(super) quantile: f64,
    /// Difference between data and model that the search has left.
    pub(super) residual: [f64; 2],
    /// Whether intervals can be stated.
    pub(super) known: bool,
}

impl Quantities<'_> {
    /// √(c1111/ρ). Its logarithm is close to normally distributed.
    pub(super) fn bulk_velocity(&self, free: &[Parameter]) -> Option<DerivedQuantity> {
        let bulk = bulk_velocity(&self.best.point).ok()?;
        let slope = |&parameter: &Parameter| {
            bulk.gradient[parameter as usize] * self.specification.range(parameter).edge()
        };
        let gradient: Vec<f64> = free.iter().map(slope).collect();
        Some(self.of_logarithm(libm::exp(bulk.logarithm), &gradient))
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
                Parameter::LongitudinalPoissonRatio | Parameter::TransversePoissonRatio => {
                    self.poisson_ratio(parameter, free)
                }
                Parameter::Density
                | Parameter::LongitudinalYoungModulus
                | Parameter::LongitudinalShearModulus
                | Parameter::TransverseYoungModulus => {
                    self.of_logarithm(value, &self.along(parameter, free, 1.0 / value))
                }
            };
            (parameter, quantity)
        };
        free.iter().map(quantity).collect()
    }

    fn poisson_ratio(&self, parameter: Parameter, free: &[Parameter]) -> DerivedQuantity {
        let value = self.best.point.get(parameter);
        let known = self.response(&self.along(parameter, free, 1.0)).map(|response| {
            let [lowest, highest] = admissible_ratios(parameter, &self.best.point);
            let reach = self.reach(&response);
            let interval = [(value - reach).max(lowest), (value + reach).min(highest)];
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
            let factor = libm::exp(self.reach(&response));
            let interval = [value / factor, value * factor];
            Uncertainty { standard_error: value * deviation, interval, free_share }
        });
        DerivedQuantity { value, known }
    }

    /// Returns half the length of an interval: the effect of the noise, plus the distance by which
    /// the solution would move if the residual were removed.
    fn reach(&self, response: &NoiseResponse) -> f64 {
        let [mean, variation] = response.transfer;
        let left = mean * self.residual[0] + variation * self.residual[1];
        self.quantile * response.deviation + left.abs()
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

/// Returns the ends of the values of a Poisson ratio with which the mean model is admissible, with
/// the other parameters as in `point`: e_L (1 - ν_T) - 2 e_T ν_L² is positive between them.
fn admissible_ratios(parameter: Parameter, point: &Point) -> [f64; 2] {
    let young = point.get(Parameter::LongitudinalYoungModulus);
    let transverse = point.get(Parameter::TransverseYoungModulus);
    if parameter == Parameter::TransversePoissonRatio {
        let ratio = point.get(Parameter::LongitudinalPoissonRatio);
        return [-1.0, 1.0 - 2.0 * transverse * ratio * ratio / young];
    }
    let ratio = point.get(Parameter::TransversePoissonRatio);
    let most = (young * (1.0 - ratio) / (2.0 * transverse)).sqrt();
    [-most, most]
}
