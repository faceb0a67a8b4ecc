//! What a search believes of the moments: the closed form, corrected by what was evaluated.
//!
//! The believed logarithms of mean velocity and coefficient of variation at x are
//!
//! y(x) = s(x) + e + E (x - x_k),    s = (ln √(c1111/ρ), ln δ),
//!
//! with the offset e such that y is right at the evaluated point x_k, and the slopes E learnt from
//! other evaluations. The Jacobian is that of s plus E: structured Broyden (Dennis and Walker,
//! SIAM J. Numer. Anal. 18, 1981), which for E alone is Broyden's own update (Math. Comp. 19,
//! 1965). What is strongly curved is in s and known; the rest is nearly constant.

use osteon_common::bulk_velocity::bulk_velocity;
use osteon_common::ensemble::Germs;

use crate::search_box::{SearchBox, admissible};

use super::nearest::{Rows, dot, nearest, norm};

/// Logarithms of mean velocity (m/s) and coefficient of variation.
pub(super) type Logarithms = [f64; 2];

/// Most linearisations of the closed form on the way to its solution; four to eight are usual, where
/// the points that match are strongly curved a hundred.
const LINEARISATIONS_MAX: usize = 300;
/// Most to come to rest among the points that match, once there: where these bend nearly as the
/// sphere around the start does, it takes a thousand.
const SLOW_LINEARISATIONS_MAX: usize = 3000;
/// Descents besides the one from the evaluated point. Of 8000 starts in the box of the paper's
/// example that one alone missed the nearest point 27 times, with these it was never missed; of
/// 2400 problems in other boxes, up to six times as wide, 50 times alone and 5 times with these.
const DESCENTS: u64 = 32;
/// The points where they begin are uniform in the box: germs of this seed, the same in each search.
const DESCENTS_SEED: u64 = 1;
/// Most linearisations of each of them. With 300 they found no more.
const DESCENT_LINEARISATIONS_MAX: usize = 60;
/// A descent that comes this near to an end, in edges of the box, goes there too.
const SAME_END: f64 = 1e-3;
/// The end of another descent is taken when it is nearer to the start by this, in edges of the box.
const NEARER_MIN: f64 = 1e-6;
/// Steps that turn back, and are longer than this share of the one before, are too long.
const TURNED_BACK: f64 = 0.3;
/// Smallest share of a step that is taken for that reason.
const SHARE_MIN: f64 = 1.0 / 64.0;
/// A step this small, in units of the box, changes nothing.
const STEP_MIN: f64 = 1e-12;
/// Equations met to this are solved.
const SOLVED: f64 = 1e-8;
/// Most halvings of a step that leaves the admissible points.
const HALVINGS_MAX: usize = 40;
/// A shorter move says nothing about slopes: velocities jump by 1e-9 where the solver's sampling changes.
const TELLING_MOVE_MIN: f64 = 1e-7;

/// What is believed of the moments.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    space: SearchBox,
    /// x_k.
    at: Vec<f64>,
    /// e.
    offset: Logarithms,
    /// E.
    slopes: Rows,
}

/// What is least at the point that is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Goal {
    /// The difference of the logarithms: of all measures the most linear, with the same zero.
    Logarithms,
    /// The cost itself, where there is no zero.
    Cost,
}

/// What a descent is for, and how far it goes.
#[derive(Debug, Clone, Copy)]
struct Descent<'a> {
    goal: Goal,
    start: &'a [f64],
    target: Logarithms,
    linearisations_max: usize,
    /// It stops beside this end of another descent.
    other: Option<&'a [f64]>,
}

impl Model {
    /// The model of which nothing is known but the closed form and this offset.
    pub(super) fn new(space: SearchBox, at: Vec<f64>, offset: Logarithms) -> Self {
        let slopes = [vec![0.0; at.len()], vec![0.0; at.len()]];
        Self { space, at, offset, slopes }
    }

    /// Makes the model right at `at`, where `found` was evaluated.
    pub(super) fn settle_on(&mut self, at: &[f64], found: Logarithms) {
        let Some((closed, _)) = closed_form(&self.space, at) else { return };
        self.offset = difference(found, closed);
        self.at = at.to_vec();
    }

    /// Broyden's update: the slopes change as little as they can for the model to be right at `at`,
    /// where `found` was evaluated, and where it was before.
    pub(super) fn learn(&mut self, at: &[f64], found: Logarithms) {
        let step = subtract(at, &self.at);
        let square = dot(&step, &step);
        let Some((believed, _)) = self.believed(at) else { return };
        if square < TELLING_MOVE_MIN * TELLING_MOVE_MIN {
            return;
        }
        let error = difference(found, believed);
        for (slopes, error) in self.slopes.iter_mut().zip(error) {
            for (slope, step) in slopes.iter_mut().zip(&step) {
                *slope += error * step / square;
            }
        }
    }

