//! The spectra of an array at one frequency, and of their noise.

use std::f64::consts::PI;
use std::ops::Range;

use osteon_common::case::Setup;
use osteon_common::line_fit::mean;
use osteon_common::signal_layout::Transmitter;
use osteon_files::probe_file::ProbeDescription;
use osteon_solver::Complex;

use super::wave_failure::WaveFailure;
use crate::array_geometry::ArrayGeometry;
use crate::array_signals::{ArraySignals, SignalSeries};
use crate::moveout_fit::LOST_MAX;
use crate::receiver_signal::{first_clipped, of_one_kind};

/// Part of the record at its end that is faded out: a wave that is still there has no edge.
const FADED: f64 = 0.1;
/// Fewest receivers.
const RECEIVERS_MIN: usize = 3;
/// Fewest samples of noise alone by which its power is known.
const QUIET_MIN: usize = 16;
/// Least number of periods in them: a slower wave is hidden by the window and by the signal's offset.
const QUIET_PERIODS_MIN: f64 = 2.0;

/// All signals of the sources on one side of a probe.
#[derive(Debug)]
pub(super) struct SideSignals<'a> {
    /// Places of the receivers that are used, m, away from the sources.
    pub(super) positions: Vec<f64>,
    /// Largest distance of a receiver from a source, m.
    pub(super) farthest: f64,
    /// Time between samples, and of the last one, s.
    step: f64,
    pub(super) end: f64,
    /// For each source, the samples of each receiver that is used, with their mean before the first arrival.
    signals: Vec<Vec<(&'a [f64], f64)>>,
    /// Samples that are noise; empty if there are too few.
    quiet: Range<usize>,
}

/// The spectra of all signals of a side at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ResponseMatrix {
    /// For each source those of the receivers.
    pub(super) columns: Vec<Vec<Complex>>,
    /// Standard deviation of the noise of each, if it is known.
    pub(super) noise: Option<f64>,
}

impl<'a> SideSignals<'a> {
    /// Returns the signals of a series by the sides on which their sources are.
    ///
    /// # Errors
    /// If those of a side cannot be used.
    pub(super) fn of_series(
        description: &ProbeDescription,
        series: &'a SignalSeries,
    ) -> Result<Vec<Self>, WaveFailure> {
        let ProbeDescription { setup, signals, .. } = description;
        let of_side = |side| Self::of_side(setup, signals.full_scale, side, series);
        Transmitter::ALL.into_iter().filter_map(of_side).collect()
    }

