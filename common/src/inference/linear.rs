//! Singular value decomposition of a Jacobian with two rows, or three with decays, and its consequences.

use super::decay::DecayWeights;
use super::jacobian::Jacobian;
use crate::conclusions::Direction;

/// A singular value below this fraction of the largest counts as rounding error.
const RANK: f64 = 1e-6;
/// A remainder of a unit vector shorter than this counts as rounding error.
const REMAINDER: f64 = 1e-6;
/// Rounds of rotations that diagonalize a matrix of three rows; each at least squares what is left.
const SWEEPS: usize = 10;

/// Directions of the box that the moments determine, and those that they leave free.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    /// Right singular vectors with their values, in decreasing order.
    pub(super) fixed: Vec<Direction>,
    /// The left singular vector of each.
    left: Vec<[f64; 3]>,
    /// An orthonormal basis of the null space.
    pub(super) undetermined: Vec<Vec<f64>>,
    /// With decays: the same of the Jacobian in standard errors, by which the least χ² moves.
    weighted: Option<(Box<Self>, DecayWeights)>,
}

/// Effect of noise on a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseResponse {
    /// Standard deviation.
    pub(super) deviation: f64,
    /// Change of the quantity with each of the moments.
    pub(super) transfer: [f64; 3],
    /// Fraction of its gradient in the null space.
    pub(super) free_share: f64,
}

impl Linear {
    /// Returns those of two moments, or of three, given their weights.
    pub(super) fn from_jacobian(jacobian: &Jacobian, weights: Option<&DecayWeights>) -> Self {
        let columns = &jacobian.columns;
        let gram = |i: usize, j: usize| columns.iter().map(|column| column[i] * column[j]).sum();
        let Some(weights) = weights else {
            let eigen = symmetric(gram(0, 0), gram(0, 1), gram(1, 1));
            let eigen = eigen.map(|(square, [x, y])| (square, [x, y, 0.0]));
            return Self::from_eigen(columns, &eigen);
        };
        let whitened: Vec<_> = columns.iter().map(|column| weights.whiten(*column)).collect();
        let weighted = Self::from_eigen(&whitened, &eigen_of_rows(&whitened));
        Self {
            weighted: Some((Box::new(weighted), *weights)),
            ..Self::from_eigen(columns, &eigen_of_rows(columns))
        }
    }

    /// Returns them, given the eigenvalues of J Jᵀ in decreasing order with their vectors.
    fn from_eigen(columns: &[[f64; 3]], eigen: &[(f64, [f64; 3])]) -> Self {
        let largest = eigen.first().map_or(0.0, |(square, _)| square.max(0.0).sqrt());
        let (mut fixed, mut lefts) = (Vec::new(), Vec::new());
        for &(square, left) in eigen.iter().take(columns.len()) {
            let singular_value = square.max(0.0).sqrt();
            if !(singular_value > 0.0 && singular_value > RANK * largest) {
                continue;
            }
            let component = |c: &[f64; 3]| dot(&left, c) / singular_value;
            let components = columns.iter().map(component).collect();
            fixed.push(Direction { singular_value, components });
            lefts.push(left);
        }
        let undetermined = complement(&fixed, columns.len());
        Self { fixed, left: lefts, undetermined, weighted: None }
    }

    /// Returns the response of a quantity with this gradient, if the moments have this covariance;
    /// `None` if the data do not determine it at all.
    pub(super) fn response(
        &self,
        gradient: &[f64],
        covariance: &[[f64; 3]; 3],
    ) -> Option<NoiseResponse> {
        let length = dot(gradient, gradient).sqrt();
        let (own, inside) = self.transfer(gradient);
        let transfer = match &self.weighted {
            Some((weighted, weights)) => weights.transposed(weighted.transfer(gradient).0),
            None => own,
        };
        let free_share = (1.0 - inside / (length * length)).max(0.0).sqrt();
        let variance = transfer[0] * transfer[0] * covariance[0][0]
            + 2.0 * transfer[0] * transfer[1] * covariance[0][1]
            + transfer[1] * transfer[1] * covariance[1][1]
            + 2.0 * transfer[2] * (transfer[0] * covariance[0][2] + transfer[1] * covariance[1][2])
            + transfer[2] * transfer[2] * covariance[2][2];
        let known = inside > 0.0 && variance.is_finite();
        known.then(|| NoiseResponse { deviation: variance.max(0.0).sqrt(), transfer, free_share })
    }

