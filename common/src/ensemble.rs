//! The random elasticity of the paper's Sec. 4: `[C] = [L]ᵀ [G] [L]` with `[G] = [L_G]ᵀ [L_G]`,
//! `E[G] = I` and `E‖G - I‖² / 6 = δ²`.
//!
//! `[L_G]` is upper triangular with independent entries: σ U off the diagonal, U standard normal,
//! σ = δ/√7; σ √(2 V_j) on it, V_j gamma of shape α_j = 7/(2δ²) + (1-j)/2, j = 1…6, scale 1. All
//! are quantiles of uniform germs, so that a realization is a continuous function of the mean and
//! of the dispersion, and one set of germs serves every point of a search.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use thiserror::Error;

use crate::elasticity::{Elasticity, NotElastic};
use crate::special::{GammaQuantile, root_gamma_moments, standard_normal_quantile};

/// The dispersion must be below this, √((n+1)/(n+5)) = √(7/11) for n = 6: then the inverse of the
/// random matrix has a finite mean square norm (C. Soize, J. Acoust. Soc. Am. 109 (2001)).
pub const DISPERSION_MAX: f64 = 0.797_724_035_217_465_6;

/// Number of germs of one realization's elasticity: the entries of a triangular 6×6 matrix.
pub const GERMS: usize = 21;
/// Largest double below 1.
const BELOW_ONE: f64 = 1.0 - 0.5 * f64::EPSILON;

/// The germs of one realization: 21 numbers in (0, 1), one for each entry of L_G, by rows:
/// 11, 12, … 16, 22, … 66.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Germs([f64; GERMS]);

/// The law of the random elasticity at one point: everything that its realizations share.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticityLaw {
    /// `[L]`, √Pa.
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
    /// α_j.
    shape: f64,
    gamma: GammaQuantile,
}

/// Reason why a law does not exist.
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
    /// Draws the germs of realization `index` of the job with this seed.
    ///
    /// ChaCha20 with 64-bit block counter from 0, the seed as key (little-endian in bytes 0-7, the
    /// rest 0) and the index as stream; each germ is ((next 64 bits >> 11) + ½) 2⁻⁵³.
    pub fn draw(seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, index);
        Self(std::array::from_fn(|_| uniform(rng.next_u64())))
    }

    /// Returns the first germ that [`Germs::draw`] draws, that of entry 11.
    pub(crate) fn first(seed: u64, index: u64) -> f64 {
        uniform(stream(seed, index).next_u64())
    }

    /// Returns the germs that follow those of [`Germs::draw`]: those of the realization's setup.
    pub(crate) fn of_setup<const COUNT: usize>(seed: u64, index: u64) -> [f64; COUNT] {
        let mut rng = stream(seed, index);
        // ChaCha20 counts words of 32 bits.
        rng.set_word_pos(2 * GERMS as u128);
        std::array::from_fn(|_| uniform(rng.next_u64()))
    }

    /// Makes each germ from the highest 53 of 64 bits, as [`Germs::draw`] does.
    pub(crate) fn from_bits(bits: [u64; GERMS]) -> Self {
        Self(bits.map(uniform))
    }

    /// Takes germs from another source (a low-discrepancy sequence, a test); `None` if one of them
    /// is outside (0, 1).
    pub fn new(germs: [f64; GERMS]) -> Option<Self> {
        germs.iter().all(|&u| u > 0.0 && u < 1.0).then_some(Self(germs))
    }

    /// Returns the germs, by rows of L_G.
    pub fn values(&self) -> &[f64; GERMS] {
        &self.0
    }
}

fn stream(seed: u64, index: u64) -> ChaCha20Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    let mut rng = ChaCha20Rng::from_seed(key);
    rng.set_stream(index);
    rng
}

/// Returns ((bits >> 11) + ½) 2⁻⁵³. The largest of these numbers, 1 - 2⁻⁵⁴, is not a double and
/// would round to 1; it becomes the largest double below 1.
pub(crate) fn uniform(bits: u64) -> f64 {
    const STEP: f64 = 1.0 / (1u64 << 53) as f64;
    (((bits >> 11) as f64 + 0.5) * STEP).min(BELOW_ONE)
}

