//! The transfer matrix of a thin sublayer by its Taylor series.
//!
//! exp(M d) of the system in [`crate::medium`] is, entry by entry, a polynomial in κ d and
//! σ d²/stiffness with real coefficients that depend on the solid alone. They are computed once
//! per solid; summed over σ once per frequency; what remains per wavenumber are polynomials in k.

use crate::complex::Complex;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::medium::{Matrix3, Medium, product};

/// Highest power of M in the series. With |λ| d ≤ [`GROWTH_MAX`] the remainder is
/// 2²¹/21! = 4e-14 of the leading terms.
pub(crate) const ORDER: usize = 20;

/// Largest |λ| d of a sublayer. Below π, where the block that is inverted becomes singular.
pub(crate) const GROWTH_MAX: f64 = 2.0;

/// Terms in σ of the lowest power of κ.
const TERMS: usize = ORDER / 2 + 1;

/// Entries (row, column) of a symmetric 3×3 matrix that are kept.
pub(crate) const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Coefficients of κ^(n-2j) σ^j in M^n/n!, upper blocks.
#[derive(Debug)]
pub(crate) struct Series {
    /// Block (u, u): entry `[m][j]` is the coefficient matrix of κ^m σ^j.
    displacement: Vec<[Matrix3; TERMS]>,
    /// Block (u, τ), symmetric: entry `[m][j]` is the coefficient matrix of κ^m σ^j.
    traction: Vec<[Matrix3; TERMS]>,
}

impl Default for Series {
    fn default() -> Self {
        Self {
            displacement: vec![[[[0.0; 3]; 3]; TERMS]; ORDER + 1],
            traction: vec![[[[0.0; 3]; 3]; TERMS]; ORDER],
        }
    }
}

impl Series {
    /// Computes the coefficients for one solid.
    #[inline(always)]
    pub(crate) fn fill(&mut self, medium: &Medium) {
        let mut transposed = medium.coupling;
        for i in 0..3 {
            for j in 0..3 {
                transposed[i][j] = medium.coupling[j][i];
            }
        }
        // x[j], y[j]: the blocks of M^n/n! at σ^j.
        let mut x = [[[0.0; 3]; 3]; TERMS + 1];
        let mut y = [[[0.0; 3]; 3]; TERMS + 1];
        for (i, row) in x[0].iter_mut().enumerate() {
            row[i] = 1.0;
        }
        self.displacement[0][0] = x[0];
        for n in 1..=ORDER {
            let factor = 1.0 / n as f64;
            let mut x_next = [[[0.0; 3]; 3]; TERMS + 1];
            let mut y_next = [[[0.0; 3]; 3]; TERMS + 1];
            for j in 0..=n / 2 {
                let xp = product(&x[j], &medium.coupling);
                let yq = product(&y[j], &medium.membrane);
                let xr = product(&x[j], &medium.compliance);
                let yp = product(&y[j], &transposed);
                for a in 0..3 {
                    for b in 0..3 {
                        let inertia = if j > 0 { y[j - 1][a][b] } else { 0.0 };
                        x_next[j][a][b] = factor * (xp[a][b] - yq[a][b] + inertia);
                        y_next[j][a][b] = factor * (xr[a][b] + yp[a][b]);
                    }
                }
                self.displacement[n - 2 * j][j] = x_next[j];
                if 2 * j < n {
                    self.traction[n - 1 - 2 * j][j] = y_next[j];
                }
            }
            x = x_next;
            y = y_next;
        }
    }

    /// Sums over σ for one frequency: `sigma` is ρ s² d² / stiffness.
    #[inline(always)]
    pub(crate) fn at_frequency(&self, sigma: Complex, polynomials: &mut Polynomials) {
        let mut powers = [Complex::new(1.0, 0.0); TERMS];
        for j in 1..TERMS {
            powers[j] = powers[j - 1] * sigma;
        }
        for (m, terms) in self.displacement.iter().enumerate() {
            let count = (ORDER - m) / 2 + 1;
            for (entry, sum) in polynomials.displacement[m].iter_mut().enumerate() {
                *sum = sum_over_sigma(&terms[..count], &powers, entry / 3, entry % 3);
            }
        }
        for (m, terms) in self.traction.iter().enumerate() {
            let count = (ORDER - 1 - m) / 2 + 1;
            for (sum, (row, column)) in polynomials.traction[m].iter_mut().zip(SYMMETRIC) {
                *sum = sum_over_sigma(&terms[..count], &powers, row, column);
            }
        }
    }
}

/// Rows of a polynomial: the powers of κ d up to the highest, in pairs of an even and an odd one.
const ROWS: usize = ORDER + 2;

/// Polynomials in κ d of one frequency.
#[derive(Debug)]
pub(crate) struct Polynomials {
    displacement: [[Complex; 9]; ROWS],
    traction: [[Complex; 6]; ROWS],
}

impl Default for Polynomials {
    fn default() -> Self {
        Self {
            displacement: [[Complex::default(); 9]; ROWS],
            traction: [[Complex::default(); 6]; ROWS],
        }
    }
}

/// Even and odd parts in κ: the value is `even + odd`, and `even - odd` at -k.
pub(crate) struct Parts<const N: usize> {
    pub(crate) even: [ComplexLanes; N],
    pub(crate) odd: [ComplexLanes; N],
}

impl Polynomials {
    /// Block (u, u) of the transfer matrix at wavenumbers `k` times d, by rows.
    #[inline(always)]
    pub(crate) fn displacement(&self, k: Lanes) -> [ComplexLanes; 9] {
        let parts = evaluate(&self.displacement, k);
        let mut sum = parts.even;
        for (sum, odd) in sum.iter_mut().zip(parts.odd) {
            *sum = *sum + odd;
        }
        sum
    }

    /// Block (u, τ), entries [`SYMMETRIC`], in even and odd parts.
    #[inline(always)]
    pub(crate) fn traction(&self, k: Lanes) -> Parts<6> {
        evaluate(&self.traction, k)
    }
}

/// Horner's rule in κ² = -k² for the even and the odd powers; then the odd part times κ = -ik.
#[inline(always)]
fn evaluate<const N: usize>(coefficients: &[[Complex; N]; ROWS], k: Lanes) -> Parts<N> {
    let square = -(k * k);
    let mut parts = Parts { even: [ComplexLanes::ZERO; N], odd: [ComplexLanes::ZERO; N] };
    for entry in 0..N {
        let (mut even, mut odd) = (ComplexLanes::ZERO, ComplexLanes::ZERO);
        for pair in (0..ROWS / 2).rev() {
            let (c, d) = (coefficients[2 * pair][entry], coefficients[2 * pair + 1][entry]);
            even.re = even.re.mul_add(square, Lanes::splat(c.re));
            even.im = even.im.mul_add(square, Lanes::splat(c.im));
            odd.re = odd.re.mul_add(square, Lanes::splat(d.re));
            odd.im = odd.im.mul_add(square, Lanes::splat(d.im));
        }
        parts.even[entry] = even;
        parts.odd[entry] = ComplexLanes { re: odd.im * k, im: -(odd.re * k) };
    }
    parts
}

#[inline(always)]
fn sum_over_sigma(
    terms: &[Matrix3],
    powers: &[Complex; TERMS],
    row: usize,
    column: usize,
) -> Complex {
    let mut sum = Complex::default();
    for (term, power) in terms.iter().zip(powers) {
        sum.re = term[row][column].mul_add(power.re, sum.re);
        sum.im = term[row][column].mul_add(power.im, sum.im);
    }
    sum
}

/// Compile-time check of the block width that the polynomials assume.
const _: () = assert!(LANES == 8);
