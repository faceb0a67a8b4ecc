//! All conclusions from one set of data, as they are contained in results.

use super::{MomentWeights, first_below_noise, inference, profiles, solutions, spread};
use crate::conclusions::{Conclusions, Profile, Solutions};
use crate::job::{JobKind, JobSpecification, Objective, SearchMethod};
use crate::parameters::Point;
use crate::results::{BestPoint, Evaluation, PointMeaning};

impl Conclusions {
    /// Draws the conclusions from set number `set` of the data, given the best evaluation of its
    /// search, if one was feasible, and all evaluations of the job. For a propagation there are
    /// none.
    pub fn new(
        specification: &JobSpecification,
        set: usize,
        best: Option<&BestPoint>,
        history: &[Evaluation],
    ) -> Self {
        if specification.kind == JobKind::Propagation {
            return Self::default();
        }
        let several = specification.search.starts > 1;
        Self {
            inference: best.and_then(|best| inference(specification, set, best, history)),
            profiles: best.map(|best| of_moments(specification, set, best)).unwrap_or_default(),
            solutions: several.then(|| all_starts(specification, set, best, history)),
            posterior: None,
        }
    }
}

/// Returns the profiles, if the cost depends on the moments of the velocities alone; they do not apply
/// to other costs: no closed form tells of other observables.
fn of_moments(specification: &JobSpecification, set: usize, best: &BestPoint) -> Vec<Profile> {
    match (best.velocity, &specification.data) {
        (Some(velocity), Some(data))
            if is_of_moments(specification) && specification.observables().is_empty() =>
        {
            let weights = weights(specification, set);
            let (model, measured) = (velocity.moments, data.moments(set));
            profiles(specification, &best.point, model, measured, weights.as_ref())
        }
        _ => Vec::new(),
    }
}

fn all_starts(
    specification: &JobSpecification,
    set: usize,
    best: Option<&BestPoint>,
    history: &[Evaluation],
) -> Solutions {
    let points = solutions(set, history);
    let cost = best.and_then(|best| best.cost).unwrap_or(f64::INFINITY);
    let most = tolerance(specification).map_or(cost, |tolerance| tolerance.max(cost));
    let matching: Vec<Point> =
        points.iter().filter(|one| one.cost <= most).map(|one| one.point).collect();
    let spread = spread(&matching, &specification.setup.structure);
    Solutions { points, matching: matching.len() as u64, spread }
}

/// Returns the meaning of the best point of a search with this cost.
pub fn meaning(specification: &JobSpecification, cost: f64) -> PointMeaning {
    match specification.search.method {
        SearchMethod::Posterior => PointMeaning::LeastCost,
        _ if tolerance(specification).is_none_or(|tolerance| cost > tolerance) => {
            PointMeaning::LeastCost
        }
        SearchMethod::Simplex => PointMeaning::SimplexEnd,
        SearchMethod::Newton => PointMeaning::NearestToStart,
    }
}

/// Returns [`first_below_noise`] if the cost depends on the moments alone.
pub fn below_noise_from(
    specification: &JobSpecification,
    set: usize,
    best: &BestPoint,
    history: &[Evaluation],
) -> Option<u64> {
    let data = specification.data.as_ref().filter(|_| is_of_moments(specification))?;
    let weights = weights(specification, set);
    first_below_noise(set, best, &data.compared(set), weights.as_ref(), history)
}

/// Returns the weights of a set of data, if the cost is χ².
fn weights(specification: &JobSpecification, set: usize) -> Option<MomentWeights> {
    let data = specification.data.as_ref();
    let data = data.filter(|_| specification.objective == Objective::ChiSquare)?;
    MomentWeights::of_data(data, set)
}

fn is_of_moments(specification: &JobSpecification) -> bool {
    specification.objective.is_of_moments() && !specification.has_priors()
}

/// Returns the cost that is low enough to stop; `None` for a likelihood.
fn tolerance(specification: &JobSpecification) -> Option<f64> {
    let by_moments = specification.objective.is_of_moments();
    by_moments.then_some(specification.search.cost_tolerance)
}
