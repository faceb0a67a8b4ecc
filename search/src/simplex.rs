//! The Nelder-Mead simplex as an ask/tell state machine in the unit box.
//!
//! It knows no realization, no job and no clock: [`Simplex::ask`] names the next point,
//! [`Simplex::tell`] takes its cost. The path is a function of the settings and of the costs
//! told, so that telling the same costs again rebuilds the same state.
//!
//! The algorithm is that of Lagarias, Reeds, Wright and Wright (SIAM J. Optim. 9, 1998) with the
//! standard coefficients (reflection 1, expansion 2, contraction ½, shrinkage ½). A point outside
//! the box, or refused by the caller, has an infinite cost without being evaluated.
//!
//! # When it stops
//!
//! - The best cost is at most the tolerance, where there is one: [`Stop::CostReached`].
//! - The simplex has collapsed: its largest extent is at most `size_tolerance` and its costs
//!   differ by at most the tolerance plus a thousandth of the best cost (logarithms: by at most what
//!   counts as equal), or, whatever the costs, the extent is at most a thousandth of
//!   `size_tolerance`. A collapse is no proof of a minimum: a simplex can flatten against a bound. So
//!   the search begins again at the best point with a fresh simplex, and only a restart that lowers
//!   the best cost by less than a thousandth (logarithms: as above) ends it: [`Stop::Settled`].
//!   Restarts are bounded: [`Stop::RestartsUsedUp`].
//! - `max_evaluations` points were evaluated: [`Stop::EvaluationsUsedUp`].
//! - No vertex of the first simplex is feasible: [`Stop::Infeasible`].

use crate::ask::{Ask, Stop};

mod likely;
#[cfg(test)]
mod tests;

/// Restarts after a collapse, at most.
pub const RESTARTS_MAX: u32 = 10;
/// A restart must lower a cost of squares by this fraction to count as progress; such costs of a
/// simplex that differ by less than this fraction of the best are equal.
const PROGRESS: f64 = 1e-3;
/// The smallest extent that rounding lets a simplex in the unit box have.
const EXTENT_MIN: f64 = 1e-14;

/// What costs are, and how they compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Costs {
    /// Sums of squares, at least 0, that compare by their ratio.
    Squares {
        /// Stop when the best cost is at most this.
        tolerance: f64,
    },
    /// Of any sign, without a value to be reached, that compare by their difference.
    Logarithms {
        /// Costs that differ by at most this are equal.
        equal: f64,
    },
}

impl Costs {
    /// Whether a cost is as low as can be asked for.
    fn reached(self, cost: f64) -> bool {
        matches!(self, Self::Squares { tolerance } if cost <= tolerance)
    }

    /// The difference from `cost`, finite, that is progress.
    fn progress(self, cost: f64) -> f64 {
        match self {
            Self::Squares { .. } => PROGRESS * cost.abs(),
            Self::Logarithms { equal } => equal,
        }
    }

    /// The largest difference of costs of a flat simplex around `cost`.
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
    /// Most points to evaluate.
    pub max_evaluations: u64,
    /// What costs are.
    pub costs: Costs,
    /// The simplex has collapsed when its largest extent is at most this.
    pub size_tolerance: f64,
    /// Edge of a fresh simplex.
    pub initial_step: f64,
}

/// A point with its cost.
#[derive(Debug, Clone, PartialEq)]
struct Vertex {
    at: Vec<f64>,
    cost: f64,
}

/// What the pending point is for.
#[derive(Debug, Clone, PartialEq)]
enum Move {
    /// A vertex of a fresh simplex.
    Build,
    Reflect,
    /// Beyond the reflected point.
    Expand {
        reflected: Vertex,
    },
    /// Between the centroid and the reflected point.
    ContractOutside {
        reflected: Vertex,
    },
    /// Between the centroid and the worst vertex.
    ContractInside,
    /// Vertex `index` drawn half way to the best.
    Shrink {
        index: usize,
    },
}

