//! Values and derivatives of a sampled signal between its samples.
//!
//! A band-limited signal is the sum of its samples times sinc functions. Here each has a Gaussian window, so
//! that [`HALF_WIDTH`] samples on each side suffice: below a third of the sampling frequency the error is a
//! millionth of the largest sample or less. Times of extrema are zeros of the slope of this sum, and do not
//! depend on where the samples lie.

use std::cmp::Ordering;
use std::f64::consts::PI;
use std::sync::LazyLock;

use osteon_solver::picking::PressureExtremum;

use crate::dot::{LANES, dot};

/// Samples on each side of a time that contribute to the signal there.
pub(crate) const HALF_WIDTH: usize = 32;
/// Samples at each end of a record in which its mirror image is felt.
pub(crate) const EDGE: usize = 8;
/// Standard deviation of the Gaussian window, samples: it falls to 1e-8 at its ends.
const WIDTH: f64 = HALF_WIDTH as f64 / 6.07;
/// The inverse of its square.
const NARROW: f64 = 1.0 / (WIDTH * WIDTH);
/// Samples that contribute to a place between two of them.
const TAPS: usize = 2 * HALF_WIDTH;
/// Signs of sine and cosine of π x, which change from tap to tap.
const SIGNS: [f64; LANES] = [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0];
/// The window at the distance of each tap from the beginning of the step.
static WINDOW: LazyLock<[f64; TAPS]> = LazyLock::new(|| {
    std::array::from_fn(|tap| {
        let whole = distance(0.0, tap);
        libm::exp(-0.5 * whole * whole * NARROW)
    })
});
/// Distance from a sample, in steps, below which the functions are power series.
const NEAR: f64 = 1e-3;
/// Steps of the search for an extremum; bisection alone ends at rounding.
const STEPS_MAX: usize = 60;

/// Value, slope (per step) and curvature (per step²) of a signal.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct LocalShape {
    pub(crate) value: f64,
    pub(crate) slope: f64,
    pub(crate) curvature: f64,
}

/// An extremum of a signal, with its curvature, per s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurvedExtremum {
    pub(crate) at: PressureExtremum,
    pub(crate) curvature: f64,
}

/// Returns a signal continued at both ends by [`HALF_WIDTH`] samples of its mirror image.
pub(crate) fn continued(samples: &[f64]) -> Vec<f64> {
    let inner = samples.get(1..samples.len().saturating_sub(1)).unwrap_or_default();
    let before = inner.iter().take(HALF_WIDTH).rev();
    let after = inner.iter().rev().take(HALF_WIDTH);
    before.chain(samples).chain(after).copied().collect()
}

/// Returns the indices of a [`continued`] signal that are at least [`EDGE`] samples away from its own ends.
pub(crate) fn interior(length: usize) -> std::ops::Range<usize> {
    let edge = HALF_WIDTH + EDGE;
    edge..length.saturating_sub(edge).max(edge)
}

/// Returns the shape at `place` (in steps from the first sample). Beyond its ends the signal is 0.
pub(crate) fn shape(samples: &[f64], place: f64) -> LocalShape {
    let first = place.floor();
    let within = place - first;
    let mut taps = taps(samples, first);
    let mut sum = LocalShape::default();
    // Of a sample that is too near the terms are power series.
    for (index, x) in [(HALF_WIDTH - 1, within), (HALF_WIDTH, within - 1.0)] {
        if x.abs() < NEAR {
            sum = near_sinc(x).times(std::mem::take(&mut taps[index]));
        }
    }
    let windows = windows(within);
    let (sine, cosine) = libm::sincos(PI * within);
    let mut sums = [[0.0; LANES]; 3];
    for block in (0..TAPS).step_by(LANES) {
        for lane in 0..LANES {
            let x = distance(within, block + lane);
            let over = if x == 0.0 { 0.0 } else { 1.0 / x };
            let sign = SIGNS[lane];
            let sinc = sign * sine / PI * over;
            let first = (sign * cosine - sinc) * over;
            let second = -PI * PI * sinc - 2.0 * first * over;
            let falling = -x * NARROW;
            let bent = falling * falling - NARROW;
            let weight = taps[block + lane] * windows[block + lane];
            sums[0][lane] += weight * sinc;
            sums[1][lane] += weight * (first + sinc * falling);
            sums[2][lane] += weight * (second + 2.0 * first * falling + sinc * bent);
        }
    }
    let [value, slope, curvature] = sums.map(|lanes| lanes.iter().sum::<f64>());
    LocalShape {
        value: sum.value + value,
        slope: sum.slope + slope,
        curvature: sum.curvature + curvature,
    }
}

