//! The gamma quantile for shapes of at least 3, however large.
//!
//! Notation: shape a, variable x = a eᵗ, h(t) = eᵗ - 1 - t, η = ± √(2h) with the sign of t
//! (N. M. Temme, "The asymptotic expansion of the incomplete gamma functions", SIAM J. Math. Anal.
//! 10 (1979); DLMF 8.12). In the variable t nothing cancels, neither for x/a of 1e-6 nor for
//! x/a - 1 of 1e-7: the density of t is √(a/2π) exp(-a h(t)) / Γ*(a), Γ* the scaled gamma function
//! of [`ln_scaled_gamma`].
//!
//! The quantile is Temme's asymptotic inversion followed by two Halley steps on the logarithm of
//! the smaller tail. The number of steps is fixed, and the steps end within rounding of the exact
//! quantile whatever branch was taken on the way, so the result is continuous in u and in the
//! shape up to rounding.

use crate::special::standard_normal_quantile;

/// Shape from which a tail is computed by the uniform expansion.
const UNIFORM_SHAPE: f64 = 64.0;
/// Largest shape told apart from the limit, where x/a = 1.
const SHAPE_MAX: f64 = 1e300;
/// Halley steps. The first guess is within 1 % of x, so that the second step ends below 1e-16.
const HALLEY_STEPS: usize = 2;
/// Most terms of the series of the lower tail; 80 are the most that it takes.
const SERIES_TERMS_MAX: u32 = 400;
/// Depth of the continued fraction of the upper tail; 35 are enough for 2e-17 at every
/// x not below the median and every shape from 3 to [`UNIFORM_SHAPE`].
const FRACTION_DEPTH: u32 = 44;
/// ½ ln 2π.
const HALF_LN_TWO_PI: f64 = 0.918_938_533_204_672_7;
/// √(2π).
const SQRT_TWO_PI: f64 = 2.506_628_274_631_000_5;

/// Taylor coefficients f_n of f(η) = η / (eᵗ - 1) = dt/dη; the radius of convergence is 2√π.
///
/// By the recurrence that a test of this module repeats, in 40 digits with mpmath.
const F: [f64; 33] = [
    1.0,
    -0.333_333_333_333_333_3,
    0.083_333_333_333_333_33,
    -0.014_814_814_814_814_815,
    0.001_157_407_407_407_407_3,
    0.000_352_733_686_067_019_4,
    -0.000_178_755_144_032_921_8,
    3.919_263_178_522_438e-5,
    -2.185_448_510_679_992e-6,
    -1.854_062_210_715_16e-6,
    8.296_711_340_953_087e-7,
    -1.766_595_273_682_607_8e-7,
    6.707_853_543_401_498e-9,
    1.026_180_978_424_030_9e-8,
    -4.382_036_018_453_353e-9,
    9.147_699_582_236_79e-10,
    -2.551_419_399_494_624_8e-11,
    -5.830_772_132_550_426e-11,
    2.436_194_802_066_741_5e-11,
    -5.027_669_280_114_175_5e-12,
    1.100_439_203_195_613_5e-13,
    3.371_763_262_400_985e-13,
    -1.392_388_722_418_162e-13,
    2.853_489_380_704_744_5e-14,
    -5.139_111_834_242_572e-16,
    -1.975_228_829_434_944_2e-15,
    8.099_521_156_704_561e-16,
    -1.652_253_121_639_816_2e-16,
    2.530_543_009_747_888_3e-18,
    1.168_693_973_855_957_6e-17,
    -4.770_037_049_820_485e-18,
    9.699_126_059_056_237e-19,
    -1.293_256_553_803_817_5e-20,
];

/// Taylor coefficients of Temme's ε₁(η) = ln(f(η)) / η, the first correction of the inversion.
const EPSILON: [f64; 7] = [
    -0.333_333_333_333_333_3,
    0.027_777_777_777_777_776,
    0.000_617_283_950_617_283_9,
    -0.001_080_246_913_580_246_8,
    0.000_275_573_192_239_858_9,
    -2.874_126_967_927_885_7e-5,
    -6.185_109_601_280_58e-6,
];

/// The quantile function of the gamma law of one shape and scale 1: right to 4e-15 (relative) for
/// shapes of at least 3 and u from 2⁻⁵⁴ to 1 - 2⁻⁵³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GammaQuantile {
    shape: f64,
    /// ln of √(a/2π) / Γ*(a).
    ln_norm: f64,
    /// β_n: Taylor coefficients in η of Γ*(a) S(η), where the upper tail is
    /// ½ erfc(η √(a/2)) + exp(-a η²/2) S(η) / √(2πa).
    beta: [f64; 32],
    scaled_gamma: f64,
}

