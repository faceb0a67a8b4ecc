//! Rules on the guided waves that are found in signals.

use crate::violations::Violations;
use crate::wave_settings::WaveSettings;

use super::section::section;

/// Records all violations of `waves`, which is the section `[waves]` of a file.
pub fn waves(waves: &WaveSettings, violations: &mut Violations) {
    section("waves", &mut waves.clone(), &mut WaveSettings::default(), violations);
    for (field, range) in [("waves.a0", &waves.a0), ("waves.s0", &waves.s0)] {
        match range.as_slice() {
            [] => {}
            _ if violations.has_at_or_below(field) => {}
            [low, high] if low < high => {}
            [low, high] => violations.add(
                field,
                format!("is [{low:?}, {high:?}]; its first velocity must be below its second"),
            ),
            _ => violations.add(field, "has one number; it must be [LOWEST, HIGHEST], in m/s"),
        }
    }
    const FREQUENCIES: &str = "waves.frequencies";
    if !waves.frequencies.is_empty() && waves.a0.is_empty() && waves.s0.is_empty() {
        violations
            .add(FREQUENCIES, "names no wave; give its phase velocities, waves.a0 or waves.s0");
    }
    let repeated = |(place, one): (usize, &f64)| waves.frequencies[..place].contains(one);
    if waves.frequencies.iter().enumerate().any(repeated) {
        violations.add(FREQUENCIES, "has a frequency twice");
    }
}
