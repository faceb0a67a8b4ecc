//! From a spectrum to a signal: values, slopes, extrema.

use std::f64::consts::PI;

use osteon_common::sampling::Sampling;

use crate::complex::Complex;

/// Grid points per period of the centre frequency on which extrema are bracketed.
const POINTS_PER_CYCLE: f64 = 40.0;
/// Most steps of the refinement of one extremum; bisection alone needs 40 to reach rounding.
const REFINEMENTS_MAX: usize = 60;

/// A local extremum of the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremum {
    /// Time, s.
    pub(crate) time: f64,
    /// Pressure, Pa.
    pub(crate) pressure: f64,
}

/// exp(2πi j/M), j = 0 … M - 1: with a grid of M steps per period every e^{iωt} is one of these.
#[derive(Debug)]
pub(crate) struct Grid {
    step: f64,
    roots: Vec<Complex>,
}

impl Grid {
    pub(crate) fn new(sampling: &Sampling, center_frequency: f64) -> Self {
        let steps = (POINTS_PER_CYCLE * center_frequency * sampling.period).ceil() as usize;
        let roots = (0..steps)
            .map(|j| Complex::new(0.0, 2.0 * PI * j as f64 / steps as f64).exp())
            .collect();
        Self { step: sampling.period / steps as f64, roots }
    }
}

/// The pressure at one receiver as a damped trigonometric polynomial
/// p(t) = e^{αt}/T (c_0 + 2 Re Σ c_n e^{iω_n t}).
pub(crate) struct Signal<'a> {
    pub(crate) sampling: &'a Sampling,
    pub(crate) spectrum: &'a [Complex],
}

impl Signal<'_> {
    /// p(t), Pa.
    pub(crate) fn at(&self, t: f64) -> f64 {
        let [sum] = self.sums::<1>(t);
        sum * libm::exp(self.sampling.damping * t) / self.sampling.period
    }

    /// All local extrema in `from` ≤ t < `to` (s), in order of time, into `extrema`.
    pub(crate) fn extrema(&self, grid: &Grid, from: f64, to: f64, extrema: &mut Vec<Extremum>) {
        extrema.clear();
        if from >= to {
            return;
        }
        let first = (from / grid.step).floor().max(0.0) as usize;
        let last = (to / grid.step).ceil() as usize;
        let mut before = self.slope_on_grid(grid, first);
        for j in first + 1..=last {
            let slope = self.slope_on_grid(grid, j);
            if (before < 0.0) != (slope < 0.0) {
                let bracket = ((j - 1) as f64 * grid.step, j as f64 * grid.step);
                let time = self.refine(bracket, (before, slope));
                if time >= from && time < to {
                    extrema.push(Extremum { time, pressure: self.at(time) });
                }
            }
            before = slope;
        }
    }

    /// e^{-αt} T dp/dt at grid point `j`.
    fn slope_on_grid(&self, grid: &Grid, j: usize) -> f64 {
        let mut sum = 0.0;
        let mut at = 0;
        let step = j % grid.roots.len();
        for (n, &c) in self.spectrum.iter().enumerate() {
            let root = grid.roots[at];
            let slope = self.differentiated(n, c);
            let term = slope.re.mul_add(root.re, -(slope.im * root.im));
            sum = self.weight(n).mul_add(term, sum);
            at += step;
            if at >= grid.roots.len() {
                at -= grid.roots.len();
            }
        }
        sum
    }

    /// The zero of the slope inside `bracket`: Newton's method, kept inside by bisection.
    fn refine(&self, bracket: (f64, f64), slopes: (f64, f64)) -> f64 {
        let (mut low, mut high) = bracket;
        let rising = slopes.1 > slopes.0;
        let mut t = low + (high - low) * (slopes.0 / (slopes.0 - slopes.1));
        for _ in 0..REFINEMENTS_MAX {
            let [_, slope, curvature] = self.sums::<3>(t);
            if (slope > 0.0) == rising {
                high = t;
            } else {
                low = t;
            }
            // The exponential's slope is in the sums: their derivative is curvature - α slope.
            let mut next = t - slope / self.sampling.damping.mul_add(-slope, curvature);
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let done = (next - t).abs() <= 1e-15 * high || high - low <= 1e-16 * high;
            t = next;
            if done {
                break;
            }
        }
        t
    }

    /// e^{-αt} T times p and its first derivatives at any t.
    fn sums<const N: usize>(&self, t: f64) -> [f64; N] {
        let (sin, cos) = libm::sincos(2.0 * PI * t / self.sampling.period);
        let turn = Complex::new(cos, sin);
        let mut phase = Complex::new(1.0, 0.0);
        let mut sums = [0.0; N];
        for (n, &c) in self.spectrum.iter().enumerate() {
            let mut term = c * phase;
            for sum in &mut sums {
                *sum = self.weight(n).mul_add(term.re, *sum);
                term = self.differentiated(n, term);
            }
            phase = phase * turn;
        }
        sums
    }

    /// (α + iω_n) c.
    fn differentiated(&self, n: usize, c: Complex) -> Complex {
        c * Complex::new(self.sampling.damping, self.sampling.angular_frequency(n))
    }

    /// Both signs of a frequency count, zero once.
    fn weight(&self, n: usize) -> f64 {
        if n == 0 { 1.0 } else { 2.0 }
    }
}
