//! Growth or phase of waves across the plate: the largest |λ| of the system's eigenvalues.
//!
//! It determines how thin a slice must be for its Taylor series. For imaginary s the system is,
//! except for a similarity and a factor -i, the real matrix
//!
//! ```text
//! N = [ kP, -R; k²Q - ρω², kPᵀ ]        P = A33⁻¹ A31, R = A33⁻¹, Q = A11 - A13 A33⁻¹ A31
//! ```
//!
//! whose spectral radius is ω times a function of the slowness k/ω alone. That function is
//! tabulated once per solid, by repeated squaring; for damped s, |s| takes the place of ω.

use crate::lanes::{LANES, Lanes};
use crate::medium::Medium;
use crate::vector::Vector;

/// Number of slownesses in the table.
const POINTS: usize = 2 * LANES;
/// Distance of the table's slownesses, in units of √(ρ / stiffness).
const STEP: f64 = 0.25;
/// Number of squarings: the norm of the 32nd power bounds the spectral radius to 6 %.
const SQUARINGS: usize = 5;

/// The table of one solid.
#[derive(Debug)]
pub(crate) struct Growth {
    /// √(ρ / stiffness), s/m.
    slowness: f64,
    /// |λ| divided by |s| √(ρ / stiffness), at slownesses 0, STEP, 2 STEP, …
    table: [f64; POINTS],
}

impl Default for Growth {
    fn default() -> Self {
        Self { slowness: 0.0, table: [0.0; POINTS] }
    }
}

impl Growth {
    /// Computes the table of one solid.
    #[inline(always)]
    pub(crate) fn fill<V: Vector>(&mut self, medium: &Medium) {
        self.slowness = (medium.density / medium.stiffness).sqrt();
        for block in 0..POINTS / LANES {
            let mut slownesses = Lanes::ZERO;
            for lane in 0..LANES {
                slownesses.0[lane] = STEP * (block * LANES + lane) as f64;
            }
            let mut radii = Lanes::ZERO;
            for part in 0..V::PARTS {
                let radius = spectral_radius(medium, V::load(&slownesses, part));
                radius.store(&mut radii, part);
            }
            for lane in 0..LANES {
                self.table[block * LANES + lane] = radii.0[lane];
            }
        }
    }

    /// Returns an upper estimate of |λ|, rad/m, at wavenumbers from `k_min` to `k_max` (rad/m) and
    /// complex frequency of modulus `s_modulus` (1/s).
    #[inline(always)]
    pub(crate) fn at(&self, k_min: f64, k_max: f64, s_modulus: f64) -> f64 {
        let unit = self.slowness * s_modulus;
        unit * self.relative(k_min / unit).max(self.relative(k_max / unit))
    }

    /// Interpolates linearly; beyond the table it grows in proportion to the slowness.
    #[inline(always)]
    fn relative(&self, slowness: f64) -> f64 {
        let position = slowness / STEP;
        let last = POINTS - 1;
        if position >= last as f64 {
            return self.table[last] * position / last as f64;
        }
        let below = position as usize;
        let (a, b) = (self.table[below], self.table[below + 1]);
        (b - a).mul_add(position - below as f64, a)
    }
}

/// Returns an upper bound of the spectral radius of N at slownesses `p`, in units of density and
/// stiffness.
#[inline(always)]
fn spectral_radius<V: Vector>(medium: &Medium, p: V) -> V {
    let mut power = [[V::splat(0.0); 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            let inertia = V::splat(if i == j { 1.0 } else { 0.0 });
            power[i][j] = p.mul(V::splat(medium.coupling[i][j]));
            power[i][j + 3] = V::splat(-medium.compliance[i][j]);
            power[i + 3][j] = p.mul(p).mul_sub(V::splat(medium.membrane[i][j]), inertia);
            power[i + 3][j + 3] = p.mul(V::splat(medium.coupling[j][i]));
        }
    }
    // ρ(N) = |N| ρ(N/|N|) and ρ(X) = ρ(X²)^½.
    let mut norms = [V::splat(1.0); SQUARINGS + 1];
    for step in 0..=SQUARINGS {
        let mut square = V::splat(0.0);
        for i in 0..6 {
            for j in 0..6 {
                square = power[i][j].mul_add(power[i][j], square);
            }
        }
        norms[step] = square.sqrt();
        if step == SQUARINGS {
            break;
        }
        let scale = square.recip();
        let mut next = [[V::splat(0.0); 6]; 6];
        for i in 0..6 {
            for j in 0..6 {
                let mut sum = power[i][0].mul(power[0][j]);
                for m in 1..6 {
                    sum = power[i][m].mul_add(power[m][j], sum);
                }
                next[i][j] = sum.mul(scale);
            }
        }
        power = next;
    }
    let mut radius = norms[SQUARINGS];
    for step in (0..SQUARINGS).rev() {
        radius = radius.sqrt().mul(norms[step]);
    }
    radius
}
