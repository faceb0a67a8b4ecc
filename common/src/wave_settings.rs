//! Which guided waves are found in a probe's signals, and where: the section `[waves]` of a probe file.

use crate::accepted::Interval;
use crate::fields::{Fields, Key, Number, Section};
use crate::observables::Observable;

/// Maximum number of frequencies.
const FREQUENCIES_MAX: usize = 64;
/// Default of the threshold: -40 dB.
const THRESHOLD: f64 = 0.01;

/// Guided waves that are found in signals.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveSettings {
    /// Frequencies, Hz, at which phase velocities are found; empty: that of the probe's guided waves.
    pub frequencies: Vec<f64>,
    /// Lowest and highest phase velocity of A0, m/s; empty: A0 is not looked for.
    pub a0: Vec<f64>,
    /// The same of S0.
    pub s0: Vec<f64>,
    /// Smallest singular value, relative to the largest of the same frequency, whose vector is one of waves.
    pub threshold: f64,
}

impl WaveSettings {
    /// Name of the section.
    pub const KEY: Key = Key { name: "waves", meaning: "which guided waves are found, and where" };

    /// Returns the waves that are looked for, with their lowest and highest phase velocity, m/s.
    pub fn wanted(&self) -> Vec<(Observable, [f64; 2])> {
        let both = [(Observable::A0Velocity, &self.a0), (Observable::S0Velocity, &self.s0)];
        let given = both.into_iter().filter_map(|(wave, range)| match range.as_slice() {
            &[low, high] => Some((wave, [low, high])),
            _ => None,
        });
        given.collect()
    }
}

impl Default for WaveSettings {
    fn default() -> Self {
        Self { frequencies: Vec::new(), a0: Vec::new(), s0: Vec::new(), threshold: THRESHOLD }
    }
}

impl Section for WaveSettings {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let frequencies = "frequencies at which phase velocities are found; by default \
                           `probe.guided_wave_frequency`";
        fields.numbers(
            Key { name: "frequencies", meaning: frequencies },
            &mut self.frequencies,
            Interval::above(0.0, "Hz"),
            FREQUENCIES_MAX,
        );
        let velocity = Interval::from_to(10.0, 1e5, "m/s");
        let a0 =
            "lowest and highest phase velocity that A0 may have; without it A0 is not looked for";
        fields.numbers(Key { name: "a0", meaning: a0 }, &mut self.a0, velocity, 2);
        let s0 = "the same for S0";
        fields.numbers(Key { name: "s0", meaning: s0 }, &mut self.s0, velocity, 2);
        let threshold = "smallest singular value, relative to the largest at the same frequency, that is taken \
                         for one of waves";
        fields.number(
            Key { name: "threshold", meaning: threshold },
            &mut self.threshold,
            Number::within(Interval::above_to(0.0, 1.0, "")),
        );
    }
}
