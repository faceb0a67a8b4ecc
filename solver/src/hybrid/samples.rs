//! Extrema of an equidistantly sampled signal.

use std::f64::consts::PI;

use crate::picking::PressureExtremum;

/// Samples of one interpolating polynomial.
const POINTS: usize = 8;
/// Number of bisections of an interval; after them rounding limits the result.
const BISECTIONS: usize = 44;

/// Centre of the low-pass filter's fall, as a fraction of the band, and its width.
const FALL: (f64, f64) = (0.84, 0.28);
/// The filter ends where its Gaussian factor is exp(-this²).
const FILTER_END: f64 = 3.2;

/// A low-pass filter without delay, ½ erfc((f - f0)/w), where f0 and w are fractions of a band. It
/// removes the components that the mesh does not resolve, which reach the receivers at wrong times.
#[derive(Debug, Clone)]
pub(super) struct LowPass {
    /// Half of the symmetric impulse response; the whole sums up to one.
    response: Vec<f64>,
}

impl LowPass {
    /// Creates the filter for `band` in cycles per sample.
    pub(super) fn new(band: f64) -> Self {
        let (middle, width) = (FALL.0 * band, FALL.1 * band);
        let count = (FILTER_END / (PI * width)) as usize + 1;
        let mut response: Vec<f64> = (0..count)
            .map(|i| {
                let t = i as f64;
                let decay = PI * width * t;
                let sinc =
                    if i == 0 { 2.0 * middle } else { libm::sin(2.0 * PI * middle * t) / (PI * t) };
                sinc * libm::exp(-decay * decay)
            })
            .collect();
        let sum =
            response.iter().skip(1).fold(response[0], |sum, value| 2.0_f64.mul_add(*value, sum));
        for value in &mut response {
            *value /= sum;
        }
        Self { response }
    }

    /// Returns the number of samples that it uses on either side.
    pub(super) fn reach(&self) -> usize {
        self.response.len() - 1
    }

    /// Writes the filtered `values` to `out`. Before the first there are zeros; the last values,
    /// whose neighbours are unknown, are copied.
    pub(super) fn apply(&self, values: &[f64], out: &mut [f64]) {
        out.copy_from_slice(values);
        for i in 0..values.len().saturating_sub(self.reach()) {
            let mut sum = self.response[0] * values[i];
            for (j, &factor) in self.response.iter().enumerate().skip(1) {
                let before = if j <= i { values[i - j] } else { 0.0 };
                sum = factor.mul_add(before + values[i + j], sum);
            }
            out[i] = sum;
        }
    }
}

/// A signal sampled every `step` (s) from `start` on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) start: f64,
    pub(super) step: f64,
    pub(super) values: &'a [f64],
}

impl Samples<'_> {
    /// Writes all local extrema in `from` ≤ t < `to` (s), in order of time, to `extrema`.
    pub(super) fn extrema(&self, from: f64, to: f64, extrema: &mut Vec<PressureExtremum>) {
        extrema.clear();
        if self.values.len() < POINTS {
            return;
        }
        let position = |t: f64| ((t - self.start) / self.step).max(0.0);
        let first = position(from) as usize;
        let last = (position(to) as usize).min(self.values.len() - 2);
        let mut next = self.piece(first.min(last));
        for i in first..=last {
            let piece = next;
            next = self.piece(i + 1);
            // One slope for each sample, so that no extremum is counted twice or missed.
            let (low, high) = (piece.at(0.0).1, next.at(0.0).1);
            if (low < 0.0) == (high < 0.0) {
                continue;
            }
            let place = piece.flat_place(low < 0.0);
            let time = (i as f64 + place).mul_add(self.step, self.start);
            if time >= from && time < to {
                extrema.push(PressureExtremum { time, pressure: piece.at(place).0 });
            }
        }
    }

    /// Returns the value at `t` (s).
    pub(super) fn at(&self, t: f64) -> f64 {
        let position = ((t - self.start) / self.step).max(0.0);
        let i = (position as usize).min(self.values.len().saturating_sub(2));
        if self.values.len() < POINTS { 0.0 } else { self.piece(i).at(position - i as f64).0 }
    }

    /// Returns the polynomial around the interval from sample `i` to the next.
    fn piece(&self, i: usize) -> Piece {
        let first = i.saturating_sub(POINTS / 2 - 1).min(self.values.len() - POINTS);
        let mut differences = [0.0; POINTS];
        differences.copy_from_slice(&self.values[first..first + POINTS]);
        for order in 1..POINTS {
            for j in (order..POINTS).rev() {
                differences[j] = (differences[j] - differences[j - 1]) / order as f64;
            }
        }
        Piece { differences, offset: (i - first) as f64 }
    }
}

