//! The model of the moments: the closed form, corrected by the evaluations.
//!
//! The model's logarithms of mean velocity and coefficient of variation at x, and the means of other
//! observables, are
//!
//! ```text
//! y(x) = s(x) + e + E (x - x_k),    s = (ln √(c1111/ρ), ln δ, 0 for other observables),
//! ```
//!
//! where the offset e makes y exact at the evaluated point x_k, and the slopes E are learnt from
//! the other evaluations. The Jacobian is that of s plus E: structured Broyden (Dennis and Walker,
//! SIAM J. Numer. Anal. 18, 1981), which for E alone is Broyden's own update (Math. Comp. 19,
//! 1965). The strongly curved part is s, which is known; the rest is nearly constant.

use std::array;

use osteon_common::ensemble::Germs;
use osteon_common::inference::MomentWeights;
use osteon_common::moments::{MOMENTS, MomentVector};
use osteon_common::parameters::{PARAMETERS, Parameter};

use crate::search_box::SearchBox;

use super::nearest::{Rows, dot, nearest, norm};

/// Maximum number of linearisations of the closed form on the way to its solution. Four to eight
/// are usual; where the matching points are strongly curved, a hundred.
const LINEARISATIONS_MAX: usize = 300;
/// Maximum number of linearisations to converge among the matching points once they are reached.
/// Where these bend nearly as much as the sphere around the start, convergence takes a thousand.
const SLOW_LINEARISATIONS_MAX: usize = 3000;
/// Number of descents besides the one from the evaluated point. Of 8000 starts in the box of the
/// paper's example, the latter alone missed the nearest point 27 times, and with these it was never
/// missed; of 2400 problems in other boxes, up to six times as wide, 50 times alone and 5 times
/// with these.
const DESCENTS: u64 = 32;
/// Seed of the descents' starting points, which are uniform in the box and the same in every
/// search.
const DESCENTS_SEED: u64 = 1;
/// Maximum number of linearisations of each of them. With 300 they found nothing more.
const DESCENT_LINEARISATIONS_MAX: usize = 60;
/// A descent that comes this near to the end of an earlier one, in edges of the box, would end
/// there too.
const SAME_END: f64 = 1e-3;
/// The end of another descent is preferred if it is nearer to the start by at least this, in edges
/// of the box.
const NEARER_MIN: f64 = 1e-6;
/// A step that reverses direction and is longer than this fraction of the one before is too long.
const TURNED_BACK: f64 = 0.3;
/// Smallest fraction to which such a step is shortened.
const SHARE_MIN: f64 = 1.0 / 64.0;
/// Steps this small, in units of the box, count as zero.
const STEP_MIN: f64 = 1e-12;
/// Equations count as solved if their residuals are at most this.
const SOLVED: f64 = 1e-8;
/// Maximum number of halvings of a step that leaves the admissible points.
const HALVINGS_MAX: usize = 40;
/// Shorter moves give no information about slopes: velocities jump by 1e-9 where the solver's
/// sampling changes.
const TELLING_MOVE_MIN: f64 = 1e-7;

/// The model of the moments.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    space: SearchBox,
    /// x_k.
    at: Vec<f64>,
    /// e.
    offset: MomentVector,
    /// E.
    slopes: Rows,
    /// Weights of the cost where it has no zero; of relative squares without.
    weights: Option<MomentWeights>,
}

/// The quantity that a descent minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Goal {
    /// The difference of the logarithms: the most linear of all measures with this zero.
    Logarithms,
    /// The cost itself, used where it has no zero.
    Cost,
}

/// Goal and limits of a descent.
#[derive(Debug, Clone, Copy)]
struct Descent<'a> {
    goal: Goal,
    start: &'a [f64],
    target: MomentVector,
    linearisations_max: usize,
    /// The descent stops near this end of an earlier descent.
    other: Option<&'a [f64]>,
}

impl Model {
    /// Creates the model that consists of the closed form and this offset only.
    pub(super) fn new(space: SearchBox, at: Vec<f64>, offset: MomentVector) -> Self {
        let slopes = array::from_fn(|_| vec![0.0; at.len()]);
        Self { space, at, offset, slopes, weights: None }
    }

    /// Makes the sum of squares with these weights the cost where it has no zero.
    pub(super) fn weigh(&mut self, weights: MomentWeights) {
        self.weights = Some(weights);
    }

