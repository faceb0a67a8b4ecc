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

mod agreement;
mod conclusions;
mod decay;
mod jacobian;
mod linear;
mod noise;
mod profile;
mod quantities;
mod solutions;
#[cfg(test)]
mod tests;
mod weights;

use crate::job::{JobSpecification, Objective};
use crate::moments::log_ratios;
use crate::results::{BestPoint, Evaluation};
use crate::statistics::{LikelihoodFit, likelihood_fit};

use self::linear::Linear;
use self::quantities::{AllNoise, LogarithmicEnds, Quantities};

pub use self::agreement::{Agreement, agreement};
use self::agreement::{compared, off_decay};
pub use self::conclusions::{below_noise_from, meaning};
pub use self::decay::{DECAY_PARTS_MIN, DecayWeights};
pub use self::jacobian::{Jacobian, jacobian};
pub use self::noise::{DataNoise, Noise, data_noise, noise};
pub(crate) use self::noise::{PARTS_MIN, student_quantile};
pub use self::profile::{PROFILE_POINTS, profiles};
pub use self::solutions::{solutions, spread};
pub use self::weights::MomentWeights;
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
    let weights = if jacobian.has_decays { DecayWeights::of_data(data, set) } else { None };
    let linear = Linear::from_jacobian(&jacobian, weights.as_ref());
    let likely = by_likelihood(specification, set, best);
    let ends = if likely.is_none() { LogarithmicEnds::of_data(data, set) } else { None };
    let of_moments = noise(data, set, &estimate);
    let (noise, residual) = match likely {
        Some((of_data, residual)) => (Noise { data: Some(of_data), ..of_moments }, residual),
        None => (of_moments, log_ratios(data.moments(set), estimate.moments)),
    };
    let quantile = noise.quantile();
    let off = best.decay.and_then(|decay| off_decay(data, set, &decay));
    let Agreement { matched, held, .. } =
        compared(specification, set, &best.point, (residual, off), &noise);
    let all = AllNoise::new(&noise, weights.as_ref(), best.decay.as_ref());
    let context = Quantities {
        specification,
        best,
        linear: &linear,
        noise: &all,
        quantile,
        residual: [residual[0], residual[1], off.map_or(0.0, |[difference, _]| difference)],
        ends,
        known: matched && !held && linear.undetermined.is_empty() && is_enough(&noise),
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

/// Returns whether the data tell enough of their own noise for intervals.
fn is_enough(noise: &Noise) -> bool {
    noise.data.is_some_and(|data| data.freedom + 1 >= PARTS_MIN)
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

/// Returns the number of the first evaluation of a search from which on its lowest cost was below
/// that of sampling noise alone: further improvement is noise, and another seed would lead
/// elsewhere. The cost is χ² with `weights`, and the sum of relative squares without.
pub fn first_below_noise(
    set: usize,
    best: &BestPoint,
    weights: Option<&MomentWeights>,
    history: &[Evaluation],
) -> Option<u64> {
    let relative = best.velocity?.relative_errors();
    let cost = match weights {
        Some(weights) => weights.of_errors(relative),
        None => relative[0] * relative[0] + relative[1] * relative[1],
    };
    let searched = history.iter().filter(|row| row.belongs_to(set) && row.role.is_of_search());
    let mut below = searched.filter(|row| row.cost.is_some_and(|found| found <= cost));
    below.next().map(|row| row.number)
}
