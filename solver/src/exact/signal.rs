//! From a spectrum to a signal: values, slopes, extrema.
//!
//! The pressure at one receiver is a damped trigonometric polynomial,
//! p(t) = 2 e^{αt}/T Re Σ c_n e^{iω_n t}, and so is its slope.

use osteon_common::case::Setup;
use osteon_common::sampling::{FrequencyRun, WaveSampling, direct_arrival};

use crate::complex::Complex;
use crate::exact::tables::Tables;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::picking::PressureExtremum;
use crate::vector::{ComplexVector, Vector};

/// Grid points per period of the centre frequency on which extrema are bracketed.
const POINTS_PER_CYCLE: f64 = 24.0;
/// Maximum number of steps of the refinement of an extremum; bisection alone needs 40 to reach
/// rounding.
const REFINEMENTS_MAX: usize = 60;
/// The refinement ends with a step that moves an extremum by less than this fraction of a grid
/// step; the next step would move it by the square of that.
const STEP_MIN: f64 = 1e-3;
/// Blocks of times that are summed side by side.
const GROUP: usize = 4;

/// A grid of times, eight at a time: e^{iωt} at lane l of block b is `coarse` (the block's first
/// time) times `fine` (the lane's delay).
#[derive(Debug)]
pub(crate) struct TimeGrid {
    step: f64,
    blocks: usize,
    /// α + iω of each line.
    slopes: Vec<Complex>,
    /// e^{iωt} of line i at the first time of block b, `[i * blocks + b]`; empty if that would take
    /// too much memory.
    coarse: Vec<Complex>,
    /// e^{iωt} of each line at the lanes' delays.
    fine: Vec<ComplexLanes>,
}

/// Scratch memory of the search for extrema.
#[derive(Debug, Default)]
pub(crate) struct Slopes {
    /// Coefficients of the slope times `fine`, per line.
    delayed: Vec<ComplexLanes>,
    /// e^{iωt} at the first times of one group of blocks, if the grid does not keep them.
    coarse: Vec<Complex>,
    /// The slope on the grid, from its first block on.
    values: Vec<Lanes>,
    /// Extrema found but not yet refined.
    brackets: Vec<Bracket>,
}

/// An extremum bracketed by two times of the grid.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    low: f64,
    high: f64,
    /// Its estimated time.
    time: f64,
    /// Whether the slope rises, i.e. the extremum is a minimum.
    rising: bool,
    done: bool,
}

impl TimeGrid {
    /// Creates a grid that covers every window of the setup.
    ///
    /// `keep`: whether its waves are kept, or recomputed whenever they are needed.
    pub(crate) fn new(setup: &Setup, tables: &Tables, keep: bool) -> Self {
        let slopes: Vec<_> = tables.lines.iter().map(|line| line.s).collect();
        let mut grid = Self {
            step: Self::step(setup),
            blocks: Self::blocks(setup),
            slopes,
            coarse: Vec::new(),
            fine: Vec::new(),
        };
        let waves = |n| -> [Complex; LANES] { std::array::from_fn(|lane| grid.wave(n, lane)) };
        let lines = 0..grid.slopes.len();
        let fine = lines.clone().map(waves).map(|waves| ComplexLanes {
            re: Lanes(waves.map(|wave| wave.re)),
            im: Lanes(waves.map(|wave| wave.im)),
        });
        grid.fine = fine.collect();
        if keep {
            let coarse = lines.flat_map(|n| (0..grid.blocks).map(move |b| (n, b)));
            grid.coarse = coarse.map(|(n, b)| grid.wave(n, b * LANES)).collect();
        }
        grid
    }

    /// Returns the memory of a grid of this many lines that keeps its waves, bytes.
    pub(crate) fn bytes(setup: &Setup, lines: usize) -> f64 {
        let a_line = Self::blocks(setup) * size_of::<Complex>() + size_of::<ComplexLanes>();
        lines as f64 * a_line as f64
    }

