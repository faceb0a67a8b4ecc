//! Minimum-norm Gauss-Newton steps with Broyden's updates, as an ask/tell state machine in the unit
//! box.
//!
//! It depends on no realization, job or clock: [`Newton::ask`] returns the next point,
//! [`Newton::tell`] takes its cost and moments. The path is a function of the settings and of the
//! values passed in, so replaying the same values rebuilds the same state.
//!
//! The search looks for the point nearest to the start, in units of the box, among the points whose
//! moments equal those of the data. Its model of the moments (`model.rs`) is the closed form ln
//! √(c1111/ρ), ln δ with a correction that every evaluation improves. The next point is the model's
//! solution (`nearest.rs`): the nearest one found by a fixed number of descents from all over the
//! box. One descent is not enough because the matching points form a curved surface, on which it
//! may end at a point that is nearest only locally. Distances are measured from the start and not
//! from the current point, so that steps add no detours. Once a whole step has ended at a cost
//! below [`NEAR`], they are measured from there, and one descent is used: the remaining distance is
//! then too small to matter, and corrections that also slid along the matching points would be
//! longer than the errors that they correct. The start itself is evaluated first, unless
//! [`Newton::from_solution`] leaves it out.
//!
//! # Safeguards
//!
//! A step is at most [`RADIUS_MAX`] long. After a point that is infeasible, or has a higher cost
//! than the best, steps are at most half as long as the one that led there; after a better one, the
//! limit is doubled again. A point refused by the caller counts as infeasible without being
//! evaluated.
//!
//! # When it stops
//!
//! - The cost is at most `cost_tolerance`: [`StopReason::CostReached`].
//! - It stalls: a step of at most `size_tolerance` does not halve the cost, [`SLOW_MAX`]
//!   evaluations do not, or the model's solution is the current point. At the first stall the
//!   slopes of the correction are reset; at the second they are measured by finite differences, one
//!   evaluation for each parameter; if the search stalls again without having halved the cost
//!   since, it ends: [`StopReason::Converged`]. This is also how a search ends, at the lowest cost, if no
//!   point in the box matches the data.
//! - `max_evaluations` points were evaluated: [`StopReason::EvaluationsUsedUp`].
//! - The start and the points between it and the model's solution are infeasible:
//!   [`StopReason::Infeasible`].

mod model;
mod nearest;

use osteon_common::inference::MomentWeights;
use osteon_common::moments::{ComparedMoments, MOMENTS, MomentVector};

use crate::proposal::{Proposal, StopReason};
use crate::search_box::SearchBox;

use self::model::{Model, subtract};
use self::nearest::norm;

pub use self::nearest::{Rows, nearest};

#[cfg(test)]
mod tests;

/// Longest step, in edges of the box.
pub const RADIUS_MAX: f64 = 1.0;
/// Number of consecutive evaluations without halving the cost after which the Jacobian is
/// refreshed.
pub const SLOW_MAX: u32 = 4;
/// Cost below which only small corrections are left to the nearest point: both moments match to 1
/// %.
pub const NEAR: f64 = 1e-4;
/// A cost below this fraction of the earlier one counts as progress.
const PROGRESS: f64 = 0.5;
/// Step of the finite differences that measure slopes, in edges of the box.
const DIFFERENCE: f64 = 1e-4;
/// Shorter steps count as zero: they are rounding errors of the coordinates.
const STEP_MIN: f64 = 1e-12;
/// Shortest step tried while no feasible point has been found.
const RADIUS_BLIND: f64 = 1.0 / 64.0;
/// Ratio of the mean velocity to √(c1111/ρ), and of the coefficient of variation to δ/√14: accurate
/// enough to continue from an infeasible start.
const RULE_OF_THUMB: f64 = 0.99;

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum number of points to evaluate.
    pub max_evaluations: u64,
    /// Stop when the cost is at most this.
    pub cost_tolerance: f64,
    /// Steps of at most this length must halve the cost.
    pub size_tolerance: f64,
}

/// An evaluated point.
#[derive(Debug, Clone, PartialEq)]
struct Evaluated {
    at: Vec<f64>,
    cost: f64,
    found: MomentVector,
}

