//! The transfer matrix of a thin slice of a plate by its Taylor series.
//!
//! The series of exp(M d) of the system in [`crate::medium`], which ends at M^(2 `TERMS` - 1), is entry by
//! entry a polynomial in κ d and σ d²/stiffness (below: κ and σ) with real coefficients that depend on the solid alone. They are computed once
//! per solid; summed over σ once per frequency; what remains per wavenumber are polynomials in k.

use crate::complex::Complex;
use crate::lanes::{LANES, Lanes};
use crate::medium::{Matrix3, Medium, product};
use crate::vector::{ComplexVector, Vector};

/// Entries (row, column) of a symmetric 3×3 matrix that are kept.
const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Entries that are kept of a transfer matrix: nine of the block (u, u), by rows, then six of the
/// symmetric block (u, τ).
const ENTRIES: usize = 15;

/// The same, in groups of eight.
type Entries = [Lanes; 2];

/// Coefficients of κ^m σ^j, with m + 2 j ≤ 2 `TERMS` - 1, at `[m * TERMS + j]`.
#[derive(Debug)]
pub(crate) struct Series<const TERMS: usize>(Vec<Entries>);

/// Polynomials in κ d of one frequency: the coefficients of κ^m at `[m]`.
#[derive(Debug, Default)]
pub(crate) struct Polynomials {
    re: Vec<Entries>,
    im: Vec<Entries>,
}

impl<const TERMS: usize> Default for Series<TERMS> {
    fn default() -> Self {
        Self(vec![[Lanes::ZERO; 2]; 2 * TERMS * TERMS])
    }
}

impl<const TERMS: usize> Series<TERMS> {
    /// Highest power of M.
    const ORDER: usize = 2 * TERMS - 1;

    /// Computes the coefficients for one solid.
    #[inline(always)]
    pub(crate) fn fill(&mut self, medium: &Medium) {
        let mut transposed = medium.coupling;
        for i in 0..3 {
            for j in 0..3 {
                transposed[i][j] = medium.coupling[j][i];
            }
        }
        // x[j], y[j]: the blocks (u, u) and (u, τ) of M^n/n! at σ^j.
        let mut x = [[[0.0; 3]; 3]; TERMS];
        let mut y = [[[0.0; 3]; 3]; TERMS];
        for (i, row) in x[0].iter_mut().enumerate() {
            row[i] = 1.0;
        }
        self.set_displacement(0, 0, &x[0]);
        for n in 1..=Self::ORDER {
            let factor = 1.0 / n as f64;
            // From the highest j down: each step needs y[j - 1] of the power before.
            for j in (0..=n / 2).rev() {
                let xp = product(&x[j], &medium.coupling);
                let yq = product(&y[j], &medium.membrane);
                let xr = product(&x[j], &medium.compliance);
                let yp = product(&y[j], &transposed);
                for a in 0..3 {
                    for b in 0..3 {
                        let inertia = if j > 0 { y[j - 1][a][b] } else { 0.0 };
                        x[j][a][b] = factor * (xp[a][b] - yq[a][b] + inertia);
                        y[j][a][b] = factor * (xr[a][b] + yp[a][b]);
                    }
                }
                self.set_displacement(n - 2 * j, j, &x[j]);
                if 2 * j < n {
                    self.set_traction(n - 1 - 2 * j, j, &y[j]);
                }
            }
        }
    }

    #[inline(always)]
    fn set_displacement(&mut self, m: usize, j: usize, matrix: &Matrix3) {
        let entries = &mut self.0[m * TERMS + j];
        for entry in 0..9 {
            entries[entry / LANES].0[entry % LANES] = matrix[entry / 3][entry % 3];
        }
    }

    #[inline(always)]
    fn set_traction(&mut self, m: usize, j: usize, matrix: &Matrix3) {
        let entries = &mut self.0[m * TERMS + j];
        for (i, (row, column)) in SYMMETRIC.into_iter().enumerate() {
            let entry = 9 + i;
            entries[entry / LANES].0[entry % LANES] = matrix[row][column];
        }
    }

    /// Sums over σ for one frequency: `sigma` is ρ s² d² / stiffness.
    #[inline(always)]
    pub(crate) fn at_frequency<V: Vector>(&self, sigma: Complex, polynomials: &mut Polynomials) {
        let mut powers = [Complex::new(1.0, 0.0); TERMS];
        for j in 1..TERMS {
            powers[j] = powers[j - 1] * sigma;
        }
        polynomials.re.resize(2 * TERMS, [Lanes::ZERO; 2]);
        polynomials.im.resize(2 * TERMS, [Lanes::ZERO; 2]);
        for m in 0..2 * TERMS {
            let terms = &self.0[m * TERMS..m * TERMS + (Self::ORDER - m) / 2 + 1];
            for group in 0..2 {
                for part in 0..V::PARTS {
                    let mut sum = ComplexVector::<V>::zero();
                    for (term, power) in terms.iter().zip(&powers) {
                        let term = V::load(&term[group], part);
                        sum.re = term.mul_add(V::splat(power.re), sum.re);
                        sum.im = term.mul_add(V::splat(power.im), sum.im);
                    }
                    sum.re.store(&mut polynomials.re[m][group], part);
                    sum.im.store(&mut polynomials.im[m][group], part);
                }
            }
        }
    }
}

/// One entry: `even` + κ `odd`.
pub(crate) struct EntryParts<V> {
    even: ComplexVector<V>,
    odd: ComplexVector<V>,
}

impl<V: Vector> EntryParts<V> {
    /// Returns the entry at wavenumbers `k`: κ = -ik.
    #[inline(always)]
    pub(crate) fn at(&self, k: V) -> ComplexVector<V> {
        let re = self.odd.im.mul_add(k, self.even.re);
        ComplexVector { re, im: self.odd.re.mul_sub_from(k, self.even.im) }
    }

    /// Returns the entry at the opposite wavenumbers.
    #[inline(always)]
    pub(crate) fn at_opposite(&self, k: V) -> ComplexVector<V> {
        let re = self.odd.im.mul_sub_from(k, self.even.re);
        ComplexVector { re, im: self.odd.re.mul_add(k, self.even.im) }
    }
}

impl Polynomials {
    /// Entry `entry` of the transfer matrix at wavenumbers `k` times d.
    ///
    /// Horner's rule in κ² = -k² for the even and the odd powers.
    #[inline(always)]
    pub(crate) fn entry<const TERMS: usize, V: Vector>(&self, entry: usize, k: V) -> EntryParts<V> {
        debug_assert!(entry < ENTRIES);
        let (group, lane) = (entry / LANES, entry % LANES);
        let (re, im) = (&self.re[..2 * TERMS], &self.im[..2 * TERMS]);
        let square = k.mul(k).neg();
        let last = 2 * TERMS - 2;
        let mut even = ComplexVector {
            re: V::splat(re[last][group].0[lane]),
            im: V::splat(im[last][group].0[lane]),
        };
        let mut odd = ComplexVector {
            re: V::splat(re[last + 1][group].0[lane]),
            im: V::splat(im[last + 1][group].0[lane]),
        };
        for pair in (0..TERMS - 1).rev() {
            let (c, d) = (2 * pair, 2 * pair + 1);
            even.re = square.mul_add(even.re, V::splat(re[c][group].0[lane]));
            even.im = square.mul_add(even.im, V::splat(im[c][group].0[lane]));
            odd.re = square.mul_add(odd.re, V::splat(re[d][group].0[lane]));
            odd.im = square.mul_add(odd.im, V::splat(im[d][group].0[lane]));
        }
        EntryParts { even, odd }
    }
}