impl ElasticityLaw {
    /// Creates the law with this mean and dispersion δ, 0 < δ < √(7/11).
    ///
    /// # Errors
    /// If the dispersion is outside its range.
    pub fn new(mean: &Elasticity, dispersion: f64) -> Result<Self, LawError> {
        if !(dispersion > 0.0 && dispersion < DISPERSION_MAX) {
            return Err(LawError::Dispersion { value: dispersion });
        }
        let square = dispersion * dispersion;
        Ok(Self {
            factor: mean.cholesky(),
            sigma: dispersion / 7.0_f64.sqrt(),
            diagonal: std::array::from_fn(|j| {
                let shape = 3.5 / square - 0.5 * j as f64;
                let mean_square = 1.0 - j as f64 * square / 7.0;
                Diagonal { mean_square, shape, gamma: GammaQuantile::new(shape) }
            }),
        })
    }

    /// Returns the realization `[C]` for these germs, Pa; it is symmetric to the bit.
    ///
    /// # Errors
    /// If rounding destroys positive definiteness: for germs at the very edge of (0, 1) at a large
    /// dispersion, or for a mean that is itself nearly singular.
    pub fn realize(&self, germs: &Germs) -> Result<Elasticity, NotElastic> {
        realize(&self.triangle(germs), &self.factor)
    }

    /// Returns a function from a mean elasticity to its realization with these germs and the dispersion of
    /// this law; `[G]` is computed once for all means.
    pub fn realize_about(
        &self,
        germs: &Germs,
    ) -> impl Fn(&Elasticity) -> Result<Elasticity, NotElastic> + use<> {
        let triangle = self.triangle(germs);
        move |mean| realize(&triangle, &mean.cholesky())
    }

    /// Returns c1111 = C11, Pa, of the realization whose germ of entry 11 is `germ`. As [L] and
    /// [L_G] are upper triangular, it depends on no other germ. The bits are those of
    /// [`ElasticityLaw::realize`].
    pub(crate) fn c1111(&self, germ: f64) -> f64 {
        let root = self.diagonal[0].entry(germ) * self.factor[0][0];
        root * root
    }

    /// Returns mean, √Pa, and variance, Pa, of √c1111 under the law: c1111 is its mean times the
    /// square of entry 11 of `[L_G]`, that is times V₁/α₁.
    pub(crate) fn root_c1111_moments(&self) -> (f64, f64) {
        let (mean, variance) = root_gamma_moments(self.diagonal[0].shape);
        let root = self.factor[0][0];
        (root * mean, root * root * variance)
    }

    /// `[L_G]`.
    fn triangle(&self, germs: &Germs) -> [[f64; 6]; 6] {
        let mut triangle = [[0.0; 6]; 6];
        let mut germs = germs.0.iter();
        for (j, (row, diagonal)) in triangle.iter_mut().zip(&self.diagonal).enumerate() {
            for (k, (entry, &u)) in row.iter_mut().skip(j).zip(germs.by_ref()).enumerate() {
                *entry = if k == 0 {
                    diagonal.entry(u)
                } else {
                    self.sigma * standard_normal_quantile(u)
                };
            }
        }
        triangle
    }
}

impl Diagonal {
    /// Returns the entry with this germ.
    fn entry(&self, germ: f64) -> f64 {
        (self.mean_square * self.gamma.relative_quantile(germ)).sqrt()
    }
}