    fn step(setup: &Setup) -> f64 {
        1.0 / (POINTS_PER_CYCLE * setup.probe.center_frequency)
    }

    fn blocks(setup: &Setup) -> usize {
        let places = setup.probe.places();
        let last = places.map(|place| direct_arrival(setup, place)).fold(0.0, f64::max);
        ((last / Self::step(setup)) as usize / LANES + 2).next_multiple_of(GROUP)
    }

    /// Returns e^{iωt} of a line at time `j` of the grid.
    fn wave(&self, line: usize, j: usize) -> Complex {
        let (sin, cos) = libm::sincos(self.slopes[line].im * (j as f64 * self.step));
        Complex::new(cos, sin)
    }

    /// Returns e^{iωt} of the first `lines` at the first times of the [`GROUP`] blocks from `start`
    /// on, as a slice indexed by `[i * stride + offset + b]`, with stride and offset.
    #[inline(always)]
    fn coarse<'a>(
        &'a self,
        lines: usize,
        start: usize,
        scratch: &'a mut Vec<Complex>,
    ) -> (&'a [Complex], usize, usize) {
        if !self.coarse.is_empty() {
            return (&self.coarse, self.blocks, start);
        }
        scratch.clear();
        for line in 0..lines {
            scratch.extend((start..start + GROUP).map(|b| self.wave(line, b * LANES)));
        }
        (scratch, GROUP, 0)
    }

    /// Computes the slope, times e^{-αt} T/2, in the blocks from `first` to at least `last`.
    #[inline(always)]
    fn slopes<V: Vector>(
        &self,
        signal: &Signal<'_>,
        first: usize,
        last: usize,
        slopes: &mut Slopes,
    ) {
        slopes.delayed.clear();
        let lines = self.slopes.len().min(signal.spectrum.len() * LANES);
        for (n, &derivative) in self.slopes[..lines].iter().enumerate() {
            let run = &signal.spectrum[n / LANES];
            let slope = derivative * Complex::new(run.re.0[n % LANES], run.im.0[n % LANES]);
            let slope = ComplexVector { re: V::splat(slope.re), im: V::splat(slope.im) };
            let mut delayed = ComplexLanes::ZERO;
            for part in 0..V::PARTS {
                slope.mul(ComplexVector::load(&self.fine[n], part)).store(&mut delayed, part);
            }
            slopes.delayed.push(delayed);
        }
        slopes.values.clear();
        let mut b = first;
        while b <= last {
            // The last group may begin earlier, so that it ends with the grid.
            let start = b.min(self.blocks - GROUP);
            let (waves, stride, offset) = self.coarse(lines, start, &mut slopes.coarse);
            let mut sums = [Lanes::ZERO; GROUP];
            for part in 0..V::PARTS {
                let mut sum = [V::splat(0.0); GROUP];
                for (n, delayed) in slopes.delayed.iter().enumerate() {
                    let wave = ComplexVector::<V>::load(delayed, part);
                    let at = n * stride + offset;
                    let coarse = &waves[at..at + GROUP];
                    for i in 0..GROUP {
                        let c = coarse[i];
                        let real = wave.re.mul_add(V::splat(c.re), sum[i]);
                        sum[i] = wave.im.mul_sub_from(V::splat(c.im), real);
                    }
                }
                for i in 0..GROUP {
                    sum[i].store(&mut sums[i], part);
                }
            }
            for i in b - start..GROUP {
                slopes.values.push(sums[i]);
            }
            b = start + GROUP;
        }
    }
}

/// The pressure at one receiver.
pub(crate) struct Signal<'a> {
    pub(crate) sampling: &'a WaveSampling,
    /// The runs in which the lines are stored.
    pub(crate) runs: &'a [FrequencyRun],
    /// The lines of the first runs, tapered; zero where a line is not computed.
    pub(crate) spectrum: &'a [ComplexLanes],
}

/// e^{-αt} T/2 times the pressure and its first two derivatives, at eight times.
struct Derivatives {
    value: Lanes,
    slope: Lanes,
    curvature: Lanes,
}

