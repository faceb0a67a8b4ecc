//! The source's pulse F(t), t ≥ 0, its slope and its spectrum.
//!
//! With p = fc t and F1 the amplitude,
//!
//! ```text
//! tone of n cycles   F = F1 sin(2π p) exp(-4 (2p/n - 1)²); n = 2 is the paper's Eq. (3)
//! Ricker             F = F1 (1 - 2 u²) exp(-u²),  u = π (p - 1.25)
//! ```
//!
//! or the spline through samples, the largest of which is F1 or -F1.

mod spline;

use std::f64::consts::PI;

use osteon_common::probe::Probe;
use osteon_common::pulse::{PulseForm, RICKER_MIDDLE};

use self::spline::PulseSpline;
use crate::complex::Complex;
use crate::quadrature::{PANEL_PHASE, for_each_node};

/// Length of the paper's pulse in periods of its centre frequency: beyond it |F| < 1e-21 F1.
const LENGTH: f64 = 4.5;
/// The same of the Ricker pulse.
const RICKER_LENGTH: f64 = 3.65;
/// Time, in periods, from which on the paper's pulse is below 1e-10 of its amplitude.
const EXTENT: f64 = 3.4;
/// The same of the Ricker pulse.
const RICKER_EXTENT: f64 = 2.95;

/// Steps by which an extremum is found to 1e-12 periods; there the value's error is the square of that.
const BISECTIONS: u32 = 40;

/// The pulse of one probe.
#[derive(Debug, Clone)]
pub(crate) struct Pulse {
    amplitude: f64,
    center_frequency: f64,
    values: PulseValues,
}

/// The values of a pulse, for the amplitude 1.
#[derive(Debug, Clone)]
enum PulseValues {
    /// A tone, with its number of cycles.
    Tone(f64),
    Ricker,
    Samples(PulseSpline),
}

impl Pulse {
    /// Creates the pulse of a probe, but with this amplitude.
    pub(crate) fn new(amplitude: f64, probe: &Probe) -> Self {
        let values = match (&probe.pulse, probe.pulse.tone_cycles()) {
            (_, Some(cycles)) => PulseValues::Tone(cycles),
            (PulseForm::Samples(samples), None) => PulseValues::Samples(PulseSpline::new(samples)),
            (_, None) => PulseValues::Ricker,
        };
        Self { amplitude, center_frequency: probe.center_frequency, values }
    }

    /// Time after which the pulse is over, s.
    pub(crate) fn length(&self) -> f64 {
        self.duration(LENGTH, RICKER_LENGTH)
    }

    /// Time after which the pulse is below 1e-10 of its amplitude, s.
    pub(crate) fn extent(&self) -> f64 {
        self.duration(EXTENT, RICKER_EXTENT)
    }

    /// Returns a time, s, that is so many periods in the paper's pulse, or in the Ricker pulse; of samples that
    /// of their end.
    fn duration(&self, paper: f64, ricker: f64) -> f64 {
        match &self.values {
            PulseValues::Tone(cycles) => 0.5 * cycles * paper / self.center_frequency,
            PulseValues::Ricker => ricker / self.center_frequency,
            PulseValues::Samples(spline) => spline.length(),
        }
    }

    /// F(t) at `t` in s; 0 before t = 0.
    pub(crate) fn at(&self, t: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        let periods = self.center_frequency * t;
        match &self.values {
            PulseValues::Tone(cycles) => {
                let (from_middle, _) = tone_envelope(*cycles, periods);
                self.amplitude
                    * libm::sin(2.0 * PI * periods)
                    * libm::exp(-4.0 * from_middle * from_middle)
            }
            PulseValues::Ricker => {
                let u = PI * (periods - RICKER_MIDDLE);
                self.amplitude * (1.0 - 2.0 * u * u) * libm::exp(-u * u)
            }
            PulseValues::Samples(spline) => self.amplitude * spline.at(t).0,
        }
    }

    /// F'(t) at `t` ≥ 0 in s.
    pub(crate) fn slope_at(&self, t: f64) -> f64 {
        let periods = self.center_frequency * t;
        let scale = self.amplitude * self.center_frequency;
        match &self.values {
            PulseValues::Tone(cycles) => {
                let (from_middle, rate) = tone_envelope(*cycles, periods);
                let (sin, cos) = libm::sincos(2.0 * PI * self.center_frequency * t);
                let envelope = libm::exp(-4.0 * from_middle * from_middle);
                scale * envelope * (2.0 * PI * cos - 8.0 * from_middle * rate * sin)
            }
            PulseValues::Ricker => {
                let u = PI * (periods - RICKER_MIDDLE);
                scale * PI * (4.0 * u * u - 6.0) * u * libm::exp(-u * u)
            }
            PulseValues::Samples(spline) => self.amplitude * spline.at(t).1,
        }
    }

