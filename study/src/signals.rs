//! Velocities picked in signals of known bones ([`picks`]), and bones identified from them ([`studies`]).

use osteon_common::case::Setup;
use osteon_common::job::Data;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::{RandomDistribution, Scatter};
use osteon_local::synthesis::{Recorder, SyntheticStudy};
use osteon_signals::{ArraySignals, SeriesPicker, SignalSeries, VelocityEstimate};

use crate::blocks::{FinishedBlock, in_blocks};
use crate::draws::OPTIMUM;
use crate::generator::Generator;
use crate::porosities::{self, DISPERSIONS, Found, IntervalCount, POROSITIES, matrix_point};
use crate::table::MarkdownTable;
use crate::twins::{Twins, data_seed};
use crate::{RowCallback, StudyError};

/// Default number of measurements of [`picks`] at each level of noise.
pub const MEASUREMENTS: u64 = 400;
/// Default number of studies of [`studies`].
pub const STUDIES: u64 = 100;
/// Levels of noise of [`picks`] below the peak of the first packet, dB.
const NOISE: [f64; 4] = [40.0, 30.0, 20.0, 10.0];
/// Largest tilt of [`picks`], degrees; tilts are uniform.
const TILT: f64 = 3.0;
/// Measurements of one seed, and of one device.
const OF_DEVICE: u64 = 20;
/// Measurements of each study of [`studies`], and their noise, dB.
const OF_STUDY: u64 = 60;
const NOISE_OF_STUDY: f64 = 30.0;
/// Time between samples, s.
const TIME_STEP: f64 = 2e-8;
/// A velocity that is wrong by more than so many of its standard errors is called wrong.
const WRONG: f64 = 6.0;
/// Half the width of the 95 % interval in standard errors.
const MOST: f64 = 1.959_963_984_540_054;

/// Picks signals in both directions of bones at the paper's optimum, with tilts of up to 3°, receivers whose gains
/// differ by 1 dB and of which 2 % fail, at four levels of noise; compares velocities with those of the model.
///
/// # Errors
/// If there are no signals.
pub fn picks(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "noise (dB)",
        "measurements",
        "without a velocity",
        "bias (m/s)",
        "stated standard error, r.m.s. (m/s)",
        "95 % intervals that hold the velocity (%)",
        "off by more than 6 standard errors",
    ]);
    for level in NOISE {
        let mut errors = PickErrors::default();
        let devices = twins.repetitions.div_ceil(OF_DEVICE);
        for block in in_blocks(devices, |number| picked_by_device(twins, number, level).map(Some)) {
            for (picked, truth) in block?.found.iter().flatten() {
                errors.add(picked.as_ref(), *truth);
            }
        }
        table.push([vec![format!("{level:.0}")], errors.cells()].concat());
        progress(&table.last_row());
    }
    Ok(table)
}

/// Counts the 95 % intervals of porosity and dispersion that hold the truth, of studies of 60 measurements each in
/// both directions, with noise of 30 dB, gains that differ by 1 dB, and receivers of which 1 % fail. Velocities and
/// their standard errors are those of the picks. Truths are drawn uniformly.
///
/// # Errors
/// If there are no signals, or an identification fails.
pub fn studies(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut counts = [IntervalCount::default(); 2];
    for block in in_blocks(twins.repetitions, |number| identify_study(twins, number).map(Some)) {
        let FinishedBlock { done, found } = block?;
        for found in &found {
            counts.iter_mut().zip(found).for_each(|(count, found)| count.add(found));
        }
        progress(&format!("{done} studies: {counts:?}"));
    }
    let mut table = MarkdownTable::new(&[
        "quantity",
        "intervals",
        "without one",
        "intervals that hold it (%)",
        "r.m.s. of (found - true)/s.e.",
    ]);
    for (name, count) in ["porosity", "dispersion"].into_iter().zip(counts) {
        table.push([vec![name.to_owned()], count.cells()].concat());
    }
    Ok(table)
}

/// How far velocities are from the truth.
#[derive(Debug, Clone, Copy, Default)]
struct PickErrors {
    all: u64,
    picked: u64,
    held: u64,
    wrong: u64,
    sum: f64,
    squares: f64,
}

impl PickErrors {
    /// Adds a measurement; one of a bone without a velocity is none.
    fn add(&mut self, picked: Option<&VelocityEstimate>, truth: Outcome) {
        let Ok(truth) = truth else { return };
        self.all += 1;
        let Some(VelocityEstimate { velocity, standard_error, .. }) = picked else { return };
        let error = velocity - truth;
        self.picked += 1;
        self.held += u64::from(error.abs() <= MOST * standard_error);
        self.wrong += u64::from(error.abs() > WRONG * standard_error);
        self.sum += error;
        self.squares = standard_error.mul_add(*standard_error, self.squares);
    }

