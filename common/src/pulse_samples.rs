//! A pulse that was measured: samples at equal steps, joined by a cubic spline.
//!
//! The first sample is one step after t = 0, where the pulse begins, and the pulse ends one step after the last
//! one. Value and slope are zero at both ends, so that a pulse begins and ends without a kink.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::accepted::{Interval, WholeRange};

/// Numbers of samples that are accepted.
pub const SAMPLES: WholeRange = WholeRange::new(8, 2048);
/// Steps between samples that are accepted.
pub const STEP: Interval = Interval::from_to(1e-10, 1e-5, "s");
/// Ratio of |F| at the first extremum to the largest |F| in the [`PACKET`] after it: extrema with smaller ones
/// are noise or the pulse's gentle beginning. That of a tone of six cycles is just above.
const ONSET_MIN: f64 = 0.035;
/// Time, in periods of the mean frequency, in which the size of the first extremum is compared.
const PACKET: f64 = 1.2;
/// Level, relative to the peak, below which a spectrum is taken to have ended.
const SPECTRUM_END: f64 = 0.01;
/// Level, relative to the largest |F|, below which the pulse is taken to have ended: e⁻⁴.
const END: f64 = 0.018_315_638_888_734_18;
/// Number of frequencies, up to half the sampling rate, at which the spectrum is looked at.
const FREQUENCIES: usize = 512;

/// A pulse of samples. Only its form matters: the amplitude is that of the probe.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseSamples {
    step: f64,
    values: Arc<[f64]>,
    traits: Traits,
}

/// Why samples are not a pulse.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoPulse {
    /// Too few or too many samples.
    #[error("has {count} samples; it must have {SAMPLES}")]
    Count {
        /// Their number.
        count: usize,
    },
    /// The step is out of range.
    #[error("has a step of {step:?} s; it must be {STEP}")]
    Step {
        /// The step, s.
        step: f64,
    },
    /// A sample is not a finite number.
    #[error("has a sample that is not finite, number {number}")]
    NotFinite {
        /// Its number, from 1.
        number: usize,
    },
    /// All samples are zero, or nearly.
    #[error("is zero in all samples")]
    Zero,
    /// The spectrum has not ended at half the sampling rate.
    #[error(
        "has a spectrum that is still {:.0} % of its peak near half the sampling rate, {half_rate:.3e} Hz; it must \
         be below 1 % from 0.8 of that on: give samples at smaller steps, or filter their noise",
        100.0 * level
    )]
    Coarse {
        /// Half the sampling rate, Hz.
        half_rate: f64,
        /// The largest level above 0.8 of it.
        level: f64,
    },
}

/// The frequencies (Hz) and times (s) of a pulse by which the sampling of its waves is chosen, and its onset.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Traits {
    mean_frequency: f64,
    last_frequency: f64,
    first_extremum: f64,
    onset: f64,
    end: f64,
}

impl PulseSamples {
    /// Creates the pulse of these samples, whatever their unit, at this step, s.
    ///
    /// # Errors
    /// If they are not a pulse.
    pub fn new(step: f64, samples: &[f64]) -> Result<Self, NoPulse> {
        let count = samples.len();
        if !SAMPLES.contains(count as u64) {
            return Err(NoPulse::Count { count });
        }
        if !STEP.contains(step) {
            return Err(NoPulse::Step { step });
        }
        if let Some(index) = samples.iter().position(|value| !value.is_finite()) {
            return Err(NoPulse::NotFinite { number: index + 1 });
        }
        let largest = largest_of(samples);
        if largest < f64::MIN_POSITIVE / f64::EPSILON {
            return Err(NoPulse::Zero);
        }
        let mut new = Self { step, values: samples.into(), traits: Traits::default() };
        new.fill_traits(largest)?;
        Ok(new)
    }

    /// Returns the step between samples, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Returns the samples, in the unit in which they were given.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the mean of the frequency over the energy spectrum, Hz.
    pub fn mean_frequency(&self) -> f64 {
        self.traits.mean_frequency
    }

    /// Returns the frequency, Hz, from which on the spectrum is below a hundredth of its peak.
    pub fn last_frequency(&self) -> f64 {
        self.traits.last_frequency
    }

    /// Returns the time of the first extremum that is no mere beginning, s.
    pub fn first_extremum(&self) -> f64 {
        self.traits.first_extremum
    }

    /// Returns the ratio of |F| at the first extremum to the largest |F| in the 1.2 periods after it.
    pub fn onset(&self) -> f64 {
        self.traits.onset
    }

    /// Returns the time, s, from which on |F| is below e⁻⁴ of its largest value.
    pub fn end(&self) -> f64 {
        self.traits.end
    }

    /// Returns the time at which the pulse is zero again, s.
    pub fn length(&self) -> f64 {
        self.step * (self.values.len() + 1) as f64
    }

    fn time(&self, index: usize) -> f64 {
        self.step * (index + 1) as f64
    }

    fn fill_traits(&mut self, largest: f64) -> Result<(), NoPulse> {
        let half_rate = 0.5 / self.step;
        let levels = self.spectrum_levels();
        let frequency = |index: usize| half_rate * index as f64 / FREQUENCIES as f64;
        let level = largest_of(&levels[4 * FREQUENCIES / 5..]);
        if level >= SPECTRUM_END {
            return Err(NoPulse::Coarse { half_rate, level });
        }
        let (mut energy, mut moment) = (0.0, 0.0);
        for (index, level) in levels.iter().enumerate() {
            energy += level * level;
            moment = (level * level).mul_add(frequency(index), moment);
        }
        let last = levels.iter().rposition(|&level| level >= SPECTRUM_END).unwrap_or(0);
        let mean_frequency = moment / energy;
        let (first, onset) = self.first_of_extrema(mean_frequency, largest);
        let end = self.values.iter().rposition(|value| value.abs() >= END * largest).unwrap_or(0);
        self.traits = Traits {
            mean_frequency,
            last_frequency: frequency(last + 1),
            first_extremum: self.time(first),
            onset,
            end: self.time(end + 1),
        };
        Ok(())
    }

