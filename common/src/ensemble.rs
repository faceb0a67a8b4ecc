//! The random elasticity of the paper's Sec. 4: [C] = [L]ᵀ [G] [L] with [G] = [L_G]ᵀ [L_G],
//! E[G] = I and E‖G - I‖² / 6 = δ².
//!
//! [L_G] is upper triangular with independent entries: σ U off the diagonal, U standard normal,
//! σ = δ/√7; σ √(2 V_j) on it, V_j gamma of shape α_j = 7/(2δ²) + (1-j)/2, j = 1…6, scale 1. All
//! are quantiles of uniform germs, so that a realization is a continuous function of the mean and
//! of the dispersion, and one set of germs serves every point of a search.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use thiserror::Error;

use crate::elasticity::{Elasticity, NotElastic};
use crate::special::{GammaQuantile, standard_normal_quantile};

/// The dispersion must be below √(7/11), where the law ceases to have the second moments that
/// make a wave problem well posed (the paper, Sec. 4).
pub const DISPERSION_MAX: f64 = 0.797_724_035_217_465_6;

/// Number of germs of one realization: the entries of a triangular 6×6 matrix.
pub const GERMS: usize = 21;

/// Largest double below 1.
const BELOW_ONE: f64 = 1.0 - 0.5 * f64::EPSILON;

/// The germs of one realization: 21 numbers in (0, 1), one for each entry of L_G, by rows:
/// 11, 12, … 16, 22, … 66.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Germs([f64; GERMS]);

/// The law of the random elasticity at one point: everything that the realizations share.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticityLaw {
    /// [L], √Pa.
    factor: [[f64; 6]; 6],
    /// σ = δ/√7.
    sigma: f64,
    diagonal: [Diagonal; 6],
}

/// A diagonal entry of L_G: √(mean square · V/α).
#[derive(Debug, Clone, PartialEq)]
struct Diagonal {
    /// 2 σ² α_j = 1 + (1-j) δ²/7.
    mean_square: f64,
    gamma: GammaQuantile,
}

/// Why there is no law.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum LawError {
    /// δ is outside (0, √(7/11)).
    #[error("dispersion is {value}; it must be above 0 and below √(7/11) = 0.79772…")]
    Dispersion {
        /// δ.
        value: f64,
    },
}

impl Germs {
    /// The germs of realization `index` of the job with this seed.
    ///
    /// ChaCha20 with 64-bit block counter from 0, the seed as key (little-endian in bytes 0-7, the
    /// rest 0) and the index as stream; each germ is ((next 64 bits >> 11) + ½) 2⁻⁵³.
    pub fn draw(seed: u64, index: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut rng = ChaCha20Rng::from_seed(key);
        rng.set_stream(index);
        Self(std::array::from_fn(|_| uniform(rng.next_u64())))
    }

    /// Germs from another source (a low-discrepancy sequence, a test), or `None` if one of them
    /// is outside (0, 1).
    pub fn new(germs: [f64; GERMS]) -> Option<Self> {
        germs.iter().all(|&u| u > 0.0 && u < 1.0).then_some(Self(germs))
    }

    /// The germs, by rows of L_G.
    pub fn values(&self) -> &[f64; GERMS] {
        &self.0
    }
}

/// ((bits >> 11) + ½) 2⁻⁵³. The largest of these numbers, 1 - 2⁻⁵⁴, is no double and would round
/// to 1; it becomes the largest double below 1.
fn uniform(bits: u64) -> f64 {
    const STEP: f64 = 1.0 / (1u64 << 53) as f64;
    (((bits >> 11) as f64 + 0.5) * STEP).min(BELOW_ONE)
}

impl ElasticityLaw {
    /// The law with this mean and dispersion δ, 0 < δ < √(7/11).
    ///
    /// # Errors
    /// When the dispersion is outside its range.
    pub fn new(mean: &Elasticity, dispersion: f64) -> Result<Self, LawError> {
        if !(dispersion > 0.0 && dispersion < DISPERSION_MAX) {
            return Err(LawError::Dispersion { value: dispersion });
        }
        let square = dispersion * dispersion;
        Ok(Self {
            factor: mean.cholesky(),
            sigma: dispersion / 7.0_f64.sqrt(),
            diagonal: std::array::from_fn(|j| Diagonal {
                mean_square: 1.0 - j as f64 * square / 7.0,
                gamma: GammaQuantile::new(3.5 / square - 0.5 * j as f64),
            }),
        })
    }

    /// The realization [C] that belongs to these germs, Pa; symmetric to the bit.
    ///
    /// # Errors
    /// When rounding spoils positive definiteness: for germs at the very edge of (0, 1) at a
    /// large dispersion, or a mean that is itself nearly singular.
    pub fn realize(&self, germs: &Germs) -> Result<Elasticity, NotElastic> {
        // [C] = [M]ᵀ [M] with [M] = [L_G] [L], upper triangular.
        let m = multiply_triangular(&self.triangle(germs), &self.factor);
        let mut c = [[0.0; 6]; 6];
        for i in 0..6 {
            for j in i..6 {
                let mut sum = 0.0;
                for row in m.iter().take(i + 1) {
                    sum = row[i].mul_add(row[j], sum);
                }
                c[i][j] = sum;
                c[j][i] = sum;
            }
        }
        Elasticity::new(c)
    }

    /// [L_G].
    fn triangle(&self, germs: &Germs) -> [[f64; 6]; 6] {
        let mut triangle = [[0.0; 6]; 6];
        let mut germs = germs.0.iter();
        for (j, (row, diagonal)) in triangle.iter_mut().zip(&self.diagonal).enumerate() {
            for (k, (entry, &u)) in row.iter_mut().skip(j).zip(germs.by_ref()).enumerate() {
                *entry = if k == 0 {
                    (diagonal.mean_square * diagonal.gamma.relative_quantile(u)).sqrt()
                } else {
                    self.sigma * standard_normal_quantile(u)
                };
            }
        }
        triangle
    }
}

/// Product of two upper triangular matrices, sums in ascending order of the inner index.
fn multiply_triangular(a: &[[f64; 6]; 6], b: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let mut product = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in i..6 {
            let mut sum = 0.0;
            for k in i..=j {
                sum = a[i][k].mul_add(b[k][j], sum);
            }
            product[i][j] = sum;
        }
    }
    product
}
