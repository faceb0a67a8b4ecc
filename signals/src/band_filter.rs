//! A filter without delay that keeps a band of frequencies.
//!
//! Each edge is a sinc function with a Gaussian window, so that its step in frequency is the integral of a
//! Gaussian: it neither rings in frequency nor moves a time. Beyond its ends a signal is continued by its mirror
//! image, which keeps the size of noise there.

use std::f64::consts::PI;

/// Standard deviation of the upper edge relative to the upper frequency: beyond three of them the pulse of the
/// centre frequency, a third of it or less, is unchanged to a thousandth.
const UPPER_EDGE: f64 = 1.0 / 6.0;
/// The same of the lower edge: frequency zero is left out to a thousandth.
const LOWER_EDGE: f64 = 1.0 / 3.0;
/// Length of the window on each side, in standard deviations.
const REACH: f64 = 4.5;

/// A filter for signals of one sampling interval.
#[derive(Debug, Clone)]
pub(crate) struct BandFilter {
    /// Weights from the middle to one end.
    half: Vec<f64>,
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
        Self { half }
    }

    /// Returns the number of samples at the ends of a signal in which its noise is not of its usual size, because
    /// the mirror image has the same noise.
    pub(crate) fn unsettled(&self) -> usize {
        self.half.len() / 2
    }

    /// Returns the filtered signal.
    pub(crate) fn apply(&self, samples: &[f64]) -> Vec<f64> {
        let reach = self.half.len() - 1;
        let last = samples.len() as i64 - 1;
        let mirrored = |index: i64| {
            let period = 2 * last.max(1);
            let place = index.rem_euclid(period);
            samples[place.min(period - place).min(last) as usize]
        };
        let extended: Vec<f64> = (-(reach as i64)..=last + reach as i64).map(mirrored).collect();
        (0..samples.len())
            .map(|index| {
                let (before, rest) = extended[index..=index + 2 * reach].split_at(reach);
                let pairs = before.iter().rev().zip(&rest[1..]).zip(&self.half[1..]);
                let middle = self.half[0] * rest[0];
                pairs.fold(middle, |sum, ((before, after), weight)| {
                    weight.mul_add(before + after, sum)
                })
            })
            .collect()
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
}
