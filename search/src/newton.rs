//! Minimum-norm Gauss-Newton steps with Broyden's updates, as an ask/tell state machine in the unit
//! box.
//!
//! It knows no realization, no job and no clock: [`Newton::ask`] names the next point,
//! [`Newton::tell`] takes its cost and moments. The path is a function of the settings and of what
//! was told, so that telling the same again rebuilds the same state.
//!
//! Looked for is, of the points whose moments are the data's, the one nearest to the start in units
//! of the box. What is believed of the moments (`model.rs`) is the closed form ln √(c1111/ρ), ln δ
//! with a correction that every evaluation improves; the next point is the believed answer
//! (`nearest.rs`): the nearest one that a fixed number of descents over the whole box find, since the
//! points that match are curved and one descent may end at a point that is nearer only than those
//! around it. It is looked for from the start and not from where the search is, so that steps
//! add no detours; once a whole step has ended at a cost below [`NEAR`], from there, and by one
//! descent: what is left to do is then so little that it does not matter, and corrections that also
//! slid along the points that match would be longer than what they correct. The start itself is
//! evaluated first.
//!
//! # Safeguards
//!
//! A step is at most [`RADIUS_MAX`] long. After a point that is infeasible, or has a higher cost
//! than the best, steps are at most half as long as the one that led there; after a better one,
//! twice as long again. A point refused by the caller counts as infeasible without being evaluated.
//!
//! # When it stops
//!
//! - The cost is at most `cost_tolerance`: [`Stop::CostReached`].
//! - It stalls: a step of at most `size_tolerance` does not halve the cost, [`SLOW_MAX`] evaluations
//!   do not, or the believed answer is where the search is. Then the correction's slopes are
//!   forgotten; when it stalls again, they are measured by differences, one evaluation for each
//!   parameter; when it stalls again and has not halved the cost since, it ends: [`Stop::Settled`].
//!   So ends a search whose data no point in the box matches, at the least cost.
//! - `max_evaluations` points were evaluated: [`Stop::EvaluationsUsedUp`].
//! - The start and the points between it and the believed answer are infeasible: [`Stop::Infeasible`].

mod model;
mod nearest;

use osteon_common::results::Moments;

use crate::ask::{Ask, Stop};
use crate::search_box::SearchBox;

use self::model::{Logarithms, Model, subtract};
use self::nearest::norm;

pub use self::nearest::{Rows, nearest};

#[cfg(test)]
mod tests;

/// Longest step, in edges of the box.
pub const RADIUS_MAX: f64 = 1.0;
/// Evaluations in a row that do not halve the cost, before the Jacobian is made anew.
pub const SLOW_MAX: u32 = 4;
/// Cost below which the nearest point is found but for corrections: both moments to 1 %.
pub const NEAR: f64 = 1e-4;
/// A cost below this fraction of another is progress.
const PROGRESS: f64 = 0.5;
/// Step of the differences that measure slopes, in edges of the box.
const DIFFERENCE: f64 = 1e-4;
/// A shorter step is none: rounding of coordinates.
const STEP_MIN: f64 = 1e-12;
/// Where nothing was feasible yet, steps shorter than this are not tried.
const RADIUS_BLIND: f64 = 1.0 / 64.0;
/// The mean velocity over √(c1111/ρ), and the coefficient of variation over δ/√14, near enough to
/// go on from a start that is infeasible.
const RULE_OF_THUMB: f64 = 0.99;

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Most points to evaluate.
    pub max_evaluations: u64,
    /// Stop when the cost is at most this.
    pub cost_tolerance: f64,
    /// Steps of at most this length must gain something.
    pub size_tolerance: f64,
}

/// An evaluated point.
#[derive(Debug, Clone, PartialEq)]
struct Evaluated {
    at: Vec<f64>,
    cost: f64,
    found: Logarithms,
}

/// What the pending point is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Purpose {
    /// The start, or a step towards the believed answer.
    Step,
    /// The slopes along this axis.
    Difference { axis: usize, step: f64 },
}

/// How the slopes were last made anew, if the cost was not halved since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Renewed {
    No,
    Forgotten,
    Measured,
}

