//! From a spectrum to a signal: values, slopes, extrema.
//!
//! The pressure at one receiver is a damped trigonometric polynomial,
//! p(t) = e^{αt}/T (c_0 + 2 Re Σ c_n e^{iω_n t}); its slope is one with coefficients
//! (α + iω_n) c_n.

use std::f64::consts::PI;

use osteon_common::case::Setup;
use osteon_common::sampling::{Sampling, direct_arrival, distances};

use crate::complex::Complex;
use crate::lanes::{ComplexLanes, LANES, Lanes};

/// Grid points per period of the centre frequency on which extrema are bracketed.
const POINTS_PER_CYCLE: f64 = 40.0;
/// Most steps of the refinement of one extremum; bisection alone needs 40 to reach rounding.
const REFINEMENTS_MAX: usize = 60;
/// A step that moves an extremum by less than this fraction of a grid step, squared by the next
/// one, is the last.
const STEP_MIN: f64 = 1e-7;

/// A local extremum of the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremum {
    /// Time, s.
    pub(crate) time: f64,
    /// Pressure, Pa.
    pub(crate) pressure: f64,
}

/// A grid of times, eight at a time: e^{iωt} at lane l of block b is `coarse` (the block's first
/// time) times `fine` (the lane's delay).
#[derive(Debug)]
pub(crate) struct Grid {
    step: f64,
    blocks: usize,
    /// e^{iω_n t} at the first time of block b: `[b * frequencies + n]`.
    coarse: Vec<Complex>,
    /// e^{iω_n t} of the lanes' delays, doubled for n > 0: both signs of a frequency count.
    fine: Vec<ComplexLanes>,
}

impl Grid {
    /// A grid that covers every window of the setup.
    pub(crate) fn new(setup: &Setup, sampling: &Sampling, frequencies: usize) -> Self {
        let step = 1.0 / (POINTS_PER_CYCLE * setup.probe.center_frequency);
        let last = distances(setup).map(|x| direct_arrival(setup, x)).fold(0.0, f64::max);
        let blocks = (last / step) as usize / LANES + 2;
        let wave = |n: usize, j: usize| {
            let (sin, cos) = libm::sincos(sampling.angular_frequency(n) * (j as f64 * step));
            Complex::new(cos, sin)
        };
        let coarse = (0..blocks)
            .flat_map(|b| (0..frequencies).map(move |n| (b, n)))
            .map(|(b, n)| wave(n, b * LANES))
            .collect();
        let fine = (0..frequencies)
            .map(|n| ComplexLanes {
                re: Lanes(std::array::from_fn(|lane| weight(n) * wave(n, lane).re)),
                im: Lanes(std::array::from_fn(|lane| weight(n) * wave(n, lane).im)),
            })
            .collect();
        Self { step, blocks, coarse, fine }
    }

    /// Σ of the waves of block `b`, `delayed` their coefficients times `fine`.
    #[inline(always)]
    fn sum(&self, b: usize, delayed: &[ComplexLanes]) -> Lanes {
        let coarse = &self.coarse[b * self.fine.len()..(b + 1) * self.fine.len()];
        let mut sum = Lanes::ZERO;
        for (wave, c) in delayed.iter().zip(coarse) {
            sum = wave.im.mul_add(Lanes::splat(-c.im), wave.re.mul_add(Lanes::splat(c.re), sum));
        }
        sum
    }
}

/// The pressure at one receiver.
pub(crate) struct Signal<'a> {
    pub(crate) sampling: &'a Sampling,
    /// c_n.
    pub(crate) spectrum: &'a [Complex],
}

impl Signal<'_> {
    /// p(t), Pa.
    #[inline(always)]
    pub(crate) fn at(&self, t: f64) -> f64 {
        let [sum] = self.sums::<1>(t);
        sum * libm::exp(self.sampling.damping * t) / self.sampling.period
    }

    /// All local extrema in `from` ≤ t < `to` (s), in order of time, into `extrema`.
    ///
    /// `slopes` is scratch memory.
    #[inline(always)]
    pub(crate) fn extrema(
        &self,
        grid: &Grid,
        from: f64,
        to: f64,
        slopes: &mut Vec<ComplexLanes>,
        extrema: &mut Vec<Extremum>,
    ) {
        extrema.clear();
        slopes.clear();
        for (n, (&c, &fine)) in self.spectrum.iter().zip(&grid.fine).enumerate() {
            let slope = self.differentiated(n, c);
            let slope = ComplexLanes { re: Lanes::splat(slope.re), im: Lanes::splat(slope.im) };
            slopes.push(slope * fine);
        }
        let first = (from / grid.step) as usize / LANES;
        let last = ((to / grid.step) as usize / LANES + 1).min(grid.blocks - 1);
        let mut before = None;
        for b in first..=last {
            for (lane, &slope) in grid.sum(b, slopes).0.iter().enumerate() {
                let t = (b * LANES + lane) as f64 * grid.step;
                if let Some((start, old)) = before
                    && ((old < 0.0) != (slope < 0.0))
                {
                    let time = self.refine((start, t), (old, slope), STEP_MIN * grid.step);
                    if time >= from && time < to {
                        extrema.push(Extremum { time, pressure: self.at(time) });
                    }
                }
                before = Some((t, slope));
            }
        }
    }

    /// The zero of the slope inside `bracket`: Newton's method, kept inside by bisection.
    #[inline(always)]
    fn refine(&self, bracket: (f64, f64), slopes: (f64, f64), step_min: f64) -> f64 {
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
            // The factor e^{αt} has no share in the zero: the slope's own derivative is this.
            let mut next = t - slope / self.sampling.damping.mul_add(-slope, curvature);
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let done = (next - t).abs() <= step_min;
            t = next;
            if done {
                break;
            }
        }
        t
    }

    /// e^{-αt} T times p and its first derivatives at any t.
    #[inline(always)]
    fn sums<const N: usize>(&self, t: f64) -> [f64; N] {
        let (sin, cos) = libm::sincos(2.0 * PI * t / self.sampling.period);
        let turn = Complex::new(cos, sin);
        let mut phase = Complex::new(1.0, 0.0);
        let mut sums = [0.0; N];
        for (n, &c) in self.spectrum.iter().enumerate() {
            let mut term = c * phase;
            for sum in &mut sums {
                *sum = weight(n).mul_add(term.re, *sum);
                term = self.differentiated(n, term);
            }
            phase = phase * turn;
        }
        sums
    }

    /// (α + iω_n) c.
    #[inline(always)]
    fn differentiated(&self, n: usize, c: Complex) -> Complex {
        c * Complex::new(self.sampling.damping, n as f64 * self.sampling.frequency_step)
    }
}

/// Both signs of a frequency count, zero once.
#[inline(always)]
fn weight(n: usize) -> f64 {
    if n == 0 { 1.0 } else { 2.0 }
}