/// The purpose of the pending point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum PointPurpose {
    /// The start, or a step towards the model's solution.
    Step,
    /// Measures the slopes along this axis.
    Difference { axis: usize, step: f64 },
}

/// The last refresh of the slopes, if the cost has not been halved since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SlopeRefresh {
    None,
    Reset,
    Measured,
}

/// A search in the unit box.
#[derive(Debug, Clone, PartialEq)]
pub struct Newton {
    settings: Settings,
    data: ComparedMoments,
    /// The first axis whose slopes are always measured. The closed form contains the bone's parameters and the
    /// porosities; other parameters of the setup come after them. With other observables, which it does not
    /// contain, it is the first axis of all.
    first_unknown: usize,
    /// Point from which distances are measured: the start, later a point near the solution.
    centre: Vec<f64>,
    /// Whether `centre` is near the solution.
    near: bool,
    model: Model,
    /// Weights of the moments, if the cost is χ².
    weights: Option<MomentWeights>,
    /// The step of lowest cost so far, if one was feasible.
    base: Option<Evaluated>,
    pending: Vec<f64>,
    /// Whether the start was left out, and may have to be evaluated after the pending solution.
    start_left_out: bool,
    purpose: PointPurpose,
    /// Whether the pending step reaches the model's solution.
    full_step: bool,
    /// Current limit of the step length.
    radius: f64,
    /// The cost to be halved, and the number of evaluations since it was halved last.
    reference_cost: f64,
    slow_evaluations: u32,
    slope_refresh: SlopeRefresh,
    cost_at_refresh: f64,
    stop: Option<StopReason>,
    evaluations: u64,
}

impl Newton {
    /// Creates a search for the point of `space` nearest to its start whose moments are those of
    /// `data` (both above 0).
    pub fn new(space: SearchBox, data: ComparedMoments, settings: Settings) -> Self {
        let start = space.start();
        let mut rule = [0.0; MOMENTS];
        rule[0] = libm::log(RULE_OF_THUMB);
        rule[1] = libm::log(RULE_OF_THUMB / 14.0_f64.sqrt());
        let has_observables = !data.observables.which().is_empty();
        let mut newton = Self {
            settings,
            data,
            first_unknown: if has_observables { 0 } else { space.first_unknown() },
            model: Model::new(space, start.clone(), rule),
            weights: None,
            base: None,
            pending: start.clone(),
            start_left_out: false,
            centre: start,
            near: false,
            purpose: PointPurpose::Step,
            full_step: false,
            radius: RADIUS_MAX,
            reference_cost: f64::INFINITY,
            slow_evaluations: 0,
            slope_refresh: SlopeRefresh::None,
            cost_at_refresh: f64::INFINITY,
            stop: None,
            evaluations: 0,
        };
        newton.stop_when_used_up();
        newton
    }

    /// Makes χ² with these weights the cost: it decides where no point of the box matches both
    /// moments.
    #[must_use]
    pub fn weighted_by(mut self, weights: MomentWeights) -> Self {
        self.model.weigh(weights.normalized());
        self.weights = Some(weights);
        self
    }

    /// Begins with the closed form's solution nearest to the start, instead of with the start. The
    /// solution is nearer to the data, and a random point of the box may have bones that take a hundred
    /// times as long to compute, or fail. If the solution is infeasible, the start is evaluated after
    /// all.
    #[must_use]
    pub fn from_solution(mut self) -> Self {
        if self.stop.is_none() {
            self.pending = self.model_solution();
            self.start_left_out = true;
            self.full_step = true;
        }
        self
    }