/// The smaller tail, on which the equation is solved.
#[derive(Clone, Copy, PartialEq)]
enum Tail {
    Lower,
    Upper,
}

impl GammaQuantile {
    /// The quantile function for a shape of at least 3.
    ///
    /// Below 3 the accuracy is lost gradually; a shape that is not above 0 makes every quantile
    /// NaN.
    pub fn new(shape: f64) -> Self {
        let shape = if shape > 0.0 { shape.min(SHAPE_MAX) } else { f64::NAN };
        let ln_scaled = ln_scaled_gamma(shape);
        Self {
            shape,
            ln_norm: 0.5 * libm::log(shape) - HALF_LN_TWO_PI - ln_scaled,
            beta: uniform_coefficients(shape),
            scaled_gamma: libm::exp(ln_scaled),
        }
    }

    /// The quantile at u, 0 < u < 1; NaN elsewhere.
    pub fn quantile(&self, u: f64) -> f64 {
        self.shape * self.relative_quantile(u)
    }

    /// The quantile at u, 0 < u < 1, over the shape (which is the law's mean): finite and
    /// accurate however large the shape.
    pub fn relative_quantile(&self, u: f64) -> f64 {
        libm::exp(self.log_quantile(u))
    }

    /// t = ln(x/a) at u.
    fn log_quantile(&self, u: f64) -> f64 {
        let (tail, probability) = if u < 0.5 { (Tail::Lower, u) } else { (Tail::Upper, 1.0 - u) };
        let ln_probability = libm::log(probability);
        let mut t = self.first_guess(standard_normal_quantile(u));
        for _ in 0..HALLEY_STEPS {
            t += self.halley_step(t, tail, ln_probability);
        }
        t
    }

    /// Temme's inversion to first order: η = η₀ + ε₁(η₀)/a with η₀ = z/√a, z the normal quantile.
    fn first_guess(&self, z: f64) -> f64 {
        let eta = z / self.shape.sqrt();
        let epsilon = if eta.abs() < 0.5 {
            horner(&EPSILON, eta)
        } else {
            libm::log(eta / libm::expm1(log_ratio(eta))) / eta
        };
        log_ratio(eta + epsilon / self.shape)
    }

    /// Halley's step in t for ln(tail(t)) = `ln_probability`.
    ///
    /// With m = tail / density: d(ln tail)/dt = ± 1/m, and d(ln density)/dt = a - x.
    fn halley_step(&self, t: f64, tail: Tail, ln_probability: f64) -> f64 {
        let exponent = self.shape * excess(t);
        let mills = match (tail, self.shape < UNIFORM_SHAPE) {
            (Tail::Lower, true) => lower_series(self.shape, self.shape * libm::exp(t)),
            (Tail::Upper, true) => upper_fraction(self.shape, self.shape * libm::exp(t)),
            (_, false) => self.uniform(t, tail),
        };
        let residual = self.ln_norm - exponent + libm::log(mills) - ln_probability;
        let sign = if tail == Tail::Lower { 1.0 } else { -1.0 };
        let slope = -self.shape * libm::expm1(t);
        -sign * residual * mills / (1.0 - 0.5 * sign * residual * (slope * mills - sign))
    }

    /// Tail over density by the uniform expansion, which is exact up to the truncation of its
    /// Taylor series: shape at least [`UNIFORM_SHAPE`].
    fn uniform(&self, t: f64, tail: Tail) -> f64 {
        let sqrt_shape = self.shape.sqrt();
        let eta = (2.0 * excess(t)).sqrt().copysign(t);
        let w = eta * sqrt_shape;
        let correction = horner(&self.beta, eta) / sqrt_shape;
        let gaussian = |w: f64| {
            let density_inverse = SQRT_TWO_PI * libm::exp(0.5 * w * w);
            0.5 * libm::erfc(w * std::f64::consts::FRAC_1_SQRT_2) * density_inverse
        };
        match tail {
            Tail::Lower => (self.scaled_gamma * gaussian(-w) - correction) / sqrt_shape,
            Tail::Upper => (self.scaled_gamma * gaussian(w) + correction) / sqrt_shape,
        }
    }
}

