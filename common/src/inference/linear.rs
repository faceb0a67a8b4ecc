//! Singular value decomposition of a Jacobian with two rows, and its consequences.

use super::jacobian::Jacobian;
use crate::conclusions::Direction;

/// A singular value below this fraction of the largest counts as rounding error.
const RANK: f64 = 1e-6;
/// A remainder of a unit vector shorter than this counts as rounding error.
const REMAINDER: f64 = 1e-6;

/// Directions of the box that two moments determine, and those that they leave free.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    /// Right singular vectors with their values, in decreasing order.
    pub(super) fixed: Vec<Direction>,
    /// The left singular vector of each.
    left: Vec<[f64; 2]>,
    /// An orthonormal basis of the null space.
    pub(super) undetermined: Vec<Vec<f64>>,
}

/// Effect of noise on a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseResponse {
    /// Standard deviation.
    pub(super) deviation: f64,
    /// Change of the quantity with each of the two logarithms.
    pub(super) transfer: [f64; 2],
    /// Fraction of its gradient in the null space.
    pub(super) free_share: f64,
}

impl Linear {
    pub(super) fn from_jacobian(jacobian: &Jacobian) -> Self {
        let columns = &jacobian.columns;
        let gram = |i: usize, j: usize| columns.iter().map(|column| column[i] * column[j]).sum();
        let eigen = symmetric(gram(0, 0), gram(0, 1), gram(1, 1));
        let largest = eigen[0].0.max(0.0).sqrt();
        let mut linear = Self { fixed: Vec::new(), left: Vec::new(), undetermined: Vec::new() };
        for (square, left) in eigen.into_iter().take(columns.len()) {
            let singular_value = square.max(0.0).sqrt();
            if !(singular_value > 0.0 && singular_value > RANK * largest) {
                continue;
            }
            let component = |c: &[f64; 2]| (left[0] * c[0] + left[1] * c[1]) / singular_value;
            let components = columns.iter().map(component).collect();
            linear.fixed.push(Direction { singular_value, components });
            linear.left.push(left);
        }
        linear.undetermined = complement(&linear.fixed, columns.len());
        linear
    }

    /// Returns the response of a quantity with this gradient, if the logarithms of the moments have
    /// this covariance; `None` if the data do not determine it at all.
    pub(super) fn response(
        &self,
        gradient: &[f64],
        covariance: &[[f64; 2]; 2],
    ) -> Option<NoiseResponse> {
        let length = dot(gradient, gradient).sqrt();
        let mut transfer = [0.0; 2];
        let mut inside = 0.0;
        for (Direction { singular_value, components }, left) in self.fixed.iter().zip(&self.left) {
            let along = dot(gradient, components);
            inside += along * along;
            for (sum, left) in transfer.iter_mut().zip(left) {
                *sum += along / singular_value * left;
            }
        }
        let free_share = (1.0 - inside / (length * length)).max(0.0).sqrt();
        let variance = transfer[0] * transfer[0] * covariance[0][0]
            + 2.0 * transfer[0] * transfer[1] * covariance[0][1]
            + transfer[1] * transfer[1] * covariance[1][1];
        let known = inside > 0.0 && variance.is_finite();
        known.then(|| NoiseResponse { deviation: variance.max(0.0).sqrt(), transfer, free_share })
    }
}

/// Returns eigenvalues, the larger first, and unit eigenvectors of [[a, b], [b, d]].
fn symmetric(a: f64, b: f64, d: f64) -> [(f64, [f64; 2]); 2] {
    let half = 0.5 * (a - d);
    let radius = (half * half + b * b).sqrt();
    let mean = 0.5 * (a + d);
    // Uses the longer of two forms of the same vector, in which nothing cancels.
    let (x, y) = if half >= 0.0 { (half + radius, b) } else { (b, radius - half) };
    let length = (x * x + y * y).sqrt();
    let [x, y] = if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] };
    [(mean + radius, [x, y]), (mean - radius, [-y, x])]
}

/// Returns an orthonormal basis of the complement of `fixed`: the axes of the box minus their
/// components in it, starting with the axis that has the largest remainder.
fn complement(fixed: &[Direction], dimensions: usize) -> Vec<Vec<f64>> {
    let mut known: Vec<Vec<f64>> = fixed.iter().map(|one| one.components.clone()).collect();
    let mut basis = Vec::new();
    while known.len() < dimensions {
        let remainders = (0..dimensions).map(|axis| remainder(axis, dimensions, &known));
        let longest = remainders.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((length, vector)) = longest.filter(|(length, _)| *length > REMAINDER) else {
            break;
        };
        let unit: Vec<f64> = vector.iter().map(|x| x / length).collect();
        known.push(unit.clone());
        basis.push(unit);
    }
    basis
}

/// Returns the remainder of an axis, with its length, after its components along orthonormal
/// vectors are subtracted.
fn remainder(axis: usize, dimensions: usize, known: &[Vec<f64>]) -> (f64, Vec<f64>) {
    let mut vector: Vec<f64> =
        (0..dimensions).map(|other| if other == axis { 1.0 } else { 0.0 }).collect();
    // Done twice, because one subtraction leaves rounding errors.
    for direction in known.iter().chain(known) {
        let share = dot(&vector, direction);
        vector.iter_mut().zip(direction).for_each(|(x, d)| *x -= share * d);
    }
    (dot(&vector, &vector).sqrt(), vector)
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}
