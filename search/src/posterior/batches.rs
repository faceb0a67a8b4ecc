//! The points at which a posterior evaluates the model, batch by batch.

use osteon_common::job::JobSpecification;
use osteon_common::moments::{ComparedMoments, MomentVector};
use osteon_common::observables::ObservableSet;
use osteon_common::parameters::Point;

use super::check::{BatchCheck, Doubt};
use super::features::features;
use super::likelihood::SetLikelihood;
use super::population::{Member, Population, PosteriorProblem, closed_form};
use super::surrogate::{Scale, Surrogate};

/// Sobol' points of the populations from which points to evaluate are drawn.
const SCOUTS: u64 = 2048;
/// Draws of each batch that check the interpolation.
const BATCH: usize = 32;
/// Further points of each batch, where draws matter that the interpolation knows least.
const LEARNT: usize = 16;
/// Largest number of batches of the prior.
const EXPLORED_MAX: u64 = 2;
/// Limit of the expected square error of a draw, in units of the data's noise: beyond, one draw is as
/// wrong as another.
const ERROR_LIMIT: f64 = 9.0;
/// Lengths of the interpolation are chosen anew when the points have increased by this factor.
const GROWTH: f64 = 1.5;

/// The search for the points that a posterior needs, as an ask/tell state machine.
#[derive(Debug, Clone)]
pub(crate) struct PosteriorSearch {
    pub(super) problem: Option<PosteriorProblem>,
    max_evaluations: u64,
    pub(super) surrogate: Surrogate,
    /// Number of points from which the lengths were chosen.
    chosen_with: usize,
    /// Points of the current batch that are still to be evaluated, in reverse order.
    /// Empty once the search has ended.
    pending: Vec<Pending>,
    pub(super) evaluations: u64,
    pub(super) populations: u64,
    /// Number of batches of the prior.
    explored: u64,
    /// Whether no point matches the data, as far as is known.
    nothing_matches: bool,
    /// The evaluated draws of the last batch.
    pub(super) check: BatchCheck,
}

/// How the search for a posterior has ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SearchOutcome {
    Converged,
    /// The result may not be that of the model, for this reason.
    Doubtful(String),
    /// No parameter set within the bounds and the priors comes near the data.
    NothingMatches,
    /// The effect of a systematic error was not measured.
    UnknownEffect,
}

/// A point that is to be evaluated.
#[derive(Debug, Clone, Copy)]
struct Pending {
    point: Point,
    used_for: PointUse,
}

/// The reason for evaluating a point.
#[derive(Debug, Clone, Copy)]
enum PointUse {
    /// It is a draw of the posterior, and checks the interpolation; with its interpolated moments.
    Check(MomentVector),
    /// The interpolation is uncertain there; with its interpolated moments, and the expected
    /// square error in units of the data's noise.
    Learn(MomentVector, f64),
    /// It is a draw of the prior.
    Explore,
}

impl PosteriorSearch {
    /// Creates the search for a set of data with this likelihood; `None` for the likelihood if the
    /// data have none. `known` are points of the model that have been evaluated already.
    pub(crate) fn new(
        specification: &JobSpecification,
        likelihood: Option<SetLikelihood>,
        known: impl Iterator<Item = (Point, ComparedMoments)>,
    ) -> Self {
        let settings = specification.posterior.unwrap_or_default();
        let problem =
            likelihood.and_then(|likelihood| PosteriorProblem::new(specification, likelihood));
        let (scale, observables) = match &problem {
            Some(problem) => (problem.scale.clone(), problem.likelihood.observables()),
            None => (Scale::from_sample(&[]), ObservableSet::NONE),
        };
        let mut search = Self {
            problem,
            max_evaluations: settings.max_evaluations,
            surrogate: Surrogate::new(scale, observables),
            chosen_with: 0,
            pending: Vec::new(),
            evaluations: 0,
            populations: 0,
            explored: 0,
            nothing_matches: false,
            check: BatchCheck::default(),
        };
        known.for_each(|(point, moments)| search.learn(&point, &moments));
        search.next_batch();
        search
    }

    /// Returns the next point, unless the search has ended.
    pub(crate) fn point(&self) -> Option<Point> {
        self.pending.last().map(|pending| pending.point)
    }

    /// Returns at most `most` points that follow the pending one.
    pub(crate) fn candidates(&self, most: usize) -> Vec<Point> {
        let following = self.pending.iter().rev().skip(1).take(most);
        following.map(|pending| pending.point).collect()
    }

