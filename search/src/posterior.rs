//! The posterior of the free parameters: which points to evaluate, and what follows from them.
//!
//! The data's likelihood depends on the two moments of the model's velocities, and on the means of the
//! other observables that were measured. These are smooth functions of the parameters, and a closed form
//! nearly gives those of the velocities. So the model is evaluated at
//! some hundred points, its moments are interpolated (`surrogate.rs`), and the posterior of the
//! interpolated model is drawn by importance sampling (`problem.rs`), at next to no cost. Fresh
//! draws are evaluated, batch by batch: the ratio of the evaluated density to the interpolated one
//! shows whether the result is that of the model itself. If it is not, the batch improves the
//! interpolation, and the next one is drawn from that.
//!
//! The ends of intervals depend on tails of which 32 draws see little. With more than two free
//! parameters a batch has 8 further points, chosen with probability proportional to posterior times
//! expected square error of the interpolation; what is found there calibrates the expected error of
//! all draws, which has to be small, too. (Points of the largest error, whatever their probability,
//! would be the textbook's choice. With 200 of them the interpolation was seven times less accurate
//! over the posterior than with draws: they lie in remote corners.) With one or two, batches are drawn
//! from a wider law. If hardly a point of the prior matches the data as far as is known, draws of the
//! prior are evaluated first, then points that the interpolation believes to be near the data, and populations are
//! drawn about these: what matches may fill a ten thousandth of the bounds, in a corner where the closed form is wrong.
//!
//! All of this is a function of the specification and the evaluations, in their order.

mod batches;
mod check;
mod cholesky;
mod density;
mod draw_law;
mod exponential;
mod features;
mod likelihood;
mod moments_grid;
mod pareto;
mod pivot;
mod population;
mod prior;
mod problem;
mod summary;
mod surrogate;
#[cfg(test)]
mod tests;

use osteon_common::inference::{ModelAtPoint, model_errors};
use osteon_common::job::JobSpecification;
use osteon_common::posterior::Posterior;
use osteon_common::results::{BestPoint, ComparedMoments, Evaluation};

pub(crate) use self::batches::{PosteriorSearch, SearchOutcome};
pub use self::density::PosteriorDensity;
pub(crate) use self::likelihood::SetLikelihood;
pub use self::prior::prior_deviation;
pub(crate) use self::problem::closed_form;

/// Returns the posterior of set number `set` of the data, given the best point of its search and all
/// evaluations of the job; `None` if the job asks for none, or its evaluations are not complete.
pub(crate) fn posterior(
    specification: &JobSpecification,
    set: usize,
    best: Option<&BestPoint>,
    history: &[Evaluation],
) -> Option<Posterior> {
    specification.posterior?;
    let rows = || history.iter().filter(|row| row.belongs_to(set) && !row.role.is_beside_best());
    let known = rows()
        .filter(|row| !row.role.posterior)
        .filter_map(|row| Some((row.point, feasible_moments(row)?)));
    let (data, best) = (specification.data.as_ref()?, best?);
    let model = ModelAtPoint::of_best(best)?;
    let likelihood = match SetLikelihood::new(specification, set) {
        Some(found) => Some(found.with_systematic(specification, set, model, history)?),
        None => None,
    };
    let mut search = PosteriorSearch::new(&specification.of_set(set), likelihood, known);
    for row in rows().filter(|row| row.role.posterior) {
        search.tell(feasible_moments(row));
    }
    let errors = model_errors(&data.compared(set), model.velocity, model.observables);
    let found = search.result(specification, errors)?;
    let predictive_p_value = summary::predictive_p_value(specification, set, best, &found);
    Some(Posterior { predictive_p_value, ..found })
}

/// Returns the moments of an evaluation, if it is feasible.
pub(crate) fn feasible_moments(row: &Evaluation) -> Option<ComparedMoments> {
    row.compared().filter(|_| row.cost.is_some_and(f64::is_finite))
}
