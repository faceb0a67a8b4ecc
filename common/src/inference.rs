//! Inference from the data: which parameters they determine and which they leave free, to first
//! order around the best point.
//!
//! y, the logarithms of mean and coefficient of variation of the velocities and the means of other
//! observables relative to those of the data, depends on the free parameters x, in units of the box, through the Jacobian J that the search has
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
mod jacobian;
mod linear;
mod noise;
mod profile;
mod quantities;
mod solutions;
mod systematic;
#[cfg(test)]
mod tests;
mod weights;

use crate::job::{JobSpecification, Objective};
use crate::moments::ComparedMoments;
use crate::results::{BestPoint, Evaluation};

use self::linear::Linear;
use self::quantities::{LogarithmicEnds, Quantities};

use self::agreement::misfit;
pub use self::agreement::{Agreement, ModelAtPoint, agreement};
pub use self::conclusions::{below_noise_from, meaning};
pub use self::jacobian::{Jacobian, jacobian};
pub use self::noise::{DataNoise, Noise, data_noise, model_errors, noise};
pub(crate) use self::noise::{PARTS_MIN, student_quantile};
pub use self::profile::{PROFILE_POINTS, profiles};
pub use self::solutions::{solutions, spread};
pub use self::systematic::systematic_covariance;
pub use self::weights::{MomentWeights, OBSERVED_PARTS_MIN};
pub use crate::conclusions::{
    BudgetQuantity, BudgetSource, Conclusions, DerivedQuantity, Direction, ErrorScale, Inference,
    NoiseErrors, Profile, QuantityErrors, Sensitivity, Solution, Solutions, Spread, Spreads,
    Uncertainty, VarianceBudget, VariancePart,
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
    let data = specification.data.as_ref()?;
    let jacobian = jacobian(specification, set, best, history)?;
    let is_weighted =
        !jacobian.observables.is_empty() && specification.objective != Objective::Moments;
    let weights = if is_weighted { MomentWeights::of_data(data, set) } else { None };
    let linear = Linear::from_jacobian(&jacobian, weights.as_ref());
    let model = ModelAtPoint::of_best(best)?;
    let misfit = misfit(specification, set, model)?;
    let Agreement { matched, held, .. } = misfit.agreement(specification, set, &best.point);
    let residual = misfit.differences.map(|difference| -difference);
    let ends = if misfit.by_likelihood { None } else { LogarithmicEnds::of_data(data, set) };
    let effects = systematic::effects(specification, set, model, history);
    let systematic = systematic::covariance(effects.as_ref().unwrap_or(&Vec::new()));
    let noise = Noise { systematic, ..misfit.noise };
    let quantile = noise.quantile();
    let context = Quantities {
        specification,
        best,
        linear: &linear,
        noise: &noise,
        quantile,
        residual,
        ends,
        known: matched
            && !held
            && linear.undetermined.is_empty()
            && is_enough(&noise)
            && effects.is_some(),
        effects: effects.as_ref(),
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
        budget: context.budget(&jacobian.free),
        errors: context.errors(&jacobian.free),
        noise: noise.errors(),
    })
}

/// Returns whether the data tell enough of their own noise for intervals.
fn is_enough(noise: &Noise) -> bool {
    noise.data.is_some_and(|data| data.freedom + 1 >= PARTS_MIN)
}

/// Returns the number of the first evaluation of a search from which on its lowest cost was below
/// that of sampling noise alone: further improvement is noise, and another seed would lead
/// elsewhere. The cost is χ² with `weights`, and the sum of relative squares without.
pub fn first_below_noise(
    set: usize,
    best: &BestPoint,
    data: &ComparedMoments,
    weights: Option<&MomentWeights>,
    history: &[Evaluation],
) -> Option<u64> {
    let errors = model_errors(data, &best.velocity?, &best.observables);
    let cost = match weights {
        Some(weights) => weights.of_errors(errors),
        None => errors.iter().map(|error| error * error).sum(),
    };
    let searched = history.iter().filter(|row| row.belongs_to(set) && row.role.is_of_search());
    let mut below = searched.filter(|row| row.cost.is_some_and(|found| found <= cost));
    below.next().map(|row| row.number)
}
