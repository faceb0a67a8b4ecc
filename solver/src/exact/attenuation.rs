//! Replaces attenuated materials by ones without attenuation at another complex frequency.
//!
//! Attenuation multiplies all moduli of a material by m(s). Its equations, divided by m, are those
//! without attenuation at s/√m in place of s. So both have the same wavenumbers, and with attenuation
//! the tractions are m times as large.

use std::f64::consts::TAU;

use osteon_common::attenuation::Attenuation;
use osteon_common::layers::Layers;

use crate::complex::Complex;

/// The complex frequencies at which layers without attenuation have the waves that the attenuated ones
/// have at one complex frequency s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LosslessFrequencies {
    /// s/√m(s) of the coupling, 1/s.
    pub(crate) coupling: Complex,
    /// s/√m(s) of the bone, 1/s.
    pub(crate) bone: Complex,
    /// s/√m(s) of the marrow, 1/s.
    pub(crate) marrow: Complex,
    /// 1/m(s) of the bone: what tractions are multiplied by.
    pub(crate) bone_compliance: Complex,
}

impl LosslessFrequencies {
    /// Computes the frequencies for `s` (1/s, real part above 0).
    pub(crate) fn at(layers: &Layers, s: Complex) -> Self {
        let bone = lossless(&layers.bone_attenuation, s);
        let bone_compliance = match layers.bone_attenuation.quality_factor {
            None => Complex::new(1.0, 0.0),
            Some(_) => {
                let ratio = bone / s;
                ratio * ratio
            }
        };
        Self {
            coupling: lossless(&layers.coupling.attenuation, s),
            bone,
            marrow: lossless(&layers.marrow.attenuation, s),
            bone_compliance,
        }
    }
}

/// Returns s/√m(s), 1/s: the complex frequency at which the same material without attenuation has the
/// waves that it has at `s`.
fn lossless(attenuation: &Attenuation, s: Complex) -> Complex {
    let exponent = attenuation.exponent();
    if exponent == 0.0 {
        return s;
    }
    let ratio = s.scale(1.0 / (TAU * attenuation.reference_frequency));
    let log = Complex::new(libm::log(ratio.abs()), libm::atan2(ratio.im, ratio.re));
    s * log.scale(-exponent).exp()
}
