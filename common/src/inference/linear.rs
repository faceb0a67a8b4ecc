//! Singular value decomposition of the Jacobian of the compared moments, and its consequences.

use std::array;

use super::jacobian::Jacobian;
use super::weights::MomentWeights;
use crate::conclusions::Direction;
use crate::moments::{MOMENTS, MomentMatrix, MomentVector};

/// A singular value below this fraction of the largest counts as rounding error.
const RANK: f64 = 1e-6;
/// A remainder of a unit vector shorter than this counts as rounding error.
const REMAINDER: f64 = 1e-6;
/// Rounds of rotations that diagonalize a matrix of a few rows; each at least squares what is left.
const SWEEPS: usize = 10;

/// Directions of the box that the moments determine, and those that they leave free.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    /// Right singular vectors with their values, in decreasing order.
    pub(super) fixed: Vec<Direction>,
    /// The left singular vector of each.
    left: Vec<MomentVector>,
    /// An orthonormal basis of the null space.
    pub(super) undetermined: Vec<Vec<f64>>,
    /// The same directions for the Jacobian in standard errors, with its weights. Errors move the point of
    /// least χ² along these, if there are more moments than two; `None` where χ² is not the cost.
    weighted: Option<(Box<Self>, MomentWeights)>,
}

/// Effect of noise on a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseResponse {
    /// Standard deviation.
    pub(super) deviation: f64,
    /// Change of the quantity with each of the moments.
    pub(super) transfer: MomentVector,
    /// Fraction of its gradient in the null space.
    pub(super) free_share: f64,
}

impl Linear {
    /// Returns those of a Jacobian; with the weights of the least χ², if that was searched.
    pub(super) fn from_jacobian(jacobian: &Jacobian, weights: Option<&MomentWeights>) -> Self {
        let columns = &jacobian.columns;
        let weighted = weights.map(|weights| {
            let whitened: Vec<_> = columns.iter().map(|column| weights.whiten(*column)).collect();
            (Box::new(Self::from_columns(&whitened)), *weights)
        });
        Self { weighted, ..Self::from_columns(columns) }
    }

    fn from_columns(columns: &[MomentVector]) -> Self {
        let eigen = eigen_of_rows(columns);
        let largest = eigen.first().map_or(0.0, |(square, _)| square.max(0.0).sqrt());
        let (mut fixed, mut lefts) = (Vec::new(), Vec::new());
        for &(square, left) in eigen.iter().take(columns.len()) {
            let singular_value = square.max(0.0).sqrt();
            if !(singular_value > 0.0 && singular_value > RANK * largest) {
                continue;
            }
            let component = |c: &MomentVector| dot(&left, c) / singular_value;
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
        covariance: &MomentMatrix,
    ) -> Option<NoiseResponse> {
        let length = dot(gradient, gradient).sqrt();
        let (own, inside) = self.transfer(gradient);
        let transfer = match &self.weighted {
            Some((weighted, weights)) => weights.transposed(&weighted.transfer(gradient).0),
            None => own,
        };
        let free_share = (1.0 - inside / (length * length)).max(0.0).sqrt();
        let variance = dot(&transfer, &covariance.map(|row| dot(&row, &transfer)));
        let known = inside > 0.0 && variance.is_finite();
        known.then(|| NoiseResponse { deviation: variance.max(0.0).sqrt(), transfer, free_share })
    }

    /// Returns the change of a quantity with this gradient by each of the moments, and the square of the
    /// part of the gradient that lies in the directions that are fixed.
    fn transfer(&self, gradient: &[f64]) -> (MomentVector, f64) {
        let (mut transfer, mut inside) = ([0.0; MOMENTS], 0.0);
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
fn eigen_of_rows(columns: &[MomentVector]) -> [(f64, MomentVector); MOMENTS] {
    let gram = |i: usize, j: usize| columns.iter().map(|column| column[i] * column[j]).sum();
    let mut matrix: MomentMatrix = array::from_fn(|i| array::from_fn(|j| gram(i, j)));
    // Rows are the vectors.
    let mut vectors: MomentMatrix =
        array::from_fn(|i| array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for _ in 0..SWEEPS {
        for p in 0..MOMENTS {
            (p + 1..MOMENTS).for_each(|q| rotate(&mut matrix, &mut vectors, p, q));
        }
    }
    let mut eigen = array::from_fn(|k| (matrix[k][k], vectors[k]));
    eigen.sort_by(|a: &(f64, MomentVector), b| b.0.total_cmp(&a.0));
    eigen
}

/// Makes the entry (p, q) of a symmetric matrix zero.
fn rotate(matrix: &mut MomentMatrix, vectors: &mut MomentMatrix, p: usize, q: usize) {
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
    for column in 0..MOMENTS {
        let (x, y) = turned(matrix[p][column], matrix[q][column]);
        (matrix[p][column], matrix[q][column]) = (x, y);
        let (x, y) = turned(vectors[p][column], vectors[q][column]);
        (vectors[p][column], vectors[q][column]) = (x, y);
    }
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
        let padded = |[a, b, c]: [f64; 3]| {
            array::from_fn(|i| match i {
                0 => a,
                1 => b,
                3 => c,
                _ => 0.0,
            })
        };
        let columns = [[1.0, -2.0, 0.5], [0.3, 0.9, -4.0], [2.0, 0.1, 0.7], [-1.0, 0.4, 0.2]];
        let columns = columns.map(padded);
        let eigen = eigen_of_rows(&columns);
        assert!(eigen.is_sorted_by(|a, b| a.0 >= b.0));
        for (k, (square, vector)) in eigen.iter().enumerate() {
            for (other, (_, beside)) in eigen.iter().enumerate() {
                let expected = if k == other { 1.0 } else { 0.0 };
                assert!((dot(vector, beside) - expected).abs() < 1e-14, "{k} {other}");
            }
            for i in 0..MOMENTS {
                let product: f64 = columns.iter().map(|c| c[i] * dot(c, vector)).sum();
                assert!((product - square * vector[i]).abs() < 1e-12, "{k} {i}");
            }
        }
        // Those of rows that are 0 are 0.
        assert_eq!(eigen.map(|(square, _)| square > 0.0), array::from_fn(|k| k < 3));
    }
}
