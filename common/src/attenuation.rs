//! Attenuation of waves by a constant quality factor.
//!
//! The law is that of E. Kjartansson, Constant Q-wave propagation and attenuation, J. Geophys. Res.
//! 84 (1979) 4737: at the complex frequency s all moduli of a material are multiplied by
//!
//! ```text
//! m(s) = (s/ω0)^(2γ),  γ = atan(1/Q)/π
//! ```
//!
//! which is causal, gives the same loss in each period at every frequency, and leaves the modulus at
//! the reference frequency ω0 as it is. With it velocities rise slowly with frequency, as ω^γ.

use std::f64::consts::PI;

use crate::fields::{Condition, Fields, Key, Number, Section};
use crate::limits::QUALITY_FACTOR_MIN;
use crate::plausible::{FREQUENCY, QUALITY_FACTOR};

/// Ratio, to the pulse's centre frequency, of the frequency whose waves count as the fastest. Waves of
/// higher frequencies arrive earlier, but are weak; what they do to a velocity is part of its estimated
/// error.
const FASTEST: f64 = 4.0;

/// Attenuation of one material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuation {
    /// Quality factor Q; without one, nothing is attenuated.
    pub quality_factor: Option<f64>,
    /// Frequency at which the material's moduli or speed of sound have the given values, Hz.
    pub reference_frequency: f64,
}

impl Default for Attenuation {
    fn default() -> Self {
        Self { quality_factor: None, reference_frequency: 1e6 }
    }
}

impl Section for Attenuation {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let meaning = "quality factor Q: 1/Q is the tangent of the loss angle, the same at every \
                       frequency";
        fields.optional_number(
            Key { name: "quality_factor", meaning },
            &mut self.quality_factor,
            Number::at_least(QUALITY_FACTOR_MIN, &QUALITY_FACTOR),
        );
        let condition = Condition {
            holds: self.quality_factor.is_some(),
            decided_by: "quality_factor",
            description: "with `quality_factor`",
            refusal: "belongs to quality_factor, which is not given; leave it out, or give both"
                .to_owned(),
        };
        fields.only_if(&condition, &mut |fields| {
            let meaning = "frequency at which elasticity or sound speed have the given values";
            fields.number(
                Key { name: "reference_frequency", meaning },
                &mut self.reference_frequency,
                Number::above_zero(&FREQUENCY),
            );
        });
    }
}

impl Attenuation {
    /// Returns γ, the power of the frequency with which velocities rise; 0 without attenuation.
    pub fn exponent(&self) -> f64 {
        self.quality_factor.map_or(0.0, |quality| libm::atan(1.0 / quality) / PI)
    }

    /// Returns the ratio of the highest speed of a wave from a pulse of this centre frequency (Hz) to
    /// the speed at the reference frequency; 1 without attenuation.
    pub fn fastest(&self, center_frequency: f64) -> f64 {
        self.speed(FASTEST * center_frequency)
    }

    /// Returns the ratio of the speed of a wave of this frequency (Hz) to √(modulus/density) at the
    /// reference frequency; 1 without attenuation.
    pub fn speed(&self, frequency: f64) -> f64 {
        let exponent = self.exponent();
        if exponent == 0.0 {
            return 1.0;
        }
        // The phase velocity is 1/Re(1/√M).
        let ratio = frequency / self.reference_frequency;
        libm::pow(ratio, exponent) / libm::cos(0.5 * PI * exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_rise_with_frequency_as_the_quality_factor_says() {
        let check = |quality_factor: Option<f64>, center_frequency: f64, expected: f64| {
            let found = Attenuation { quality_factor, ..Attenuation::default() };
            let fastest = found.fastest(center_frequency);
            assert!((fastest - expected).abs() < 1e-12, "{found:?}: {fastest}");
        };
        check(None, 1e6, 1.0);
        // 4^γ and 1^γ, divided by cos(πγ/2), with γ = atan(1/15)/π.
        check(Some(15.0), 1e6, 1.03038099395401);
        check(Some(15.0), 0.25e6, 1.00055417085371);
        let slower = Attenuation { quality_factor: Some(15.0), reference_frequency: 4e6 };
        assert!((slower.speed(1e6) - 1.00055417085371 / 1.029810303099).abs() < 1e-8);
    }
}
