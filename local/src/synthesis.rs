//! Studies of a known truth: the signals that a probe would record of a job's realizations.
//!
//! All bits follow from the job, the point and the settings of the recorder, on every number of threads.

mod noise;
mod npy;

use std::fmt::Write as _;

use osteon_common::case::Case;
use osteon_common::germ_source::GermSource;
use osteon_common::job::JobSpecification;
use osteon_common::limits::SIGNAL_SAMPLES_MAX;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::porosity::NoPorousBone;
use osteon_common::realization::{Ensemble, NoBone, PointError, mean_bone};
use osteon_common::settings::Method;
use osteon_common::signal_layout::{SignalAxis, SignalLayout, SignalUnit, Transmitter};
use osteon_files::probe_file::ProbeDescription;
use osteon_solver::{Failure, Isa, Solver, TraceError, Workspace};
use rayon::ThreadPoolBuildError;
use rayon::prelude::*;
use thiserror::Error;

use self::noise::NoiseStream;
use crate::source_traces::{source_traces, sources};

/// Samples in a period of the centre frequency, unless the time step is given.
const SAMPLES_OF_PERIOD: f64 = 50.0;
/// A record ends after the latest first signal of the mean bone by this fraction of its time, and these periods.
const LATER_BY: f64 = 0.3;
const PERIODS_AFTER: f64 = 4.0;
/// Length of a first packet, in periods, from the picked extremum on.
const PACKET_PERIODS: f64 = 1.2;
/// Edge of the filter for signals with noise, as a multiple of the centre frequency.
const BAND: f64 = 2.5;
/// The recorder's largest number.
const COUNTS: f64 = 32_767.0;
/// The largest sample of the mean bone is smaller than the recorder's largest by this factor.
const HEADROOM: f64 = 1.25;

/// How signals are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Recorder {
    /// Level of the noise below the peak of the mean bone's first packet, dB; `None`: no noise.
    pub noise_db: Option<f64>,
    /// Standard deviation of the receivers' gains, dB. Each receiver has one gain throughout.
    pub gain_db: f64,
    /// Probability that a receiver records nothing in a series, 0 to 1.
    pub dropouts: f64,
    /// Largest pressure that is recorded, in peaks of the mean bone's first packet; `None`: larger than any.
    pub full_scale: Option<f64>,
    /// Time between samples, s; `None`: a fiftieth of the period of the centre frequency.
    pub time_step: Option<f64>,
    /// Time of the last sample, s; `None`: some periods after the latest first signal.
    pub duration: Option<f64>,
    /// Number of sources beyond each of the probe's own.
    pub further_sources: u32,
    /// Distance of these neighbours, m.
    pub source_pitch: f64,
}

/// Signals of many bones, as whole numbers of a recorder.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticStudy {
    /// Lengths of the array's axes.
    shape: Vec<usize>,
    /// The samples, in the order of the axes.
    samples: Vec<i16>,
    /// The model's velocity of each series.
    truths: Vec<Outcome>,
    description: ProbeDescription,
}

/// Reason why a study cannot be synthesized.
#[derive(Debug, Error)]
pub enum SynthesisError {
    /// The point has no ensemble.
    #[error(transparent)]
    Point(#[from] PointError),
    /// The point has no mean bone.
    #[error("the mean bone is not defined: {0}")]
    NoMean(#[from] NoPorousBone),
    /// The mean bone has no first signal, by which the record's length and its noise are chosen.
    #[error("the mean bone has no first signal: {}: {}", .0.kind.name(), .0.detail)]
    NoSignal(Failure),
    /// A realization does not exist.
    #[error(
        "series {index} has no bone: {reason}; lower the dispersion, or choose another monte_carlo.seed"
    )]
    NoBone {
        /// Index of the realization.
        index: u64,
        /// Why.
        reason: NoBone,
    },
    /// There are no traces.
    #[error(transparent)]
    Traces(#[from] TraceError),
    /// There are too many samples.
    #[error(
        "{series} series of {each} samples are more than {SIGNAL_SAMPLES_MAX} in all; ask for fewer series, or for a \
         longer --time-step"
    )]
    TooLarge {
        /// Number of series.
        series: u64,
        /// Number of samples of each.
        each: u64,
    },
    /// No threads can be started.
    #[error(transparent)]
    Threads(#[from] ThreadPoolBuildError),
}

