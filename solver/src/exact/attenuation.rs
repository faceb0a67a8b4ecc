//! Attenuated materials as ones without attenuation at another complex frequency.
//!
//! If all moduli of a material are multiplied by m(s), its equations are those without attenuation,
//! divided by m, with s/√m in place of s: the wavenumbers are the same, and tractions are m times
//! theirs.

use std::f64::consts::TAU;

use osteon_common::attenuation::Attenuation;

use crate::complex::Complex;

/// Returns s/√m(s), 1/s: the complex frequency at which the same material without attenuation has the
/// waves that it has at `s` (1/s, real part above 0).
pub(crate) fn lossless(attenuation: &Attenuation, s: Complex) -> Complex {
    let exponent = attenuation.exponent();
    if exponent == 0.0 {
        return s;
    }
    let ratio = s.scale(1.0 / (TAU * attenuation.reference_frequency));
    let log = Complex::new(libm::log(ratio.abs()), libm::atan2(ratio.im, ratio.re));
    s * log.scale(-exponent).exp()
}

/// Returns 1/m(s).
pub(crate) fn compliance(attenuation: &Attenuation, s: Complex) -> Complex {
    if attenuation.quality_factor.is_none() {
        return Complex::new(1.0, 0.0);
    }
    let ratio = lossless(attenuation, s) / s;
    ratio * ratio
}