    /// Makes the slopes along one axis right, from what was `found` at a point that differs from
    /// the model's own in that coordinate only.
    pub(super) fn learn_along(&mut self, axis: usize, at: &[f64], found: Logarithms) {
        let step = at[axis] - self.at[axis];
        let Some((believed, _)) = self.believed(at) else { return };
        for (slopes, error) in self.slopes.iter_mut().zip(difference(found, believed)) {
            slopes[axis] += error / step;
        }
    }

    /// Forgets the slopes: the Jacobian is the closed form's again. Whether that changed anything.
    pub(super) fn forget_slopes(&mut self) -> bool {
        let changed = self.slopes.iter().flatten().any(|slope| *slope != 0.0);
        self.slopes.iter_mut().flatten().for_each(|slope| *slope = 0.0);
        changed
    }

    /// Of the admissible points that the model takes for `target`, the one nearest to `start` that
    /// is found by [`Self::nearest_from_here`] and [`DESCENTS`] more descents, which begin all over
    /// the box; where the first of them finds none, where that ends.
    ///
    /// The points that match are a curved surface, on which several points may be nearer to the
    /// start than all others around them. A descent ends at one of these.
    pub(super) fn nearest(&self, start: &[f64], target: Logarithms) -> Vec<f64> {
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

    /// An admissible point that the model takes for `target` and that is nearer to `start` than all
    /// others around it, by a descent from the evaluated point; where it finds none, of the points
    /// around with the least cost.
    ///
    /// The descent linearises the model again and again: each linearisation has a nearest point,
    /// and where these come to rest, the way from the start is normal to the model's solutions
    /// (within the active bounds). Where those are curved more strongly than the sphere around the
    /// start, whole steps would go to and fro, and shares are taken.
    pub(super) fn nearest_from_here(&self, start: &[f64], target: Logarithms) -> Vec<f64> {
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

    /// Whether the model takes this point for `target`.
    fn solves(&self, at: &[f64], target: Logarithms) -> bool {
        let missed = self.believed(at).map(|(believed, _)| difference(believed, target));
        missed.is_some_and(|missed| missed.iter().all(|d| d.abs() < SOLVED))
    }

    /// Linearises until that comes to rest. Whether it does.
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

    /// Two equations, linear in the coordinates, that say that `goal` is reached.
    fn linear(&self, goal: Goal, at: &[f64], target: Logarithms) -> Option<(Rows, [f64; 2])> {
        let (believed, mut rows) = self.believed(at)?;
        let mut residual = difference(believed, target);
        if goal == Goal::Cost {
            for (row, residual) in rows.iter_mut().zip(&mut residual) {
                let ratio = libm::exp(*residual);
                row.iter_mut().for_each(|slope| *slope *= ratio);
                *residual = ratio - 1.0;
            }
        }
        let right = [0, 1].map(|i| dot(&rows[i], at) - residual[i]);
        Some((rows, right))
    }

    /// The step, or as much of it as stays admissible.
    fn admissible_step(&self, from: &[f64], step: &[f64], mut share: f64) -> Vec<f64> {
        for _ in 0..HALVINGS_MAX {
            let to: Vec<f64> =
                from.iter().zip(step).map(|(u, d)| (u + share * d).clamp(0.0, 1.0)).collect();
            if admissible(&self.space.point(&to)) {
                return to;
            }
            share *= 0.5;
        }
        from.to_vec()
    }

    /// Value and Jacobian at a point; `None` where the closed form has none.
    pub(super) fn believed(&self, at: &[f64]) -> Option<(Logarithms, Rows)> {
        let (closed, mut rows) = closed_form(&self.space, at)?;
        let step = subtract(at, &self.at);
        for (row, slopes) in rows.iter_mut().zip(&self.slopes) {
            row.iter_mut().zip(slopes).for_each(|(slope, learnt)| *slope += learnt);
        }
        Some(([0, 1].map(|i| closed[i] + (self.offset[i] + dot(&self.slopes[i], &step))), rows))
    }
}

/// ln √(c1111/ρ) and ln δ with their derivatives with respect to the coordinates.
fn closed_form(space: &SearchBox, at: &[f64]) -> Option<(Logarithms, Rows)> {
    let point = space.point(at);
    let velocity = bulk_velocity(&point).ok()?;
    let dispersion = point.dispersion();
    let mut of_dispersion = [0.0; 7];
    of_dispersion[6] = 1.0 / dispersion;
    let rows = [space.per_edge(&velocity.gradient), space.per_edge(&of_dispersion)];
    (dispersion > 0.0).then(|| ([velocity.logarithm, libm::log(dispersion)], rows))
}

fn difference(a: Logarithms, b: Logarithms) -> Logarithms {
    [a[0] - b[0], a[1] - b[1]]
}

/// a - b.
pub(super) fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn largest(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |largest, d| largest.max(d.abs()))
}
