//! The point of the unit box nearest to a start among the solutions of a few linear equations, or, if
//! there are none in the box, among the points with the smallest residuals.

use std::array;

use osteon_common::moments::{MOMENTS, MomentMatrix, MomentVector};

/// Inverse of the weight of the equations: the minimised function is |x - start|² + |J x - b|² / `SOFTNESS`.
/// The equations are thus met to about 1e-10 where they can be met in the box; where they cannot,
/// their least squares outweigh the distance. With a much smaller value rounding errors spoil the
/// latter case.
const SOFTNESS: f64 = 1e-10;
/// Maximum number of steps on the multipliers; three to ten are usual, and each leaves a bound or
/// reaches one.
const STEPS_MAX: usize = 100;
/// Maximum number of halvings of an interval of step lengths.
const HALVINGS_MAX: usize = 60;
/// Equations with residuals of at most this need no further step.
const MET: f64 = 1e-14;
/// The iteration also ends if the multipliers change by less than this fraction, which is rounding
/// error where they are large.
const CHANGE_MIN: f64 = 1e-13;

/// A row of coefficients for each equation; those of an equation that does not count are 0.
pub type Rows = [Vec<f64>; MOMENTS];

/// Minimises |x - start|² + |rows · x - right|² / `SOFTNESS` over the unit box.
///
/// The dual of that problem has an unknown for each equation, the multipliers λ: x is the start moved by rowsᵀ λ
/// and clipped to the box, and λ solves rows · x(λ) - right + `SOFTNESS` λ = 0. The left side is
/// the gradient of a convex function that is piecewise quadratic, with one piece for each set of
/// active bounds. Newton's method with an exact search along each step ends on the solution; this
/// is an active-set method in which many bounds may change at once (Hintermüller, Ito and Kunisch,
/// SIAM J. Optim. 13, 2002).
pub fn nearest(start: &[f64], rows: &Rows, right: MomentVector) -> Vec<f64> {
    let dual = Dual { start, rows, right };
    let mut multipliers = [0.0; MOMENTS];
    for _ in 0..STEPS_MAX {
        let gradient = dual.gradient(multipliers);
        if gradient.iter().all(|g| g.abs() <= MET) {
            break;
        }
        let step = dual.newton_step(multipliers, gradient);
        let share = dual.share(multipliers, step);
        let next = moved(multipliers, step, share);
        let change = size(array::from_fn(|i| next[i] - multipliers[i]));
        multipliers = next;
        if change <= CHANGE_MIN * size(multipliers) {
            break;
        }
    }
    (0..start.len()).map(|axis| dual.coordinate(axis, multipliers)).collect()
}

struct Dual<'a> {
    start: &'a [f64],
    rows: &'a Rows,
    right: MomentVector,
}

impl Dual<'_> {
    fn uncut(&self, axis: usize, multipliers: MomentVector) -> f64 {
        let moved = self.rows.iter().zip(multipliers);
        self.start[axis] + moved.fold(0.0, |sum, (row, multiplier)| sum + row[axis] * multiplier)
    }

    fn coordinate(&self, axis: usize, multipliers: MomentVector) -> f64 {
        self.uncut(axis, multipliers).clamp(0.0, 1.0)
    }

    fn gradient(&self, multipliers: MomentVector) -> MomentVector {
        let mut gradient = array::from_fn(|i| SOFTNESS * multipliers[i] - self.right[i]);
        for axis in 0..self.start.len() {
            let at = self.coordinate(axis, multipliers);
            gradient.iter_mut().zip(self.rows).for_each(|(sum, row)| *sum += row[axis] * at);
        }
        gradient
    }

    /// Returns the step to the minimum of the current quadratic piece.
    fn newton_step(&self, multipliers: MomentVector, gradient: MomentVector) -> MomentVector {
        // The second derivatives, of which the upper triangle is used.
        let mut matrix: MomentMatrix =
            array::from_fn(|i| array::from_fn(|j| if i == j { SOFTNESS } else { 0.0 }));
        for axis in 0..self.start.len() {
            if (0.0..=1.0).contains(&self.uncut(axis, multipliers)) {
                for (i, row) in matrix.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate().skip(i) {
                        *entry += self.rows[i][axis] * self.rows[j][axis];
                    }
                }
            }
        }
        solve(matrix, gradient).map(|step| -step)
    }

    /// Returns the fraction of `step`, at most 1, at which the convex function is lowest along it.
    fn share(&self, multipliers: MomentVector, step: MomentVector) -> f64 {
        let slope = |share: f64| dot(&self.gradient(moved(multipliers, step, share)), &step);
        if slope(1.0) <= 0.0 {
            return 1.0;
        }
        let (mut lower, mut upper) = (0.0, 1.0);
        for _ in 0..HALVINGS_MAX {
            let middle = 0.5 * (lower + upper);
            if slope(middle) <= 0.0 {
                lower = middle;
            } else {
                upper = middle;
            }
        }
        // Take the end where the function still falls, unless that is no step at all.
        if lower > 0.0 { lower } else { upper }
    }
}

/// Solves a symmetric system of which the upper triangle is given, by elimination. Pivots that
/// cancellation makes too small are raised to [`SOFTNESS`].
fn solve(mut matrix: MomentMatrix, mut right: MomentVector) -> MomentVector {
    for i in 0..MOMENTS {
        matrix[i][i] = matrix[i][i].max(SOFTNESS);
        for j in i + 1..MOMENTS {
            let factor = matrix[i][j] / matrix[i][i];
            let upper = matrix[i];
            matrix[j]
                .iter_mut()
                .zip(upper)
                .skip(j)
                .for_each(|(entry, above)| *entry -= above * factor);
            right[j] -= right[i] * factor;
        }
    }
    for i in (0..MOMENTS).rev() {
        let known: f64 = (i + 1..MOMENTS).fold(0.0, |sum, k| sum + matrix[i][k] * right[k]);
        right[i] = (right[i] - known) / matrix[i][i];
    }
    right
}

fn size(vector: MomentVector) -> f64 {
    vector.iter().fold(0.0, |largest, one| largest.max(one.abs()))
}

fn moved(from: MomentVector, step: MomentVector, share: f64) -> MomentVector {
    array::from_fn(|i| from[i] + share * step[i])
}

/// Returns Σ a_i b_i, summed in the order of the axes.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Returns the Euclidean norm.
pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

#[cfg(test)]
mod tests;