    /// Makes the model exact at `at`, where `found` was evaluated.
    pub(super) fn make_exact_at(&mut self, at: &[f64], found: MomentVector) {
        let Some((closed, _)) = closed_form(&self.space, at) else { return };
        self.offset = difference(found, closed);
        self.at = at.to_vec();
    }

    /// Broyden's update: the smallest change of the slopes with which the model is exact both at
    /// `at`, where `found` was evaluated, and at its present point.
    pub(super) fn update_slopes(&mut self, at: &[f64], found: MomentVector) {
        let step = subtract(at, &self.at);
        let square = dot(&step, &step);
        let Some((predicted, _)) = self.predict(at) else { return };
        if square < TELLING_MOVE_MIN * TELLING_MOVE_MIN {
            return;
        }
        let error = difference(found, predicted);
        for (slopes, error) in self.slopes.iter_mut().zip(error) {
            for (slope, step) in slopes.iter_mut().zip(&step) {
                *slope += error * step / square;
            }
        }
    }

    /// Corrects the slopes along one axis, from `found` at a point that differs from the model's
    /// own in that coordinate only.
    pub(super) fn correct_slope(&mut self, axis: usize, at: &[f64], found: MomentVector) {
        let step = at[axis] - self.at[axis];
        let Some((predicted, _)) = self.predict(at) else { return };
        for (slopes, error) in self.slopes.iter_mut().zip(difference(found, predicted)) {
            slopes[axis] += error / step;
        }
    }

    /// Resets the slopes, so that the Jacobian is the closed form's again. Returns whether this
    /// changed anything.
    pub(super) fn reset_slopes(&mut self) -> bool {
        let changed = self.slopes.iter().flatten().any(|slope| *slope != 0.0);
        self.slopes.iter_mut().flatten().for_each(|slope| *slope = 0.0);
        changed
    }

    /// Returns the point nearest to `start` among the admissible solutions of the model for
    /// `target` that are found by [`Self::nearest_from_here`] and [`DESCENTS`] more descents, which
    /// begin all over the box. If the first descent finds no solution, returns the point where it
    /// ended.
    ///
    /// The solutions form a curved surface, which may have several points that are locally nearest
    /// to the start. A descent ends at one of these.
    pub(super) fn nearest(&self, start: &[f64], target: MomentVector) -> Vec<f64> {
        let mut nearest = self.nearest_from_here(start, target);
        if !self.solves(&nearest, target) {
            return nearest;
        }
        let mut distance = norm(&subtract(&nearest, start));
        for index in 0..DESCENTS {
            let way = subtract(Germs::draw(DESCENTS_SEED, index).values(), start);
            let mut at = self.admissible_step(start, &way, 1.0);
            let descent = Descent {
                goal: Goal::Logarithms,
                start,
                target,
                linearisations_max: DESCENT_LINEARISATIONS_MAX,
                other: Some(&nearest),
            };
            self.approach(&mut at, &descent);
            let found = norm(&subtract(&at, start));
            if found < distance - NEARER_MIN && self.solves(&at, target) {
                let linearisations_max = SLOW_LINEARISATIONS_MAX;
                self.approach(&mut at, &Descent { linearisations_max, other: None, ..descent });
                (nearest, distance) = (at, found);
            }
        }
        nearest
    }

    /// Returns an admissible solution of the model for `target` that is locally nearest to `start`,
    /// by a descent from the evaluated point; if it finds none, returns a local minimum of the
    /// cost.
    ///
    /// The descent repeats a linearisation of the model: each linearisation has a nearest point,
    /// and where these converge, the line from the start is normal to the model's solutions (within
    /// the active bounds). Where the solutions are curved more strongly than the sphere around the
    /// start, full steps would oscillate, so the steps are shortened.
    pub(super) fn nearest_from_here(&self, start: &[f64], target: MomentVector) -> Vec<f64> {
        let mut at = self.at.clone();
        for goal in [Goal::Logarithms, Goal::Cost] {
            let linearisations_max = LINEARISATIONS_MAX;
            let descent = Descent { goal, start, target, linearisations_max, other: None };
            let rests = self.approach(&mut at, &descent);
            if self.solves(&at, target) {
                if !rests {
                    let linearisations_max = SLOW_LINEARISATIONS_MAX;
                    self.approach(&mut at, &Descent { linearisations_max, ..descent });
                }
                break;
            }
        }
        at
    }

    /// Returns whether this point solves the model for `target`.
    fn solves(&self, at: &[f64], target: MomentVector) -> bool {
        let missed = self.predict(at).map(|(predicted, _)| difference(predicted, target));
        missed.is_some_and(|missed| missed.iter().all(|d| d.abs() < SOLVED))
    }