    /// Returns the ratio of |F| at a tone's first extremum to that at the largest of its first three, which
    /// are less than 1.2 periods apart.
    fn tone_onset(&self) -> f64 {
        // Between two zeros of the sine there is one extremum.
        let sizes = [0.0, 0.5, 1.0].map(|zero| {
            let period = 1.0 / self.center_frequency;
            let (mut low, mut high) = (zero * period, (zero + 0.5) * period);
            let rises = self.slope_at(low) > 0.0;
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if (self.slope_at(middle) > 0.0) == rises {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            self.at(low).abs()
        });
        sizes[0] / sizes.into_iter().fold(0.0, f64::max)
    }

    /// The Laplace transforms ∫ F(t) exp(-s t) dt at s = `damping` + i 2π n / `period` for
    /// each n of `numbers`.
    ///
    /// That of a formula by quadrature: the pulse is smooth on its support, and no special function is needed.
    pub(crate) fn spectrum(&self, damping: f64, period: f64, numbers: &[usize]) -> Vec<Complex> {
        if let PulseValues::Samples(spline) = &self.values {
            let at = |&n: &usize| Complex::new(damping, 2.0 * PI * n as f64 / period);
            return numbers.iter().map(|n| spline.transform(at(n)).scale(self.amplitude)).collect();
        }
        let last = numbers.iter().copied().max().unwrap_or(0);
        let length = self.length();
        let highest = 2.0 * PI * (last as f64 / period + self.center_frequency);
        let panels = ((highest * length / PANEL_PHASE).ceil() as usize).max(8);
        let mut sums = vec![Complex::default(); numbers.len()];
        for_each_node(0.0, length, panels, |t, weight| {
            let value = weight * self.at(t) * libm::exp(-damping * t);
            for (&n, sum) in numbers.iter().zip(&mut sums) {
                let (sin, cos) = libm::sincos(2.0 * PI * n as f64 / period * t);
                sum.re = value.mul_add(cos, sum.re);
                sum.im = (-value).mul_add(sin, sum.im);
            }
        });
        sums
    }
}

/// Returns how much more gently the probe's pulse begins than the paper's: the ratio of their first extrema,
/// each relative to its largest neighbour; at most 1.
pub(crate) fn relative_onset(probe: &Probe) -> f64 {
    let of_tone = |pulse: PulseForm| {
        let probe = Probe { pulse, center_frequency: 1.0, ..Probe::default() };
        Pulse::new(1.0, &probe).tone_onset()
    };
    let onset = match &probe.pulse {
        &PulseForm::Tone { cycles } if cycles > 2.0 => of_tone(PulseForm::Tone { cycles }),
        PulseForm::Samples(samples) => samples.onset(),
        _ => return 1.0,
    };
    (onset / of_tone(PulseForm::Paper)).min(1.0)
}

/// Returns the distance from the middle of a tone, relative to half its length, and its rate per period.
fn tone_envelope(cycles: f64, periods: f64) -> (f64, f64) {
    let rate = 2.0 / cycles;
    (periods * rate - 1.0, rate)
}

#[cfg(test)]
mod tests {
    use osteon_common::pulse_samples::PulseSamples;

    use super::*;

    fn pulse(pulse: PulseForm) -> Pulse {
        Pulse::new(100.0, &Probe { pulse, ..Probe::default() })
    }

    fn tone(cycles: f64) -> Pulse {
        pulse(PulseForm::Tone { cycles })
    }

    fn formulas() -> [Pulse; 5] {
        [pulse(PulseForm::Paper), tone(1.0), tone(2.5), tone(6.0), pulse(PulseForm::Ricker)]
    }

    /// Samples of the Ricker pulse at steps of 20 ns.
    fn samples() -> PulseForm {
        let ricker = pulse(PulseForm::Ricker);
        let values: Vec<f64> = (1..180).map(|j| ricker.at(2e-8 * f64::from(j))).collect();
        PulseForm::Samples(PulseSamples::new(2e-8, &values).unwrap())
    }

    #[test]
    fn main_extrema_are_where_the_formula_puts_them() {
        for (pulse, times) in [
            (pulse(PulseForm::Paper), &[0.359e-6, 0.791e-6, 1.209e-6, 1.641e-6][..]),
            (tone(1.0), &[0.353e-6, 0.647e-6]),
            (tone(5.0), &[0.317e-6, 0.803e-6]),
            (pulse(PulseForm::Ricker), &[0.86e-6, 1.25e-6, 1.64e-6]),
        ] {
            for &t in times {
                let slope = (pulse.at(t + 1e-9) - pulse.at(t - 1e-9)) / 2e-9;
                // Zero slope to the three printed digits: |F''| is at most 6π² F1/µs².
                assert!(slope.abs() < 6e-10 * 6e13 * 100.0, "{pulse:?}, {t}: {slope}");
            }
        }
    }

