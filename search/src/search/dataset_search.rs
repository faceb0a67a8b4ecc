//! The search for one set of data: from one start or several, then the derivatives at the best
//! point.

use osteon_common::ensemble::Germs;
use osteon_common::inference::{ModelAtPoint, MomentWeights, agreement, model_errors};
use osteon_common::job::{JobSpecification, MonteCarlo, NoVariation, Objective};
use osteon_common::moments::MomentVector;
use osteon_common::observables::ObservableValues;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::{ComparedMoments, Evaluation, EvaluationRole, GroupEnding, Status};
use osteon_common::statistics::{PointStatistics, estimate, likelihood_cost, observable_estimates};

use super::differences::differences;
use super::ending::Ending;
use super::method::MethodState;
use super::reasons;
use crate::posterior::{PosteriorSearch, SearchOutcome, SetLikelihood, feasible_moments};
use crate::proposal::{Proposal, StopReason};
use crate::search_box::SearchBox;

/// χ² at which a further start ends once an earlier one has met the tolerance, and so is the answer:
/// a tenth of a standard error of the data is enough for one more set of parameters that fits them.
const FITTING: f64 = 1e-2;
/// Maximum number of random points of the box that are tried for an admissible start.
const START_TRIES: u64 = 64;

/// The search for one set of data.
#[derive(Debug, Clone)]
pub(super) struct DatasetSearch {
    /// Number of the set.
    set: u32,
    data: ComparedMoments,
    /// Weights of the moments, if the cost is χ², or other observables were measured.
    weights: Option<MomentWeights>,
    /// Number of the current start.
    start: u32,
    /// The search ends with this start, without derivatives and posterior.
    is_of_one_start: bool,
    space: SearchBox,
    method: MethodState,
    /// Number of points evaluated for this set, and the first of them.
    evaluations: u64,
    first: Option<Evaluation>,
    best: Option<Best>,
    /// The points after the best one of the same start.
    trials: reasons::Trials,
    /// Why the search from the start of the best point stopped, or, while there is none, the latest
    /// search.
    stop: Option<StopReason>,
    /// Points that measure derivatives, in reverse order.
    differences: Vec<(Option<Parameter>, Point)>,
    /// Evaluations with a shifted setup.
    shifted: Vec<Evaluation>,
    /// Whether there is no posterior because one of these has no moments.
    lacks_effect: bool,
    /// Feasible points of the search, kept only for a posterior.
    known: Vec<(Point, ComparedMoments)>,
    /// Points of the posterior, which come last.
    posterior: Option<Box<PosteriorSearch>>,
    ending: Option<GroupEnding>,
}

/// The best feasible evaluation so far.
#[derive(Debug, Clone)]
struct Best {
    row: Evaluation,
    outcomes: Outcomes,
}

impl DatasetSearch {
    /// Creates the search for set number `set` of the data.
    pub(super) fn new(specification: &JobSpecification, set: usize) -> Self {
        let tolerance = specification.search.cost_tolerance;
        Self::from_start(specification, set, (0, false), tolerance)
    }

    /// Creates the search for a set from one of several starts alone, which ends at a cost of at most
    /// `tolerance`.
    pub(super) fn of_one_start(
        specification: &JobSpecification,
        set: usize,
        start: u32,
        tolerance: f64,
    ) -> Self {
        Self::from_start(specification, set, (start, true), tolerance)
    }

    fn from_start(
        specification: &JobSpecification,
        set: usize,
        (start, is_of_one_start): (u32, bool),
        tolerance: f64,
    ) -> Self {
        let given = specification.data.as_ref();
        let data = given.map_or(ComparedMoments::UNKNOWN, |given| given.compared(set));
        let space = space_of_start(specification, set, start);
        let is_weighted = specification.objective == Objective::ChiSquare
            || !specification.observables().is_empty();
        let weighted = given.filter(|_| is_weighted);
        let weights = weighted.and_then(|given| MomentWeights::of_data(given, set));
        let measured = measured(specification, set);
        let method =
            MethodState::new(specification, data, measured, weights, space.clone(), tolerance);
        let mut search = Self {
            // A job has at most a thousand sets.
            set: u32::try_from(set).unwrap_or(u32::MAX),
            data,
            weights,
            start,
            is_of_one_start,
            space,
            method: method_of_start(specification, start, method),
            evaluations: 0,
            first: None,
            best: None,
            trials: reasons::Trials::default(),
            stop: None,
            differences: Vec::new(),
            shifted: Vec::new(),
            lacks_effect: false,
            known: Vec::new(),
            posterior: None,
            ending: None,
        };
        match given.and_then(|given| given.groups().get(set)?.no_variation()) {
            Some(why) => search.ending = Some(unsearched(why)),
            None => search.settle(specification),
        }
        search
    }