    /// Linearises repeatedly until the point converges. Returns whether it does.
    fn approach(&self, at: &mut Vec<f64>, descent: &Descent<'_>) -> bool {
        let Descent { goal, start, target, linearisations_max, other } = *descent;
        let mut share = 1.0;
        let mut before: Vec<f64> = Vec::new();
        for _ in 0..linearisations_max {
            if other.is_some_and(|other| norm(&subtract(at, other)) < SAME_END) {
                return false;
            }
            let Some((rows, right)) = self.linear(goal, at, target) else { return false };
            let wanted = subtract(&nearest(start, &rows, right), at);
            if dot(&wanted, &before) < -TURNED_BACK * dot(&before, &before) && share > SHARE_MIN {
                share *= 0.5;
            }
            *at = self.admissible_step(at, &wanted, share);
            if largest(&wanted) <= STEP_MIN {
                return true;
            }
            before = wanted;
        }
        false
    }

    /// Returns equations, linear in the coordinates, that express that `goal` is reached.
    fn linear(&self, goal: Goal, at: &[f64], target: MomentVector) -> Option<(Rows, MomentVector)> {
        let (predicted, mut rows) = self.predict(at)?;
        let mut residual = difference(predicted, target);
        if let (Goal::Cost, Some(weights)) = (goal, &self.weights) {
            residual = weights.whiten(residual);
            let whitened = |axis: usize| weights.whiten(array::from_fn(|i| rows[i][axis]));
            let columns: Vec<MomentVector> = (0..at.len()).map(whitened).collect();
            rows = array::from_fn(|i| columns.iter().map(|column| column[i]).collect());
        } else if goal == Goal::Cost {
            // Those of the velocities; the others are relative differences already.
            for (row, residual) in rows.iter_mut().zip(&mut residual).take(2) {
                let ratio = libm::exp(*residual);
                row.iter_mut().for_each(|slope| *slope *= ratio);
                *residual = ratio - 1.0;
            }
        }
        let right = array::from_fn(|i| dot(&rows[i], at) - residual[i]);
        Some((rows, right))
    }

    /// Makes the step, or the largest part of it (by halving) that stays admissible.
    fn admissible_step(&self, from: &[f64], step: &[f64], mut share: f64) -> Vec<f64> {
        for _ in 0..HALVINGS_MAX {
            let to: Vec<f64> =
                from.iter().zip(step).map(|(u, d)| (u + share * d).clamp(0.0, 1.0)).collect();
            if self.space.admits(&self.space.point(&to)) {
                return to;
            }
            share *= 0.5;
        }
        from.to_vec()
    }

    /// Returns the model's value and Jacobian at a point; `None` where the closed form is
    /// undefined.
    pub(super) fn predict(&self, at: &[f64]) -> Option<(MomentVector, Rows)> {
        let (closed, mut rows) = closed_form(&self.space, at)?;
        let step = subtract(at, &self.at);
        for (row, slopes) in rows.iter_mut().zip(&self.slopes) {
            row.iter_mut().zip(slopes).for_each(|(slope, learnt)| *slope += learnt);
        }
        let value = |i: usize| closed[i] + (self.offset[i] + dot(&self.slopes[i], &step));
        Some((array::from_fn(value), rows))
    }
}

/// Returns ln √(c1111/ρ), ln δ and 0 for each observable, with their derivatives with respect to the
/// coordinates.
fn closed_form(space: &SearchBox, at: &[f64]) -> Option<(MomentVector, Rows)> {
    let point = space.point(at);
    let velocity = space.structure().bulk_velocity(&point).ok()?;
    let dispersion = point.dispersion();
    let mut of_dispersion = [0.0; PARAMETERS];
    of_dispersion[Parameter::Dispersion as usize] = 1.0 / dispersion;
    let mut rows: Rows = array::from_fn(|_| vec![0.0; at.len()]);
    rows[0] = space.per_edge(&velocity.gradient);
    rows[1] = space.per_edge(&of_dispersion);
    let mut closed = [0.0; MOMENTS];
    (closed[0], closed[1]) = (velocity.logarithm, libm::log(dispersion));
    (dispersion > 0.0).then_some((closed, rows))
}

fn difference(a: MomentVector, b: MomentVector) -> MomentVector {
    array::from_fn(|i| a[i] - b[i])
}

/// Returns a - b.
pub(super) fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn largest(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |largest, d| largest.max(d.abs()))
}
