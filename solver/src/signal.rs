//! From a spectrum to a signal: values, slopes, extrema.
//!
//! The pressure at one receiver is a damped trigonometric polynomial,
//! p(t) = e^{αt}/T (c_0 + 2 Re Σ c_n e^{iω_n t}); its slope is one with coefficients
//! (α + iω_n) c_n.

use std::f64::consts::PI;

use osteon_common::case::Setup;
use osteon_common::sampling::{Sampling, direct_arrival, distances};

use crate::complex::Complex;
use crate::lanes::{LANES, Lanes};

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

/// Weighted e^{iω_n t_j} on a grid of times, eight at a time.
#[derive(Debug)]
pub(crate) struct Grid {
    step: f64,
    blocks: usize,
    /// 2 cos and -2 sin (1 and 0 for n = 0) of frequency n at block b: `[b * frequencies + n]`.
    waves: Vec<[Lanes; 2]>,
    frequencies: usize,
}

impl Grid {
    /// A grid that covers every window of the setup.
    pub(crate) fn new(setup: &Setup, sampling: &Sampling, frequencies: usize) -> Self {
        let step = 1.0 / (POINTS_PER_CYCLE * setup.probe.center_frequency);
        let last = distances(setup).map(|x| direct_arrival(setup, x)).fold(0.0, f64::max);
        let blocks = (last / step) as usize / LANES + 2;
        let waves = (0..blocks)
            .flat_map(|b| (0..frequencies).map(move |n| (b, n)))
            .map(|(b, n)| {
                let wave = |lane: usize| {
                    let t = (b * LANES + lane) as f64 * step;
                    libm::sincos(sampling.angular_frequency(n) * t)
                };
                [
                    Lanes(std::array::from_fn(|lane| weight(n) * wave(lane).1)),
                    Lanes(std::array::from_fn(|lane| -weight(n) * wave(lane).0)),
                ]
            })
            .collect();
        Self { step, blocks, waves, frequencies }
    }

    /// Σ of the waves of block `b` with coefficients `c`.
    #[inline(always)]
    fn sum(&self, b: usize, c: &[Complex]) -> Lanes {
        let waves = &self.waves[b * self.frequencies..(b + 1) * self.frequencies];
        let mut sum = Lanes::ZERO;
        for ([re, im], c) in waves.iter().zip(c) {
            sum = im.mul_add(Lanes::splat(c.im), re.mul_add(Lanes::splat(c.re), sum));
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
        slopes: &mut Vec<Complex>,
        extrema: &mut Vec<Extremum>,
    ) {
        extrema.clear();
        slopes.clear();
        for (n, &c) in self.spectrum.iter().enumerate() {
            slopes.push(self.differentiated(n, c));
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
