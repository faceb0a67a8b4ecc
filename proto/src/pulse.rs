//! The form of a pulse as a message.

use osteon_common::pulse::PulseForm;
use osteon_common::pulse_samples::PulseSamples;
use osteon_common::violations::Violations;

use crate::v1::{self, PulseShape};

const FIELD: &str = "probe.pulse";

/// Returns a form as a message.
pub(crate) fn to_message(form: &PulseForm) -> v1::Pulse {
    let (shape, cycles, samples) = match form {
        PulseForm::Paper => (PulseShape::Paper, None, None),
        PulseForm::Tone { cycles } => (PulseShape::Tone, Some(*cycles), None),
        PulseForm::Ricker => (PulseShape::Ricker, None, None),
        PulseForm::Samples(samples) => (PulseShape::Samples, None, Some(samples)),
    };
    v1::Pulse {
        shape: shape.into(),
        cycles,
        step: samples.map(PulseSamples::step),
        samples: samples.map(|samples| samples.values().to_vec()).unwrap_or_default(),
    }
}

/// Returns the form of a message. `None` after recording an unknown shape, a field that is missing or
/// belongs to another shape, or samples that are no pulse.
pub(crate) fn from_message(message: &v1::Pulse, violations: &mut Violations) -> Option<PulseForm> {
    let v1::Pulse { shape, cycles, step, samples } = message;
    let Ok(shape) = PulseShape::try_from(*shape) else {
        violations.add(format!("{FIELD}.shape"), format!("is {shape}, which is not known"));
        return None;
    };
    let is = |of: PulseShape| shape == of;
    let given = [
        ("cycles", cycles.is_some(), is(PulseShape::Tone), PulseShape::Tone),
        ("step", step.is_some(), is(PulseShape::Samples), PulseShape::Samples),
        ("samples", !samples.is_empty(), is(PulseShape::Samples), PulseShape::Samples),
    ];
    let mut complete = true;
    for (field, is_given, is_needed, of) in given {
        if is_given != is_needed {
            let (field, name) = (format!("{FIELD}.{field}"), of.as_str_name());
            let problem = if is_given { "belongs to" } else { "is missing; it is required with" };
            violations.add(field, format!("{problem} the shape {name}"));
            complete = false;
        }
    }
    match shape {
        PulseShape::Unspecified | PulseShape::Paper if complete => Some(PulseForm::Paper),
        PulseShape::Ricker if complete => Some(PulseForm::Ricker),
        PulseShape::Tone if complete => cycles.map(|cycles| PulseForm::Tone { cycles }),
        PulseShape::Samples if complete => {
            match PulseSamples::new(step.unwrap_or_default(), samples) {
                Ok(samples) => Some(PulseForm::Samples(samples)),
                Err(refused) => {
                    violations.add(format!("{FIELD}.samples"), refused.to_string());
                    None
                }
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(message: &v1::Pulse) -> String {
        let mut violations = Violations::new();
        match from_message(message, &mut violations) {
            Some(form) => format!("{form:?}"),
            None => violations.to_string(),
        }
    }

    #[test]
    fn fields_that_are_missing_or_of_another_shape_are_refused() {
        let pulse = |shape: PulseShape| v1::Pulse { shape: shape.into(), ..v1::Pulse::default() };
        for (message, expected) in [
            (pulse(PulseShape::Unspecified), "Paper"),
            (pulse(PulseShape::Ricker), "Ricker"),
            (v1::Pulse { cycles: Some(3.0), ..pulse(PulseShape::Tone) }, "Tone { cycles: 3.0 }"),
            (
                pulse(PulseShape::Tone),
                "probe.pulse.cycles: is missing; it is required with the shape PULSE_SHAPE_TONE",
            ),
            (
                v1::Pulse { step: Some(1e-8), ..pulse(PulseShape::Paper) },
                "probe.pulse.step: belongs to the shape PULSE_SHAPE_SAMPLES",
            ),
            (
                v1::Pulse { shape: 99, ..v1::Pulse::default() },
                "probe.pulse.shape: is 99, which is not known",
            ),
            (
                v1::Pulse { step: Some(1e-8), samples: vec![1.0], ..pulse(PulseShape::Samples) },
                "probe.pulse.samples: has 1 samples; it must have a whole number from 8 to 2048",
            ),
        ] {
            assert_eq!(check(&message), expected);
        }
    }
}