    /// Returns the next point, or the reason why there is none. Does not change the state.
    pub fn ask(&self) -> Proposal<'_> {
        match self.stop {
            Some(stop) => Proposal::Stopped(stop),
            None => Proposal::Evaluate(&self.pending),
        }
    }

    /// Takes the cost and the moments of the pending point; if the cost or the logarithm of a
    /// moment is not finite, the point is infeasible. Ignored once stopped.
    pub fn tell(&mut self, cost: f64, moments: Option<ComparedMoments>) {
        if self.stop.is_some() {
            return;
        }
        self.evaluations += 1;
        let at = self.pending.clone();
        let found = moments.map(|moments| moments.in_logarithms(&self.data));
        let found = found.filter(|found| found.iter().all(|y| y.is_finite()));
        let feasible = cost.is_finite();
        self.take(found.filter(|_| feasible).map(|found| Evaluated { at, cost, found }));
        self.stop_when_used_up();
    }

    /// Reports that the pending point is inadmissible and was not evaluated. If every point is
    /// refused, the search ends, since each refusal halves the step.
    pub fn refuse(&mut self) {
        if self.stop.is_none() {
            self.take(None);
        }
    }

    /// Returns the number of points evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Returns at most `most` points that the search may ask for after the pending one: the
    /// remaining points at which slopes are measured. A step cannot be predicted, as it depends on
    /// all earlier results.
    pub fn candidates(&self, most: usize) -> Vec<Vec<f64>> {
        let PointPurpose::Difference { axis, .. } = self.purpose else {
            return Vec::new();
        };
        let left = self.settings.max_evaluations.saturating_sub(self.evaluations + 1);
        let axes = (axis + 1..self.base_point().len()).take(most);
        let axes = axes.take(usize::try_from(left).unwrap_or(usize::MAX));
        axes.map(|axis| self.displaced(axis, self.difference(axis))).collect()
    }

    fn stop_when_used_up(&mut self) {
        if self.stop.is_none() && self.evaluations >= self.settings.max_evaluations {
            self.stop = Some(StopReason::EvaluationsUsedUp);
        }
    }

    /// Takes the result at the pending point; `None` if it is infeasible.
    fn take(&mut self, trial: Option<Evaluated>) {
        if trial.as_ref().is_some_and(|trial| trial.cost <= self.settings.cost_tolerance) {
            self.stop = Some(StopReason::CostReached);
            return;
        }
        match self.purpose {
            PointPurpose::Step => self.finish_step(trial),
            PointPurpose::Difference { axis, step } => self.finish_difference(axis, step, trial),
        }
    }

    fn finish_step(&mut self, trial: Option<Evaluated>) {
        let length = norm(&subtract(&self.pending, self.base_point()));
        let lowest = self.base.as_ref().map(|base| base.cost);
        let start_left_out = std::mem::take(&mut self.start_left_out);
        let Some(trial) = trial else {
            if start_left_out {
                // As long as no point was feasible, this is the start.
                self.pending = self.base_point().to_vec();
                self.full_step = false;
                return;
            }
            // The start is not a step and has no length.
            self.radius = if length > 0.0 { 0.5 * length } else { self.radius };
            self.next_step(false);
            return;
        };
        if lowest.is_some() {
            self.model.update_slopes(&trial.at, trial.found);
        }
        let halved = trial.cost < PROGRESS * self.reference_cost;
        if halved {
            self.reference_cost = trial.cost;
            self.slow_evaluations = 0;
        } else {
            self.slow_evaluations += 1;
        }
        let is_first = lowest.is_none();
        if lowest.is_none_or(|lowest| trial.cost < lowest) {
            self.model.make_exact_at(&trial.at, trial.found);
            if self.full_step && self.is_near(&trial) {
                self.centre.clone_from(&trial.at);
                self.near = true;
            }
            self.base = Some(trial);
            self.radius = (2.0 * self.radius).min(RADIUS_MAX);
        } else {
            self.radius = 0.5 * length;
        }
        if is_first && self.first_unknown < self.centre.len() {
            self.measure_from(self.first_unknown);
            return;
        }
        self.next_step(!halved && length <= self.settings.size_tolerance);
    }

    /// Returns whether all moments nearly match.
    fn is_near(&self, trial: &Evaluated) -> bool {
        let squares = trial.found.iter().zip(self.target()).map(|(one, other)| {
            let difference = one - other;
            difference * difference
        });
        match self.weights {
            Some(_) => squares.sum::<f64>() < NEAR,
            None => trial.cost < NEAR,
        }
    }

    /// Makes the next step pending, or refreshes the slopes if no step leads further. Ends, because
    /// each turn uses the next of the finitely many ways of refreshing.
    fn next_step(&mut self, mut stalled: bool) {
        loop {
            let shortest = match self.base {
                Some(_) => self.settings.size_tolerance.max(STEP_MIN),
                None => RADIUS_BLIND,
            };
            stalled |= self.slow_evaluations >= SLOW_MAX || self.radius < shortest;
            if stalled && !self.reset_slopes() {
                return;
            }
            let base = self.base_point();
            let mut step = subtract(&self.model_solution(), base);
            let length = norm(&step);
            if length > self.radius {
                step.iter_mut().for_each(|d| *d *= self.radius / length);
            }
            if length > STEP_MIN {
                let moved = base.iter().zip(&step).map(|(u, d)| (u + d).clamp(0.0, 1.0));
                self.pending = moved.collect();
                self.purpose = PointPurpose::Step;
                self.full_step = length <= self.radius;
                return;
            }
            stalled = true;
        }
    }

    /// Returns the model's solution, to which the search would go if the step length were
    /// unlimited.
    fn model_solution(&self) -> Vec<f64> {
        if self.near {
            self.model.nearest_from_here(&self.centre, self.target())
        } else {
            self.model.nearest(&self.centre, self.target())
        }
    }

    /// Returns the data's moments, in the coordinates of the model's.
    fn target(&self) -> MomentVector {
        self.data.in_logarithms(&self.data)
    }

    /// Refreshes the slopes without an evaluation by resetting them. If that was already done, or
    /// changes nothing, starts to measure them; if that was done too, ends the search. In these two
    /// cases returns false: there is no step to choose now.
    fn reset_slopes(&mut self) -> bool {
        let Some(base) = &self.base else {
            self.stop = Some(StopReason::Infeasible);
            return false;
        };
        if base.cost < PROGRESS * self.cost_at_refresh {
            self.cost_at_refresh = base.cost;
            self.slope_refresh = SlopeRefresh::None;
        }
        self.radius = RADIUS_MAX;
        self.slow_evaluations = 0;
        let all_in_closed_form = self.first_unknown == self.centre.len();
        let may_reset = all_in_closed_form && self.slope_refresh == SlopeRefresh::None;
        if may_reset && self.model.reset_slopes() {
            self.slope_refresh = SlopeRefresh::Reset;
            return true;
        }
        if self.slope_refresh == SlopeRefresh::Measured {
            self.stop = Some(StopReason::Converged);
            return false;
        }
        self.slope_refresh = SlopeRefresh::Measured;
        self.measure_from(0);
        false
    }

    /// Makes the difference along `axis` pending, or continues with a step after the last axis.
    fn measure_from(&mut self, axis: usize) {
        if axis < self.base_point().len() {
            self.measure(axis, self.difference(axis));
        } else {
            self.next_step(false);
        }
    }

    /// Returns the step of the difference along `axis` that is tried first.
    fn difference(&self, axis: usize) -> f64 {
        if self.base_point()[axis] + DIFFERENCE <= 1.0 { DIFFERENCE } else { -DIFFERENCE }
    }

    /// Returns the current base point, moved along `axis`.
    fn displaced(&self, axis: usize, step: f64) -> Vec<f64> {
        let mut at = self.base_point().to_vec();
        at[axis] += step;
        at
    }

    fn measure(&mut self, axis: usize, step: f64) {
        self.pending = self.displaced(axis, step);
        self.purpose = PointPurpose::Difference { axis, step };
    }

    fn finish_difference(&mut self, axis: usize, step: f64, trial: Option<Evaluated>) {
        match trial {
            Some(trial) => self.model.correct_slope(axis, &trial.at, trial.found),
            // Try the other direction once. If both are infeasible, the slopes along this axis are
            // kept.
            None if step > 0.0 && self.base_point()[axis] - step >= 0.0 => {
                self.measure(axis, -step);
                return;
            }
            None => {}
        }
        self.measure_from(axis + 1);
    }

    /// Returns the point at which steps begin.
    fn base_point(&self) -> &[f64] {
        self.base.as_ref().map_or(&self.centre, |base| &base.at)
    }
}