    /// Takes the moments of the pending point; `None` if it is infeasible.
    pub(crate) fn tell(&mut self, moments: Option<ComparedMoments>) {
        let (Some(pending), Some(problem)) = (self.pending.pop(), &self.problem) else { return };
        self.evaluations += 1;
        let values = moments.map(|moments| moments.in_logarithms(&problem.likelihood.data));
        match (pending.used_for, values) {
            (PointUse::Check(interpolated), values) => {
                let exact = values.map_or(f64::NEG_INFINITY, |at| problem.likelihood.log(&at));
                self.check.add(exact - problem.likelihood.log(&interpolated));
            }
            (PointUse::Learn(interpolated, expected), Some(values)) => {
                let errors = values.iter().zip(interpolated).map(|(exact, one)| exact - one);
                let squares = errors.map(|error| error * error);
                self.check.learn(problem.in_noise(squares) / expected);
            }
            (PointUse::Learn(..), None) | (PointUse::Explore, _) => {}
        }
        if let Some(moments) = moments {
            self.learn(&pending.point, &moments);
        }
        if self.pending.is_empty() {
            self.next_batch();
        }
    }

    /// Returns how the search has ended.
    pub(crate) fn outcome(&self) -> SearchOutcome {
        let Some(problem) = self.problem.as_ref().filter(|_| !self.nothing_matches) else {
            return SearchOutcome::NothingMatches;
        };
        let evaluations = self.evaluations;
        match self.doubt(problem) {
            Some(doubt) => {
                SearchOutcome::Doubtful(format!("after {evaluations} evaluations {doubt}"))
            }
            None => SearchOutcome::Converged,
        }
    }

    fn learn(&mut self, point: &Point, moments: &ComparedMoments) {
        let Some(problem) = &self.problem else { return };
        let mut deviations = moments.in_logarithms(&problem.likelihood.data);
        let Some(closed) = closed_form(&problem.structure, point) else { return };
        deviations.iter_mut().zip(closed).for_each(|(one, closed)| *one -= closed);
        if let Some(at) = features(&problem.structure, point)
            && deviations.iter().all(|deviation| deviation.is_finite())
        {
            self.surrogate.add(&at, deviations);
        }
    }

    /// Draws the next batch, or none, which ends the search.
    fn next_batch(&mut self) {
        let Some(problem) = &self.problem else { return };
        // More points do not make infeasible draws rarer.
        let passed = matches!(self.doubt(problem), None | Some(Doubt::Infeasible(..)));
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
        self.nothing_matches = population.members.is_empty();
        if self.nothing_matches {
            let skipped = self.explored as usize * BATCH;
            let enough = self.explored == EXPLORED_MAX;
            let points = if enough { Vec::new() } else { problem.prior_points(SCOUTS) };
            let points = points.into_iter().skip(skipped).take(BATCH.min(left));
            self.pending =
                points.map(|point| Pending { point, used_for: PointUse::Explore }).collect();
            self.explored += 1;
            return;
        }
        if problem.is_of_few() {
            population = problem.widened(population);
        }
        let draws = population.resampled(BATCH.min(left), 0.5);
        let checking = draws.iter().map(|member| Pending {
            point: member.point,
            used_for: PointUse::Check(member.moments),
        });
        let mut pending: Vec<Pending> = checking.collect();
        self.check = BatchCheck::default();
        if !problem.is_of_few() {
            let errors = self.expected_errors(problem, &population);
            self.check.expected = population.mean(&errors);
            pending.extend(most_uncertain(&population, &errors, LEARNT.min(left - pending.len())));
        }
        pending.reverse();
        self.pending = pending;
    }

    /// Returns the expected square error of the interpolation at each member, in units of the data's
    /// noise.
    fn expected_errors(&self, problem: &PosteriorProblem, population: &Population) -> Vec<f64> {
        let of = |member: &Member| {
            let at = features(&problem.structure, &member.point);
            let variances = at.map(|at| self.surrogate.variances(&at));
            variances.map_or(0.0, |found| problem.in_noise(found.into_iter()).min(ERROR_LIMIT))
        };
        population.members.iter().map(of).collect()
    }

    /// Returns why the last batch does not show that the result is that of the model; `None` if it
    /// does.
    fn doubt(&self, problem: &PosteriorProblem) -> Option<Doubt> {
        self.check.doubt(BATCH, problem.is_of_few())
    }
}

/// Returns members in proportion to weight times expected square error: the tails of the posterior,
/// of which draws that check see little, as far as they are not known yet.
fn most_uncertain(
    population: &Population,
    errors: &[f64],
    count: usize,
) -> impl Iterator<Item = Pending> {
    let reweighted = population.reweighted(errors);
    let chosen = reweighted.resampled_indices(count, 0.5);
    let mut pending: Vec<Pending> = Vec::new();
    for index in chosen {
        let (Member { point, moments, .. }, expected) = (population.members[index], errors[index]);
        let known = pending.iter().any(|other| other.point == point);
        if expected > 0.0 && !known {
            pending.push(Pending { point, used_for: PointUse::Learn(moments, expected) });
        }
    }
    pending.into_iter()
}