/// An interpolating polynomial in Newton's form, in units of samples.
struct Piece {
    differences: [f64; POINTS],
    /// Position of the interval's lower end among the polynomial's nodes.
    offset: f64,
}

impl Piece {
    /// Returns value and slope at `x`, 0 to 1 in the interval.
    fn at(&self, x: f64) -> (f64, f64) {
        let x = x + self.offset;
        let (mut value, mut slope) = (self.differences[POINTS - 1], 0.0);
        for j in (0..POINTS - 1).rev() {
            let distance = x - j as f64;
            slope = distance.mul_add(slope, value);
            value = distance.mul_add(value, self.differences[j]);
        }
        (value, slope)
    }

    /// Returns the position where the slope, `rising` or falling through zero, vanishes.
    fn flat_place(&self, rising: bool) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (self.at(middle).1 < 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn extrema_of_a_sine_are_found_far_below_the_sample() {
        // 2.5 MHz every 10 ns: 40 samples a period.
        let omega = 2.0 * PI * 2.5e6;
        let values: Vec<f64> =
            (0..120).map(|i| libm::sin(omega * (f64::from(i) * 10e-9 + 3e-9))).collect();
        let samples = Samples { start: 3e-9, step: 10e-9, values: &values };
        let mut extrema = Vec::new();
        samples.extrema(0.15e-6, 0.95e-6, &mut extrema);
        let expected = [0.3e-6, 0.5e-6, 0.7e-6, 0.9e-6];
        assert_eq!(extrema.len(), expected.len());
        for (extremum, time) in extrema.iter().zip(expected) {
            assert!((extremum.time - time).abs() < 1e-13, "{extremum:?}");
            assert!((extremum.pressure.abs() - 1.0).abs() < 1e-9);
        }
        assert!((samples.at(0.25e-6) - libm::sin(omega * 0.25e-6)).abs() < 1e-9);
    }

    #[test]
    fn the_low_pass_takes_high_frequencies_and_leaves_the_low_ones() {
        let filter = LowPass::new(0.1);
        let count = 3 * filter.reach();
        for (frequency, gain, tolerance) in [
            (0.0, 1.0, 1e-12),
            (0.01, 1.0, 2e-4),
            (0.084, 0.5, 1e-3),
            (0.15, 0.0, 1e-3),
            (0.3, 0.0, 2e-4),
        ] {
            let wave = |i: usize| libm::cos(2.0 * PI * frequency * i as f64);
            let values: Vec<f64> = (0..count).map(wave).collect();
            let mut out = vec![0.0; count];
            filter.apply(&values, &mut out);
            for i in filter.reach()..count - filter.reach() {
                assert!(
                    (out[i] - gain * values[i]).abs() < tolerance,
                    "{frequency}, {i}: {}",
                    out[i]
                );
            }
        }
    }

    #[test]
    fn extrema_are_listed_once_and_only_in_the_window() {
        let parabola: Vec<f64> =
            (0..40).map(|i| 1.0 - f64::from(i - 20) * f64::from(i - 20)).collect();
        let samples = Samples { start: 0.0, step: 1.0, values: &parabola };
        let mut extrema = Vec::new();
        for (from, to, count) in [(0.0, 39.0, 1), (20.5, 39.0, 0), (0.0, 19.5, 0), (50.0, 60.0, 0)]
        {
            samples.extrema(from, to, &mut extrema);
            assert_eq!(extrema.len(), count, "{from} to {to}");
        }
    }
}
