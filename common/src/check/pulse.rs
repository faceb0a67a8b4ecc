//! Rules on the pulse of a probe.

use crate::accepted::Interval;
use crate::probe::Probe;
use crate::pulse::{PulseForm, TONE_CYCLES};
use crate::violations::Violations;

use super::value::{known_wrong, number};

/// Ratios of a measured pulse's mean frequency to the probe's centre frequency that are accepted.
const FREQUENCY_RATIO: Interval = Interval::from_to(0.67, 1.5, "");
/// Largest ratio of the band of a measured pulse to that of the paper's.
const BANDWIDTH_MAX: f64 = 2.0;
/// Largest time, in periods of the centre frequency, by which a measured pulse may end later than the paper's.
const LATENESS_MAX: f64 = 8.0;

/// Checks the number of a tone, and that samples have the centre frequency that is said of them.
pub(super) fn pulse(probe: &Probe, violations: &mut Violations) {
    const FIELD: &str = PulseForm::KEY.name;
    let (field, frequency) = (format!("probe.{FIELD}"), probe.center_frequency);
    let samples = match &probe.pulse {
        PulseForm::Paper | PulseForm::Ricker => return,
        PulseForm::Tone { cycles } => {
            return number(&format!("{field}.tone"), *cycles, TONE_CYCLES, violations);
        }
        PulseForm::Samples(samples) => samples,
    };
    if known_wrong("probe.center_frequency", violations) || known_wrong(&field, violations) {
        return;
    }
    let (mean, last) = (samples.mean_frequency(), samples.last_frequency());
    let lateness = probe.pulse.lateness(frequency);
    let message = if !FREQUENCY_RATIO.contains(mean / frequency) {
        format!(
            "has a mean frequency of {mean:.3e} Hz, and probe.center_frequency is {frequency:?}; set that to \
             about the mean frequency"
        )
    } else if probe.pulse.bandwidth(frequency) > BANDWIDTH_MAX {
        format!(
            "has frequencies of up to {last:.3e} Hz above 1 % of its spectrum's peak, too many for \
             probe.center_frequency = {frequency:?}; filter the samples"
        )
    } else if lateness > LATENESS_MAX {
        format!(
            "is over {lateness:.1} periods later than the paper's, and may be {LATENESS_MAX}; leave out \
             samples before its beginning, or cut what follows its end"
        )
    } else {
        return;
    };
    violations.add(field, message);
}
