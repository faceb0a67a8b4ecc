//! Phase velocities of guided waves from the signals of an array.

use std::f64::consts::PI;

use osteon_common::observables::Observable;
use osteon_files::probe_file::ProbeDescription;

use super::response_matrix::SideSignals;
use super::signal_subspace::SignalSubspace;
use super::wave_failure::WaveFailure;
use crate::array_signals::SignalSeries;

/// Smallest squared length of a plane wave's part in the space of the signals that shows a wave.
const NORM_MIN: f64 = 0.6;
/// Largest standard error of a phase velocity, relative to it.
const RELATIVE_ERROR_MAX: f64 = 0.05;
/// Wavenumbers that are looked at in the width of a wave's peak, 2π over the length of the array.
const STEPS_OF_PEAK: f64 = 16.0;
/// Most of them.
const STEPS_MAX: f64 = 10_000.0;
/// Halvings of a step that find the maximum within it.
const HALVINGS: usize = 40;
/// Periods of the slowest wave that must be recorded after its arrival.
const PERIODS_AFTER: f64 = 2.0;

/// A phase velocity with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveEstimate {
    /// Phase velocity, m/s: 2π times the frequency, divided by the wavenumber; of two sides by its mean.
    pub phase_velocity: f64,
    /// Its standard error from the noise, m/s; 0 if the noise is unknown.
    pub standard_error: f64,
}

/// A wave at a frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveTarget {
    /// The wave.
    pub wave: Observable,
    /// Frequency, Hz.
    pub frequency: f64,
    /// Its lowest and highest phase velocity, m/s.
    range: [f64; 2],
    /// Whether the frequency is that of the probe's guided waves, at which the model has the observable.
    is_observable: bool,
}

/// What was found of one wave at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct WavePick {
    /// The wave.
    pub target: WaveTarget,
    /// Its phase velocity, or why there is none.
    pub estimate: Result<WaveEstimate, WaveFailure>,
}

/// Finds guided waves in the series of one probe.
#[derive(Debug, Clone)]
pub struct WaveFinder {
    description: ProbeDescription,
    targets: Vec<WaveTarget>,
}

impl WaveTarget {
    /// Returns the names of its columns: of the velocity, its standard error and the failure. The observable of a
    /// job has that of the job's key; at another frequency all end with it.
    pub fn columns(&self) -> [String; 3] {
        let velocity = self.wave.name();
        let short = velocity.trim_end_matches("_velocity");
        let end = match self.is_observable {
            true => String::new(),
            false => format!("_{}kHz", self.frequency / 1e3),
        };
        [
            format!("{velocity}{end}"),
            format!("{short}_standard_error{end}"),
            format!("{short}_failure{end}"),
        ]
    }
}

impl WaveFinder {
    /// Creates a finder for a probe that has been checked.
    pub fn new(description: ProbeDescription) -> Self {
        let observable = description.setup.probe.frequency_of_guided_waves();
        let mut frequencies = description.waves.frequencies.clone();
        if frequencies.is_empty() {
            frequencies.push(observable);
        }
        let target = |wave, range, frequency| WaveTarget {
            wave,
            frequency,
            range,
            is_observable: frequency == observable,
        };
        let wanted = description.waves.wanted();
        let targets = wanted
            .into_iter()
            .flat_map(|(wave, range)| frequencies.iter().map(move |&f| target(wave, range, f)))
            .collect();
        Self { description, targets }
    }

    /// Returns which waves are found.
    pub fn targets(&self) -> &[WaveTarget] {
        &self.targets
    }

    /// Finds the waves of a series. The bits depend on the series and the probe alone.
    ///
    /// Each array must have the probe's number of receivers.
    pub fn find(&self, series: &SignalSeries) -> Vec<WavePick> {
        if self.targets.is_empty() {
            return Vec::new();
        }
        let sides = SideSignals::of_series(&self.description, series);
        let estimate = |target: &WaveTarget| {
            let sides = sides.as_ref().map_err(|failure| *failure)?;
            let found = sides.iter().map(|side| self.wavenumber(side, target));
            of_sides(&found.collect::<Result<Vec<_>, _>>()?, target.frequency)
        };
        let pick =
            |target| WavePick { target: WaveTarget::clone(target), estimate: estimate(target) };
        self.targets.iter().map(pick).collect()
    }