    /// Returns the number of the set.
    pub(super) fn set(&self) -> u32 {
        self.set
    }

    /// Returns the number of the current start; that of the last one plus one if none is left.
    pub(super) fn start(&self) -> u32 {
        self.start
    }

    /// Returns the next point, unless the search has ended.
    pub(super) fn point(&self) -> Option<Point> {
        if self.ending.is_some() {
            return None;
        }
        if let Some(posterior) = &self.posterior {
            return posterior.point();
        }
        match (self.differences.last(), self.method.ask()) {
            (Some((_, point)), _) => Some(*point),
            (None, Proposal::Evaluate(at)) => Some(self.space.point(at)),
            (None, Proposal::Stopped(_)) => None,
        }
    }

    /// Returns at most `most` points that the search may ask for after the pending one, the most
    /// probable first.
    pub(super) fn candidates(&self, most: usize) -> Vec<Point> {
        if let Some(posterior) = &self.posterior {
            return posterior.candidates(most);
        }
        if self.differences.is_empty() {
            let candidates = self.method.candidates(most);
            let points = candidates.iter().map(|at| self.space.point(at));
            return points.filter(|point| self.space.admits(point)).collect();
        }
        self.differences.iter().rev().skip(1).take(most).map(|(_, point)| *point).collect()
    }

    /// Returns the cost of the pending point, given its moments.
    pub(super) fn cost(
        &self,
        specification: &JobSpecification,
        statistics: &PointStatistics,
        point: &Point,
        outcomes: &Outcomes,
    ) -> f64 {
        let measured = measured(specification, self.set as usize);
        let cost = match (specification.objective, measured, &self.weights) {
            (Objective::Likelihood, Some(measured), weights) => {
                let velocities = (&specification.monte_carlo, point, outcomes, measured);
                self.likelihood_cost(statistics, velocities, weights.as_ref())
            }
            (Objective::ChiSquare, _, Some(weights)) => {
                statistics.cost_by(|model| weights.cost(&self.data, model))
            }
            _ => statistics.cost(&self.data),
        };
        cost + specification.penalty(point)
    }

    /// Returns minus the logarithm of the likelihood of the velocities, per velocity, and of the means of
    /// the other observables, given the moments of the velocities.
    fn likelihood_cost(
        &self,
        statistics: &PointStatistics,
        (monte_carlo, point, outcomes, measured): (&MonteCarlo, &Point, &Outcomes, &[f64]),
        weights: Option<&MomentWeights>,
    ) -> f64 {
        let cost = likelihood_cost(statistics, monte_carlo, point, outcomes, measured);
        let Some(weights) = weights else { return cost };
        let count = measured.len() as f64;
        cost + statistics.cost_by(|model| {
            weights.square_given_velocities(model.differences(&self.data)) / (2.0 * count)
        })
    }

    /// Takes the moments and the outcomes of the pending point, with its cost in the row. Returns
    /// the completed row.
    pub(super) fn tell(
        &mut self,
        specification: &JobSpecification,
        mut row: Evaluation,
        statistics: PointStatistics,
        outcomes: Outcomes,
    ) -> Evaluation {
        row.role =
            EvaluationRole { group: self.set, start: self.start, ..EvaluationRole::default() };
        if self.posterior.is_some() {
            self.tell_posterior(specification, &mut row, outcomes);
        } else if let Some((varied, _)) = self.differences.pop() {
            let start = self.best().map_or(0, |best| best.role.start);
            let shifted = row.point.shift().is_some();
            row.role = EvaluationRole { start, varied, shifted, ..row.role };
            // Another setup may make other realizations fail, and its effect is no small one.
            let is_kept = if shifted { statistics.feasible } else { self.fails_alike(&outcomes) };
            row.moments = statistics.moments.filter(|_| is_kept);
            if row.moments.is_none() {
                row.observables = ObservableValues::default();
            }
            if shifted {
                self.shifted.push(row);
            }
        } else {
            self.method.tell(row.cost.unwrap_or(f64::INFINITY), statistics.compared());
            self.evaluations += 1;
            self.first.get_or_insert(row);
            self.keep_for_posterior(specification, &row);
            self.keep_if_better(specification, row, outcomes);
            self.note_trial(&row, &statistics);
        }
        self.settle(specification);
        row
    }

