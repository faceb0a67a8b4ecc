//! Values and derivatives of a sampled signal between its samples.
//!
//! A band-limited signal is the sum of its samples times sinc functions. Here each has a Gaussian window, so
//! that [`HALF_WIDTH`] samples on each side suffice: below a third of the sampling frequency the error is a
//! millionth of the largest sample or less. Times of extrema are zeros of the slope of this sum, and do not
//! depend on where the samples lie.

use std::f64::consts::PI;
use std::sync::LazyLock;

use osteon_solver::picking::PressureExtremum;

/// Samples on each side of a time that contribute to the signal there.
pub(crate) const HALF_WIDTH: usize = 32;
/// Samples at each end of a record in which its mirror image is felt.
pub(crate) const EDGE: usize = 8;
/// Standard deviation of the Gaussian window, samples: it falls to 1e-8 at its ends.
const WIDTH: f64 = HALF_WIDTH as f64 / 6.07;
/// The window at whole distances from a sample.
static WINDOW: LazyLock<[f64; HALF_WIDTH + 1]> =
    LazyLock::new(|| std::array::from_fn(|k| libm::exp(-0.5 * (k * k) as f64 / (WIDTH * WIDTH))));
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
    let (sine, cosine) = libm::sincos(PI * within);
    // The window at x = within - offset is the product of this one, of that at the whole distance `offset`, and
    // of a power that grows from sample to sample.
    let narrow = 1.0 / (WIDTH * WIDTH);
    let ratio = libm::exp(within * narrow);
    let first_offset = -(HALF_WIDTH as i64 - 1);
    let mut scale =
        libm::exp(within * narrow * first_offset as f64 - 0.5 * within * within * narrow);
    let mut sum = LocalShape::default();
    for offset in first_offset..=HALF_WIDTH as i64 {
        let window = scale * WINDOW[offset.unsigned_abs() as usize];
        scale *= ratio;
        let index = first as i64 + offset;
        let Some(&sample) = usize::try_from(index).ok().and_then(|index| samples.get(index)) else {
            continue;
        };
        // Sine and cosine of π x change their signs from sample to sample.
        let sign = if offset % 2 == 0 { 1.0 } else { -1.0 };
        let one = windowed_sinc(within - offset as f64, sign * sine, sign * cosine, window);
        sum.value = sample.mul_add(one.value, sum.value);
        sum.slope = sample.mul_add(one.slope, sum.slope);
        sum.curvature = sample.mul_add(one.curvature, sum.curvature);
    }
    sum
}

/// Returns the value that [`shape`] has at `place`, in a quarter of the time.
pub(crate) fn value(samples: &[f64], place: f64) -> f64 {
    let first = place.floor();
    let within = place - first;
    let sample = |index: i64| {
        usize::try_from(index).ok().and_then(|index| samples.get(index)).copied().unwrap_or(0.0)
    };
    if within == 0.0 {
        return sample(first as i64);
    }
    let narrow = 1.0 / (WIDTH * WIDTH);
    let ratio = libm::exp(within * narrow);
    let first_offset = -(HALF_WIDTH as i64 - 1);
    let mut scale =
        libm::exp(within * narrow * first_offset as f64 - 0.5 * within * within * narrow);
    let mut sum = 0.0;
    for offset in first_offset..=HALF_WIDTH as i64 {
        let sign = if offset % 2 == 0 { scale } else { -scale };
        let weight = sign * WINDOW[offset.unsigned_abs() as usize] / (within - offset as f64);
        sum = sample(first as i64 + offset).mul_add(weight, sum);
        scale *= ratio;
    }
    sum * libm::sin(PI * within) / PI
}

/// Returns the sinc function at `x` times a window of the size `window` there, given sin πx and cos πx.
fn windowed_sinc(x: f64, sine: f64, cosine: f64, window: f64) -> LocalShape {
    let square = PI * PI * x * x;
    let (sinc, first, second) = if x.abs() < NEAR {
        (
            1.0 - square / 6.0 * (1.0 - square / 20.0),
            -PI * PI * x / 3.0 * (1.0 - square / 10.0),
            -PI * PI / 3.0 * (1.0 - 0.3 * square),
        )
    } else {
        let sinc = sine / (PI * x);
        let first = (cosine - sinc) / x;
        (sinc, first, -PI * PI * sinc - 2.0 * first / x)
    };
    let narrow = 1.0 / (WIDTH * WIDTH);
    let falling = -x * narrow;
    let bent = falling * falling - narrow;
    LocalShape {
        value: sinc * window,
        slope: (first + sinc * falling) * window,
        curvature: (second + 2.0 * first * falling + sinc * bent) * window,
    }
}

/// Slopes at the samples themselves, where the sinc functions need no sine.
pub(crate) struct SampleSlopes {
    /// Weight of the sample `k + 1` steps after the place, which is minus that of the one before it.
    weights: [f64; HALF_WIDTH],
}

impl SampleSlopes {
    /// Computes the weights.
    pub(crate) fn new() -> Self {
        let weights = std::array::from_fn(|k| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            sign / (k + 1) as f64 * WINDOW[k + 1]
        });
        Self { weights }
    }

    /// Returns the slope, per step, at a sample of the [`interior`].
    pub(crate) fn at(&self, samples: &[f64], index: usize) -> f64 {
        let (before, after) = (&samples[index - HALF_WIDTH..index], &samples[index + 1..]);
        let pairs = before.iter().rev().zip(after).zip(&self.weights);
        pairs.fold(0.0, |sum, ((before, after), weight)| weight.mul_add(after - before, sum))
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