/// Returns the value that [`shape`] has at `place`, in less time.
pub(crate) fn value(samples: &[f64], place: f64) -> f64 {
    let first = place.floor();
    let within = place - first;
    let taps = taps(samples, first);
    if within == 0.0 {
        return taps[HALF_WIDTH - 1];
    }
    let windows = windows(within);
    let mut sums = [0.0; LANES];
    for block in (0..TAPS).step_by(LANES) {
        for lane in 0..LANES {
            let weight = SIGNS[lane] * windows[block + lane] / distance(within, block + lane);
            sums[lane] += taps[block + lane] * weight;
        }
    }
    sums.iter().sum::<f64>() * libm::sin(PI * within) / PI
}

/// Returns the samples around the step that begins at sample `first`, with 0 where there are none.
fn taps(samples: &[f64], first: f64) -> [f64; TAPS] {
    let begin = first as i64 + 1 - HALF_WIDTH as i64;
    let inside = usize::try_from(begin).ok().and_then(|begin| samples.get(begin..begin + TAPS));
    inside.and_then(|inside| inside.try_into().ok()).unwrap_or_else(|| {
        std::array::from_fn(|k| {
            let index = usize::try_from(begin + k as i64).ok();
            index.and_then(|index| samples.get(index)).copied().unwrap_or(0.0)
        })
    })
}

/// Returns the distance, in steps, from a tap to a place `within` the step in the middle.
fn distance(within: f64, tap: usize) -> f64 {
    within - (tap as f64 - (HALF_WIDTH - 1) as f64)
}

/// Returns the window at the distance of each tap.
///
/// At a distance of x = within - k it is the product of those at `within` and at the whole distance k, and of
/// exp(within k / width²), which grows from tap to tap by the same factor.
fn windows(within: f64) -> [f64; TAPS] {
    let factor = libm::exp(within * NARROW);
    let least = -((HALF_WIDTH - 1) as f64);
    let mut growths = [libm::exp(within * NARROW * (least - 0.5 * within)); LANES];
    for lane in 1..LANES {
        growths[lane] = growths[lane - 1] * factor;
    }
    let stride = {
        let square = factor * factor;
        (square * square) * (square * square)
    };
    let whole = &*WINDOW;
    let mut windows = [0.0; TAPS];
    for block in (0..TAPS).step_by(LANES) {
        for lane in 0..LANES {
            windows[block + lane] = growths[lane] * whole[block + lane];
            growths[lane] *= stride;
        }
    }
    windows
}

/// Returns the sinc function near its middle, times the window.
fn near_sinc(x: f64) -> LocalShape {
    let square = PI * PI * x * x;
    let sinc = 1.0 - square / 6.0 * (1.0 - square / 20.0);
    let first = -PI * PI * x / 3.0 * (1.0 - square / 10.0);
    let second = -PI * PI / 3.0 * (1.0 - 0.3 * square);
    let window = libm::exp(-0.5 * x * x * NARROW);
    let falling = -x * NARROW;
    LocalShape {
        value: sinc * window,
        slope: (first + sinc * falling) * window,
        curvature: (second + 2.0 * first * falling + sinc * (falling * falling - NARROW)) * window,
    }
}

impl LocalShape {
    fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            slope: self.slope * factor,
            curvature: self.curvature * factor,
        }
    }
}

/// Slopes at the samples themselves, where the sinc functions need no sine.
pub(crate) struct SampleSlopes {
    /// Weights of the samples from [`HALF_WIDTH`] before the place to as many after it.
    weights: [f64; TAPS + 1],
}

impl SampleSlopes {
    /// Computes the weights.
    pub(crate) fn new() -> Self {
        let weight = |k: usize| {
            let sign = if k.is_multiple_of(2) { -1.0 } else { 1.0 };
            sign / k as f64 * WINDOW[HALF_WIDTH + k - 1]
        };
        let weights = std::array::from_fn(|place| match place.cmp(&HALF_WIDTH) {
            Ordering::Less => -weight(HALF_WIDTH - place),
            Ordering::Equal => 0.0,
            Ordering::Greater => weight(place - HALF_WIDTH),
        });
        Self { weights }
    }

