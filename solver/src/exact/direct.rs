//! The direct wave of a line source in an unbounded fluid, in closed form:
//! p̂(r, s) = ρ/(2π) K0(s r/c) F(s).
//!
//! It is added in the frequency domain, so that a trace is as a whole the response to one pulse:
//! the given one, cut smoothly at the band's end.

use std::f64::consts::PI;

use crate::complex::Complex;

/// Largest step of the quadrature; its error is exp(-(π/step)²).
const STEP_MAX: f64 = 0.14;
/// Beyond this the integrand is below 1e-19 of its start.
const RANGE: f64 = 6.6;

/// Pressure over F at complex frequency `s` (1/s, real part above 0) of a wave that needs `travel`
/// (s, above 0) from the source, in a fluid of density `density` (kg/m³).
pub(crate) fn pressure(density: f64, travel: f64, s: Complex) -> Complex {
    bessel_k0(s.scale(travel)).scale(density / (2.0 * PI))
}

/// The modified Bessel function K0(z), real part of z above 0.
///
/// K0(z) = 2 e^(-z) ∫ e^(-v²) / √(v² + 2z) dv over v > 0, by the trapezoidal rule, which converges
/// exponentially: as exp(-2π d/step) with the distance d ≥ √|z| of the integrand's branch points
/// from the real axis.
fn bessel_k0(z: Complex) -> Complex {
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
}