    fn cells(&self) -> Vec<String> {
        let picked = self.picked as f64;
        let counts = [self.all.to_string(), (self.all - self.picked).to_string()];
        let of_picked = match self.picked {
            0 => ["–"; 4].map(str::to_owned),
            _ => [
                format!("{:+.2}", self.sum / picked),
                format!("{:.2}", (self.squares / picked).sqrt()),
                format!("{:.1}", 100.0 * self.held as f64 / picked),
                self.wrong.to_string(),
            ],
        };
        [&counts[..], &of_picked].concat()
    }
}

/// A velocity that was picked, and that of the model.
type PickedVelocity = (Option<VelocityEstimate>, Outcome);

/// Records and picks the measurements of one device.
fn picked_by_device(
    twins: &Twins,
    number: u64,
    level: f64,
) -> Result<Vec<PickedVelocity>, StudyError> {
    let mut setup = Setup::default();
    setup.probe.bidirectional = true;
    let recorder = recorder(level, 0.02);
    let seed = data_seed(twins.seed, number);
    let mut job = porosities::specification(&setup, None, 1, seed);
    // A uniform law reaches √3 standard deviations to either side.
    job.random.probe_tilt = Scatter {
        standard_deviation: Some(TILT.to_radians() / 3.0_f64.sqrt()),
        distribution: RandomDistribution::Uniform,
    };
    let study =
        SyntheticStudy::record((&job, &OPTIMUM), OF_DEVICE, &recorder, (twins.isa, 1), || {})?;
    Ok(pick(&study))
}

/// Returns porosity and dispersion as identified from signals.
fn identify_study(twins: &Twins, number: u64) -> Result<[Found; 2], StudyError> {
    let mut generator = Generator::for_index(twins.seed, number);
    let truth = [POROSITIES, DISPERSIONS].map(|[from, to]| generator.between(from, to));
    let mut setup = Setup::default();
    setup.probe.bidirectional = true;
    let seed = data_seed(twins.seed, number);
    let mut bones = porosities::specification(&setup, None, 1, seed);
    bones.setup.structure.porosity = Some(truth[0]);
    let point: Point = matrix_point(truth[1]);
    let recorder = recorder(NOISE_OF_STUDY, 0.01);
    let study =
        SyntheticStudy::record((&bones, &point), OF_STUDY, &recorder, (twins.isa, 1), || {})?;
    let picked: Vec<VelocityEstimate> = pick(&study).into_iter().filter_map(|one| one.0).collect();
    let velocities: Vec<f64> = picked.iter().map(|one| one.velocity).collect();
    let squares: f64 = picked.iter().map(|one| one.standard_error * one.standard_error).sum();
    let repeatability = (squares / picked.len() as f64).sqrt();
    let data = Data { repeatability, ..Data::from_velocities(velocities) };
    let found = porosities::identify_pores(&setup, data, twins)?;
    Ok([0, 1].map(|k| (found.map(|found| found[k]), truth[k])))
}

fn recorder(noise_db: f64, dropouts: f64) -> Recorder {
    Recorder {
        noise_db: Some(noise_db),
        gain_db: 1.0,
        dropouts,
        time_step: Some(TIME_STEP),
        ..Recorder::default()
    }
}

/// Picks all series of a study.
fn pick(study: &SyntheticStudy) -> Vec<PickedVelocity> {
    let description = study.description();
    let picker = SeriesPicker::new(description.clone());
    let picked = study.truths().iter().enumerate().map(|(series, truth)| {
        let recorded = description.signals.transmitters.iter().zip(study.signals(series));
        let directions = recorded.map(|(&transmitter, receivers)| ArraySignals {
            transmitter,
            offset: 0.0,
            start: 0.0,
            step: TIME_STEP,
            receivers,
        });
        let signals = SignalSeries { directions: directions.collect() };
        (picker.pick(&signals).estimate.ok(), *truth)
    });
    picked.collect()
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn picked_velocities_are_those_of_the_model() {
        let twins = Twins { repetitions: 20, seed: 1, isa: Isa::fastest() };
        let table = picks(&twins, &|_| {}).unwrap();
        let rows = table.rows();
        assert_eq!(rows.len(), NOISE.len());
        let bias: f64 = rows[0][3].parse().unwrap();
        assert!(rows[0][1] == "20" && bias.abs() < 5.0, "{table}");
        assert_eq!([&rows[0][6], &rows[1][6], &rows[2][6]], ["0"; 3], "{table}");
    }

    #[test]
    fn a_study_of_signals_finds_its_porosity() {
        let twins = Twins { repetitions: 1, seed: 3, isa: Isa::fastest() };
        let [(porosity, truth), _] = identify_study(&twins, 0).unwrap();
        let found = porosity.unwrap();
        let error = found.known.unwrap().standard_error;
        assert!((found.value - truth).abs() < 4.0 * error, "{found:?}, {truth}");
    }
}
