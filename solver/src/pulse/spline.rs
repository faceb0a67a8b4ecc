//! The cubic spline through the samples of a measured pulse, and its Laplace transform.
//!
//! With M_j its second derivatives at the knots 0, Δ, …, F'' is linear between them, so that
//! s² ∫ F exp(-s t) dt = Σ M_j ∫ h_j exp(-s t) dt, with h_j the hat function of knot j. Value and slope vanish at
//! both ends.

use osteon_common::pulse_samples::PulseSamples;

use crate::complex::Complex;

/// A pulse of samples, of which the largest has the size 1.
#[derive(Debug, Clone)]
pub(super) struct PulseSpline {
    /// Distance of the knots, s.
    step: f64,
    /// Values at the knots.
    values: Vec<f64>,
    /// Second derivatives at the knots, times step².
    curvatures: Vec<f64>,
}

impl PulseSpline {
    /// Joins samples.
    pub(super) fn new(samples: &PulseSamples) -> Self {
        let largest = samples.values().iter().fold(0.0_f64, |max, value| value.abs().max(max));
        let inner = samples.values().iter().map(|value| value / largest);
        let values: Vec<f64> = [0.0].into_iter().chain(inner).chain([0.0]).collect();
        Self { step: samples.step(), curvatures: curvatures(&values), values }
    }

    /// Returns the time at which the pulse is zero again, s.
    pub(super) fn length(&self) -> f64 {
        self.step * (self.values.len() - 1) as f64
    }

    /// Returns value, and slope per second, at `t` in s; zeros outside.
    pub(super) fn at(&self, t: f64) -> (f64, f64) {
        let place = t / self.step;
        let last = self.values.len() - 1;
        if !(place > 0.0 && place < last as f64) {
            return (0.0, 0.0);
        }
        let left = (place as usize).min(last - 1);
        let b = place - left as f64;
        let a = 1.0 - b;
        let (left_value, right_value) = (self.values[left], self.values[left + 1]);
        let (m, n) = (self.curvatures[left], self.curvatures[left + 1]);
        let value =
            a * left_value + b * right_value + ((a * a * a - a) * m + (b * b * b - b) * n) / 6.0;
        let slope =
            right_value - left_value + ((1.0 - 3.0 * a * a) * m + (3.0 * b * b - 1.0) * n) / 6.0;
        (value, slope / self.step)
    }

    /// Returns ∫ F(t) exp(-s t) dt, s.
    pub(super) fn transform(&self, s: Complex) -> Complex {
        let x = s.scale(self.step);
        let one = Complex::new(1.0, 0.0);
        let shift = x.scale(-1.0).exp();
        // The transform of a hat function about 0, in units of the step: (sinh(x/2)/(x/2))².
        let (growing, falling) = (x.scale(0.5).exp(), x.scale(-0.5).exp());
        let ratio = (growing - falling) / x;
        let whole = ratio * ratio;
        // The transforms of its half after 0 and of its half before 0.
        let after = (one - (one - shift) / x) / x;
        let before = whole - after;
        let last = self.curvatures.len() - 1;
        let mut sum = before.scale(self.curvatures[last]);
        for &curvature in self.curvatures[1..last].iter().rev() {
            sum = sum * shift + whole.scale(curvature);
        }
        sum = sum * shift + after.scale(self.curvatures[0]);
        (sum / (x * x)).scale(self.step)
    }
}

/// Returns the second derivatives, times the squared step, of the spline with zero slopes at both ends, by
/// elimination: M_(j-1) + 4 M_j + M_(j+1) = 6 (f_(j-1) - 2 f_j + f_(j+1)).
fn curvatures(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let right = |j: usize| match j {
        0 => 6.0 * (values[1] - values[0]),
        _ if j == last => 6.0 * (values[last - 1] - values[last]),
        _ => 6.0 * (values[j - 1] - 2.0 * values[j] + values[j + 1]),
    };
    let diagonal = |j: usize| if j == 0 || j == last { 2.0 } else { 4.0 };
    let (mut pivots, mut sums) = (vec![diagonal(0)], vec![right(0)]);
    for j in 1..=last {
        let factor = 1.0 / pivots[j - 1];
        pivots.push(diagonal(j) - factor);
        sums.push(right(j) - factor * sums[j - 1]);
    }
    let mut found = sums;
    found[last] /= pivots[last];
    for j in (0..last).rev() {
        found[j] = (found[j] - found[j + 1]) / pivots[j];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spline() -> PulseSpline {
        let value = |j: f64| j * j * libm::sin(0.35 * j) * libm::exp(-0.15 * j);
        let samples: Vec<f64> = (1..150).map(|j| value(f64::from(j))).collect();
        PulseSpline::new(&PulseSamples::new(2e-8, &samples).unwrap())
    }

    #[test]
    fn a_spline_runs_smoothly_through_its_samples_and_begins_and_ends_at_rest() {
        let spline = spline();
        for (j, value) in spline.values.iter().enumerate() {
            let t = 2e-8 * j as f64;
            let of = |t| spline.at(t).0;
            assert!((of(t) - value).abs() < 1e-9, "{j}");
            let slope = (of(t + 1e-11) - of(t - 1e-11)) / 2e-11;
            assert!((slope - spline.at(t + 1e-14).1).abs() < 1e-4 * 2.5e7, "{j}: {slope:e}");
        }
        assert!(spline.at(1e-12).1.abs() < 1e-3 * 2.5e7);
        assert_eq!(spline.at(-1e-9), (0.0, 0.0));
        assert_eq!(spline.at(1.0), (0.0, 0.0));
    }

    #[test]
    fn the_transform_is_that_of_fine_sums() {
        let spline = spline();
        for s in [Complex::new(1e5, 0.0), Complex::new(8e5, 3e7), Complex::new(1e5, 9e7)] {
            let (steps, length) = (600_000_u32, 3e-6);
            let step = length / f64::from(steps);
            let mut sum = Complex::default();
            for j in 1..steps {
                let t = step * f64::from(j);
                sum = sum + s.scale(-t).exp().scale(step * spline.at(t).0);
            }
            let error = (sum - spline.transform(s)).abs();
            assert!(error < 1e-9 * 1e-6, "{s:?}: {error:e}");
        }
    }
}