    /// Returns the wavenumber of a wave as one side sees it, rad/m, and its standard error.
    fn wavenumber(
        &self,
        side: &SideSignals<'_>,
        target: &WaveTarget,
    ) -> Result<(f64, f64), WaveFailure> {
        let &WaveTarget { frequency, range: [slowest, fastest], .. } = target;
        let omega = 2.0 * PI * frequency;
        let [least, most] = [omega / fastest, omega / slowest];
        if most * self.description.setup.probe.receivers.pitch >= 2.0 * PI {
            return Err(WaveFailure::TooCoarse);
        }
        if side.end < side.farthest / slowest + PERIODS_AFTER / frequency {
            return Err(WaveFailure::TooShort);
        }
        let threshold = self.description.waves.threshold;
        let space = SignalSubspace::new(&side.positions, side.response(frequency), threshold);
        if space.is_empty() {
            return Err(WaveFailure::TooNoisy);
        }
        let found = peaks(&space, side.aperture(), [least, most]);
        let &[k] = found.as_slice() else {
            let is_none = found.is_empty();
            return Err(if is_none { WaveFailure::NoWave } else { WaveFailure::SeveralWaves });
        };
        // Where noise decides how many waves there are, the other number has another wavenumber.
        let other = space.other_choice().map(|other| peaks(&other, side.aperture(), [least, most]));
        let nearest = other.into_iter().flatten().map(|other| (other - k).abs()).reduce(f64::min);
        let error = libm::hypot(space.standard_error(k), nearest.unwrap_or(0.0));
        match error <= RELATIVE_ERROR_MAX * k {
            true => Ok((k, error)),
            false => Err(WaveFailure::TooNoisy),
        }
    }
}

/// Returns the wavenumbers between `least` and `most`, rad/m, at which there is a wave.
fn peaks(space: &SignalSubspace, aperture: f64, [least, most]: [f64; 2]) -> Vec<f64> {
    let wide = 2.0 * PI / (aperture * STEPS_OF_PEAK);
    let count = ((most - least) / wide).ceil().clamp(1.0, STEPS_MAX);
    let step = (most - least) / count;
    let at = |j: usize| (j as f64).mul_add(step, least);
    let slopes: Vec<f64> = (0..=count as usize).map(|j| space.shape(at(j)).slope).collect();
    let rises_and_falls = |(_, two): &(usize, &[f64])| two[0] > 0.0 && two[1] <= 0.0;
    let found = slopes.windows(2).enumerate().filter(rises_and_falls);
    let found = found.map(|(j, _)| maximum(space, at(j), at(j + 1)));
    found.filter(|k| space.norm(*k) >= NORM_MIN).collect()
}

/// Returns where the slope falls through 0 between two wavenumbers.
fn maximum(space: &SignalSubspace, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if space.shape(middle).slope > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Returns the phase velocity by the mean wavenumber of all sides, which hardly depends on a tilt.
fn of_sides(sides: &[(f64, f64)], frequency: f64) -> Result<WaveEstimate, WaveFailure> {
    let count = sides.len() as f64;
    let k = sides.iter().map(|(k, _)| k).sum::<f64>() / count;
    let square = sides.iter().fold(0.0, |sum: f64, (_, error)| error.mul_add(*error, sum));
    let phase_velocity = 2.0 * PI * frequency / k;
    if !phase_velocity.is_finite() {
        return Err(WaveFailure::NoWave);
    }
    Ok(WaveEstimate {
        phase_velocity,
        standard_error: phase_velocity * square.sqrt() / (count * k),
    })
}
