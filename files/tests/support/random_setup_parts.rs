//! Random attenuations and pulses of a setup.

use osteon_common::attenuation::Attenuation;
use osteon_common::pulse::PulseForm;
use proptest::prelude::*;

pub(crate) fn attenuation() -> impl Strategy<Value = Attenuation> {
    prop::option::of((2.0..1e3, 0.2e6..5e6)).prop_map(|given| match given {
        None => Attenuation::default(),
        Some((quality, reference_frequency)) => {
            Attenuation { quality_factor: Some(quality), reference_frequency }
        }
    })
}

/// Returns a tone.
pub(crate) fn tone(cycles: f64) -> PulseForm {
    PulseForm::Tone { cycles }
}

pub(crate) fn pulse_form() -> impl Strategy<Value = PulseForm> {
    prop_oneof![Just(PulseForm::default()), (1.0..6.0).prop_map(tone), Just(PulseForm::Ricker)]
}