impl Signal<'_> {
    /// Returns p, Pa, at eight times, s.
    #[inline(always)]
    pub(crate) fn at<V: Vector>(&self, times: &Lanes) -> Lanes {
        let mut pressures = self.derivatives::<V, _>(&self.turns(times), &Unweighted).value;
        for lane in 0..LANES {
            pressures.0[lane] = self.pressure(times.0[lane], pressures.0[lane]);
        }
        pressures
    }

    #[inline(always)]
    fn pressure(&self, t: f64, value: f64) -> f64 {
        2.0 * value * libm::exp(self.sampling.damping * t) / self.sampling.period
    }

    /// Writes all local extrema in `from` ≤ t < `to` (s), in order of time, to `extrema`; returns
    /// p(`to`), Pa.
    #[inline(always)]
    pub(crate) fn extrema<V: Vector>(
        &self,
        grid: &TimeGrid,
        from: f64,
        to: f64,
        slopes: &mut Slopes,
        extrema: &mut Vec<PressureExtremum>,
    ) -> f64 {
        let first = (from / grid.step) as usize / LANES;
        let last = ((to / grid.step) as usize / LANES + 1).min(grid.blocks - 1);
        grid.slopes::<V>(self, first, last, slopes);
        slopes.values.truncate(last - first + 1);
        find_brackets(grid.step, first, slopes);
        slopes.brackets.push(Bracket { low: to, high: to, time: to, rising: true, done: true });
        extrema.clear();
        let mut last = 0.0;
        for brackets in slopes.brackets.chunks_mut(LANES) {
            let values = self.refine::<V>(brackets, STEP_MIN * grid.step);
            for (bracket, value) in brackets.iter().zip(values.0) {
                let time = bracket.time;
                last = self.pressure(time, value);
                if time >= from && time < to {
                    extrema.push(PressureExtremum { time, pressure: last });
                }
            }
        }
        last
    }

    /// Moves the times of up to eight brackets to the zeros of the slope by Newton's method, kept
    /// inside the brackets by bisection; converged times stay. Returns the pressures there, times
    /// e^{-αt} T/2.
    #[inline(always)]
    fn refine<V: Vector>(&self, brackets: &mut [Bracket], step_min: f64) -> Lanes {
        let mut values = None;
        let mut times = Lanes::ZERO;
        for _ in 0..REFINEMENTS_MAX {
            for (time, bracket) in times.0.iter_mut().zip(&*brackets) {
                *time = bracket.time;
            }
            let at = self.derivatives::<V, _>(&self.turns(&times), &Unweighted);
            let values = values.get_or_insert(at.value);
            let mut all_done = true;
            for (lane, bracket) in brackets.iter_mut().enumerate() {
                if bracket.done {
                    continue;
                }
                values.0[lane] = at.value.0[lane];
                let (t, slope) = (bracket.time, at.slope.0[lane]);
                if (slope > 0.0) == bracket.rising {
                    bracket.high = t;
                } else {
                    bracket.low = t;
                }
                let mut next = t - self.newton_step(slope, at.curvature.0[lane]);
                if !(next > bracket.low && next < bracket.high) {
                    next = 0.5 * (bracket.low + bracket.high);
                }
                bracket.done = (next - t).abs() <= step_min;
                bracket.time = next;
                all_done &= bracket.done;
            }
            if all_done {
                break;
            }
        }
        values.unwrap_or(Lanes::ZERO)
    }

    /// Returns the position to which one step of Newton's method moves the extremum near `time` (s)
    /// if the lines are weighted: `weights` contains, by run and line, eight weightings side by
    /// side.
    #[inline(always)]
    pub(crate) fn moved_extrema<V: Vector>(&self, time: f64, weights: &[[Lanes; LANES]]) -> Lanes {
        let (sin, cos) = libm::sincos(self.sampling.frequency_step * time);
        let turns = ComplexLanes { re: Lanes([cos; LANES]), im: Lanes([sin; LANES]) };
        let at = self.derivatives::<V, _>(&turns, weights);
        let mut times = Lanes([time; LANES]);
        for lane in 0..LANES {
            times.0[lane] -= self.newton_step(at.slope.0[lane], at.curvature.0[lane]);
        }
        times
    }

    /// Returns the first and second derivatives of the pressure, Pa/s and Pa/s², at eight times (s) if
    /// the lines are weighted: `weights` contains one weight per line, by run.
    #[inline(always)]
    pub(crate) fn bends<V: Vector>(&self, times: &Lanes, weights: &[Lanes]) -> (Lanes, Lanes) {
        let at = self.derivatives::<V, _>(&self.turns(times), weights);
        let (mut slopes, mut curvatures) = (Lanes::ZERO, Lanes::ZERO);
        for (lane, &t) in times.0.iter().enumerate() {
            slopes.0[lane] = self.pressure(t, at.slope.0[lane]);
            curvatures.0[lane] = self.pressure(t, at.curvature.0[lane]);
        }
        (slopes, curvatures)
    }

    /// The factor e^{αt} does not affect the zero: this is Newton's step for the rest.
    #[inline(always)]
    fn newton_step(&self, slope: f64, curvature: f64) -> f64 {
        slope / self.sampling.damping.mul_add(-slope, curvature)
    }

    /// Returns e^{iωt} of the first frequency above zero.
    #[inline(always)]
    fn turns(&self, times: &Lanes) -> ComplexLanes {
        let mut turns = ComplexLanes::ZERO;
        for lane in 0..LANES {
            let (sin, cos) = libm::sincos(self.sampling.frequency_step * times.0[lane]);
            turns.re.0[lane] = cos;
            turns.im.0[lane] = sin;
        }
        turns
    }

    /// Returns the derivatives at eight times, given by their [`Signal::turns`].
    #[inline(always)]
    fn derivatives<V: Vector, W: Weights + ?Sized>(
        &self,
        turns: &ComplexLanes,
        weights: &W,
    ) -> Derivatives {
        let (alpha, omega) = (self.sampling.damping, self.sampling.frequency_step);
        let zero = Lanes::ZERO;
        let mut derivatives = Derivatives { value: zero, slope: zero, curvature: zero };
        for part in 0..V::PARTS {
            let mut turn = ComplexVector::<V>::load(turns, part);
            let mut phase = ComplexVector { re: V::splat(1.0), im: V::splat(0.0) };
            let mut stride = 1;
            // Σ Re, Σ n Im, Σ n² Re of c e^{iωt}.
            let (mut a, mut b, mut second) = (V::splat(0.0), V::splat(0.0), V::splat(0.0));
            for (i, (run, spectrum)) in self.runs.iter().zip(self.spectrum).enumerate() {
                while stride < run.stride {
                    turn = turn.mul(turn);
                    stride *= 2;
                }
                // Two chains of phases, for even and odd lines: half the latency.
                let mut phases = [phase, phase.mul(turn)];
                let double = turn.mul(turn);
                for lane in 0..LANES {
                    let n = (run.first + lane * run.stride) as f64;
                    let c = (spectrum.re.0[lane], spectrum.im.0[lane]);
                    let (re, im) = weights.apply::<V>(i, lane, part, c);
                    let phase = &mut phases[lane % 2];
                    let value = phase.im.mul_sub_from(im, phase.re.mul(re));
                    let other = phase.im.mul_add(re, phase.re.mul(im));
                    a = a.add(value);
                    b = other.mul_add(V::splat(n), b);
                    second = value.mul_add(V::splat(n * n), second);
                    *phase = phase.mul(double);
                }
                phase = phases[0];
            }
            let turned = b.mul(V::splat(-omega));
            let bent = second.mul(V::splat(-(omega * omega)));
            let (alpha, twice) = (V::splat(alpha), V::splat(2.0 * alpha));
            a.store(&mut derivatives.value, part);
            alpha.mul_add(a, turned).store(&mut derivatives.slope, part);
            let curvature = alpha.mul(alpha).mul_add(a, twice.mul_add(turned, bent));
            curvature.store(&mut derivatives.curvature, part);
        }
        derivatives
    }
}