    /// Returns the magnitude of the samples' spectrum, relative to its peak, at equal steps from 0 to half the
    /// sampling rate.
    fn spectrum_levels(&self) -> Vec<f64> {
        let magnitude = |index: usize| {
            let (sin, cos) = libm::sincos(0.5 * TAU * index as f64 / FREQUENCIES as f64);
            // Horner's rule in z = exp(-i ω Δ).
            let (mut re, mut im) = (0.0_f64, 0.0_f64);
            for &value in self.values.iter().rev() {
                (re, im) = (re * cos + im * sin + value, im * cos - re * sin);
            }
            libm::hypot(re, im)
        };
        let mut levels: Vec<f64> = (0..=FREQUENCIES).map(magnitude).collect();
        let peak = largest_of(&levels);
        levels.iter_mut().for_each(|level| *level /= peak);
        levels
    }

    /// Returns the index of the sample at the first extremum that is no mere beginning, and its ratio to the
    /// largest sample of its packet.
    fn first_of_extrema(&self, mean_frequency: f64, largest: f64) -> (usize, f64) {
        let packet = (PACKET / (mean_frequency * self.step)).ceil() as usize;
        let value = |index: usize| self.values.get(index).copied().unwrap_or(0.0).abs();
        let is_extremum = |&index: &usize| {
            let before = index.checked_sub(1).map_or(0.0, value);
            value(index) >= before && value(index) > value(index + 1)
        };
        let ratio = |index: usize| {
            let end = (index + packet).min(self.values.len() - 1);
            (index, value(index) / largest_of(&self.values[index..=end]))
        };
        let extrema = (0..self.values.len()).filter(is_extremum);
        // Beginnings are small beside the whole pulse, too.
        let mut sizable = extrema.filter(|&index| value(index) >= ONSET_MIN * largest).map(ratio);
        sizable.find(|&(_, ratio)| ratio >= ONSET_MIN).unwrap_or((0, 1.0))
    }
}

fn largest_of(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a tone of six cycles of 1 MHz.
    fn tone(step: f64) -> Vec<f64> {
        let value = |time: f64| {
            let from_middle = time * 1e6 / 3.0 - 1.0;
            libm::sin(TAU * 1e6 * time) * libm::exp(-4.0 * from_middle * from_middle)
        };
        (1..).map(|index| step * f64::from(index)).take_while(|t| *t < 10e-6).map(value).collect()
    }

    #[test]
    fn what_samplings_need_to_know_of_a_tone_is_that_of_its_formula() {
        let pulse = PulseSamples::new(1e-8, &tone(1e-8)).unwrap();
        assert!((pulse.mean_frequency() - 1e6).abs() < 2e3, "{pulse:?}");
        // 1 + 2.76/6 MHz, of a Gaussian without the kink.
        assert!((pulse.last_frequency() - 1.46e6).abs() < 0.1e6, "{:?}", pulse.traits);
        assert!((pulse.first_extremum() - 0.31e-6).abs() < 1e-8, "{:?}", pulse.traits);
        assert!((pulse.onset() - 0.14).abs() < 0.01, "{:?}", pulse.traits);
        assert!((pulse.end() - 5.8e-6).abs() < 0.1e-6, "{:?}", pulse.traits);
    }

    #[test]
    fn samples_that_are_no_pulse_are_refused() {
        let refusal = |step, samples: &[f64]| PulseSamples::new(step, samples).unwrap_err();
        assert_eq!(refusal(1e-8, &[1.0; 7]), NoPulse::Count { count: 7 });
        assert_eq!(refusal(1e-8, &vec![1.0; 2049]), NoPulse::Count { count: 2049 });
        assert_eq!(refusal(0.0, &tone(1e-8)), NoPulse::Step { step: 0.0 });
        assert_eq!(refusal(1e-8, &[0.0; 10]), NoPulse::Zero);
        let mut wrong = tone(1e-8);
        wrong[3] = f64::NAN;
        assert_eq!(refusal(1e-8, &wrong), NoPulse::NotFinite { number: 4 });
        assert!(matches!(refusal(4e-7, &tone(4e-7)), NoPulse::Coarse { .. }));
    }

    /// A beginning of 3 % of the largest value is passed over, one of 4 % is the first extremum.
    #[test]
    fn a_small_beginning_is_no_extremum() {
        for (size, expected) in [(0.03, 0.5), (0.04, 0.1)] {
            let bump = |time: f64, at: f64| libm::exp(-libm::pow((time - at) / 3e-8, 2.0));
            let time = |index: u32| 1e-8 * f64::from(index);
            let value = |t| size * bump(t, 1e-7) - bump(t, 5e-7) + bump(t, 8e-7);
            let samples: Vec<f64> = (1..150).map(|index| value(time(index))).collect();
            let found = PulseSamples::new(1e-8, &samples).unwrap().first_extremum();
            assert!((found - expected * 1e-6).abs() < 1e-12, "{size}: {found}");
        }
    }
}
