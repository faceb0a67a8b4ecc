//! The points at which a posterior evaluates the model, batch by batch.

use osteon_common::job::JobSpecification;
use osteon_common::moments::{ComparedMoments, MomentVector};
use osteon_common::observables::ObservableSet;
use osteon_common::parameters::Point;

use super::check::{BatchCheck, Doubt};
use super::features::features;
use super::likelihood::SetLikelihood;
use super::population::{Member, Population};
use super::problem::{PosteriorProblem, closed_form, moments};
use super::surrogate::{Scale, Surrogate};

/// Sobol' points of the populations from which points to evaluate are drawn.
const SCOUTS: u64 = 2048;
/// Draws of each batch that check the interpolation.
const BATCH: usize = 32;
/// Further points of each batch, where draws matter that the interpolation knows least.
const LEARNT: usize = 16;
/// A population of fewer points does not tell where the data are matched.
const MEMBERS_MIN: usize = BATCH;
/// Largest number of batches that look for points near the data, where the interpolation knows none.
const EXPLORED_MAX: u64 = 8;
/// Largest number of these, one after another, that come no nearer.
const VAIN_MAX: u64 = 2;
/// Distances of scouts from the nearest point, in units of those of points of the prior.
const CLOSER: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Number of the nearest scouts about which a population is drawn if points of the prior do not match.
const NEAR: usize = 64;
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
    /// Number of batches that look for points near the data.
    explored: u64,
    /// That of their points which is nearest to the data, and its distance in units of the data's noise.
    nearest: Option<(Point, f64)>,
    /// Number of the last of these batches that came no nearer.
    in_vain: u64,
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
    /// No point near the data is known, and this may be one.
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
            nearest: None,
            in_vain: 0,
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
            (PointUse::Explore, Some(values)) => {
                let distance = problem.distance(&values);
                if self.nearest.is_none_or(|(_, least)| distance < least) {
                    self.nearest = Some((pending.point, distance));
                    self.in_vain = 0;
                }
            }
            (PointUse::Learn(..) | PointUse::Explore, None) => {}
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
        let (population, scouts) = self.population(number);
        self.nothing_matches = population.members.is_empty();
        let pending = match population.members.len() < MEMBERS_MIN && self.goes_on_exploring() {
            true => self.batch_to_explore(scouts, left),
            false if self.nothing_matches => Vec::new(),
            false => self.batch_to_check(population, left),
        };
        self.pending = pending.into_iter().rev().collect();
    }

    /// Draws population number `number`. If points of the prior do not match the data, it is drawn about the scouts
    /// that are nearest to these, and the scouts are returned, too.
    fn population(&mut self, number: u64) -> (Population, Vec<Point>) {
        let Some(problem) = &self.problem else { return Default::default() };
        let population = problem.population(&self.surrogate, SCOUTS, number);
        if population.members.len() >= MEMBERS_MIN {
            return (population, Vec::new());
        }
        let scouts = self.scouts(problem);
        if self.surrogate.len() == 0 {
            return (population, scouts);
        }
        let near: Vec<&Point> = scouts.iter().take(NEAR).collect();
        let problem = problem.clone().drawn_near(&near);
        let population = problem.population(&self.surrogate, SCOUTS, number);
        self.problem = Some(problem);
        (population, scouts)
    }

    /// Returns the first of these points, at most `most`, to be evaluated.
    fn batch_to_explore(&mut self, scouts: Vec<Point>, most: usize) -> Vec<Pending> {
        self.explored += 1;
        self.in_vain += 1;
        let scouts = scouts.into_iter().take(BATCH.min(most));
        scouts.map(|point| Pending { point, used_for: PointUse::Explore }).collect()
    }

    /// Returns at most `most` points by which the interpolation is checked and bettered.
    fn batch_to_check(&mut self, mut population: Population, most: usize) -> Vec<Pending> {
        let Some(problem) = &self.problem else { return Vec::new() };
        if problem.is_of_few() {
            population = problem.widened(population);
        }
        let draws = population.resampled(BATCH.min(most), 0.5);
        let checking = draws.iter().map(|member| Pending {
            point: member.point,
            used_for: PointUse::Check(member.moments),
        });
        let mut pending: Vec<Pending> = checking.collect();
        self.check = BatchCheck::default();
        if !problem.is_of_few() {
            let errors = self.expected_errors(problem, &population);
            self.check.expected = population.mean(&errors);
            pending.extend(most_uncertain(&population, &errors, LEARNT.min(most - pending.len())));
        }
        pending
    }

    /// Returns whether another batch may find points nearer to the data.
    fn goes_on_exploring(&self) -> bool {
        self.explored < EXPLORED_MAX && self.in_vain <= VAIN_MAX
    }

    /// Returns points that may be near the data: of the prior, and as soon as the model is known somewhere also about
    /// the nearest point, those first that the interpolation believes to be nearest.
    fn scouts(&self, problem: &PosteriorProblem) -> Vec<Point> {
        let scouts = problem.prior_points(self.explored * SCOUTS..(self.explored + 1) * SCOUTS);
        let Some((nearest, _)) = self.nearest.filter(|_| self.surrogate.len() > 0) else {
            return scouts;
        };
        let closer = scouts.into_iter().enumerate().map(|(index, mut scout)| {
            let part = CLOSER[index % CLOSER.len()];
            let values = scout.0.iter_mut().zip(nearest.0);
            values.for_each(|(value, near)| *value = near + part * (*value - near));
            scout
        });
        let distance = |point: Point| {
            let values = moments(&self.surrogate, &problem.structure, &point)?;
            Some((problem.distance(&values), point))
        };
        let mut known: Vec<(f64, Point)> = closer.filter_map(distance).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        known.into_iter().map(|(_, point)| point).collect()
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