/// Factor of a line's coefficient in each of eight lanes.
trait Weights {
    /// Returns the weighted coefficient of line `line` of run `run`, in part `part` of the lanes.
    fn apply<V: Vector>(&self, run: usize, line: usize, part: usize, c: (f64, f64)) -> (V, V);
}

/// Weights of 1.
struct Unweighted;

impl Weights for Unweighted {
    #[inline(always)]
    fn apply<V: Vector>(&self, _: usize, _: usize, _: usize, (re, im): (f64, f64)) -> (V, V) {
        (V::splat(re), V::splat(im))
    }
}

/// The same weights in all lanes.
impl Weights for [Lanes] {
    #[inline(always)]
    fn apply<V: Vector>(&self, run: usize, line: usize, _: usize, (re, im): (f64, f64)) -> (V, V) {
        let weight = self[run].0[line];
        (V::splat(weight * re), V::splat(weight * im))
    }
}

impl Weights for [[Lanes; LANES]] {
    #[inline(always)]
    fn apply<V: Vector>(
        &self,
        run: usize,
        line: usize,
        part: usize,
        (re, im): (f64, f64),
    ) -> (V, V) {
        let weight = V::load(&self[run][line], part);
        (weight.mul(V::splat(re)), weight.mul(V::splat(im)))
    }
}

