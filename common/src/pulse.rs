//! The form of the source's pulse, and how samplings, which are made for the paper's pulse, change with it.
//!
//! The values of a pulse of a formula are in the solver, those of a pulse of samples in
//! [`crate::pulse_samples`].

use crate::accepted::Interval;
use crate::fields::Key;
use crate::pulse_samples::PulseSamples;

/// Cycles that a tone may have. With one, it is a wave of one peak and one trough; the first extremum of
/// one with more than six is too small beside the waves that follow it.
pub const TONE_CYCLES: Interval = Interval::from_to(1.0, 6.0, "cycles");
/// Cycles of the paper's pulse.
const PAPER_CYCLES: f64 = 2.0;
/// Middle of the Ricker pulse, in periods: so late that the pulse starts at 6e-6 of its amplitude.
pub const RICKER_MIDDLE: f64 = 1.25;
/// Time of the first extremum of the paper's pulse, in periods.
const PAPER_FIRST: f64 = 0.359;
/// Time by which the first extremum of the Ricker pulse is later, in periods: 0.860 - 0.359.
const RICKER_DELAY: f64 = 0.5;
/// Ratio of the frequencies above which the spectra of the Ricker pulse and of the paper's are less than
/// a hundredth of their peaks, rounded up from 1.16.
const RICKER_BANDWIDTH: f64 = 1.2;
/// Ratio, to the centre frequency, of the frequency from which on the paper's spectrum is less than a
/// hundredth of its peak. The spectrum of a tone of n cycles falls to this level at 2/n of the paper's distance
/// above the centre frequency.
const PAPER_END: f64 = 2.38;

/// The form of a pulse: everything about it but centre frequency and amplitude.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum PulseForm {
    /// The paper's: a tone of two cycles.
    #[default]
    Paper,
    /// A sine that starts at t = 0, under a Gaussian.
    Tone {
        /// Cycles n, [`TONE_CYCLES`]: the Gaussian is exp(-4 (2 fc t/n - 1)²), which is largest after n/2 cycles
        /// and e⁻⁴ of that at t = 0 and after n cycles.
        cycles: f64,
    },
    /// The second derivative of a Gaussian: a peak between two troughs.
    Ricker,
    /// A measured pulse.
    Samples(PulseSamples),
}

impl PulseForm {
    /// The key of a probe that has it.
    pub const KEY: Key = Key {
        name: "pulse",
        meaning: "form of the pulse: `\"paper\"`, `\"ricker\"`, a tone `{ tone = 3.0 }` of 1 to 6 cycles, or \
                  measured: `{ file = \"pulse.csv\" }`, or `{ step = 2e-8, samples = [0.0, …] }` with the step in s \
                  ([physics.md](physics.md#the-pulse) has formulas and rules)",
    };
    /// The forms without a number, by their names in files.
    pub const NAMED: [(&str, Self); 2] = [("paper", Self::Paper), ("ricker", Self::Ricker)];

    /// Returns the number of cycles of the tone that the pulse is; `None` if it is none.
    pub fn tone_cycles(&self) -> Option<f64> {
        match self {
            Self::Paper => Some(PAPER_CYCLES),
            Self::Tone { cycles } => Some(*cycles),
            Self::Ricker | Self::Samples(_) => None,
        }
    }

    /// Returns the ratio of the band that the pulse needs to that of the paper's pulse of this centre
    /// frequency, Hz; at least 1.
    pub fn bandwidth(&self, center_frequency: f64) -> f64 {
        match self {
            Self::Ricker => RICKER_BANDWIDTH,
            Self::Tone { cycles } if *cycles < PAPER_CYCLES => {
                (1.0 + (PAPER_END - 1.0) * PAPER_CYCLES / cycles) / PAPER_END
            }
            // A longer tone has a narrower spectrum, but the same tail of the kink at t = 0, which decides.
            Self::Paper | Self::Tone { .. } => 1.0,
            Self::Samples(samples) => {
                (samples.last_frequency() / (PAPER_END * center_frequency)).max(1.0)
            }
        }
    }

    /// Returns the time by which the first extremum is later than that of the paper's pulse of this centre
    /// frequency (Hz), in its periods; at least 0.
    pub fn delay(&self, center_frequency: f64) -> f64 {
        match self {
            Self::Paper | Self::Tone { .. } => 0.0,
            Self::Ricker => RICKER_DELAY,
            Self::Samples(samples) => {
                (samples.first_extremum() * center_frequency - PAPER_FIRST).max(0.0)
            }
        }
    }

    /// Returns the time by which the pulse ends later than the paper's of this centre frequency (Hz), in its
    /// periods: where it has fallen to e⁻⁴ of its largest value. At least [`PulseForm::delay`].
    pub fn lateness(&self, center_frequency: f64) -> f64 {
        match self {
            Self::Samples(samples) => {
                let late = samples.end() * center_frequency - PAPER_CYCLES;
                late.max(self.delay(center_frequency))
            }
            _ => self.tone_cycles().map_or(RICKER_DELAY, |cycles| (cycles - PAPER_CYCLES).max(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samplings_change_only_with_the_pulse() {
        let tone = |cycles| PulseForm::Tone { cycles };
        for (form, bandwidth, delay, lateness) in [
            (PulseForm::Paper, 1.0, 0.0, 0.0),
            (tone(2.0), 1.0, 0.0, 0.0),
            (tone(5.0), 1.0, 0.0, 3.0),
            // A hundredth at 1 + 2 · 1.38 centre frequencies.
            (tone(1.0), 3.76 / 2.38, 0.0, 0.0),
            (PulseForm::Ricker, 1.2, 0.5, 0.5),
        ] {
            assert_eq!((form.delay(1e6), form.lateness(1e6)), (delay, lateness), "{form:?}");
            assert!((form.bandwidth(1e6) - bandwidth).abs() < 1e-15, "{form:?}");
        }
    }
}
