//! The posterior of the free parameters: which points to evaluate, and what follows from them.
//!
//! The data's likelihood depends on the two moments of the model's velocities alone, and these are
//! smooth functions of the parameters that a closed form nearly gives. So the model is evaluated at
//! some hundred points, its moments are interpolated (`surrogate.rs`), and the posterior of the
//! interpolated model is drawn by importance sampling (`population.rs`), at next to no cost. Fresh
//! draws are evaluated, batch by batch: the ratio of the evaluated density to the interpolated one
//! shows whether the result is that of the model itself. If it is not, the batch improves the
//! interpolation, and the next one is drawn from that. (Points where the interpolation is least
//! certain would be the textbook's choice. With 200 points their interpolation was seven times less
//! accurate over the posterior than that of draws: they lie in remote corners.)
//!
//! All of this is a function of the specification and the evaluations, in their order.

mod check;
mod cholesky;
mod features;
mod moments_grid;
mod pareto;
mod pivot;
mod population;
mod prior;
mod summary;
mod surrogate;
#[cfg(test)]
mod tests;

use osteon_common::data_likelihood::DataLikelihood;
use osteon_common::job::{JobSpecification, Measurements};
use osteon_common::parameters::Point;
use osteon_common::posterior::Posterior;
use osteon_common::results::{BestPoint, Evaluation, Moments};

use self::check::{BatchCheck, Doubt};
use self::features::features;
use self::population::{Member, PosteriorProblem, closed_form};
use self::surrogate::Surrogate;
use crate::newton::logarithms;

/// Sobol' points of the populations from which points to evaluate are drawn.
const SCOUTS: u64 = 2048;
/// Draws of each batch.
const BATCH: usize = 32;
/// Lengths of the interpolation are chosen anew when the points have increased by this factor.
const GROWTH: f64 = 1.5;

/// Returns the likelihood of set number `set` of the data; `None` if their noise is unknown.
pub(crate) fn likelihood(specification: &JobSpecification, set: usize) -> Option<DataLikelihood> {
    let data = specification.data.as_ref()?;
    let instrument = data.repeatability;
    match (&data.measurements, data.velocities(set), data.subjects(set)) {
        (&Measurements::Moments { mean, coefficient_of_variation, count }, ..) => {
            let moments = Moments { mean, coefficient_of_variation };
            DataLikelihood::from_moments(moments, count?, instrument)
        }
        (_, Some(velocities), Some(subjects)) => {
            DataLikelihood::of_subjects(velocities, subjects, instrument)
        }
        (_, Some(velocities), None) => DataLikelihood::independent(velocities, instrument),
        (_, None, _) => None,
    }
}

/// Returns the posterior of set number `set` of the data, given the best point of its search and all
/// evaluations of the job; `None` if the job asks for none, or its evaluations are not complete.
pub(crate) fn posterior(
    specification: &JobSpecification,
    set: usize,
    best: Option<&BestPoint>,
    history: &[Evaluation],
) -> Option<Posterior> {
    specification.posterior?;
    let rows = || history.iter().filter(|row| row.belongs_to(set) && row.role.varied.is_none());
    let known = rows()
        .filter(|row| !row.role.posterior)
        .filter_map(|row| Some((row.point, feasible_moments(row)?)));
    let likelihood = likelihood(specification, set);
    let mut search = PosteriorSearch::new(specification, likelihood, known);
    for row in rows().filter(|row| row.role.posterior) {
        search.tell(feasible_moments(row));
    }
    let errors = best.and_then(|best| best.velocity).map(|velocity| velocity.relative_errors());
    let found = search.result(specification, errors?)?;
    let predictive_p_value =
        best.and_then(|best| summary::predictive_p_value(specification, set, best, &found));
    Some(Posterior { predictive_p_value, ..found })
}

/// Returns the moments of an evaluation, if it is feasible.
pub(crate) fn feasible_moments(row: &Evaluation) -> Option<Moments> {
    row.moments.filter(|_| row.cost.is_some_and(f64::is_finite))
}

