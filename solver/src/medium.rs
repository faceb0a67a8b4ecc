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
    /// Bound of |λ|/k of the static system (σ = 0), λ its eigenvalues.
    pub(crate) static_growth: f64,
    /// Bound of |λ|² · stiffness / |σ| at k = 0.
    pub(crate) dynamic_growth: f64,
}

impl Medium {
    pub(crate) fn new(bone: &Bone) -> Self {
        let c = &bone.elasticity;
        let stiffness = (0..6).map(|i| c.rows()[i][i]).fold(0.0, f64::max);
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
        let static_growth = static_growth(&compliance, &coupling, &membrane);
        let dynamic_growth = largest_eigenvalue(&compliance);
        Self {
            density: bone.density,
            stiffness,
            compliance,
            coupling,
            membrane,
            fastest,
            static_growth,
            dynamic_growth,
        }
    }

    /// Estimate from above of |λ|, rad/m, of the system at wavenumber `k` (rad/m) and complex
    /// frequency of modulus `s_modulus` (1/s). Exact up to the bounds in it for a solid with
    /// λ² = k² + s²/c².
    #[inline(always)]
    pub(crate) fn growth(&self, k: f64, s_modulus: f64) -> f64 {
        let dynamic = self.density * s_modulus * s_modulus / self.stiffness * self.dynamic_growth;
        let across = self.static_growth * k;
        across.mul_add(across, dynamic).sqrt()
    }
}

/// (A_jl)_im = c_ijml / stiffness.
fn block(c: &Elasticity, j: usize, l: usize, stiffness: f64) -> Matrix3 {
    std::array::from_fn(|i| std::array::from_fn(|m| c.component(i, j, m, l) / stiffness))
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
fn inverse_symmetric(a: &Matrix3) -> Matrix3 {
    let minor = |i: usize, j: usize| {
        let rows = [(i + 1) % 3, (i + 2) % 3];
        let columns = [(j + 1) % 3, (j + 2) % 3];
        a[rows[0]][columns[0]]
            .mul_add(a[rows[1]][columns[1]], -(a[rows[0]][columns[1]] * a[rows[1]][columns[0]]))
    };
    let determinant =
        a[0][2].mul_add(minor(0, 2), a[0][1].mul_add(minor(0, 1), a[0][0] * minor(0, 0)));
    let mut inverse = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in i..3 {
            inverse[i][j] = minor(i, j) / determinant;
            inverse[j][i] = inverse[i][j];
        }
    }
    inverse
}

/// Largest eigenvalue of a symmetric matrix by cyclic Jacobi rotations.
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

/// Bound of the spectral radius of the system at κ = 1, σ = 0: the 16th root of a norm of its
/// 16th power. (The system is homogeneous: its eigenvalues at κ are κ times these.)
fn static_growth(compliance: &Matrix3, coupling: &Matrix3, membrane: &Matrix3) -> f64 {
    let mut power = [[0.0; 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            power[i][j] = coupling[i][j];
            power[i][j + 3] = compliance[i][j];
            power[i + 3][j] = -membrane[i][j];
            power[i + 3][j + 3] = coupling[j][i];
        }
    }
    for _ in 0..4 {
        power = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..6).fold(0.0, |sum, m| power[i][m].mul_add(power[m][j], sum))
            })
        });
    }
    let mut norm: f64 = 0.0;
    for row in power {
        norm = norm.max(row.iter().fold(0.0, |sum, value| sum + value.abs()));
    }
    // Four square roots are the 16th root.
    norm.sqrt().sqrt().sqrt().sqrt()
}
