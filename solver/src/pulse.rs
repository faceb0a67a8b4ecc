//! The pulse F(t) = F1 sin(2π fc t) exp(-4 (fc t - 1)²) for t ≥ 0 (the paper's Eq. (3)).

use std::f64::consts::PI;

use crate::complex::Complex;
use crate::quadrature::{PANEL_PHASE, for_each_node};

/// Length of the pulse in periods of its centre frequency: beyond it |F| < 1e-21 F1.
const LENGTH_PERIODS: f64 = 4.5;

/// The pulse of one probe.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pulse {
    amplitude: f64,
    center_frequency: f64,
}

impl Pulse {
    pub(crate) fn new(amplitude: f64, center_frequency: f64) -> Self {
        Self { amplitude, center_frequency }
    }

    /// Time after which the pulse is over, s.
    pub(crate) fn length(&self) -> f64 {
        LENGTH_PERIODS / self.center_frequency
    }

    /// F(t) at `t` in s; 0 before t = 0.
    pub(crate) fn at(&self, t: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        let periods = self.center_frequency * t;
        let from_center = periods - 1.0;
        self.amplitude * libm::sin(2.0 * PI * periods) * libm::exp(-4.0 * from_center * from_center)
    }

    /// The Laplace transforms ∫ F(t) exp(-s t) dt at s = `damping` + i 2π n / `period` for
    /// each n of `numbers`.
    ///
    /// By quadrature: the pulse is smooth on its support, and no special function is needed.
    pub(crate) fn spectrum(&self, damping: f64, period: f64, numbers: &[usize]) -> Vec<Complex> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn main_extrema_are_where_the_formula_puts_them() {
        let pulse = Pulse::new(100.0, 1e6);
        for t in [0.359e-6, 0.791e-6, 1.209e-6, 1.641e-6] {
            let slope = (pulse.at(t + 1e-9) - pulse.at(t - 1e-9)) / 2e-9;
            // Zero slope to the three printed digits: |F''| is about 4e15 F1/s².
            assert!(slope.abs() < 2.5e-10 * 4e15 * 100.0, "{t}: {slope}");
        }
    }

    #[test]
    fn spectrum_is_forty_decibels_down_at_2_38_megahertz() {
        let pulse = Pulse::new(100.0, 1e6);
        let spectrum = pulse.spectrum(0.0, 50e-6, &(0..120).collect::<Vec<_>>());
        let peak = spectrum.iter().map(|z| z.abs()).fold(0.0, f64::max);
        let ratio = spectrum[119].abs() / peak;
        assert!((20.0 * libm::log10(ratio) + 40.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn spectrum_agrees_with_a_fine_sum() {
        let pulse = Pulse::new(100.0, 1e6);
        let (damping, period) = (1.2e6, 10e-6);
        let spectrum = pulse.spectrum(damping, period, &(0..60).collect::<Vec<_>>());
        let steps = 90_000;
        let step = pulse.length() / f64::from(steps);
        for n in [0_usize, 10, 59] {
            let omega = 2.0 * PI * n as f64 / period;
            let mut sum = Complex::default();
            for j in 1..steps {
                let t = f64::from(j) * step;
                sum = sum + Complex::new(-damping * t, -omega * t).exp().scale(pulse.at(t) * step);
            }
            // The trapezoidal rule's error at the kink is step²/12 F'(0).
            assert!((sum - spectrum[n]).abs() < 1e-8 * spectrum[10].abs(), "{n}");
        }
    }
}