/// The search for the points that a posterior needs, as an ask/tell state machine.
#[derive(Debug, Clone)]
pub(crate) struct PosteriorSearch {
    problem: Option<PosteriorProblem>,
    max_evaluations: u64,
    surrogate: Surrogate,
    /// Number of points from which the lengths were chosen.
    chosen_with: usize,
    /// Draws of the current batch that are still to be evaluated, in reverse order.
    /// Empty once the search has ended.
    pending: Vec<Member>,
    evaluations: u64,
    populations: u64,
    /// The evaluated draws of the last batch.
    check: BatchCheck,
}

impl PosteriorSearch {
    /// Creates the search for a set of data with this likelihood; `None` for the likelihood if the
    /// data have none. `known` are points of the model that have been evaluated already.
    pub(crate) fn new(
        specification: &JobSpecification,
        likelihood: Option<DataLikelihood>,
        known: impl Iterator<Item = (Point, Moments)>,
    ) -> Self {
        let settings = specification.posterior.unwrap_or_default();
        let problem =
            likelihood.and_then(|likelihood| PosteriorProblem::new(specification, likelihood));
        let scale = problem.as_ref().map_or_else(|| surrogate::Scale::of(&[]), |one| one.scale);
        let mut search = Self {
            problem,
            max_evaluations: settings.max_evaluations,
            surrogate: Surrogate::new(scale),
            chosen_with: 0,
            pending: Vec::new(),
            evaluations: 0,
            populations: 0,
            check: BatchCheck::default(),
        };
        known.for_each(|(point, moments)| search.learn(&point, moments));
        search.next_batch();
        search
    }

    /// Returns the next point, unless the search has ended.
    pub(crate) fn point(&self) -> Option<Point> {
        self.pending.last().map(|member| member.point)
    }

    /// Returns at most `most` points that follow the pending one.
    pub(crate) fn candidates(&self, most: usize) -> Vec<Point> {
        self.pending.iter().rev().skip(1).take(most).map(|member| member.point).collect()
    }

    /// Takes the moments of the pending point; `None` if it is infeasible.
    pub(crate) fn tell(&mut self, moments: Option<Moments>) {
        let (Some(member), Some(problem)) = (self.pending.pop(), &self.problem) else { return };
        self.evaluations += 1;
        let exact =
            moments.map_or(f64::NEG_INFINITY, |found| problem.likelihood.log(logarithms(found)));
        self.check.add(exact - problem.likelihood.log(member.moments));
        if let Some(moments) = moments {
            self.learn(&member.point, moments);
        }
        if self.pending.is_empty() {
            self.next_batch();
        }
    }

    fn learn(&mut self, point: &Point, moments: Moments) {
        let logs = logarithms(moments);
        let deviations =
            closed_form(point).map(|closed| [logs[0] - closed[0], logs[1] - closed[1]]);
        if let (Some(at), Some(deviations)) = (features(point), deviations)
            && deviations.iter().all(|deviation| deviation.is_finite())
        {
            self.surrogate.add(&at, deviations);
        }
    }

    /// Draws the next batch, or none, which ends the search.
    fn next_batch(&mut self) {
        let Some(problem) = &self.problem else { return };
        let passed = self.doubt(problem).is_none();
        let choose = self.surrogate.len() as f64 >= GROWTH * self.chosen_with as f64;
        self.surrogate.fit(choose && self.surrogate.len() > 1);
        if choose {
            self.chosen_with = self.surrogate.len();
        }
        let number = self.populations;
        self.populations += 1;
        let left = self.max_evaluations.saturating_sub(self.evaluations);
        let left = usize::try_from(left).unwrap_or(usize::MAX);
        if passed || left == 0 {
            return;
        }
        let mut population = problem.population(&self.surrogate, SCOUTS, number);
        if population.members.is_empty() {
            return;
        }
        if problem.is_of_few() {
            population = problem.widened(population);
        }
        self.check = BatchCheck::default();
        let draws = population.resampled(BATCH.min(left), 0.5);
        self.pending = draws.into_iter().rev().copied().collect();
    }

    /// Returns why the last batch does not show that the result is that of the model; `None` if it
    /// does.
    fn doubt(&self, problem: &PosteriorProblem) -> Option<Doubt> {
        self.check.doubt(BATCH, problem.is_of_few())
    }
}