impl SyntheticStudy {
    /// Records `series` independent bones of a job's law at `point`, with the solver's exact layers, on so many
    /// threads. They follow from the job's seed, and are none of its realizations, so that the job can be run on
    /// their velocities. `done` is called after each.
    ///
    /// # Errors
    /// If there is no such bone, or too much is asked for.
    pub fn record(
        (specification, point): (&JobSpecification, &Point),
        series: u64,
        recorder: &Recorder,
        (isa, threads): (Isa, usize),
        done: impl Fn() + Sync,
    ) -> Result<Self, SynthesisError> {
        let recording = RecordingDevice::new(specification, point, recorder, isa)?;
        let each = recording.samples_of_series();
        if series.saturating_mul(each) > SIGNAL_SAMPLES_MAX {
            return Err(SynthesisError::TooLarge { series, each });
        }
        let record = |workspace: &mut Workspace, index| {
            let recorded = recording.series(index, workspace);
            done();
            recorded
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let all = pool.install(|| {
            let all = (0..series).into_par_iter().map_init(Workspace::default, record);
            all.collect::<Result<Vec<_>, _>>()
        })?;
        let (samples, truths): (Vec<Vec<i16>>, Vec<Outcome>) = all.into_iter().unzip();
        let description = recording.description();
        let mut shape = vec![series as usize];
        shape.extend(recording.lengths());
        Ok(Self { shape, samples: samples.concat(), truths, description })
    }

    /// Returns the file of the signals, an array of NumPy.
    pub fn to_npy(&self) -> Vec<u8> {
        npy::of_samples(&self.shape, &self.samples)
    }

    /// Returns the signals of a series, in steps of the recorder: of each source those of all receivers.
    pub fn signals(&self, series: usize) -> Vec<Vec<Vec<f64>>> {
        let [.., receivers, samples] = self.shape[..] else { return Vec::new() };
        let each = self.shape[1..].iter().product();
        let recorded = self.samples.chunks(each).nth(series).unwrap_or_default();
        let receiver = |samples: &[i16]| samples.iter().copied().map(f64::from).collect();
        let source = |signals: &[i16]| signals.chunks(samples).map(receiver).collect();
        recorded.chunks(receivers * samples).map(source).collect()
    }

    /// Returns the model's velocity of each series.
    pub fn truths(&self) -> &[Outcome] {
        &self.truths
    }

    /// Returns how the signals are recorded.
    pub fn description(&self) -> &ProbeDescription {
        &self.description
    }

    /// Returns the model's velocity of each series, m/s, as CSV.
    pub fn truths_csv(&self) -> String {
        let mut text = "series,velocity,failure\n".to_owned();
        for (index, truth) in self.truths.iter().enumerate() {
            let velocity = truth.map_or_else(|_| String::new(), |velocity| format!("{velocity:?}"));
            let failure = truth.err().map_or("", |kind| kind.name());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{},{velocity},{failure}", index + 1);
        }
        text
    }
}

/// What all series have in common.
struct RecordingDevice<'a> {
    specification: &'a JobSpecification,
    ensemble: Ensemble,
    solver: Solver,
    recorder: Recorder,
    /// Each with how much farther it is than the probe's own on its side, m.
    sources: Vec<(Transmitter, f64)>,
    /// Time between samples, and of the last one, s.
    step: f64,
    duration: f64,
    /// Standard deviation of the noise, Pa.
    noise: f64,
    /// Gain of each receiver.
    gains: Vec<f64>,
    /// Pressure of one step of the recorder, Pa.
    count: f64,
}

impl<'a> RecordingDevice<'a> {
    fn new(
        specification: &'a JobSpecification,
        point: &Point,
        recorder: &Recorder,
        isa: Isa,
    ) -> Result<Self, SynthesisError> {
        let mut device = NoiseStream::of_device(specification.monte_carlo.seed);
        let bones = GermSource::streams(device.seed());
        let ensemble = Ensemble::drawn(point, bones)?.with_random(specification.random);
        let setup = point.setup(&specification.setup);
        let mean = mean_bone(point, &setup)?;
        let solver = Solver::with_isa(&setup, isa);
        let arrival =
            solver.arrival(&mean, &mut Workspace::default()).map_err(SynthesisError::NoSignal)?;
        let period = 1.0 / setup.probe.center_frequency;
        let latest = arrival.times.iter().fold(0.0, |latest: f64, time| latest.max(*time));
        let step = recorder.time_step.unwrap_or(period / SAMPLES_OF_PERIOD);
        let usual = latest * (1.0 + LATER_BY) + PERIODS_AFTER * period;
        let duration = recorder.duration.unwrap_or(usual);
        let traces = solver.traces(&mean, duration.max(usual), step)?;
        let packets = traces.pressures.iter().zip(&arrival.times).map(|(trace, time)| {
            let place = |time: f64| ((time / step) as usize).min(trace.len());
            peak(&trace[place(*time)..place(time + PACKET_PERIODS * period)])
        });
        let packet = packets.sum::<f64>() / arrival.times.len() as f64;
        let mut largest = traces.pressures.iter().map(|trace| peak(trace)).fold(0.0, f64::max);
        let sources = sources(&setup.probe, recorder.further_sources, recorder.source_pitch);
        // Waves may be larger from farther sources, where several add up.
        let case = Case { setup, bone: mean };
        for source in sources.iter().filter(|(_, offset)| *offset > 0.0) {
            let traces = source_traces(&case, *source, (duration, step), isa)?;
            largest = traces.iter().map(|trace| peak(trace)).fold(largest, f64::max);
        }
        let scale = recorder.full_scale.map_or(HEADROOM * largest, |ratio| ratio * packet);
        let gain = |_| decibels(recorder.gain_db * device.normal());
        Ok(Self {
            specification,
            ensemble,
            recorder: *recorder,
            sources,
            step,
            duration,
            noise: recorder.noise_db.map_or(0.0, |level| packet * decibels(-level)),
            gains: (0..case.setup.probe.receivers.count).map(gain).collect(),
            count: scale / COUNTS,
            solver,
        })
    }

