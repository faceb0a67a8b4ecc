//! The Nelder-Mead simplex as an ask/tell state machine in the unit box.
//!
//! It depends on no realization, job or clock: [`Simplex::ask`] returns the next point,
//! [`Simplex::tell`] takes its cost. The path is a function of the settings and of the costs passed
//! in, so replaying the same costs rebuilds the same state.
//!
//! The algorithm is that of Lagarias, Reeds, Wright and Wright (SIAM J. Optim. 9, 1998) with the
//! standard coefficients (reflection 1, expansion 2, contraction ½, shrinkage ½). A point outside
//! the box, or refused by the caller, has an infinite cost without being evaluated.
//!
//! # When it stops
//!
//! - The best cost is at most the tolerance, where there is one: [`StopReason::CostReached`].
//! - The simplex has collapsed. This is so when its largest extent is at most `size_tolerance` and
//!   its costs differ by at most the tolerance plus a thousandth of the best cost (logarithms: by
//!   at most the difference that counts as equal), or, whatever the costs, when the extent is at
//!   most a thousandth of `size_tolerance`. A collapse does not prove a minimum: a simplex can
//!   flatten against a bound. Therefore the search restarts at the best point with a fresh simplex,
//!   and only a restart that lowers the best cost by less than a thousandth (logarithms: as above)
//!   ends it: [`StopReason::Converged`]. The number of restarts is limited: [`StopReason::RestartsUsedUp`].
//! - `max_evaluations` points were evaluated: [`StopReason::EvaluationsUsedUp`].
//! - No vertex of the first simplex is feasible: [`StopReason::Infeasible`].

use crate::proposal::{Proposal, StopReason};

mod candidates;
#[cfg(test)]
mod tests;

/// Maximum number of restarts after a collapse.
pub const RESTARTS_MAX: u32 = 10;
/// A restart counts as progress if it lowers a cost of squares by at least this fraction. Such
/// costs of a simplex count as equal if they differ by less than this fraction of the best.
const PROGRESS: f64 = 1e-3;
/// Smallest extent of a simplex in the unit box that rounding errors permit.
const EXTENT_MIN: f64 = 1e-14;

/// The kind of costs, which decides how they compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Costs {
    /// Sums of squares (at least 0), compared by their ratio.
    Squares {
        /// Stop when the best cost is at most this.
        tolerance: f64,
    },
    /// Costs of any sign without a target value, compared by their difference.
    Logarithms {
        /// Costs that differ by at most this are equal.
        equal: f64,
    },
}

impl Costs {
    /// Returns whether a cost is low enough to stop.
    fn reached(self, cost: f64) -> bool {
        matches!(self, Self::Squares { tolerance } if cost <= tolerance)
    }

    /// Returns the finite decrease from `cost` that counts as progress.
    fn progress(self, cost: f64) -> f64 {
        match self {
            Self::Squares { .. } => PROGRESS * cost.abs(),
            Self::Logarithms { equal } => equal,
        }
    }

    /// Returns the largest cost difference within a simplex around `cost` that counts as flat.
    fn flat(self, cost: f64) -> f64 {
        match self {
            Self::Squares { tolerance } => tolerance + PROGRESS * cost.abs(),
            Self::Logarithms { equal } => equal,
        }
    }
}

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum number of points to evaluate.
    pub max_evaluations: u64,
    /// The kind of costs.
    pub costs: Costs,
    /// The simplex has collapsed when its largest extent is at most this.
    pub size_tolerance: f64,
    /// Edge length of a fresh simplex.
    pub initial_step: f64,
}

/// A point with its cost.
#[derive(Debug, Clone, PartialEq)]
struct Vertex {
    at: Vec<f64>,
    cost: f64,
}

/// The purpose of the pending point.
#[derive(Debug, Clone, PartialEq)]
enum Move {
    /// A vertex of a fresh simplex.
    Build,
    Reflect,
    /// A point beyond the reflected point.
    Expand {
        reflected: Vertex,
    },
    /// A point between the centroid and the reflected point.
    ContractOutside {
        reflected: Vertex,
    },
    /// A point between the centroid and the worst vertex.
    ContractInside,
    /// Vertex `index` moved half way to the best.
    Shrink {
        index: usize,
    },
}

