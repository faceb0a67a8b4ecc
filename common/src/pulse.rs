//! The form of the source's pulse, and how samplings, which are made for the paper's pulse, change with it.
//!
//! Times are in periods of the centre frequency, from the pulse's start on. The values of a pulse are in
//! the solver.

use crate::accepted::Interval;
use crate::fields::{self, Condition, Fields, Key, Number, Section};

fields::choices!(PulseShape);

/// Fewest cycles of a tone: with one, it is a wave of one peak and one trough.
const CYCLES_MIN: f64 = 1.0;
/// Most cycles of a tone: the first extremum of longer ones is too small beside the waves that follow it.
const CYCLES_MAX: f64 = 6.0;
/// Cycles of the paper's pulse.
const PAPER_CYCLES: f64 = 2.0;
/// Middle of the Ricker pulse, in periods: so late that the pulse starts at 6e-6 of its amplitude.
pub const RICKER_MIDDLE: f64 = 1.25;
/// Time by which the first extremum of the Ricker pulse is later than the paper's, in periods: 0.860 - 0.359.
const RICKER_DELAY: f64 = 0.5;
/// Ratio of the frequencies above which the spectra of the Ricker pulse and of the paper's are less than
/// a hundredth of their peaks, rounded up from 1.16.
const RICKER_BANDWIDTH: f64 = 1.2;
/// Ratio, to the centre frequency, of the frequency from which on the paper's spectrum is less than a
/// hundredth of its peak. The spectrum of a tone of n cycles falls to this level at 2/n of the paper's distance
/// above the centre frequency.
const PAPER_END: f64 = 2.38;

/// The shape of a pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PulseShape {
    /// The paper's: a tone of two cycles.
    #[default]
    Paper,
    /// A sine that starts at t = 0, under a Gaussian.
    Tone,
    /// The second derivative of a Gaussian: a peak between two troughs.
    Ricker,
}

impl PulseShape {
    /// All shapes, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Tone, Self::Ricker];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Tone => "tone",
            Self::Ricker => "ricker",
        }
    }
}

/// The form of a pulse: everything about it but centre frequency and amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseForm {
    /// The shape.
    pub shape: PulseShape,
    /// Cycles n of a tone, 1 to 6: its Gaussian is exp(-4 (2 fc t/n - 1)²), which is largest after n/2 cycles
    /// and e⁻⁴ of that at t = 0 and after n cycles. Other shapes have the default.
    pub cycles: f64,
}

impl Default for PulseForm {
    fn default() -> Self {
        Self { shape: PulseShape::Paper, cycles: 3.0 }
    }
}

impl PulseForm {
    /// Returns the number of cycles of the tone that the pulse is; `None` if it is none.
    pub fn tone_cycles(&self) -> Option<f64> {
        match self.shape {
            PulseShape::Paper => Some(PAPER_CYCLES),
            PulseShape::Tone => Some(self.cycles),
            PulseShape::Ricker => None,
        }
    }

    /// Returns the ratio of the band that the pulse needs to that of the paper's pulse; at least 1.
    pub fn bandwidth(&self) -> f64 {
        match self.tone_cycles() {
            None => RICKER_BANDWIDTH,
            Some(cycles) if cycles < PAPER_CYCLES => {
                (1.0 + (PAPER_END - 1.0) * PAPER_CYCLES / cycles) / PAPER_END
            }
            // A longer tone has a narrower spectrum, but the same tail of the kink at t = 0, which decides.
            Some(_) => 1.0,
        }
    }

    /// Returns the time by which the first extremum is later than that of the paper's pulse, in periods.
    pub fn delay(&self) -> f64 {
        if self.tone_cycles().is_some() { 0.0 } else { RICKER_DELAY }
    }

    /// Returns the time by which the pulse ends later than the paper's, in periods.
    pub fn lateness(&self) -> f64 {
        self.tone_cycles().map_or(RICKER_DELAY, |cycles| (cycles - PAPER_CYCLES).max(0.0))
    }
}

impl Section for PulseForm {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let shape = "shape: `\"paper\"`, `\"tone\"`, or `\"ricker\"` \
                     ([physics.md](physics.md#the-pulse) has the formulas)";
        fields.choice(Key { name: "shape", meaning: shape }, &mut self.shape);
        let (given, tone) = (self.shape.name(), PulseShape::Tone.name());
        let condition = Condition {
            holds: self.shape == PulseShape::Tone,
            decided_by: "shape",
            description: "for `\"tone\"`",
            refusal: format!(
                "belongs to the shape \"{tone}\", and probe.pulse.shape is \"{given}\"; leave it out, or \
                 set probe.pulse.shape = \"{tone}\""
            ),
        };
        fields.only_if(&condition, &mut |fields| {
            let cycles = "cycles of the tone; with 2 it is the paper's pulse";
            fields.number(
                Key { name: "cycles", meaning: cycles },
                &mut self.cycles,
                Number::within(Interval::from_to(CYCLES_MIN, CYCLES_MAX, "cycles")),
            );
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samplings_change_only_with_the_pulse() {
        let tone = |cycles| PulseForm { shape: PulseShape::Tone, cycles };
        let ricker = PulseForm { shape: PulseShape::Ricker, ..PulseForm::default() };
        for (form, bandwidth, delay, lateness) in [
            (PulseForm::default(), 1.0, 0.0, 0.0),
            (tone(2.0), 1.0, 0.0, 0.0),
            (tone(5.0), 1.0, 0.0, 3.0),
            // A hundredth at 1 + 2 · 1.38 centre frequencies.
            (tone(1.0), 3.76 / 2.38, 0.0, 0.0),
            (ricker, 1.2, 0.5, 0.5),
        ] {
            assert_eq!((form.delay(), form.lateness()), (delay, lateness), "{form:?}");
            assert!((form.bandwidth() - bandwidth).abs() < 1e-15, "{form:?}");
        }
    }
}
