//! A filter without delay that keeps a band of frequencies.
//!
//! Each edge is a sinc function with a Gaussian window, so that its step in frequency is the integral of a
//! Gaussian: it neither rings in frequency nor moves a time. Beyond its ends a signal is continued by its mirror
//! image, which keeps the size of noise there.

use std::f64::consts::PI;

use crate::dot::dot;

/// Standard deviation of the upper edge relative to the upper frequency: beyond three of them the pulse of the
/// centre frequency, a third of it or less, is unchanged to a thousandth.
const UPPER_EDGE: f64 = 1.0 / 6.0;
/// The same of the lower edge: frequency zero is left out to a thousandth.
const LOWER_EDGE: f64 = 1.0 / 3.0;
/// Length of the window on each side, in standard deviations.
const REACH: f64 = 4.5;
/// Samples, in a period of the upper frequency, that are enough of a filtered signal. Interpolation would need a
/// quarter, but also feels what is some ten samples away, such as the arrival in the noise before it.
const SAMPLES_PER_PERIOD: f64 = 12.0;

/// A filter for signals of one sampling interval.
#[derive(Debug, Clone)]
pub(crate) struct BandFilter {
    /// An odd number of weights, which are the same from both ends.
    weights: Vec<f64>,
    /// Number of samples from one that is kept to the next: 1 keeps all.
    stride: usize,
}

impl BandFilter {
    /// Creates a filter of the band from `low` (0: none) to `high`, Hz, for samples every `step`, s.
    pub(crate) fn new(low: f64, high: f64, step: f64) -> Self {
        let mut half = edge(high * step, UPPER_EDGE);
        if low > 0.0 {
            let lower = edge(low * step, LOWER_EDGE);
            half.resize(half.len().max(lower.len()), 0.0);
            for (weight, lower) in half.iter_mut().zip(lower) {
                *weight -= lower;
            }
        }
        let stride = (1.0 / (high * step * SAMPLES_PER_PERIOD)).max(1.0) as usize;
        let weights = half.iter().skip(1).rev().chain(&half).copied().collect();
        Self { weights, stride }
    }

    /// Returns the number of samples from one that [`BandFilter::apply`] keeps to the next.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Returns the number of filtered samples at the ends of a signal in which its noise is not of its usual size, because
    /// the mirror image has the same noise.
    pub(crate) fn unsettled(&self) -> usize {
        self.weights.len() / (4 * self.stride)
    }

    /// Returns the filtered signal at every [`stride`](Self::stride)th sample.
    pub(crate) fn apply(&self, samples: &[f64]) -> Vec<f64> {
        let reach = self.weights.len() / 2;
        let last = samples.len() as i64 - 1;
        let mirrored = |index: i64| {
            let period = 2 * last.max(1);
            let place = index.rem_euclid(period);
            samples[place.min(period - place).min(last) as usize]
        };
        let extended: Vec<f64> = (-(reach as i64)..=last + reach as i64).map(mirrored).collect();
        let windows = extended.windows(self.weights.len()).step_by(self.stride);
        windows.map(|window| dot(window, &self.weights)).collect()
    }
}

/// Returns half of the weights that keep what is below `frequency`, in cycles per step.
fn edge(frequency: f64, relative_width: f64) -> Vec<f64> {
    let width = 1.0 / (2.0 * PI * frequency * relative_width);
    let count = (REACH * width).ceil() as usize + 1;
    let weight = |k: usize| {
        let x = k as f64;
        let sinc = match k {
            0 => 2.0 * frequency,
            _ => libm::sin(2.0 * PI * frequency * x) / (PI * x),
        };
        sinc * libm::exp(-0.5 * (x / width) * (x / width))
    };
    (0..count).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Filters a cosine of a frequency (cycles per step) through the band 0.01 to 0.06, and compares its size.
    fn check(frequency: f64, expected: f64) {
        let filter = BandFilter::new(0.01, 0.06, 1.0);
        let samples: Vec<f64> =
            (0..3000).map(|j| libm::cos(2.0 * PI * frequency * f64::from(j))).collect();
        let filtered = filter.apply(&samples);
        let most = filtered[1000..2000].iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        assert!((most - expected).abs() < 3e-3, "{frequency}: {most}");
        // There is no delay: a maximum of the cosine stays one of the filtered signal.
        assert!((filtered[1000] - samples[1000] * filtered[0].signum() * most).abs() < 0.02);
    }

    #[test]
    fn a_band_passes_and_the_rest_does_not() {
        for (frequency, expected) in [
            (0.0, 0.0),
            (0.01, 0.5),
            (0.02, 0.998),
            (0.03, 1.0),
            (0.06, 0.5),
            (0.1, 0.0),
            (0.4, 0.0),
        ] {
            check(frequency, expected);
        }
    }

    #[test]
    fn of_many_samples_some_are_kept() {
        let samples: Vec<f64> = (0..500).map(|j| libm::cos(0.01 * f64::from(j * j % 97))).collect();
        let filter = BandFilter::new(0.0, 0.012, 1.0);
        let all = BandFilter { stride: 1, ..filter.clone() }.apply(&samples);
        assert_eq!(filter.stride(), 6);
        assert_eq!(filter.apply(&samples), all.into_iter().step_by(6).collect::<Vec<_>>());
    }
}