    /// Counts the point among those after the best one.
    fn note_trial(&mut self, row: &Evaluation, statistics: &PointStatistics) {
        let Some(best) = self.best() else { return };
        if best.number == row.number {
            self.trials = reasons::Trials::default();
        } else if best.role.start == self.start {
            let refused = !statistics.feasible && row.failures.total() > 0;
            self.trials.take(row, refused);
        }
    }

    fn tell_posterior(
        &mut self,
        specification: &JobSpecification,
        row: &mut Evaluation,
        outcomes: Outcomes,
    ) {
        row.role.posterior = true;
        if self.evaluations == 0 {
            self.first.get_or_insert(*row);
            self.keep_if_better(specification, *row, outcomes);
        }
        if let Some(posterior) = &mut self.posterior {
            posterior.tell(feasible_moments(row));
        }
    }

    fn keep_for_posterior(&mut self, specification: &JobSpecification, row: &Evaluation) {
        if specification.posterior.is_some() {
            self.known.extend(feasible_moments(row).map(|moments| (row.point, moments)));
        }
    }

    /// Returns the best evaluation, if a point was feasible. Of equal costs the first is kept, and
    /// a point within the tolerance is never replaced.
    pub(super) fn best(&self) -> Option<&Evaluation> {
        self.best.as_ref().map(|best| &best.row)
    }

    /// Returns the outcomes of the best evaluation.
    pub(super) fn best_outcomes(&self) -> Option<&Outcomes> {
        self.best.as_ref().map(|best| &best.outcomes)
    }

    /// Returns how the search ended, if it has.
    pub(super) fn ending(&self) -> Option<&GroupEnding> {
        self.ending.as_ref()
    }

    /// Returns whether the same realizations failed as at the best point.
    fn fails_alike(&self, outcomes: &Outcomes) -> bool {
        self.best_outcomes().is_some_and(|best| {
            best.iter().zip(outcomes.iter()).all(|(one, other)| one.is_err() == other.is_err())
        })
    }

    fn keep_if_better(
        &mut self,
        specification: &JobSpecification,
        row: Evaluation,
        outcomes: Outcomes,
    ) {
        let Some(cost) = row.cost else { return };
        let tolerance = match specification.objective {
            Objective::Moments | Objective::ChiSquare => specification.search.cost_tolerance,
            // A likelihood has no value that is high enough to stop.
            Objective::Likelihood => f64::NEG_INFINITY,
        };
        let lowest = self.best.as_ref().and_then(|best| best.row.cost);
        if cost.is_finite() && lowest.is_none_or(|lowest| lowest > tolerance && cost < lowest) {
            self.best = Some(Best { row, outcomes });
        }
    }

    /// Moves on to a point that is to be evaluated, or to the end.
    fn settle(&mut self, specification: &JobSpecification) {
        while self.ending.is_none() && self.differences.is_empty() {
            if let Some(posterior) = &self.posterior {
                if posterior.point().is_none() {
                    self.end(specification);
                }
                return;
            }
            match self.method.ask() {
                Proposal::Evaluate(at) if self.space.admits(&self.space.point(at)) => return,
                Proposal::Evaluate(_) => self.method.refuse(),
                Proposal::Stopped(stop) => self.stopped(specification, stop),
            }
        }
    }

    /// Starts the search from the next start; after the last start, the derivatives or the end.
    fn stopped(&mut self, specification: &JobSpecification, stop: StopReason) {
        if self.is_of_one_start {
            self.stop = Some(stop);
            return self.end(specification);
        }
        if u64::from(self.start) == specification.search.starts {
            return self.begin_posterior(specification);
        }
        if self.best().is_none_or(|best| best.role.start == self.start) {
            self.stop = Some(stop);
        }
        self.start += 1;
        if u64::from(self.start) < specification.search.starts {
            let set = self.set as usize;
            self.space = space_of_start(specification, set, self.start);
            let measured = measured(specification, set);
            let (data, weights, space) = (self.data, self.weights, self.space.clone());
            let tolerance = self.tolerance(specification);
            let method = MethodState::new(specification, data, measured, weights, space, tolerance);
            self.method = method_of_start(specification, self.start, method);
            return;
        }
        if let Some(best) = self.best.as_ref().filter(|_| specification.search.sensitivities) {
            self.differences = differences(specification, &best.row.point);
        }
        if self.differences.is_empty() {
            self.begin_posterior(specification);
        }
    }