/// A search in the unit box.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplex {
    settings: Settings,
    /// Sorted by cost once complete; ties keep the order of their creation.
    vertices: Vec<Vertex>,
    pending: Vec<f64>,
    purpose: Move,
    stop: Option<StopReason>,
    evaluations: u64,
    restarts: u32,
    /// Best cost when the current simplex was started.
    cost_at_restart: f64,
    /// The point at which the current simplex was started.
    origin: Vec<f64>,
}

impl Simplex {
    /// Starts a search at `start`, which has one coordinate in `[0, 1]` for each free parameter.
    pub fn new(start: &[f64], settings: Settings) -> Self {
        let mut simplex = Self {
            settings,
            vertices: Vec::with_capacity(start.len() + 1),
            pending: start.to_vec(),
            purpose: Move::Build,
            stop: None,
            evaluations: 0,
            restarts: 0,
            cost_at_restart: f64::INFINITY,
            origin: start.to_vec(),
        };
        simplex.skip_what_needs_no_evaluation();
        simplex
    }

    /// Returns the next point, or the reason why there is none. Does not change the state.
    pub fn ask(&self) -> Proposal<'_> {
        match self.stop {
            Some(stop) => Proposal::Stopped(stop),
            None => Proposal::Evaluate(&self.pending),
        }
    }

    /// Takes the cost of the pending point; NaN counts as infinite. Ignored once stopped.
    pub fn tell(&mut self, cost: f64) {
        if self.stop.is_none() {
            self.evaluations += 1;
            self.take(if cost.is_nan() { f64::INFINITY } else { cost });
            self.skip_what_needs_no_evaluation();
        }
    }

    /// Reports that the pending point is inadmissible: its cost is infinite, and it was not
    /// evaluated. If every point is refused, the search ends, since each round of refusals halves
    /// the simplex.
    pub fn refuse(&mut self) {
        if self.stop.is_none() {
            self.take(f64::INFINITY);
            self.skip_what_needs_no_evaluation();
        }
    }

    /// Returns the number of points evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Returns the number of restarts with a fresh simplex after a collapse.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Assigns infinite costs to pending points outside the box. Ends after two of them: every
    /// other point lies in the convex hull of the vertices.
    fn skip_what_needs_no_evaluation(&mut self) {
        while self.stop.is_none() && self.pending.iter().any(|u| !(0.0..=1.0).contains(u)) {
            self.take(f64::INFINITY);
        }
        if self.stop.is_none() && self.evaluations >= self.settings.max_evaluations {
            self.stop = Some(StopReason::EvaluationsUsedUp);
        }
    }

    /// Takes the cost of the pending point.
    fn take(&mut self, cost: f64) {
        if self.settings.costs.reached(cost) {
            self.stop = Some(StopReason::CostReached);
        } else {
            self.step(cost);
        }
    }

    /// Makes the step that follows from a cost above the tolerance.
    fn step(&mut self, cost: f64) {
        let trial = Vertex { at: std::mem::take(&mut self.pending), cost };
        match std::mem::replace(&mut self.purpose, Move::Build) {
            Move::Build => self.built(trial),
            Move::Reflect => self.reflected(trial),
            Move::Expand { reflected } => {
                self.replace_worst(if trial.cost < reflected.cost { trial } else { reflected });
            }
            Move::ContractOutside { reflected } => {
                if trial.cost <= reflected.cost {
                    self.replace_worst(trial);
                } else {
                    self.shrink(1);
                }
            }
            Move::ContractInside => {
                if trial.cost < self.worst().cost {
                    self.replace_worst(trial);
                } else {
                    self.shrink(1);
                }
            }
            Move::Shrink { index } => {
                self.vertices[index] = trial;
                self.shrink(index + 1);
            }
        }
    }

    fn built(&mut self, vertex: Vertex) {
        self.vertices.push(vertex);
        let built = self.vertices.len();
        if built <= self.origin.len() {
            self.pending = self.fresh_vertex(built - 1);
            self.purpose = Move::Build;
            return;
        }
        if self.vertices.iter().all(|vertex| vertex.cost == f64::INFINITY) {
            self.stop = Some(StopReason::Infeasible);
        } else if self.origin.is_empty() {
            self.stop = Some(StopReason::Converged);
        } else {
            self.iterate();
        }
    }

    /// Returns the origin moved along one axis by the initial step: upwards in even and downwards
    /// in odd simplexes, the other way if that leaves the box, and to the farther face if both do.
    fn fresh_vertex(&self, axis: usize) -> Vec<f64> {
        let mut at = self.origin.clone();
        let sign = if self.restarts.is_multiple_of(2) { 1.0 } else { -1.0 };
        let step = sign * self.settings.initial_step;
        let inside = |u: &f64| (0.0..=1.0).contains(u);
        let farther = if at[axis] > 0.5 { 0.0 } else { 1.0 };
        at[axis] = [at[axis] + step, at[axis] - step].into_iter().find(inside).unwrap_or(farther);
        at
    }

    fn reflected(&mut self, trial: Vertex) {
        let last = self.vertices.len() - 1;
        if trial.cost < self.vertices[0].cost {
            self.propose(Move::Expand { reflected: trial }, 2.0);
        } else if trial.cost < self.vertices[last - 1].cost {
            self.replace_worst(trial);
        } else if trial.cost < self.vertices[last].cost {
            self.propose(Move::ContractOutside { reflected: trial }, 0.5);
        } else {
            self.propose(Move::ContractInside, -0.5);
        }
    }

    /// Begins the next iteration, unless the simplex has collapsed.
    fn iterate(&mut self) {
        self.vertices.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        if self.collapsed() {
            self.restart();
        } else {
            self.propose(Move::Reflect, 1.0);
        }
    }

    /// Makes `centroid + factor · (centroid - worst)` the pending point.
    fn propose(&mut self, purpose: Move, factor: f64) {
        let last = self.vertices.len() - 1;
        let count = last as f64;
        let contraction = matches!(purpose, Move::ContractOutside { .. } | Move::ContractInside);
        self.pending = (0..self.origin.len())
            .map(|axis| {
                let sum: f64 = self.vertices[..last].iter().map(|vertex| vertex.at[axis]).sum();
                let centroid = sum / count;
                let at = centroid + factor * (centroid - self.vertices[last].at[axis]);
                // A contraction lies in the box except for rounding errors.
                if contraction { at.clamp(0.0, 1.0) } else { at }
            })
            .collect();
        self.purpose = purpose;
    }

    fn replace_worst(&mut self, vertex: Vertex) {
        let last = self.vertices.len() - 1;
        self.vertices[last] = vertex;
        self.iterate();
    }

    /// Makes vertex `index`, moved half way to the best, the pending point; continues the iteration
    /// after the last vertex.
    fn shrink(&mut self, index: usize) {
        let Some(vertex) = self.vertices.get(index) else {
            self.iterate();
            return;
        };
        let best = &self.vertices[0].at;
        self.pending = best.iter().zip(&vertex.at).map(|(b, v)| b + 0.5 * (v - b)).collect();
        self.purpose = Move::Shrink { index };
    }

    fn collapsed(&self) -> bool {
        let extent = self.extent();
        let Settings { costs, size_tolerance, .. } = self.settings;
        let best = self.vertices[0].cost;
        // The worst cost may be infinite, but the best is finite, so this is never NaN.
        let flat = self.worst().cost - best <= costs.flat(best);
        (extent <= size_tolerance && flat) || extent <= (PROGRESS * size_tolerance).max(EXTENT_MIN)
    }

    /// Returns the largest extent of the simplex along any axis.
    fn extent(&self) -> f64 {
        (0..self.origin.len())
            .map(|axis| {
                let along = self.vertices.iter().map(|vertex| vertex.at[axis]);
                along.clone().fold(f64::NEG_INFINITY, f64::max)
                    - along.fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    }

    /// Restarts at the best vertex, if the simplex that collapsed had made progress.
    fn restart(&mut self) {
        let best = self.vertices[0].clone();
        let before = self.cost_at_restart;
        let progress = best.cost < before - self.settings.costs.progress(before);
        if self.cost_at_restart.is_finite() && !progress {
            self.stop = Some(StopReason::Converged);
        } else if self.restarts == RESTARTS_MAX {
            self.stop = Some(StopReason::RestartsUsedUp);
        } else {
            self.restarts += 1;
            self.cost_at_restart = best.cost;
            self.origin.clone_from(&best.at);
            self.vertices.clear();
            self.built(best);
        }
    }

    fn worst(&self) -> &Vertex {
        &self.vertices[self.vertices.len() - 1]
    }
}
