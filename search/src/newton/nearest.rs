//! The point of the unit box nearest to a start among the solutions of two linear equations, or, if
//! there are none in the box, among the points with the smallest residuals.

/// Weight of a violated equation: the minimised function is |x - start|² + |J x - b|² / `SOFTNESS`.
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

/// Two rows of coefficients, one for each equation.
pub type Rows = [Vec<f64>; 2];

/// Minimises |x - start|² + |rows · x - right|² / `SOFTNESS` over the unit box.
///
/// The dual of that problem has two unknowns, the multipliers λ: x is the start moved by rowsᵀ λ
/// and clipped to the box, and λ solves rows · x(λ) - right + `SOFTNESS` λ = 0. The left side is
/// the gradient of a convex function that is piecewise quadratic, with one piece for each set of
/// active bounds. Newton's method with an exact search along each step ends on the solution; this
/// is an active-set method in which many bounds may change at once (Hintermüller, Ito and Kunisch,
/// SIAM J. Optim. 13, 2002).
pub fn nearest(start: &[f64], rows: &Rows, right: [f64; 2]) -> Vec<f64> {
    let dual = Dual { start, rows, right };
    let mut multipliers = [0.0; 2];
    for _ in 0..STEPS_MAX {
        let gradient = dual.gradient(multipliers);
        if gradient.iter().all(|g| g.abs() <= MET) {
            break;
        }
        let step = dual.newton_step(multipliers, gradient);
        let share = dual.share(multipliers, step);
        let next = moved(multipliers, step, share);
        let change = size([next[0] - multipliers[0], next[1] - multipliers[1]]);
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
    right: [f64; 2],
}

impl Dual<'_> {
    fn uncut(&self, axis: usize, multipliers: [f64; 2]) -> f64 {
        self.start[axis]
            + (self.rows[0][axis] * multipliers[0] + self.rows[1][axis] * multipliers[1])
    }

    fn coordinate(&self, axis: usize, multipliers: [f64; 2]) -> f64 {
        self.uncut(axis, multipliers).clamp(0.0, 1.0)
    }

    fn gradient(&self, multipliers: [f64; 2]) -> [f64; 2] {
        let mut gradient = [0, 1].map(|i| SOFTNESS * multipliers[i] - self.right[i]);
        for axis in 0..self.start.len() {
            let at = self.coordinate(axis, multipliers);
            gradient[0] += self.rows[0][axis] * at;
            gradient[1] += self.rows[1][axis] * at;
        }
        gradient
    }

    /// Returns the step to the minimum of the current quadratic piece.
    fn newton_step(&self, multipliers: [f64; 2], gradient: [f64; 2]) -> [f64; 2] {
        // The matrix [a b; b d] of second derivatives.
        let [mut a, mut b, mut d] = [SOFTNESS, 0.0, SOFTNESS];
        for axis in 0..self.start.len() {
            if (0.0..=1.0).contains(&self.uncut(axis, multipliers)) {
                let (first, second) = (self.rows[0][axis], self.rows[1][axis]);
                a += first * first;
                b += first * second;
                d += second * second;
            }
        }
        // Cholesky: the pivots stay above zero where the difference in the determinant cancels.
        let pivot = (d - b * (b / a)).max(SOFTNESS);
        let second = -(gradient[1] - gradient[0] * (b / a)) / pivot;
        [-(gradient[0] + b * second) / a, second]
    }

    /// Returns the fraction of `step`, at most 1, at which the convex function is lowest along it.
    fn share(&self, multipliers: [f64; 2], step: [f64; 2]) -> f64 {
        let slope = |share: f64| {
            let gradient = self.gradient(moved(multipliers, step, share));
            gradient[0] * step[0] + gradient[1] * step[1]
        };
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

fn size(vector: [f64; 2]) -> f64 {
    vector[0].abs().max(vector[1].abs())
}

fn moved(from: [f64; 2], step: [f64; 2], share: f64) -> [f64; 2] {
    [from[0] + share * step[0], from[1] + share * step[1]]
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