/// A search in the unit box.
#[derive(Debug, Clone, PartialEq)]
pub struct Newton {
    settings: Settings,
    target: Logarithms,
    /// From where the nearest point is looked for: the start, later where it nearly is.
    centre: Vec<f64>,
    /// Whether it nearly is there.
    near: bool,
    model: Model,
    /// The lowest cost of all steps, once one was feasible.
    base: Option<Evaluated>,
    pending: Vec<f64>,
    purpose: Purpose,
    /// Whether the pending step goes all the way.
    whole: bool,
    /// Longest step for now.
    radius: f64,
    /// The cost to halve, and evaluations since it was halved.
    mark: f64,
    slow: u32,
    renewed: Renewed,
    cost_at_renewal: f64,
    stop: Option<Stop>,
    evaluations: u64,
}

impl Newton {
    /// A search for the point of `space` nearest to its start whose moments are those of `data`
    /// (both above 0).
    pub fn new(space: SearchBox, data: Moments, settings: Settings) -> Self {
        let start = space.start();
        let rule = [RULE_OF_THUMB, RULE_OF_THUMB / 14.0_f64.sqrt()].map(libm::log);
        let mut newton = Self {
            settings,
            target: logarithms(data),
            model: Model::new(space, start.clone(), rule),
            base: None,
            pending: start.clone(),
            centre: start,
            near: false,
            purpose: Purpose::Step,
            whole: false,
            radius: RADIUS_MAX,
            mark: f64::INFINITY,
            slow: 0,
            renewed: Renewed::No,
            cost_at_renewal: f64::INFINITY,
            stop: None,
            evaluations: 0,
        };
        newton.stop_when_used_up();
        newton
    }

