//! Inference from the data: which parameters they determine and which they leave free, to first
//! order around the best point.
//!
//! y = (ln v, ln Δ), the logarithms of mean and coefficient of variation of the velocities, depend
//! on the free parameters x, in units of the box, through the Jacobian J that the search has
//! measured by differences on common germs. A small error e of the data's or the model's moments
//! moves the solution by J⁺ e, where J⁺ is the pseudo-inverse; nothing is known about its position
//! along the null space of J. With the covariance C of e, a quantity with the gradient g has the
//! variance (g J⁺) C (g J⁺)ᵀ, as far as g lies in the row space of J; the data leave the rest of g
//! undetermined.
//!
//! The residual r that the search has left between data and model would move the quantity by (g J⁺)
//! r; intervals are extended by this amount.
//!
//! C is the sum of two parts. The data's part, known if the velocities are, is the covariance of
//! the influences of each velocity on both logarithms (the delta method, without the assumption of
//! a normal law), or of the sums of influences over each subject, if subjects are named. Where a
//! likelihood was maximised, residual and covariance are those of its maximum. Of moments
//! with a number of velocities it is that of a normal law. The model's part has the squares of the reported relative standard errors on its
//! diagonal; the correlation of the two errors is neglected.

mod conclusions;
mod jacobian;
mod linear;
mod noise;
mod profile;
mod solutions;
#[cfg(test)]
mod tests;

use crate::bulk_velocity::bulk_velocity;
use crate::job::{Data, JobSpecification, Objective};
use crate::parameters::Parameter;
use crate::results::{BestPoint, Estimate, Evaluation};
use crate::statistics::{LikelihoodFit, likelihood_fit};

use self::jacobian::log_ratios;
use self::linear::{Linear, NoiseResponse};

pub use self::conclusions::{below_noise_from, meaning};
pub use self::jacobian::{Jacobian, jacobian};
pub use self::noise::{DataNoise, Noise, data_noise, noise};
pub use self::profile::{PROFILE_POINTS, profiles};
pub use self::solutions::{solutions, spread};
pub use crate::conclusions::{
    Conclusions, DerivedQuantity, Direction, Inference, NoiseErrors, Profile, Sensitivity,
    Solution, Solutions, Spread, Spreads, Uncertainty,
};
pub use crate::data_statistics::CONFIDENCE;

/// Returns the conclusions from set number `set` of the data, given the best evaluation of its
/// search and all evaluations of the job. `None` if the derivatives were not measured, or cannot be
/// computed.
pub fn inference(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
    history: &[Evaluation],
) -> Option<Inference> {
    let estimate = best.velocity?;
    let data = specification.data.as_ref()?;
    let jacobian = jacobian(specification, set, best, history)?;
    let linear = Linear::from_jacobian(&jacobian);
    let (noise, residual) = match by_likelihood(specification, set, best) {
        Some((of_data, residual)) => {
            (Noise { data: Some(of_data), ..noise(data, set, &estimate) }, residual)
        }
        None => {
            let residual = log_ratios(data.moments(set), estimate.moments);
            (noise(data, set, &estimate), residual)
        }
    };
    let quantile = noise.quantile();
    let matched = is_matched(residual, &noise);
    let context = Context {
        specification,
        best,
        linear: &linear,
        noise: &noise,
        quantile,
        residual,
        matched,
    };
    Some(Inference {
        matched,
        level: CONFIDENCE,
        free: jacobian.free.clone(),
        sensitivities: jacobian.sensitivities(&best.point, specification),
        fixed: linear.fixed.clone(),
        undetermined: linear.undetermined.clone(),
        bulk_velocity: context.bulk_velocity(&jacobian.free)?,
        dispersion: context.dispersion(&jacobian.free),
        parameters: context.parameters(&jacobian.free),
        noise: noise.errors(),
    })
}

/// Returns noise and residual of the moments by which the velocities are most likely, if a likelihood
/// was maximised; `None` if it was not, or has no maximum.
fn by_likelihood(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
) -> Option<(DataNoise, [f64; 2])> {
    if specification.objective != Objective::Likelihood {
        return None;
    }
    let velocities = specification.data.as_ref()?.set(set)?;
    let monte_carlo = &specification.monte_carlo;
    let LikelihoodFit { residual, covariance } =
        likelihood_fit(monte_carlo, &best.point, &best.outcomes, &velocities)?;
    Some((DataNoise { covariance, freedom: velocities.parts() as u64 - 1 }, residual))
}