/// Returns `[C]` for a triangle `[L_G]` and the factor `[L]` of a mean.
fn realize(triangle: &[[f64; 6]; 6], factor: &[[f64; 6]; 6]) -> Result<Elasticity, NotElastic> {
    // [C] = [M]ᵀ [M] with [M] = [L_G] [L], upper triangular.
    let m = multiply_triangular(triangle, factor);
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

/// Multiplies two upper triangular matrices; sums run in ascending order of the inner index.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::EngineeringConstants;

    fn optimum() -> Elasticity {
        EngineeringConstants {
            longitudinal_young_modulus: 17.717e9,
            longitudinal_poisson_ratio: 0.3816,
            longitudinal_shear_modulus: 4.795e9,
            transverse_young_modulus: 9.8254e9,
            transverse_poisson_ratio: 0.4495,
        }
        .elasticity()
        .unwrap()
    }

    /// Seed, index and germs from an independent ChaCha20 in Python (64-bit counter and 64-bit
    /// stream, checked against the first block of the published all-zero vector).
    const PINNED: [(u64, u64, [f64; GERMS]); 3] = [
        (
            0,
            0,
            [
                0.5634451882632474,
                0.15914191768880798,
                0.1051872746830676,
                0.7775492397603869,
                0.551885087388972,
                0.2159858178928294,
                0.11183310066255198,
                0.5249928651407689,
                0.47742184012795624,
                0.050906029410355325,
                0.41171093485914784,
                0.9276570198692999,
                0.26292268104419386,
                0.8329139027484425,
                0.2733618209969106,
                0.4347759064103616,
                0.8805564874552376,
                0.4594788609618429,
                0.7749454666860005,
                0.3660221493812755,
                0.060020156066653174,
            ],
        ),
        (
            1,
            2746,
            [
                0.07937437617117588,
                0.9255446963372209,
                0.7562714785190661,
                0.5718036126137751,
                0.7790555496006737,
                0.20573790882897464,
                0.5222901014747203,
                0.6008663502210216,
                0.5418841478098133,
                0.3077564070877015,
                0.46482176933229075,
                0.5926249284571914,
                0.47589025210639596,
                0.39804204767072354,
                0.7249670778292439,
                0.3518064035541066,
                0.7992753258144896,
                0.730808776059757,
                0.3179173187922955,
                0.05397360116911237,
                0.943284848860747,
            ],
        ),
        (
            (1 << 63) - 1,
            (1 << 40) + 7,
            [
                0.43135465896499653,
                0.2739039013501862,
                0.909419097282937,
                0.8109432854144503,
                0.06834990056246754,
                0.21898270611433351,
                0.7232379190159126,
                0.38706138557805886,
                0.9511909867300654,
                0.9753611111313458,
                0.6619384475106669,
                0.2527549534458448,
                0.5390836376323269,
                0.0990549865268921,
                0.3798545925808566,
                0.24891071055363717,
                0.4270159269908205,
                0.8553133392866408,
                0.6490787987726276,
                0.33016336474624236,
                0.9390131258356691,
            ],
        ),
    ];

    #[test]
    fn germs_are_those_of_an_independent_chacha20() {
        for (seed, index, expected) in PINNED {
            assert_eq!(Germs::draw(seed, index).values(), &expected, "({seed}, {index})");
        }
    }

    #[test]
    fn setup_germs_continue_the_stream() {
        let mut rng = stream(5, 17);
        let all: Vec<f64> = (0..GERMS + 4).map(|_| uniform(rng.next_u64())).collect();
        assert_eq!(all[..GERMS], *Germs::draw(5, 17).values());
        assert_eq!(all[GERMS..], Germs::of_setup::<4>(5, 17));
    }

    #[test]
    fn every_germ_lies_inside_the_unit_interval() {
        for (bits, expected) in [
            (0, 1.0 / (1u64 << 54) as f64),
            ((1 << 11) - 1, 1.0 / (1u64 << 54) as f64),
            (1 << 63, 0.5),
            (u64::MAX, BELOW_ONE),
            (u64::MAX - (1 << 11), 1.0 - f64::EPSILON),
        ] {
            assert_eq!(uniform(bits), expected, "{bits:#x}");
        }
        let mut germs = [0.5; GERMS];
        assert!(Germs::new(germs).is_some());
        for outside in [0.0, 1.0, -0.1, 1.1, f64::NAN] {
            germs[20] = outside;
            assert_eq!(Germs::new(germs), None, "{outside}");
        }
    }

    #[test]
    fn germs_go_by_rows_of_the_triangle() {
        let law = ElasticityLaw::new(&optimum(), 0.3).unwrap();
        let middle = law.triangle(&Germs([0.5; GERMS]));
        let entries = (0..6).flat_map(|j| (j..6).map(move |k| (j, k)));
        for (germ, entry) in entries.enumerate() {
            let mut germs = [0.5; GERMS];
            germs[germ] = 0.9;
            let triangle = law.triangle(&Germs(germs));
            for j in 0..6 {
                for k in 0..6 {
                    let moved = triangle[j][k] > middle[j][k];
                    assert_eq!(moved, (j, k) == entry, "germ {germ}, entry ({j},{k})");
                    assert!(moved || triangle[j][k] == middle[j][k]);
                }
            }
        }
    }

    /// Off the diagonal σ U; on it σ √(2 V_j), with V_j from the quantile function of its shape.
    #[test]
    fn entries_are_the_quantiles_of_the_papers_laws() {
        for dispersion in [0.02, 0.1029, 0.5, 0.79] {
            let germs = Germs::draw(9, 9);
            let triangle = ElasticityLaw::new(&optimum(), dispersion).unwrap().triangle(&germs);
            let sigma = dispersion / 7.0_f64.sqrt();
            let mut germs = germs.values().iter();
            for (j, row) in triangle.iter().enumerate() {
                for (k, entry) in row.iter().enumerate().skip(j) {
                    let u = *germs.next().unwrap();
                    let expected = if j == k {
                        let shape = 7.0 / (2.0 * dispersion * dispersion) - 0.5 * j as f64;
                        sigma * (2.0 * GammaQuantile::new(shape).quantile(u)).sqrt()
                    } else {
                        sigma * standard_normal_quantile(u)
                    };
                    let error = (entry - expected).abs();
                    assert!(error < 1e-14 * expected.abs(), "δ {dispersion}, ({j},{k})");
                }
            }
        }
    }

    #[test]
    fn without_dispersion_the_realization_is_the_mean() {
        let mean = optimum();
        for dispersion in [f64::MIN_POSITIVE, 1e-200, 1e-17] {
            let law = ElasticityLaw::new(&mean, dispersion).unwrap();
            let drawn = law.realize(&Germs::draw(1, 0)).unwrap();
            for i in 0..6 {
                for j in 0..6 {
                    let error = (drawn.rows()[i][j] - mean.rows()[i][j]).abs();
                    assert!(error < 1e-15 * mean.rows()[0][0], "δ {dispersion:e} ({i},{j})");
                }
            }
        }
    }

    #[test]
    fn extreme_germs_give_an_elasticity_or_say_that_it_is_none() {
        let ends = [1.0 / (1u64 << 54) as f64, BELOW_ONE];
        for dispersion in [0.1, 0.79] {
            let law = ElasticityLaw::new(&optimum(), dispersion).unwrap();
            for pattern in 0..1u32 << 12 {
                let end = |germ: usize| ends[(pattern.rotate_left(germ as u32) & 1) as usize];
                match law.realize(&Germs(std::array::from_fn(end))) {
                    Ok(drawn) => assert!(drawn.rows()[0][0] > 0.0),
                    Err(error) => {
                        assert!(matches!(error, NotElastic::NotPositiveDefinite { .. }), "{error}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_dispersion_outside_its_range_is_refused() {
        assert_eq!(DISPERSION_MAX, (7.0_f64 / 11.0).sqrt());
        for value in [0.0, -0.1, DISPERSION_MAX, 1.0, f64::NAN, f64::INFINITY] {
            let message = ElasticityLaw::new(&optimum(), value).unwrap_err().to_string();
            assert!(message.starts_with(&format!("dispersion is {value};")), "{message}");
        }
        assert!(ElasticityLaw::new(&optimum(), DISPERSION_MAX.next_down()).is_ok());
    }
}