/// β_n by Temme's backward recurrence β_{n-1} = f_n + (n+1)/a β_{n+1}, which follows from
/// η S = S'/a + f/Γ* - 1 (N. M. Temme, "On the computation of the incomplete gamma functions for
/// large values of the parameters", Algorithms for Approximation, 1987).
fn uniform_coefficients(shape: f64) -> [f64; 32] {
    let mut beta = [0.0; 32];
    for n in (1..=32).rev() {
        let next = beta.get(n + 1).copied().unwrap_or(0.0);
        beta[n - 1] = F[n] + (n as f64 + 1.0) / shape * next;
    }
    beta
}

/// ln Γ*(a), Γ*(a) = Γ(a) / (√(2π/a) (a/e)ᵃ): Stirling's series, after a shift to at least 16.
fn ln_scaled_gamma(shape: f64) -> f64 {
    // B_2k / (2k (2k-1)), DLMF 5.11.1.
    const STIRLING: [f64; 8] = [
        1.0 / 12.0,
        -1.0 / 360.0,
        1.0 / 1260.0,
        -1.0 / 1680.0,
        1.0 / 1188.0,
        -691.0 / 360_360.0,
        1.0 / 156.0,
        -3617.0 / 122_400.0,
    ];
    const ODD_RECIPROCALS: [f64; 10] = [
        1.0 / 3.0,
        1.0 / 5.0,
        1.0 / 7.0,
        1.0 / 9.0,
        1.0 / 11.0,
        1.0 / 13.0,
        1.0 / 15.0,
        1.0 / 17.0,
        1.0 / 19.0,
        1.0 / 21.0,
    ];
    let mut shifted = shape;
    let mut shift = 0.0;
    while shifted < 16.0 {
        // (s + ½) ln(1 + 1/s) - 1 = y²/3 + y⁴/5 + …, y = 1 / (2s + 1): nothing cancels.
        let y = 1.0 / (2.0 * shifted + 1.0);
        shift += y * y * horner(&ODD_RECIPROCALS, y * y);
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    shift + inverse * horner(&STIRLING, inverse * inverse)
}

/// P(a,x) / (xᵃ e⁻ˣ / Γ(a)) by its series of positive terms, DLMF 8.11.4.
fn lower_series(shape: f64, x: f64) -> f64 {
    let mut term = 1.0 / shape;
    let mut sum = term;
    let mut denominator = shape;
    for _ in 0..SERIES_TERMS_MAX {
        denominator += 1.0;
        term *= x / denominator;
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

/// Q(a,x) / (xᵃ e⁻ˣ / Γ(a)) by Legendre's continued fraction (even part of DLMF 8.9.2), from the
/// bottom up: each division damps the rounding errors of those below it.
fn upper_fraction(shape: f64, x: f64) -> f64 {
    let mut denominator = x - shape + (2.0 * f64::from(FRACTION_DEPTH) + 1.0);
    for n in (1..=FRACTION_DEPTH).rev() {
        let n = f64::from(n);
        denominator = (x - shape + (2.0 * n - 1.0)) + n * (shape - n) / denominator;
    }
    1.0 / denominator
}

/// eᵗ - 1 - t without cancellation.
fn excess(t: f64) -> f64 {
    // 2 / (n+2)!
    const TAYLOR: [f64; 17] = reciprocal_factorials();
    if t.abs() < 1.0 { 0.5 * t * t * horner(&TAYLOR, t) } else { libm::expm1(t) - t }
}

const fn reciprocal_factorials() -> [f64; 17] {
    let mut table = [1.0; 17];
    let mut n = 1;
    let mut factorial = 1.0;
    while n < 17 {
        factorial *= n as f64 + 2.0;
        table[n] = 1.0 / factorial;
        n += 1;
    }
    table
}

/// t with eᵗ - 1 - t = η²/2 and the sign of η, to about 1 %: a start for Halley's method.
fn log_ratio(eta: f64) -> f64 {
    if eta.abs() < 1.5 {
        // The integral of f.
        let mut sum = 0.0;
        for n in (0..14).rev() {
            sum = sum * eta + F[n] / (n as f64 + 1.0);
        }
        return sum * eta;
    }
    let target = 0.5 * eta * eta;
    let mut t = if eta < 0.0 {
        let t = -1.0 - target;
        t + libm::exp(t)
    } else {
        libm::log(1.0 + target + libm::log(1.0 + target))
    };
    let e = libm::expm1(t);
    t -= (e - t - target) / e;
    t
}

/// Polynomial with its constant term first.
fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests;