    /// The next point, or why there is none. Asking changes nothing.
    pub fn ask(&self) -> Ask<'_> {
        match self.stop {
            Some(stop) => Ask::Stopped(stop),
            None => Ask::At(&self.pending),
        }
    }

    /// Takes the cost of the point asked for, and its moments; a cost or a logarithm of a moment
    /// that is not finite makes it infeasible. Ignored once stopped.
    pub fn tell(&mut self, cost: f64, moments: Option<Moments>) {
        if self.stop.is_some() {
            return;
        }
        self.evaluations += 1;
        let at = self.pending.clone();
        let found = moments.map(logarithms).filter(|found| found.iter().all(|y| y.is_finite()));
        let feasible = cost.is_finite();
        self.take(found.filter(|_| feasible).map(|found| Evaluated { at, cost, found }));
        self.stop_when_used_up();
    }

    /// The point asked for is inadmissible: it was not evaluated. Refusing every point ends the
    /// search: each refusal halves the step.
    pub fn refuse(&mut self) {
        if self.stop.is_none() {
            self.take(None);
        }
    }

    /// Points evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Points that may be asked for after the pending one, at most `most`: the others at which
    /// slopes are measured. Where a step goes depends on all that is told before.
    pub fn likely(&self, most: usize) -> Vec<Vec<f64>> {
        let Purpose::Difference { axis, .. } = self.purpose else {
            return Vec::new();
        };
        let left = self.settings.max_evaluations.saturating_sub(self.evaluations + 1);
        let axes = (axis + 1..self.anchor().len()).take(most);
        let axes = axes.take(usize::try_from(left).unwrap_or(usize::MAX));
        axes.map(|axis| self.beside(axis, self.difference(axis))).collect()
    }

    fn stop_when_used_up(&mut self) {
        if self.stop.is_none() && self.evaluations >= self.settings.max_evaluations {
            self.stop = Some(Stop::EvaluationsUsedUp);
        }
    }

    /// What is at the pending point; `None` if it is infeasible.
    fn take(&mut self, trial: Option<Evaluated>) {
        if trial.as_ref().is_some_and(|trial| trial.cost <= self.settings.cost_tolerance) {
            self.stop = Some(Stop::CostReached);
            return;
        }
        match self.purpose {
            Purpose::Step => self.stepped(trial),
            Purpose::Difference { axis, step } => self.differed(axis, step, trial),
        }
    }

    fn stepped(&mut self, trial: Option<Evaluated>) {
        let length = norm(&subtract(&self.pending, self.anchor()));
        let lowest = self.base.as_ref().map(|base| base.cost);
        let Some(trial) = trial else {
            // The start is no step.
            self.radius = if length > 0.0 { 0.5 * length } else { self.radius };
            self.go_on(false);
            return;
        };
        if lowest.is_some() {
            self.model.learn(&trial.at, trial.found);
        }
        let halved = trial.cost < PROGRESS * self.mark;
        if halved {
            self.mark = trial.cost;
            self.slow = 0;
        } else {
            self.slow += 1;
        }
        if lowest.is_none_or(|lowest| trial.cost < lowest) {
            self.model.settle_on(&trial.at, trial.found);
            if self.whole && trial.cost < NEAR {
                self.centre.clone_from(&trial.at);
                self.near = true;
            }
            self.base = Some(trial);
            self.radius = (2.0 * self.radius).min(RADIUS_MAX);
        } else {
            self.radius = 0.5 * length;
        }
        self.go_on(!halved && length <= self.settings.size_tolerance);
    }

    /// Makes the next step pending, or what is to be done when there is none that leads on. Ends:
    /// each turn makes the slopes anew in the next of the ways that there are.
    fn go_on(&mut self, mut stalled: bool) {
        loop {
            let shortest = match self.base {
                Some(_) => self.settings.size_tolerance.max(STEP_MIN),
                None => RADIUS_BLIND,
            };
            stalled |= self.slow >= SLOW_MAX || self.radius < shortest;
            if stalled && !self.forget_slopes() {
                return;
            }
            let anchor = self.anchor();
            let mut step = subtract(&self.believed_answer(), anchor);
            let length = norm(&step);
            if length > self.radius {
                step.iter_mut().for_each(|d| *d *= self.radius / length);
            }
            if length > STEP_MIN {
                let moved = anchor.iter().zip(&step).map(|(u, d)| (u + d).clamp(0.0, 1.0));
                self.pending = moved.collect();
                self.purpose = Purpose::Step;
                self.whole = length <= self.radius;
                return;
            }
            stalled = true;
        }
    }

    /// Where the search would go if steps could be as long as they like.
    fn believed_answer(&self) -> Vec<f64> {
        if self.near {
            self.model.nearest_from_here(&self.centre, self.target)
        } else {
            self.model.nearest(&self.centre, self.target)
        }
    }

    /// Makes the slopes anew without an evaluation. If that was done, or changes nothing, they are
    /// measured; if that was done too, the search is over. Then false: there is no step to look for.
    fn forget_slopes(&mut self) -> bool {
        let Some(base) = &self.base else {
            self.stop = Some(Stop::Infeasible);
            return false;
        };
        if base.cost < PROGRESS * self.cost_at_renewal {
            self.cost_at_renewal = base.cost;
            self.renewed = Renewed::No;
        }
        self.radius = RADIUS_MAX;
        self.slow = 0;
        if self.renewed == Renewed::No && self.model.forget_slopes() {
            self.renewed = Renewed::Forgotten;
            return true;
        }
        if self.renewed == Renewed::Measured {
            self.stop = Some(Stop::Settled);
            return false;
        }
        self.renewed = Renewed::Measured;
        self.measure_from(0);
        false
    }

    /// Asks for the difference along `axis`, or goes on when all are there.
    fn measure_from(&mut self, axis: usize) {
        if axis < self.anchor().len() {
            self.measure(axis, self.difference(axis));
        } else {
            self.go_on(false);
        }
    }

    /// Step of the difference along `axis` that is tried first.
    fn difference(&self, axis: usize) -> f64 {
        if self.anchor()[axis] + DIFFERENCE <= 1.0 { DIFFERENCE } else { -DIFFERENCE }
    }

    /// Where steps begin, moved along `axis`.
    fn beside(&self, axis: usize, step: f64) -> Vec<f64> {
        let mut at = self.anchor().to_vec();
        at[axis] += step;
        at
    }

    fn measure(&mut self, axis: usize, step: f64) {
        self.pending = self.beside(axis, step);
        self.purpose = Purpose::Difference { axis, step };
    }

    fn differed(&mut self, axis: usize, step: f64, trial: Option<Evaluated>) {
        match trial {
            Some(trial) => self.model.learn_along(axis, &trial.at, trial.found),
            // Once the other way; the slopes along an axis between walls stay as they are.
            None if step > 0.0 && self.anchor()[axis] - step >= 0.0 => {
                self.measure(axis, -step);
                return;
            }
            None => {}
        }
        self.measure_from(axis + 1);
    }

    /// Where steps begin.
    fn anchor(&self) -> &[f64] {
        self.base.as_ref().map_or(&self.centre, |base| &base.at)
    }
}

fn logarithms(moments: Moments) -> Logarithms {
    [moments.mean, moments.coefficient_of_variation].map(libm::log)
}