/// A search in the unit box.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplex {
    settings: Settings,
    /// In order of cost once complete; ties in the order of their making.
    vertices: Vec<Vertex>,
    pending: Vec<f64>,
    purpose: Move,
    stop: Option<Stop>,
    evaluations: u64,
    restarts: u32,
    /// Best cost when the present simplex was begun.
    cost_at_restart: f64,
    /// Where the present simplex was begun.
    origin: Vec<f64>,
}

impl Simplex {
    /// A search that begins at `start`, one coordinate in `[0, 1]` for each free parameter.
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

    /// The next point, or why there is none. Asking changes nothing.
    pub fn ask(&self) -> Ask<'_> {
        match self.stop {
            Some(stop) => Ask::Stopped(stop),
            None => Ask::At(&self.pending),
        }
    }

    /// Takes the cost of the point asked for; NaN counts as infinite. Ignored once stopped.
    pub fn tell(&mut self, cost: f64) {
        if self.stop.is_none() {
            self.evaluations += 1;
            self.take(if cost.is_nan() { f64::INFINITY } else { cost });
            self.skip_what_needs_no_evaluation();
        }
    }

    /// The point asked for is inadmissible: its cost is infinite, and it was not evaluated.
    /// Refusing every point ends the search: each round of refusals halves the simplex.
    pub fn refuse(&mut self) {
        if self.stop.is_none() {
            self.take(f64::INFINITY);
            self.skip_what_needs_no_evaluation();
        }
    }

    /// Points evaluated so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Fresh simplexes begun after a collapse.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Takes infinite costs for pending points outside the box. Ends after two: every other
    /// point lies in the convex hull of the vertices.
    fn skip_what_needs_no_evaluation(&mut self) {
        while self.stop.is_none() && self.pending.iter().any(|u| !(0.0..=1.0).contains(u)) {
            self.take(f64::INFINITY);
        }
        if self.stop.is_none() && self.evaluations >= self.settings.max_evaluations {
            self.stop = Some(Stop::EvaluationsUsedUp);
        }
    }

    /// The pending point has this cost.
    fn take(&mut self, cost: f64) {
        if self.settings.costs.reached(cost) {
            self.stop = Some(Stop::CostReached);
        } else {
            self.step(cost);
        }
    }

    /// The step that a cost above the tolerance leads to.
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
            self.stop = Some(Stop::Infeasible);
        } else if self.origin.is_empty() {
            self.stop = Some(Stop::Settled);
        } else {
            self.iterate();
        }
    }

    /// The origin moved along one axis: by the initial step, upwards in even and downwards in
    /// odd simplexes, the other way if that leaves the box, and to the farther face if both do.
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
                // In the box but for rounding.
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

    /// Asks for vertex `index` half way to the best, or goes on when all are there.
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
        // The worst cost may be infinite, the best is not: no NaN.
        let flat = self.worst().cost - best <= costs.flat(best);
        (extent <= size_tolerance && flat) || extent <= (PROGRESS * size_tolerance).max(EXTENT_MIN)
    }

    /// Largest extent of the simplex along any axis.
    fn extent(&self) -> f64 {
        (0..self.origin.len())
            .map(|axis| {
                let along = self.vertices.iter().map(|vertex| vertex.at[axis]);
                along.clone().fold(f64::NEG_INFINITY, f64::max)
                    - along.fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    }

    /// Begins again at the best vertex, if the simplex that collapsed had made progress.
    fn restart(&mut self) {
        let best = self.vertices[0].clone();
        let before = self.cost_at_restart;
        let progress = best.cost < before - self.settings.costs.progress(before);
        if self.cost_at_restart.is_finite() && !progress {
            self.stop = Some(Stop::Settled);
        } else if self.restarts == RESTARTS_MAX {
            self.stop = Some(Stop::RestartsUsedUp);
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