    /// Returns the change of a quantity with this gradient by each of the moments, and the square of the
    /// part of the gradient that lies in the directions that are fixed.
    fn transfer(&self, gradient: &[f64]) -> ([f64; 3], f64) {
        let (mut transfer, mut inside) = ([0.0; 3], 0.0);
        for (Direction { singular_value, components }, left) in self.fixed.iter().zip(&self.left) {
            let along = dot(gradient, components);
            inside += along * along;
            for (sum, left) in transfer.iter_mut().zip(left) {
                *sum += along / singular_value * left;
            }
        }
        (transfer, inside)
    }
}

/// Returns the eigenvalues of J Jᵀ, given the columns of J, in decreasing order, with their vectors, by
/// Jacobi's rotations.
fn eigen_of_rows(columns: &[[f64; 3]]) -> [(f64, [f64; 3]); 3] {
    let gram = |i: usize, j: usize| columns.iter().map(|column| column[i] * column[j]).sum();
    let mut matrix = [0, 1, 2].map(|i| [0, 1, 2].map(|j| gram(i, j)));
    // Rows are the vectors.
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].repeat(SWEEPS) {
        rotate(&mut matrix, &mut vectors, p, q);
    }
    let mut eigen = [0, 1, 2].map(|k| (matrix[k][k], vectors[k]));
    eigen.sort_by(|a, b| b.0.total_cmp(&a.0));
    eigen
}

/// Makes the entry (p, q) of a symmetric matrix zero.
fn rotate(matrix: &mut [[f64; 3]; 3], vectors: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let off: f64 = matrix[p][q];
    if off == 0.0 {
        return;
    }
    let half = (matrix[q][q] - matrix[p][p]) / (2.0 * off);
    let tangent = half.signum() / (half.abs() + (half * half + 1.0).sqrt());
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    let turned = |x: f64, y: f64| (cosine * x - sine * y, sine * x + cosine * y);
    for row in matrix.iter_mut() {
        (row[p], row[q]) = turned(row[p], row[q]);
    }
    for column in 0..3 {
        let (x, y) = turned(matrix[p][column], matrix[q][column]);
        (matrix[p][column], matrix[q][column]) = (x, y);
        let (x, y) = turned(vectors[p][column], vectors[q][column]);
        (vectors[p][column], vectors[q][column]) = (x, y);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_find_the_eigenvectors() {
        let columns = [[1.0, -2.0, 0.5], [0.3, 0.9, -4.0], [2.0, 0.1, 0.7], [-1.0, 0.4, 0.2]];
        let eigen = eigen_of_rows(&columns);
        assert!(eigen.is_sorted_by(|a, b| a.0 >= b.0));
        for (k, (square, vector)) in eigen.iter().enumerate() {
            for (other, (_, beside)) in eigen.iter().enumerate() {
                let expected = if k == other { 1.0 } else { 0.0 };
                assert!((dot(vector, beside) - expected).abs() < 1e-14, "{k} {other}");
            }
            for i in 0..3 {
                let product: f64 = columns.iter().map(|c| c[i] * dot(c, vector)).sum();
                assert!((product - square * vector[i]).abs() < 1e-12, "{k} {i}");
            }
        }
        // Without a third row, as the closed form for two.
        let columns = [[1.0, -2.0, 0.0], [0.3, 0.9, 0.0]];
        let [first, second] = symmetric(1.09, -1.73, 4.81);
        let found = eigen_of_rows(&columns);
        assert!((found[0].0 - first.0).abs() < 1e-14 && (found[1].0 - second.0).abs() < 1e-14);
    }
}