    /// By an independent program, from the largest values in each half period.
    #[test]
    fn gentle_tones_lower_the_threshold() {
        for (pulse, expected) in [
            (PulseForm::Paper, 1.0),
            (PulseForm::Tone { cycles: 1.0 }, 1.0),
            (PulseForm::Tone { cycles: 3.0 }, 0.463_708_9),
            (PulseForm::Tone { cycles: 5.0 }, 0.617_801_2),
            (PulseForm::Tone { cycles: 6.0 }, 0.766_014_3),
            (PulseForm::Ricker, 1.0),
            (samples(), 1.0),
        ] {
            let probe = Probe { pulse, ..Probe::default() };
            assert!((relative_onset(&probe) - expected).abs() < 1e-6, "{:?}", probe.pulse);
        }
    }

    #[test]
    fn spectrum_is_forty_decibels_down_at_2_38_megahertz() {
        let pulse = pulse(PulseForm::Paper);
        let spectrum = pulse.spectrum(0.0, 50e-6, &(0..120).collect::<Vec<_>>());
        let peak = spectrum.iter().map(|z| z.abs()).fold(0.0, f64::max);
        let ratio = spectrum[119].abs() / peak;
        assert!((20.0 * libm::log10(ratio) + 40.0).abs() < 0.1, "{ratio}");
    }

    /// Also of F'(t), whose transform is s times that of F(t), less F(0).
    #[test]
    fn spectra_agree_with_fine_sums_of_values_and_slopes() {
        let (damping, period) = (1.2e6, 10e-6);
        for pulse in formulas().into_iter().chain([pulse(samples())]) {
            let spectrum = pulse.spectrum(damping, period, &(0..60).collect::<Vec<_>>());
            let largest = spectrum.iter().map(|z| z.abs()).fold(0.0, f64::max);
            let steps = 90_000;
            let step = pulse.length() / f64::from(steps);
            for n in [0_usize, 10, 59] {
                let s = Complex::new(damping, 2.0 * PI * n as f64 / period);
                let mut sum = Complex::default();
                let mut of_slopes = Complex::new(0.5 * step * pulse.slope_at(0.0), 0.0);
                for j in 1..steps {
                    let t = f64::from(j) * step;
                    let wave = s.scale(-t).exp().scale(step);
                    sum = sum + wave.scale(pulse.at(t));
                    of_slopes = of_slopes + wave.scale(pulse.slope_at(t));
                }
                // The trapezoidal rule's errors at the start are step²/12 of F'(0) and of (F' e^(-st))'.
                let error = (sum - spectrum[n]).abs();
                assert!(error < 1e-8 * largest, "{pulse:?}, {n}: {error:e}");
                let start = Complex::new(pulse.at(1e-300), 0.0);
                let error = (of_slopes + start - spectrum[n] * s).abs();
                assert!(error < 1e-6 * s.abs() * largest, "{pulse:?}, {n}: {error:e}");
            }
        }
    }

    #[test]
    fn a_tone_of_two_cycles_is_the_papers_pulse_to_the_bit() {
        let [paper, tone] = [pulse(PulseForm::Paper), tone(2.0)];
        assert_eq!((tone.length(), tone.extent()), (paper.length(), paper.extent()));
        for t in (0..400).map(|i| f64::from(i) * 11e-9) {
            let of = |pulse: Pulse| [pulse.at(t), pulse.slope_at(t)].map(f64::to_bits);
            assert_eq!(of(tone.clone()), of(paper.clone()), "{t}");
        }
    }

    /// Starts and ends are as small as they are documented, relative to the amplitude.
    #[test]
    fn pulses_end_where_they_are_cut() {
        for pulse in formulas().into_iter().chain([pulse(samples())]) {
            assert!(pulse.at(1e-300).abs() < 100.0 * 1e-5, "{pulse:?}");
            for (from, most) in [(pulse.extent(), 1e-10), (pulse.length(), 1e-20)] {
                let beyond = (0..100).map(|i| from * (1.0 + 0.01 * f64::from(i)));
                let largest = beyond.map(|t| pulse.at(t).abs()).fold(0.0, f64::max);
                assert!(largest < 100.0 * most, "{pulse:?}: {largest:e}");
            }
        }
    }
}
