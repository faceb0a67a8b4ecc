//! The picks of all series as CSV and JSON.

use std::path::PathBuf;

use osteon_common::settings::Picking;
use osteon_files::picking_comment;
use serde::Serialize;

use crate::array_decision::PickRefusal;
use crate::direction::VelocityEstimate;
use crate::pick_failure::PickFailure;
use crate::receiver_pick::{MeasuredValue, ReceiverPick};
use crate::series_pick::SeriesPick;
use crate::waves::{WaveFailure, WavePick, WaveTarget};

/// The header of the CSV file.
const COLUMNS: &str = "velocity,standard_error,quality,failure,other_velocity,other_standard_error,decay,\
                       decay_standard_error,center_frequency,center_frequency_standard_error";

/// A series of a file, with its pick.
#[derive(Debug, Clone, PartialEq)]
pub struct PickedSeries {
    /// The file.
    pub file: PathBuf,
    /// Positions of the receivers, m.
    pub positions: Vec<f64>,
    /// What was found.
    pub pick: SeriesPick,
    /// The guided waves that were looked for.
    pub waves: Vec<WavePick>,
}

impl PickedSeries {
    fn estimate(&self) -> Option<VelocityEstimate> {
        self.pick.estimate.as_ref().ok().copied()
    }

    fn refusal(&self) -> Option<&PickRefusal> {
        self.pick.estimate.as_ref().err()
    }
}

/// Returns the rows of all series as CSV: velocity and standard error in m/s, empty if there is none; quality
/// from 0 to 1; the name of the failure, empty if there is none; the other velocity (m/s), decay (dB/cm) and centre
/// frequency (Hz) with their standard errors, empty if there is none; and likewise for the guided waves `targets`
/// of each series. Comments above them state the criterion.
pub fn to_csv(series: &[PickedSeries], targets: &[WaveTarget], picking: &Picking) -> String {
    let names = targets.iter().flat_map(WaveTarget::columns);
    let header: Vec<String> = std::iter::once(COLUMNS.to_owned()).chain(names).collect();
    let head = picking_comment::of_picking(picking) + &header.join(",") + "\n";
    let row = |one: &PickedSeries| {
        let waves: String = one.waves.iter().map(wave_fields).collect();
        let first = one.pick.first_signal;
        let others = [first.other_velocity, first.decay, first.center_frequency];
        let others: String = others.into_iter().map(measured_fields).collect();
        format!("{}{others}{waves}\n", velocity_fields(&one.pick))
    };
    std::iter::once(head).chain(series.iter().map(row)).collect()
}

fn velocity_fields(pick: &SeriesPick) -> String {
    match &pick.estimate {
        Ok(VelocityEstimate { velocity, standard_error, quality }) => {
            format!("{velocity:?},{standard_error:?},{quality:?},")
        }
        Err(refusal) => format!(",,0.0,{}", refusal.failure.name()),
    }
}

fn measured_fields(found: Option<MeasuredValue>) -> String {
    found.map_or(",,".to_owned(), |it| format!(",{:?},{:?}", it.value, it.standard_error))
}

fn wave_fields(pick: &WavePick) -> String {
    match &pick.estimate {
        Ok(found) => format!(",{:?},{:?},", found.phase_velocity, found.standard_error),
        Err(failure) => format!(",,,{}", failure.name()),
    }
}

#[derive(Serialize)]
struct PicksJson<'a> {
    series: Vec<SeriesJson<'a>>,
    picking: Option<Picking>,
}

#[derive(Serialize)]
struct SeriesJson<'a> {
    file: String,
    velocity: Option<f64>,
    standard_error: Option<f64>,
    quality: f64,
    failure: Option<PickFailure>,
    detail: Option<&'a str>,
    directions: Option<[f64; 2]>,
    other_velocity: Option<MeasuredValue>,
    decay: Option<MeasuredValue>,
    center_frequency: Option<MeasuredValue>,
    receivers: Vec<ReceiverJson>,
    waves: Vec<WaveJson>,
}

#[derive(Serialize)]
struct WaveJson {
    wave: &'static str,
    frequency: f64,
    phase_velocity: Option<f64>,
    standard_error: Option<f64>,
    failure: Option<WaveFailure>,
}

#[derive(Serialize)]
struct ReceiverJson {
    x1: f64,
    time: Option<f64>,
    standard_error: Option<f64>,
    amplitude: Option<MeasuredValue>,
    failure: Option<PickFailure>,
}

/// Returns all series as JSON, with the criterion if it is one for all.
///
/// # Errors
/// If a number is not finite, which none is.
pub fn to_json(
    series: &[PickedSeries],
    picking: Option<Picking>,
) -> Result<String, serde_json::Error> {
    let one = |one: &PickedSeries| {
        let estimate = one.estimate();
        let receivers = one.positions.iter().zip(&one.pick.receivers);
        let receivers = receivers.map(|(&x1, receiver)| {
            let &ReceiverPick { time, standard_error, amplitude, failure } = receiver;
            let standard_error = time.map(|_| standard_error);
            ReceiverJson { x1, time, standard_error, amplitude, failure }
        });
        (estimate, receivers.collect())
    };
    let picks = PicksJson {
        series: series
            .iter()
            .map(|picked| {
                let (estimate, receivers) = one(picked);
                let first = picked.pick.first_signal;
                SeriesJson {
                    file: picked.file.to_string_lossy().into_owned(),
                    velocity: estimate.map(|it| it.velocity),
                    standard_error: estimate.map(|it| it.standard_error),
                    quality: estimate.map_or(0.0, |it| it.quality),
                    failure: picked.refusal().map(|it| it.failure),
                    detail: picked.refusal().map(|it| it.detail.as_str()),
                    directions: picked.pick.directions,
                    other_velocity: first.other_velocity,
                    decay: first.decay,
                    center_frequency: first.center_frequency,
                    receivers,
                    waves: picked.waves.iter().map(wave_json).collect(),
                }
            })
            .collect(),
        picking,
    };
    serde_json::to_string_pretty(&picks).map(|text| text + "\n")
}

fn wave_json(pick: &WavePick) -> WaveJson {
    let found = pick.estimate.as_ref().ok();
    WaveJson {
        wave: pick.target.wave.row().short,
        frequency: pick.target.frequency,
        phase_velocity: found.map(|it| it.phase_velocity),
        standard_error: found.map(|it| it.standard_error),
        failure: pick.estimate.as_ref().err().copied(),
    }
}