/// Lists the sign changes of the slope on the grid, whose values begin with block `first`.
#[inline(always)]
fn find_brackets(step: f64, first: usize, slopes: &mut Slopes) {
    let Slopes { values, brackets, .. } = slopes;
    brackets.clear();
    let count = values.len() * LANES;
    let mut before = values[0].0[0];
    for (block, lanes) in values.iter().enumerate() {
        let mut negative = 0_u32;
        for lane in 0..LANES {
            negative |= u32::from(lanes.0[lane] < 0.0) << lane;
        }
        // Bit i: the sign changes between value i - 1 and i.
        let mut changes = (negative ^ (negative << 1 | u32::from(before < 0.0))) & 0xff;
        before = lanes.0[LANES - 1];
        while changes != 0 {
            let i = block * LANES + changes.trailing_zeros() as usize;
            changes &= changes - 1;
            let at = |i: usize| values[i / LANES].0[i % LANES];
            let (a, b) = (at(i - 1), at(i));
            let within = if i >= 2 && i + 1 < count {
                cubic_root([at(i - 2), a, b, at(i + 1)])
            } else {
                a / (a - b)
            };
            let start = (first * LANES + i - 1) as f64;
            brackets.push(Bracket {
                low: start * step,
                high: (start + 1.0) * step,
                time: (start + within) * step,
                rising: b > a,
                done: false,
            });
        }
    }
}

/// Returns the approximate root between 0 and 1 of the cubic through values at -1, 0, 1, 2, given
/// that the middle values differ in sign: two Newton steps from the secant's root.
#[inline(always)]
fn cubic_root([a, b, c, d]: [f64; 4]) -> f64 {
    // The Newton form at 0, 1, -1, 2.
    let (first, second) = (c - b, 0.5 * (c - 2.0 * b + a));
    let third = (d - a - 3.0 * (c - b)) / 6.0;
    let secant = b / (b - c);
    let mut x = secant;
    for _ in 0..2 {
        let (p, q) = (x * (x - 1.0), x + 1.0);
        let value = third.mul_add(p * q, second.mul_add(p, first.mul_add(x, b)));
        let bend = 2.0 * x - 1.0;
        let slope = third.mul_add(bend.mul_add(q, p), second.mul_add(bend, first));
        x -= value / slope;
    }
    if (0.0..=1.0).contains(&x) { x } else { secant }
}
