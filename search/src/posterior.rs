//! The posterior of the free parameters: which points to evaluate, and what follows from them.
//!
//! The data's likelihood depends on the two moments of the model's velocities alone, and these are
//! smooth functions of the parameters that a closed form nearly gives. So the model is evaluated at
//! some hundred points, its moments are interpolated (`surrogate.rs`), and the posterior of the
//! interpolated model is drawn by importance sampling (`population.rs`), at next to no cost. New
//! points are evaluated where the posterior is and the interpolation is least certain. Then fresh
//! draws are evaluated: the ratio of the evaluated density to the interpolated one shows whether
//! the result is that of the model itself. If it is not, these points improve the interpolation,
//! and it goes on.
//!
//! All of this is a function of the specification and the evaluations, in their order.

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

use self::cholesky::dot;
use self::features::features;
use self::population::{Member, Problem, closed_form, normalised};
use self::surrogate::Surrogate;

/// Sobol' points of the populations from which points to evaluate are chosen.
const SCOUTS: u64 = 2048;
/// Draws among which the points to evaluate are chosen.
const CANDIDATES: usize = 256;
/// Points of the first batch, and of later ones.
const BATCHES: [usize; 2] = [24, 12];
/// Fresh draws that are evaluated to check the interpolation.
const CHECKED: usize = 40;
/// The check is begun when the root mean square of the predicted error of the log density is at
/// most this, nats, with up to two free parameters and with more. With few parameters more accuracy
/// costs next to nothing.
const PREDICTED_ERRORS: [f64; 2] = [2e-4, 0.15];
/// The interpolation is accepted if this share of the checked draws counts after weighting.
const EFFICIENCY_MIN: f64 = 0.95;
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
    search.result(specification, errors?)
}

/// Returns the moments of an evaluation, if it is feasible.
pub(crate) fn feasible_moments(row: &Evaluation) -> Option<Moments> {
    row.moments.filter(|_| row.cost.is_some_and(f64::is_finite))
}

/// The search for the points that a posterior needs, as an ask/tell state machine.
#[derive(Debug, Clone)]
pub(crate) struct PosteriorSearch {
    problem: Option<Problem>,
    max_evaluations: u64,
    surrogate: Surrogate,
    /// Number of points from which the lengths were chosen.
    chosen_with: usize,
    /// Points of the current batch that are still to be evaluated, in reverse order.
    pending: Vec<Member>,
    stage: Stage,
    evaluations: u64,
    infeasible: u64,
    populations: u64,
    /// The last check.
    check: Check,
}

/// Purpose of the current batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Exploring,
    Checking,
    Done,
}

/// The checked draws.
#[derive(Debug, Clone, Default)]
struct Check {
    /// Logarithm of the evaluated density minus that of the interpolated one; minus infinity where
    /// the point is infeasible.
    log_ratios: Vec<f64>,
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
        let problem = likelihood.and_then(|likelihood| Problem::new(specification, likelihood));
        let scale = problem.as_ref().map_or_else(|| surrogate::Scale::of(&[]), |one| one.scale);
        let mut search = Self {
            problem,
            max_evaluations: settings.max_evaluations,
            surrogate: Surrogate::new(scale),
            chosen_with: 0,
            pending: Vec::new(),
            stage: Stage::Exploring,
            evaluations: 0,
            infeasible: 0,
            populations: 0,
            check: Check::default(),
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
        if self.stage == Stage::Checking {
            let exact =
                moments.map_or(f64::NEG_INFINITY, |found| problem.likelihood.log(logs(found)));
            self.check.log_ratios.push(exact - problem.likelihood.log(member.moments));
        }
        match moments {
            Some(moments) => self.learn(&member.point, moments),
            None => self.infeasible += 1,
        }
        if self.pending.is_empty() {
            self.next_batch();
        }
    }

    fn learn(&mut self, point: &Point, moments: Moments) {
        let logs = logs(moments);
        let deviations =
            closed_form(point).map(|closed| [logs[0] - closed[0], logs[1] - closed[1]]);
        if let (Some(at), Some(deviations)) = (features(point), deviations)
            && deviations.iter().all(|deviation| deviation.is_finite())
        {
            self.surrogate.add(&at, deviations);
        }
    }