/// Relative difference below which moments always count as matched: no measurement is more
/// accurate.
const EXACT: f64 = 1e-4;

/// Returns whether the moments differ by at most three standard errors (of data and sampling
/// together), or by a negligible amount.
fn is_matched(residual: [f64; 2], noise: &Noise) -> bool {
    let covariance = noise.covariance();
    let within = |axis: usize| {
        let square = residual[axis] * residual[axis];
        square <= (9.0 * covariance[axis][axis]).max(EXACT * EXACT)
    };
    within(0) && within(1)
}

/// Returns whether the model's moments match those of set number `set` of the data, as
/// [`Inference::matched`] states.
pub fn matches_data(data: &Data, set: usize, estimate: &Estimate) -> bool {
    let residual = log_ratios(data.moments(set), estimate.moments);
    is_matched(residual, &noise(data, set, estimate))
}

struct Context<'a> {
    specification: &'a JobSpecification,
    best: &'a BestPoint,
    linear: &'a Linear,
    noise: &'a Noise,
    quantile: f64,
    /// Difference between data and model that the search has left.
    residual: [f64; 2],
    matched: bool,
}

impl Context<'_> {
    /// √(c1111/ρ). Its logarithm is close to normally distributed.
    fn bulk_velocity(&self, free: &[Parameter]) -> Option<DerivedQuantity> {
        let bulk = bulk_velocity(&self.best.point).ok()?;
        let slope = |&parameter: &Parameter| {
            bulk.gradient[parameter as usize] * self.specification.range(parameter).edge()
        };
        let gradient: Vec<f64> = free.iter().map(slope).collect();
        Some(self.of_logarithm(libm::exp(bulk.logarithm), &gradient))
    }

    fn dispersion(&self, free: &[Parameter]) -> DerivedQuantity {
        let dispersion = self.best.point.dispersion();
        let slope = |&parameter: &Parameter| match parameter {
            Parameter::Dispersion => self.specification.range(parameter).edge() / dispersion,
            _ => 0.0,
        };
        let gradient: Vec<f64> = free.iter().map(slope).collect();
        self.of_logarithm(dispersion, &gradient)
    }

    fn parameters(&self, free: &[Parameter]) -> Vec<(Parameter, DerivedQuantity)> {
        let quantity = |(place, &parameter): (usize, &Parameter)| {
            let value = self.best.point.get(parameter);
            let axis = (0..free.len()).map(|other| if other == place { 1.0 } else { 0.0 });
            let gradient: Vec<f64> = axis.collect();
            let known = self.response(&gradient).map(|response| {
                let NoiseResponse { deviation, free_share, .. } = response;
                let edge = self.specification.range(parameter).edge();
                let standard_error = deviation * edge;
                let reach = self.reach(&response) * edge;
                Uncertainty { standard_error, interval: [value - reach, value + reach], free_share }
            });
            (parameter, DerivedQuantity { value, known })
        };
        free.iter().enumerate().map(quantity).collect()
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
    /// match, if the quantity does not depend on any free parameter, or if the data leave a
    /// direction free: even a quantity whose gradient is nearly orthogonal to it then depends on how
    /// far the parameters may move along it, which the posterior says.
    fn response(&self, gradient: &[f64]) -> Option<NoiseResponse> {
        let known = self.matched && self.linear.undetermined.is_empty();
        if !known || gradient.iter().all(|slope| *slope == 0.0) {
            return None;
        }
        self.linear.response(gradient, &self.noise.covariance())
    }
}

/// Returns the number of the first evaluation of a search from which on its lowest cost was below
/// that of sampling noise alone: further improvement is noise, and another seed would lead
/// elsewhere.
pub fn first_below_noise(set: usize, best: &BestPoint, history: &[Evaluation]) -> Option<u64> {
    let relative = best.velocity?.relative_errors();
    let cost = relative[0] * relative[0] + relative[1] * relative[1];
    let searched = history.iter().filter(|row| row.belongs_to(set) && row.role.is_of_search());
    let mut below = searched.filter(|row| row.cost.is_some_and(|found| found <= cost));
    below.next().map(|row| row.number)
}