    /// Takes the signals of a series whose sources are on one side; `None` if there are none.
    fn of_side(
        setup: &Setup,
        full_scale: Option<f64>,
        side: Transmitter,
        series: &'a SignalSeries,
    ) -> Option<Result<Self, WaveFailure>> {
        let of_side = series.directions.iter().filter(|array| array.transmitter == side);
        let arrays: Vec<&ArraySignals> = of_side.collect();
        let first = *arrays.first()?;
        let geometry = ArrayGeometry::new(setup, side);
        let all: Vec<Vec<&[f64]>> = arrays.iter().map(|array| from_the_source(array)).collect();
        let period = 1.0 / (setup.probe.center_frequency * first.step);
        let is_clipped = |raw: &&[f64]| first_clipped(raw, period, full_scale).is_some();
        if all.iter().flatten().any(is_clipped) {
            return Some(Err(WaveFailure::Saturated));
        }
        let alive: Vec<usize> = (0..geometry.distances.len())
            .filter(|&r| all.iter().all(|of_source| !is_constant(of_source[r])))
            .collect();
        let lost = geometry.distances.len() - alive.len();
        if lost as f64 > LOST_MAX * geometry.distances.len() as f64 || alive.len() < RECEIVERS_MIN {
            return Some(Err(WaveFailure::DeadReceiver));
        }
        let earliest = geometry.earliest.iter().copied().fold(f64::INFINITY, f64::min);
        let quiet = quiet_samples(&all, &alive, (earliest - first.start) / first.step);
        let offset = |samples: &[f64]| match quiet.is_empty() {
            true => 0.0,
            false => mean(&samples[quiet.clone()]),
        };
        let samples = all.first().map_or(0, |of_source| of_source[alive[0]].len());
        let used = |of_source: &Vec<&'a [f64]>| -> Vec<(&'a [f64], f64)> {
            alive.iter().map(|&r| (of_source[r], offset(of_source[r]))).collect()
        };
        let last = geometry.distances.iter().copied().fold(0.0, f64::max);
        Some(Ok(Self {
            positions: alive.iter().map(|&r| geometry.distances[r]).collect(),
            farthest: arrays.iter().map(|array| last + array.offset).fold(0.0, f64::max),
            step: first.step,
            end: (samples.saturating_sub(1) as f64).mul_add(first.step, first.start),
            signals: all.iter().map(used).collect(),
            quiet,
        }))
    }

    /// Returns the length of the array, m.
    pub(super) fn aperture(&self) -> f64 {
        let ends = self.positions.first().zip(self.positions.last());
        ends.map_or(0.0, |(first, last)| last - first)
    }

    /// Returns the spectra at `frequency`, Hz, up to a common factor.
    pub(super) fn response(&self, frequency: f64) -> ResponseMatrix {
        let samples = self.signals.first().and_then(|of_source| of_source.first());
        let samples = samples.map_or(0, |(samples, _)| samples.len());
        let phases = self.phases(frequency, 0..samples);
        let window: Vec<f64> = (0..samples).map(|j| fading(j, samples)).collect();
        let weights = weighted(&phases, &window);
        let columns = self.signals.iter().map(|of_source| {
            of_source.iter().map(|(samples, offset)| spectrum(samples, *offset, &weights)).collect()
        });
        let columns = columns.collect();
        ResponseMatrix { columns, noise: self.noise(frequency, &window) }
    }

    /// Returns the factors of a Fourier transform at these samples.
    fn phases(&self, frequency: f64, samples: Range<usize>) -> Vec<Complex> {
        let turn = -2.0 * PI * frequency * self.step;
        let phase = |j: usize| {
            let (sin, cos) = libm::sincos(turn * j as f64);
            Complex::new(cos, sin)
        };
        samples.map(phase).collect()
    }

    /// Returns the standard deviation of the noise of a spectrum: from the power at this frequency of what is
    /// recorded before any wave arrives, in the mean over all signals; at the lowest that is seen there, if that is
    /// higher.
    fn noise(&self, frequency: f64, window: &[f64]) -> Option<f64> {
        if self.quiet.is_empty() {
            return None;
        }
        let count = self.quiet.len();
        let frequency = frequency.max(QUIET_PERIODS_MIN / (count as f64 * self.step));
        let bell: Vec<f64> = (0..count)
            .map(|j| {
                let sine = libm::sin(PI * (j as f64 + 0.5) / count as f64);
                sine * sine
            })
            .collect();
        let weights = weighted(&self.phases(frequency, self.quiet.clone()), &bell);
        let powers: Vec<f64> = self
            .signals
            .iter()
            .flatten()
            .map(|(samples, offset)| {
                spectrum(&samples[self.quiet.clone()], *offset, &weights).norm_sqr()
            })
            .collect();
        let squares = |window: &[f64]| window.iter().fold(0.0, |sum: f64, w| w.mul_add(*w, sum));
        Some((mean(&powers) / squares(&bell) * squares(window)).sqrt())
    }
}

impl ResponseMatrix {
    /// Returns the root of the sum of all squares.
    pub(super) fn size(&self) -> f64 {
        let squares = self.columns.iter().flatten().map(|z| z.norm_sqr());
        squares.fold(0.0, |sum, square| sum + square).sqrt()
    }
}

/// Returns the samples of the receivers in the order of their distances from the source.
fn from_the_source(array: &ArraySignals) -> Vec<&[f64]> {
    let mut receivers: Vec<&[f64]> = array.receivers.iter().map(Vec::as_slice).collect();
    if array.transmitter == Transmitter::Second {
        receivers.reverse();
    }
    receivers
}

fn is_constant(samples: &[f64]) -> bool {
    samples.windows(2).all(|two| two[0] == two[1])
}

/// Returns the samples before the place of the earliest arrival that are noise in all signals.
fn quiet_samples(all: &[Vec<&[f64]>], alive: &[usize], earliest: f64) -> Range<usize> {
    let signals = || all.iter().flat_map(|of_source| alive.iter().map(|&r| of_source[r]));
    let shortest = signals().map(<[f64]>::len).min().unwrap_or(0);
    let whole = 0..(earliest.max(0.0) as usize).min(shortest);
    let starts = signals().map(|samples| of_one_kind(samples, whole.clone()).start);
    let quiet = starts.max().unwrap_or(0)..whole.end;
    if quiet.len() < QUIET_MIN { 0..0 } else { quiet }
}

/// Returns the window of the record: 1, and falling to 0 at its end.
fn fading(j: usize, samples: usize) -> f64 {
    let faded = FADED * samples as f64;
    let left = ((samples - j) as f64 / faded).min(1.0);
    0.5 * (1.0 - libm::cos(PI * left))
}

fn weighted(phases: &[Complex], window: &[f64]) -> Vec<Complex> {
    phases.iter().zip(window).map(|(phase, size)| phase.scale(*size)).collect()
}

fn spectrum(samples: &[f64], offset: f64, weights: &[Complex]) -> Complex {
    samples.iter().zip(weights).fold(Complex::default(), |sum, (sample, weight)| {
        let sample = sample - offset;
        Complex::new(weight.re.mul_add(sample, sum.re), weight.im.mul_add(sample, sum.im))
    })
}