    /// Chooses the points of the next batch, or ends the search.
    fn next_batch(&mut self) {
        let Some(problem) = &self.problem else {
            self.stage = Stage::Done;
            return;
        };
        let passed = self.stage == Stage::Checking && self.check.efficiency() >= EFFICIENCY_MIN;
        let choose = self.surrogate.len() as f64 >= GROWTH * self.chosen_with as f64;
        self.surrogate.fit(choose && self.surrogate.len() > 1);
        if choose {
            self.chosen_with = self.surrogate.len();
        }
        let left = self.max_evaluations.saturating_sub(self.evaluations);
        let left = usize::try_from(left).unwrap_or(usize::MAX);
        let population = problem.population(&self.surrogate, SCOUTS, self.populations);
        self.populations += 1;
        if passed || left == 0 || population.members.is_empty() {
            self.stage = Stage::Done;
            return;
        }
        let draws = population.resampled(CANDIDATES, 0.5);
        let few = problem.priors.len() <= 2;
        let wanted = PREDICTED_ERRORS[usize::from(!few)];
        let enough = self.surrogate.len() >= BATCHES[0];
        if enough && predicted_error(problem, &self.surrogate, &draws) <= wanted || left <= CHECKED
        {
            self.stage = Stage::Checking;
            self.check = Check::default();
            let fresh = population.resampled(CHECKED.min(left), 0.25);
            self.pending = fresh.into_iter().rev().copied().collect();
        } else {
            self.stage = Stage::Exploring;
            let count = BATCHES[usize::from(enough)].min(left - CHECKED);
            let mut chosen = most_informative(problem, &self.surrogate, &draws, count);
            chosen.reverse();
            self.pending = chosen;
        }
    }
}

impl Check {
    /// Returns the share of the draws that counts after weighting with the ratios, (Σ w)²/(n Σ w²).
    fn efficiency(&self) -> f64 {
        if !self.log_ratios.iter().any(|ratio| ratio.is_finite()) {
            return 0.0;
        }
        let weights = normalised(&self.log_ratios);
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        1.0 / (squares * weights.len() as f64)
    }

    /// Returns the root mean square deviation of the log ratios from their mean.
    fn error(&self) -> f64 {
        let finite = self.log_ratios.iter().filter(|ratio| ratio.is_finite());
        let count = finite.clone().count() as f64;
        let mean = finite.clone().sum::<f64>() / count;
        let squares: f64 = finite.map(|ratio| (ratio - mean) * (ratio - mean)).sum();
        (squares / count).sqrt()
    }
}

/// Returns the logarithms of both moments.
fn logs(moments: Moments) -> [f64; 2] {
    [moments.mean, moments.coefficient_of_variation].map(libm::log)
}

/// Returns the root mean square over the draws of the predicted error of the log density, nats: the
/// errors of both moments in units of the data's.
fn predicted_error(problem: &Problem, model: &Surrogate, draws: &[&Member]) -> f64 {
    let errors = problem.likelihood.errors();
    let of = |draw: &&Member| {
        let variance = model.predict(&draw.features).variance;
        variance[0] / (errors[0] * errors[0]) + variance[1] / (errors[1] * errors[1])
    };
    (draws.iter().map(of).sum::<f64>() / draws.len() as f64).sqrt()
}

/// Chooses `count` of the draws, one after another, each where an evaluation removes most of the
/// uncertainty of the log density, summed over all draws (the criterion of D. A. Cohn, Neural
/// Networks 9 (1996)). A criterion by the largest uncertainty alone would choose remote corners, in
/// which a realization may also take a hundred times as long.
fn most_informative(
    problem: &Problem,
    model: &Surrogate,
    draws: &[&Member],
    count: usize,
) -> Vec<Member> {
    let errors = problem.likelihood.errors();
    let mut covariances = [0, 1].map(|k| covariances(model, draws, k));
    let mut chosen = Vec::new();
    for _ in 0..count {
        let gain = |draw: usize| {
            let of = |k: usize| {
                let row = &covariances[k][draw];
                let pivot = row[draw].max(f64::MIN_POSITIVE);
                dot(row, row) / (pivot * (errors[k] * errors[k]))
            };
            of(0) + of(1)
        };
        let gains: Vec<f64> = (0..draws.len()).map(gain).collect();
        let best = (0..draws.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b]));
        let Some(best) = best.filter(|best| gains[*best] > 0.0) else { break };
        chosen.push(*draws[best]);
        for covariances in &mut covariances {
            let row = covariances[best].clone();
            let pivot = row[best].max(f64::MIN_POSITIVE);
            for (rows, factor) in covariances.iter_mut().zip(&row) {
                rows.iter_mut().zip(&row).for_each(|(c, value)| *c -= factor / pivot * value);
            }
        }
    }
    chosen
}

/// Returns the covariances of one deviation at the draws, given the evaluated points.
fn covariances(model: &Surrogate, draws: &[&Member], k: usize) -> Vec<Vec<f64>> {
    let explained: Vec<Vec<f64>> =
        draws.iter().map(|draw| model.explained(&draw.features, k)).collect();
    let entry = |i: usize, j: usize| {
        let prior = model.covariance(&draws[i].features, &draws[j].features, k);
        prior - dot(&explained[i], &explained[j])
    };
    let mut rows: Vec<Vec<f64>> =
        (0..draws.len()).map(|i| (0..=i).map(|j| entry(i, j)).collect()).collect();
    for i in 0..rows.len() {
        let above: Vec<f64> = (i + 1..rows.len()).map(|j| rows[j][i]).collect();
        rows[i].extend(above);
    }
    rows
}