    /// Returns the slope, per step, at a sample of the [`interior`].
    pub(crate) fn at(&self, samples: &[f64], index: usize) -> f64 {
        dot(&samples[index - HALF_WIDTH..=index + HALF_WIDTH], &self.weights)
    }
}

/// Returns all extrema between two samples of the [`interior`], `from` < `to`, in order of time; `start` and
/// `step` are those of the signal, s.
pub(crate) fn extrema(
    samples: &[f64],
    (from, to): (usize, usize),
    (start, step): (f64, f64),
    slopes: &SampleSlopes,
) -> Vec<CurvedExtremum> {
    let mut found = Vec::new();
    let mut before = slopes.at(samples, from);
    for index in from + 1..=to {
        let after = slopes.at(samples, index);
        if (before < 0.0) != (after < 0.0) {
            let (place, shape) = refined(samples, index - 1, before, after);
            let at = PressureExtremum { time: place.mul_add(step, start), pressure: shape.value };
            found.push(CurvedExtremum { at, curvature: shape.curvature / (step * step) });
        }
        before = after;
    }
    found
}

/// Returns place and shape of the extremum in the step after sample `index`, by Newton's method within a
/// bracket.
fn refined(samples: &[f64], index: usize, before: f64, after: f64) -> (f64, LocalShape) {
    let (mut low, mut high) = (index as f64, (index + 1) as f64);
    let mut place = low + before / (before - after);
    let mut at = shape(samples, place);
    for _ in 0..STEPS_MAX {
        if (at.slope < 0.0) == (before < 0.0) {
            low = place;
        } else {
            high = place;
        }
        let mut next = place - at.slope / at.curvature;
        if !(next > low && next < high) {
            next = 0.5 * (low + high);
        }
        let moved = (next - place).abs();
        place = next;
        at = shape(samples, place);
        if moved < 1e-9 {
            break;
        }
    }
    (place, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A burst whose highest frequency is well below half of the sampling frequency.
    fn burst(t: f64, cycles_per_step: f64) -> f64 {
        let u = (t - 100.3) * cycles_per_step;
        libm::sin(2.0 * PI * u) * libm::exp(-u * u)
    }

    fn check(samples_per_cycle: f64, error_max: f64) {
        let rate = 1.0 / samples_per_cycle;
        let samples: Vec<f64> = (0..220).map(|j| burst(f64::from(j), rate)).collect();
        let found = extrema(&samples, (40, 180), (0.0, 1.0), &SampleSlopes::new());
        let large: Vec<_> = found.iter().filter(|e| e.at.pressure.abs() > 0.2).collect();
        // The two largest lie symmetrically about the middle: their slope is zero where
        // 2π cos 2πu = 2u sin 2πu.
        let mut u = 0.2;
        for _ in 0..60 {
            let f = |u: f64| PI * libm::cos(2.0 * PI * u) - u * libm::sin(2.0 * PI * u);
            u -= f(u) * 1e-6 / (f(u + 1e-6) - f(u));
        }
        for expected in [100.3 - u * samples_per_cycle, 100.3 + u * samples_per_cycle] {
            let nearest =
                large.iter().map(|e| (e.at.time - expected).abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest * rate < error_max, "{samples_per_cycle}: {:e}", nearest * rate);
        }
    }

    #[test]
    fn times_of_extrema_do_not_depend_on_the_samples() {
        for samples_per_cycle in [8.0, 12.5, 20.0] {
            check(samples_per_cycle, 1e-6);
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        let samples: Vec<f64> = (0..220).map(|j| burst(f64::from(j), 0.06)).collect();
        for place in [95.0, 95.0005, 95.37, 101.999] {
            let at = |delta: f64| shape(&samples, place + delta);
            let slope = (at(1e-4).value - at(-1e-4).value) / 2e-4;
            let curvature = (at(1e-4).slope - at(-1e-4).slope) / 2e-4;
            assert!((at(0.0).value - value(&samples, place)).abs() < 1e-7, "{place}");
            assert!((at(0.0).slope - slope).abs() < 1e-7, "{place}");
            assert!((at(0.0).curvature - curvature).abs() < 1e-6, "{place}");
        }
        let on_sample = SampleSlopes::new().at(&samples, 95);
        // The window ends at 1e-8.
        assert!((on_sample - shape(&samples, 95.0).slope).abs() < 1e-8);
    }
}
