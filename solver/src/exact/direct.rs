//! The direct wave of a line source in an unbounded fluid, in closed form:
//! p̂(r, s) = ρ/(2π) K0(s r/c) F(s).
//!
//! It is added in the frequency domain, so that a trace is as a whole the response to one pulse:
//! the given one, cut smoothly at the band's end.

use std::f64::consts::{LN_2, PI};

use crate::complex::Complex;

/// Largest step of the quadrature; its error is exp(-(π/step)²).
const STEP_MAX: f64 = 0.14;
/// Beyond this the integrand is below 1e-19 of its start.
const RANGE: f64 = 6.6;
/// Up to this |z| the series about 0 is taken: the steps of the quadrature shrink as √|z|.
const SERIES_END: f64 = 0.01;
/// Its terms fall as (|z|/2)^(2j)/(j!)²: the first one left out is below 1e-20.
const SERIES_TERMS: u32 = 4;
/// Euler's constant γ.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Pressure over F at complex frequency `s` (1/s, real part above 0) of a wave that needs `travel`
/// (s, above 0) from the source, in a fluid of density `density` (kg/m³). At the source itself it
/// is infinite.
pub(crate) fn pressure(density: f64, travel: f64, s: Complex) -> Complex {
    bessel_k0(s.scale(travel)).scale(density / (2.0 * PI))
}

/// The modified Bessel function K0(z), real part of z above 0.
fn bessel_k0(z: Complex) -> Complex {
    if z.abs() <= SERIES_END { k0_near_zero(z) } else { k0_by_quadrature(z) }
}

/// K0(z) = Σ (z²/4)^j/(j!)² (H_j - γ - ln(z/2)) with H_j = 1 + 1/2 + … + 1/j: Abramowitz and
/// Stegun, Handbook of Mathematical Functions, 9.6.13.
fn k0_near_zero(z: Complex) -> Complex {
    let modulus = libm::hypot(z.re, z.im);
    let log = Complex::new(libm::log(modulus) - LN_2, libm::atan2(z.im, z.re));
    let quarter = (z * z).scale(0.25);
    let mut bracket = Complex::new(-EULER_GAMMA, 0.0) - log;
    let (mut power, mut sum) = (Complex::new(1.0, 0.0), bracket);
    for j in (1..SERIES_TERMS).map(f64::from) {
        power = (power * quarter).scale(1.0 / (j * j));
        bracket.re += 1.0 / j;
        sum = sum + power * bracket;
    }
    sum
}

/// K0(z) = 2 e^(-z) ∫ e^(-v²) / √(v² + 2z) dv over v > 0, by the trapezoidal rule, which converges
/// exponentially: as exp(-2π d/step) with the distance d ≥ √|z| of the integrand's branch points
/// from the real axis. For |z| above [`SERIES_END`] it has at most 472 terms.
fn k0_by_quadrature(z: Complex) -> Complex {
    let step = STEP_MAX * z.abs().sqrt().min(1.0);
    let two_z = z.scale(2.0);
    let one = Complex::new(1.0, 0.0);
    let mut sum = (one / two_z.sqrt()).scale(0.5);
    let mut v = step;
    while v < RANGE {
        let square = v * v;
        let root = (two_z + Complex::new(square, 0.0)).sqrt();
        sum = sum + (one / root).scale(libm::exp(-square));
        v += step;
    }
    ((-z).exp() * sum).scale(2.0 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn k0_agrees_with_an_independent_library() {
        // mpmath.besselk(0, z) with 30 digits.
        let cases = [
            (Complex::new(1e-40, 0.0), Complex::new(92.21933523542024, 0.0)),
            (Complex::new(1e-15, 1e-12), Complex::new(27.74695213158721, -1.5697963271282297)),
            (Complex::new(2e-4, -6e-3), Complex::new(5.231316980851951, 1.5374577702392583)),
            (Complex::new(9.9e-3, 0.0), Complex::new(4.73129246598806, 0.0)),
            (Complex::new(1e-3, 9.9e-3), Complex::new(4.725944773327369, -1.4700636768685103)),
            (Complex::new(0.02, 0.0), Complex::new(4.028457330358716, 0.0)),
            (Complex::new(0.02, 0.3), Complex::new(1.2705793431684278, -1.4638595353629507)),
            (Complex::new(0.5, 0.0), Complex::new(0.9244190712276659, 0.0)),
            (Complex::new(0.5, 4.0), Complex::new(-0.006886823364506452, 0.3759071978881295)),
            (Complex::new(3.0, 1.0), Complex::new(0.013830675060516719, -0.030989778540318227)),
            (
                Complex::new(5.5, 90.0),
                Complex::new(-0.0005061557107320798, -0.00018630523673302207),
            ),
            (
                Complex::new(12.0, 700.0),
                Complex::new(-2.851464643900798e-07, 5.824371130829016e-08),
            ),
        ];
        for (z, expected) in cases {
            let error = (bessel_k0(z) - expected).abs() / expected.abs();
            assert!(error < 1e-13, "{z:?}: {error:e}");
        }
    }

    #[test]
    fn series_and_quadrature_meet() {
        for angle in [-1.5, -0.7, 0.0, 0.3, 1.55] {
            let (sin, cos) = libm::sincos(angle);
            let z = Complex::new(SERIES_END * cos, SERIES_END * sin);
            let (series, quadrature) = (k0_near_zero(z), k0_by_quadrature(z));
            let error = (series - quadrature).abs() / series.abs();
            assert!(error < 1e-13, "{angle}: {error:e}");
        }
    }
}