    /// Returns the lengths of the axes of one series.
    fn lengths(&self) -> Vec<usize> {
        let (receivers, samples) =
            (self.gains.len(), (self.duration / self.step + 1e-9) as usize + 1);
        match self.sources.len() {
            1 => vec![receivers, samples],
            several => vec![several, receivers, samples],
        }
    }

    fn samples_of_series(&self) -> u64 {
        self.lengths().into_iter().fold(1, |product, length| product.saturating_mul(length as u64))
    }

    /// Records the bone at `index`; returns its samples and its velocity.
    fn series(
        &self,
        index: u64,
        workspace: &mut Workspace,
    ) -> Result<(Vec<i16>, Outcome), SynthesisError> {
        let given = self.solver.setup();
        let drawn = self.ensemble.realization(index, given);
        let drawn = drawn.map_err(|reason| SynthesisError::NoBone { index, reason })?;
        let case = drawn.into_case(given);
        let truth = self.solver.realization(&self.ensemble, index, workspace).outcome;
        let seed = self.specification.monte_carlo.seed;
        let mut random = NoiseStream::of_series(seed, index);
        let mut samples = Vec::with_capacity(self.samples_of_series() as usize);
        for source in &self.sources {
            let sampling = (self.duration, self.step);
            let traces = source_traces(&case, *source, sampling, self.solver.isa())?;
            for (trace, gain) in traces.iter().zip(&self.gains) {
                let is_dead = random.uniform() < self.recorder.dropouts;
                samples.extend(trace.iter().map(|pressure| {
                    let noisy = self.noise.mul_add(random.normal(), gain * pressure);
                    if is_dead { 0 } else { self.converted(noisy) }
                }));
            }
        }
        Ok((samples, truth))
    }

    /// Returns what the recorder stores of a pressure, Pa; beyond its largest number it is saturated.
    fn converted(&self, pressure: f64) -> i16 {
        (pressure / self.count).round_ties_even().clamp(-COUNTS, COUNTS) as i16
    }

    fn description(&self) -> ProbeDescription {
        let mut setup = self.solver.setup().clone();
        setup.solver.method = Method::Exact;
        let usual = [SignalAxis::Receiver, SignalAxis::Time];
        let of_sources = (self.sources.len() > 1).then_some(SignalAxis::Transmitter);
        let band = match self.recorder.noise_db {
            Some(_) => vec![0.0, BAND * setup.probe.center_frequency],
            None => Vec::new(),
        };
        let signals = SignalLayout {
            axes: [SignalAxis::Series].into_iter().chain(of_sources).chain(usual).collect(),
            sampling_interval: Some(self.step),
            unit: SignalUnit::Counts,
            full_scale: Some(COUNTS),
            band,
            transmitters: self.sources.iter().map(|(side, _)| *side).collect(),
            transmitter_offsets: match self.recorder.further_sources {
                0 => Vec::new(),
                _ => self.sources.iter().map(|(_, offset)| *offset).collect(),
            },
            ..SignalLayout::default()
        };
        ProbeDescription { setup, signals, ..ProbeDescription::default() }
    }
}

fn peak(samples: &[f64]) -> f64 {
    samples.iter().fold(0.0, |peak: f64, sample| peak.max(sample.abs()))
}

/// Returns the ratio of amplitudes of so many decibels.
fn decibels(level: f64) -> f64 {
    libm::pow(10.0, level / 20.0)
}

#[cfg(test)]
mod tests;
