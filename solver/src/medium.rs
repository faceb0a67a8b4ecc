//! The solid as a first-order system in depth.
//!
//! With (A_jl)_im = c_ijml and one wavenumber k along x1, displacement u and traction τ on planes
//! of constant x3 obey, with κ = -ik and σ = ρ s²,
//!
//! ```text
//! ∂3 u = A33⁻¹ τ + κ A33⁻¹ A31 u
//! ∂3 τ = [σ - κ² (A11 - A13 A33⁻¹ A31)] u + κ A13 A33⁻¹ τ
//! ```
//!
//! whose coefficients are real: all complexity sits in κ and σ. Stiffnesses are divided by a
//! scale, so that all numbers here are of order one.

use osteon_common::case::Bone;
use osteon_common::elasticity::Elasticity;

/// A real 3×3 matrix, by rows.
pub(crate) type Matrix3 = [[f64; 3]; 3];

/// The system's coefficients.
#[derive(Debug, Clone)]
pub(crate) struct Medium {
    /// Mass density, kg/m³.
    pub(crate) density: f64,
    /// The stiffness, Pa, by which the matrices are scaled.
    pub(crate) stiffness: f64,
    /// A33⁻¹ · stiffness: symmetric, positive definite.
    pub(crate) compliance: Matrix3,
    /// A33⁻¹ A31.
    pub(crate) coupling: Matrix3,
    /// (A11 - A13 A33⁻¹ A31) / stiffness: symmetric, positive semidefinite.
    pub(crate) membrane: Matrix3,
    /// Bound of every wave's speed along x1 in the solid, m/s: √(λmax(A11)/ρ).
    pub(crate) fastest: f64,
}

impl Medium {
    #[inline(always)]
    pub(crate) fn new(bone: &Bone) -> Self {
        let c = &bone.elasticity;
        let mut stiffness = 0.0_f64;
        for i in 0..6 {
            stiffness = stiffness.max(c.rows()[i][i]);
        }
        let a11 = block(c, 0, 0, stiffness);
        let a31 = block(c, 2, 0, stiffness);
        let a33 = block(c, 2, 2, stiffness);
        let compliance = inverse_symmetric(&a33);
        let coupling = product(&compliance, &a31);
        let mut membrane = a11;
        for i in 0..3 {
            for j in 0..3 {
                for m in 0..3 {
                    membrane[i][j] = (-a31[m][i]).mul_add(coupling[m][j], membrane[i][j]);
                }
            }
        }
        symmetrize(&mut membrane);
        let fastest = (largest_eigenvalue(&a11) * stiffness / bone.density).sqrt();
        Self { density: bone.density, stiffness, compliance, coupling, membrane, fastest }
    }

    /// Speed of the slowest wave straight across, m/s.
    pub(crate) fn slowest_across(&self) -> f64 {
        (self.stiffness / (largest_eigenvalue(&self.compliance) * self.density)).sqrt()
    }
}

/// (A_jl)_im = c_ijml / stiffness.
#[inline(always)]
fn block(c: &Elasticity, j: usize, l: usize, stiffness: f64) -> Matrix3 {
    let mut matrix = [[0.0; 3]; 3];
    for i in 0..3 {
        for m in 0..3 {
            matrix[i][m] = c.component(i, j, m, l) / stiffness;
        }
    }
    matrix
}

#[inline(always)]
pub(crate) fn product(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    let mut c = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] = a[i][2].mul_add(b[2][j], a[i][1].mul_add(b[1][j], a[i][0] * b[0][j]));
        }
    }
    c
}

#[inline(always)]
fn symmetrize(a: &mut Matrix3) {
    for i in 0..3 {
        for j in i + 1..3 {
            let mean = 0.5 * (a[i][j] + a[j][i]);
            a[i][j] = mean;
            a[j][i] = mean;
        }
    }
}

/// Inverse of a symmetric positive definite matrix by cofactors, symmetric to the bit.
#[inline(always)]
fn inverse_symmetric(a: &Matrix3) -> Matrix3 {
    let determinant =
        a[0][2].mul_add(minor(a, 0, 2), a[0][1].mul_add(minor(a, 0, 1), a[0][0] * minor(a, 0, 0)));
    let mut inverse = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in i..3 {
            inverse[i][j] = minor(a, i, j) / determinant;
            inverse[j][i] = inverse[i][j];
        }
    }
    inverse
}

/// The cofactor of entry (i, j) of a symmetric matrix.
#[inline(always)]
fn minor(a: &Matrix3, i: usize, j: usize) -> f64 {
    let rows = [(i + 1) % 3, (i + 2) % 3];
    let columns = [(j + 1) % 3, (j + 2) % 3];
    a[rows[0]][columns[0]]
        .mul_add(a[rows[1]][columns[1]], -(a[rows[0]][columns[1]] * a[rows[1]][columns[0]]))
}

/// Largest eigenvalue of a symmetric matrix by cyclic Jacobi rotations.
#[inline(always)]
fn largest_eigenvalue(a: &Matrix3) -> f64 {
    // Convergence is quadratic: after five sweeps nothing is left off the diagonal.
    const SWEEPS: usize = 6;
    let mut a = *a;
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, p, q);
        }
    }
    a[0][0].max(a[1][1]).max(a[2][2])
}

/// One Jacobi rotation that annihilates entry (p, q).
#[inline(always)]
fn rotate(a: &mut Matrix3, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = 1.0f64.copysign(theta) / (theta.abs() + theta.mul_add(theta, 1.0).sqrt());
    let cos = 1.0 / t.mul_add(t, 1.0).sqrt();
    let sin = t * cos;
    for row in a.iter_mut() {
        let (x, y) = (row[p], row[q]);
        row[p] = cos.mul_add(x, -(sin * y));
        row[q] = sin.mul_add(x, cos * y);
    }
    for m in 0..3 {
        let (x, y) = (a[p][m], a[q][m]);
        a[p][m] = cos.mul_add(x, -(sin * y));
        a[q][m] = sin.mul_add(x, cos * y);
    }
}
