//! Left singular vectors of small complex matrices.
//!
//! By Jacobi's one-sided method (M. R. Hestenes, J. SIAM 6 (1958) 51): pairs of columns are rotated until all are
//! orthogonal; their lengths are then the singular values. The order of the operations is fixed, and with it every
//! bit, which those of libraries for large matrices are not.

use osteon_solver::Complex;

/// Columns are orthogonal if their product is below this part of that of their lengths.
const ORTHOGONAL: f64 = 1e-15;
/// Most sweeps over all pairs; some eight suffice.
const SWEEPS_MAX: usize = 40;

/// A singular value with its left vector, of length 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SingularVector {
    pub(super) value: f64,
    pub(super) left: Vec<Complex>,
}

/// Returns the singular values above 0 of the matrix with these columns, the largest first, with their vectors.
pub(super) fn singular_vectors(mut columns: Vec<Vec<Complex>>) -> Vec<SingularVector> {
    for _ in 0..SWEEPS_MAX {
        let mut is_done = true;
        for q in 1..columns.len() {
            let (before, rest) = columns.split_at_mut(q);
            for p in before {
                is_done &= !rotate(p, &mut rest[0]);
            }
        }
        if is_done {
            break;
        }
    }
    let of_column = |column: Vec<Complex>| {
        let value = product(&column, &column).re.sqrt();
        let left = column.into_iter().map(|z| z.scale(1.0 / value)).collect();
        SingularVector { value, left }
    };
    let mut vectors: Vec<_> = columns.into_iter().map(of_column).collect();
    vectors.retain(|vector| vector.value > 0.0 && vector.value.is_finite());
    vectors.sort_by(|a, b| b.value.total_cmp(&a.value));
    vectors
}

/// Returns the Hermitian product of two vectors, which is antilinear in the first.
pub(super) fn product(one: &[Complex], other: &[Complex]) -> Complex {
    let zero = Complex::default();
    one.iter().zip(other).fold(zero, |sum, (a, b)| sum + Complex::new(a.re, -a.im) * *b)
}

/// Rotates two columns so that they are orthogonal; returns whether they were not.
fn rotate(p: &mut [Complex], q: &mut [Complex]) -> bool {
    let (alpha, beta, gamma) = (product(p, p).re, product(q, q).re, product(p, q));
    let size = gamma.abs();
    if size.is_nan() || size <= ORTHOGONAL * (alpha * beta).sqrt() {
        return false;
    }
    let zeta = (beta - alpha) / (2.0 * size);
    let tangent = 1.0_f64.copysign(zeta) / (zeta.abs() + zeta.mul_add(zeta, 1.0).sqrt());
    let cosine = 1.0 / tangent.mul_add(tangent, 1.0).sqrt();
    let phase = gamma.scale(cosine * tangent / size);
    for (a, b) in p.iter_mut().zip(q) {
        let (old_a, old_b) = (*a, *b);
        *a = old_a.scale(cosine) - Complex::new(phase.re, -phase.im) * old_b;
        *b = old_b.scale(cosine) + phase * old_a;
    }
    true
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

    use super::*;

    fn random(rows: usize, columns: usize, seed: u64) -> Vec<Vec<Complex>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = move || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        (0..columns)
            .map(|_| (0..rows).map(|_| Complex::new(uniform(), uniform())).collect())
            .collect()
    }

    fn check(columns: &[Vec<Complex>], expected_rank: usize) {
        let vectors = singular_vectors(columns.to_vec());
        let largest = vectors[0].value;
        let rank = vectors.iter().filter(|one| one.value > 1e-12 * largest).count();
        assert_eq!(rank, expected_rank);
        let kept = &vectors[..rank];
        for (i, one) in kept.iter().enumerate() {
            for (j, other) in kept.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                let found = product(&one.left, &other.left);
                assert!((found - Complex::new(expected, 0.0)).abs() < 1e-12, "{i} {j} {found:?}");
            }
        }
        // Each vector has its value's length in the rows of the adjoint, and all of the matrix lies in their space.
        for one in kept {
            let length: f64 = columns.iter().map(|c| product(&one.left, c).norm_sqr()).sum();
            assert!((length.sqrt() / one.value - 1.0).abs() < 1e-12, "{length}");
        }
        for column in columns {
            let inside: f64 = kept.iter().map(|one| product(&one.left, column).norm_sqr()).sum();
            assert!((inside - product(column, column).re).abs() < 1e-12 * largest * largest);
        }
    }

    #[test]
    fn vectors_are_orthonormal_and_span_the_matrix() {
        for (rows, columns, seed) in [(24, 5, 1), (14, 1, 2), (3, 3, 3), (5, 12, 4), (64, 64, 5)] {
            check(&random(rows, columns, seed), rows.min(columns));
        }
    }

    #[test]
    fn dependent_and_empty_columns_lower_the_rank() {
        let mut columns = random(10, 3, 6);
        columns.push(columns[0].iter().map(|z| z.scale(-2.0)).collect());
        columns.push(vec![Complex::default(); 10]);
        check(&columns, 3);
        assert_eq!(singular_vectors(vec![vec![Complex::default(); 4]; 2]), Vec::new());
    }
}
