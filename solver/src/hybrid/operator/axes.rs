//! Principal axes of a symmetric matrix.

use crate::medium::Matrix3;

/// Sweeps of rotations. Convergence is quadratic: after five nothing is left off the diagonal.
const SWEEPS: usize = 6;

/// An orthogonal matrix Q, its columns the axes, such that Qᵀ `a` Q is diagonal: by Jacobi's
/// rotations.
pub(super) fn principal_axes(a: &Matrix3) -> Matrix3 {
    let mut a = *a;
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let tangent =
                1.0_f64.copysign(theta) / (theta.abs() + theta.mul_add(theta, 1.0).sqrt());
            let cos = 1.0 / tangent.mul_add(tangent, 1.0).sqrt();
            let sin = tangent * cos;
            turn(&mut a, p, q, cos, sin);
            for m in 0..3 {
                let (x, y) = (a[p][m], a[q][m]);
                a[p][m] = cos.mul_add(x, -(sin * y));
                a[q][m] = sin.mul_add(x, cos * y);
            }
            turn(&mut axes, p, q, cos, sin);
        }
    }
    axes
}

/// Rotates columns `p` and `q`.
fn turn(a: &mut Matrix3, p: usize, q: usize, cos: f64, sin: f64) {
    for row in a {
        let (x, y) = (row[p], row[q]);
        row[p] = cos.mul_add(x, -(sin * y));
        row[q] = sin.mul_add(x, cos * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn along_its_axes_a_matrix_is_diagonal() {
        for a in [
            [[4.0, 1.0, 0.5], [1.0, 3.0, -0.7], [0.5, -0.7, 5.0]],
            [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]],
            [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
            [[1e-9, 0.0, 3.0], [0.0, 1.0, 0.0], [3.0, 0.0, 1e9]],
        ] {
            let axes = principal_axes(&a);
            let scale = a.as_flattened().iter().fold(0.0_f64, |max, x| max.max(x.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    let sum = |term: &dyn Fn(usize, usize) -> f64| -> f64 {
                        (0..3).map(|p| (0..3).map(|q| term(p, q)).sum::<f64>()).sum()
                    };
                    let product = sum(&|p, q| axes[p][i] * a[p][q] * axes[q][j]);
                    let unit = sum(&|p, q| if p == q { axes[p][i] * axes[q][j] } else { 0.0 });
                    let expected = f64::from(u8::from(i == j));
                    assert!((unit - expected).abs() < 1e-14, "{a:?}");
                    assert!(i == j || product.abs() < 1e-14 * scale, "{a:?}");
                }
            }
        }
    }
}