    /// Returns the cost at which a further start ends, by what is known so far.
    pub(super) fn tolerance(&self, specification: &JobSpecification) -> f64 {
        let given = specification.search.cost_tolerance;
        let is_answered =
            self.best().and_then(|best| best.cost).is_some_and(|lowest| lowest <= given);
        if !is_answered {
            return given;
        }
        let of_data = || MomentWeights::of_data(specification.data.as_ref()?, self.set as usize);
        let fitting = match specification.objective {
            Objective::ChiSquare => Some(FITTING),
            Objective::Moments => of_data().map(|weights| weights.relative_squares(FITTING)),
            Objective::Likelihood => None,
        };
        fitting.map_or(given, |fitting| fitting.max(given))
    }

    /// Begins the posterior, if the job asks for one; otherwise ends the search.
    fn begin_posterior(&mut self, specification: &JobSpecification) {
        if specification.posterior.is_none() {
            return self.end(specification);
        }
        let set = self.set as usize;
        let likelihood = match SetLikelihood::new(specification, set) {
            Some(found) if !specification.systematic.is_empty() => {
                let found = self.model_at_best(specification, |model, _| {
                    found.with_systematic(specification, set, model, &self.shifted)
                });
                let Some(found) = found.flatten() else {
                    self.lacks_effect = true;
                    return self.end(specification);
                };
                Some(found)
            }
            found => found,
        };
        let known = std::mem::take(&mut self.known);
        let posterior =
            PosteriorSearch::new(&specification.of_set(set), likelihood, known.into_iter());
        self.posterior = Some(Box::new(posterior));
    }

    /// Returns what `of` says of the model at the best point and its sampling errors; `None` if no realization
    /// succeeded there.
    fn model_at_best<T>(
        &self,
        specification: &JobSpecification,
        of: impl FnOnce(ModelAtPoint<'_>, MomentVector) -> T,
    ) -> Option<T> {
        let Best { row, outcomes } = self.best.as_ref()?;
        let velocity = &estimate(&specification.monte_carlo, &row.point, outcomes)?;
        let observables = &observable_estimates(&specification.monte_carlo, outcomes);
        let errors = model_errors(&self.data, velocity, observables);
        Some(of(ModelAtPoint { point: &row.point, velocity, observables, outcomes }, errors))
    }

    fn end(&mut self, specification: &JobSpecification) {
        let found = self.model_at_best(specification, |model, errors| {
            (agreement(specification, self.set as usize, model), errors)
        });
        let (agreement, errors) = found.unzip();
        let evidence = reasons::Evidence {
            best: self.best(),
            agreement: agreement.flatten(),
            trials: self.trials,
            first: self.first.as_ref(),
            evaluations: self.evaluations,
            posterior: match &self.posterior {
                // The search has a status of its own, which the posterior does not change.
                Some(posterior) if specification.is_searched() => Some(posterior.outcome()),
                Some(posterior) => Some(posterior.ending(errors)),
                None if self.lacks_effect => Some(SearchOutcome::UnknownEffect),
                None => None,
            },
        };
        // Always set before the end.
        let stop = self.stop.unwrap_or(StopReason::Converged);
        let Ending { status, reason, .. } = reasons::ending(stop, &evidence, specification);
        let best = self.best().map(|row| row.number);
        self.ending = Some(GroupEnding { status, reason, best });
    }
}

/// Returns the ending of a group whose data have no variation to match.
fn unsearched(why: NoVariation) -> GroupEnding {
    GroupEnding { status: Status::Failed, reason: Some(why.to_string()), best: None }
}

/// Returns the velocities of a set of data, if they are known.
fn measured(specification: &JobSpecification, set: usize) -> Option<&[f64]> {
    specification.data.as_ref().and_then(|data| data.velocities(set))
}

/// Lets the search from a random point begin near the data; that from the parameters' own start begins
/// there.
fn method_of_start(
    specification: &JobSpecification,
    start: u32,
    method: MethodState,
) -> MethodState {
    let is_random = specification.search.first_start + u64::from(start) > 0;
    if is_random { method.near_the_data() } else { method }
}

/// Returns the box for one of the searches for a set of data. Its start is that of the parameters, or a
/// random point, which is the same for every set.
fn space_of_start(specification: &JobSpecification, set: usize, start: u32) -> SearchBox {
    let space = SearchBox::new(specification.ranges_of(set))
        .with_structure(specification.setup.structure.clone());
    let start = specification.search.first_start + u64::from(start);
    if start == 0 {
        return space;
    }
    let tries = (0..START_TRIES).map(|attempt| {
        // No realization has an index this large, so these germs are used for nothing else.
        let index = u64::MAX - (start * START_TRIES + attempt);
        space.started_at(Germs::draw(specification.monte_carlo.seed, index).values())
    });
    let mut usable = tries.filter(|moved| moved.admits(&moved.point(&moved.start())));
    usable.next().unwrap_or(space)
}
