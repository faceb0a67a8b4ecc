//! Whether a file of signals and the description of its probe agree.

use osteon_common::limits::SIGNAL_LENGTH_MAX;
use osteon_common::signal_layout::{SignalAxis, SignalLayout};
use osteon_files::probe_file::ProbeDescription;

use super::array_file::{ArrayFile, RecordedGrid};
use super::signal_content::Recording;
use super::traces_csv::TraceTable;
use crate::array_geometry::ArrayGeometry;
use crate::interpolation::{EDGE, HALF_WIDTH};
use crate::reading_error::SignalFault;

/// Fewest samples in a period of the centre frequency.
const PER_PERIOD_MIN: f64 = 8.0;
/// Largest distance, m, of a column's heading from its receiver's position.
const POSITION_ERROR_MAX: f64 = 1e-6;
/// Largest relative difference of a sampling interval from that of a column of times.
const INTERVAL_ERROR_MAX: f64 = 1e-3;
/// The band, relative to the centre frequency, that a filter must keep.
const KEPT_BAND: (f64, f64) = (0.5, 1.5);
/// Lowest edge above 0, relative to the centre frequency: a filter with a lower one is longer than any record.
const LOWEST: f64 = 0.02;

/// What a file says of itself.
#[derive(Debug, Clone, PartialEq)]
pub enum RecognizedSignals<'a> {
    /// A table of one series.
    Table {
        /// Heading of each receiver's column: x1, m.
        positions: &'a [f64],
        /// First time, in the unit of the column of times.
        start: f64,
        /// Step of the times, in the same unit.
        step: f64,
        /// Number of rows.
        samples: usize,
    },
    /// An array.
    Array {
        /// Lengths of its axes, as the program that wrote it shows them.
        shape: &'a [usize],
        /// What these axes usually count in such a file.
        usual: Vec<SignalAxis>,
        /// Its name, if the file has several from which a description must choose.
        variable: Option<&'a str>,
        /// What the file says of its signals.
        grid: Option<RecordedGrid>,
    },
}

impl RecognizedSignals<'_> {
    /// Returns whether the file says where its receivers are.
    pub fn has_positions(&self) -> bool {
        matches!(self, Self::Table { .. })
    }
}

/// How the series of a file are recorded.
#[derive(Debug)]
pub(super) struct RecordedSeries {
    pub(super) axes: Vec<SignalAxis>,
    /// Number of series.
    pub(super) series: u64,
    /// Time of the first sample, s.
    pub(super) start: f64,
    /// Time between samples, s.
    pub(super) step: f64,
}

/// Checks a file against its description.
pub(super) fn check(
    description: &ProbeDescription,
    recording: &Recording<'_>,
) -> Result<RecordedSeries, SignalFault> {
    let (recorded, samples) = match recording {
        Recording::Table(table) => (of_table(description, table)?, rows(table)),
        Recording::Array(array) => of_array(description, array)?,
    };
    record(description, &recorded, samples)?;
    band(description, recorded.step)?;
    Ok(recorded)
}

fn rows(table: &TraceTable) -> usize {
    table.receivers.first().map_or(0, Vec::len)
}

fn of_table(
    description: &ProbeDescription,
    table: &TraceTable,
) -> Result<RecordedSeries, SignalFault> {
    let ProbeDescription { setup, signals, .. } = description;
    let receivers = &setup.probe.receivers;
    receiver_count(description, table.positions.len(), "columns")?;
    for (index, (expected, &found)) in receivers.positions().zip(&table.positions).enumerate() {
        if (found - expected).abs() > POSITION_ERROR_MAX {
            return Err(SignalFault::disagrees(
                "probe.receivers",
                format!(
                    "has receiver {} at {expected:?} m, and the file has it at {found:?} m in column {}",
                    index + 1,
                    index + 2
                ),
            ));
        }
    }
    transmitter_count(signals, 1)?;
    let scale = signals.time_unit.per_second();
    let step = table.step / scale;
    interval(signals, step, || {
        let unit = signals.time_unit.name();
        format!("the file's column of times has steps of {step:e} s if its unit is \"{unit}\"")
    })?;
    Ok(RecordedSeries {
        axes: Vec::new(),
        series: 1,
        start: signals.start + table.start / scale,
        step,
    })
}

/// Checks that a sampling interval that is given agrees with that of the file, of which `said` tells.
fn interval(
    signals: &SignalLayout,
    step: f64,
    said: impl Fn() -> String,
) -> Result<(), SignalFault> {
    match signals.sampling_interval {
        Some(given) if (given / step - 1.0).abs() > INTERVAL_ERROR_MAX => {
            let problem = format!("is {given:e} s, and {}", said());
            Err(SignalFault::disagrees("signals.sampling_interval", problem))
        }
        _ => Ok(()),
    }
}

fn of_array(
    description: &ProbeDescription,
    array: &ArrayFile,
) -> Result<(RecordedSeries, usize), SignalFault> {
    let signals = &description.signals;
    let shape = array.axes().shape.as_slice();
    let axes = match signals.axes.is_empty() {
        true => array.axes().usual(),
        false => signals.axes.clone(),
    };
    if axes.len() != shape.len() || axes.is_empty() {
        let names: Vec<_> = axes.iter().map(|axis| format!("\"{}\"", axis.name())).collect();
        return Err(SignalFault::disagrees(
            "signals.axes",
            format!(
                "is [{}], and the array has {} axes, of the lengths {shape:?}; name each, in this order",
                names.join(", "),
                shape.len()
            ),
        ));
    }
    let length = |axis| axes.iter().position(|&one| one == axis).map(|index| shape[index]);
    for (&axis, &length) in axes.iter().zip(shape) {
        if length == 0 {
            let problem =
                format!("has the axis \"{}\" of length 0: it has no signals", axis.name());
            return Err(SignalFault::disagrees("signals.axes", problem));
        }
    }
    receiver_count(
        description,
        length(SignalAxis::Receiver).unwrap_or(0),
        "elements along \"receiver\"",
    )?;
    transmitter_count(signals, length(SignalAxis::Transmitter).unwrap_or(1))?;
    let step = array_step(signals, array.grid())?;
    let series = length(SignalAxis::Series).unwrap_or(1) as u64;
    let samples = length(SignalAxis::Time).unwrap_or(0);
    Ok((RecordedSeries { axes, series, start: signals.start, step }, samples))
}

/// Returns the time between the samples of an array, s.
fn array_step(signals: &SignalLayout, grid: Option<RecordedGrid>) -> Result<f64, SignalFault> {
    if let Some(RecordedGrid { step, .. }) = grid {
        interval(signals, step, || format!("the file says that it is {step:e} s"))?;
        return Ok(step);
    }
    signals.sampling_interval.ok_or_else(|| {
        SignalFault::disagrees(
            "signals.sampling_interval",
            "is missing; an array has no times: give the time between samples, in s, in a probe file \
             (--describe)",
        )
    })
}

fn receiver_count(
    description: &ProbeDescription,
    found: usize,
    what: &str,
) -> Result<(), SignalFault> {
    let expected = description.setup.probe.receivers.count;
    if found == expected as usize {
        return Ok(());
    }
    let problem = format!("is {expected}, and the file has {found} {what}");
    Err(SignalFault::disagrees("probe.receivers.count", problem))
}

fn transmitter_count(signals: &SignalLayout, found: usize) -> Result<(), SignalFault> {
    let expected = signals.transmitters.len();
    if found == expected {
        return Ok(());
    }
    let problem = format!("names {expected}, and the file has the signals of {found}");
    Err(SignalFault::disagrees("signals.transmitters", problem))
}

/// Checks that the record is fine and long enough.
fn record(
    description: &ProbeDescription,
    recorded: &RecordedSeries,
    samples: usize,
) -> Result<(), SignalFault> {
    let &RecordedSeries { start, step, .. } = recorded;
    let fc = description.setup.probe.center_frequency;
    if step * fc * PER_PERIOD_MIN > 1.0 {
        return Err(SignalFault::disagrees(
            "signals.sampling_interval",
            format!(
                "is {step:e} s; with probe.center_frequency = {fc:e} Hz it must be at most {:e} s, \
                 {PER_PERIOD_MIN} samples in a period",
                1.0 / (fc * PER_PERIOD_MIN)
            ),
        ));
    }
    if !(4 * HALF_WIDTH..=SIGNAL_LENGTH_MAX).contains(&samples) {
        return Err(SignalFault::damaged(format!(
            "each signal has {samples} samples; there must be {} to {SIGNAL_LENGTH_MAX}",
            4 * HALF_WIDTH
        )));
    }
    let transmitters = description.signals.transmitters.iter();
    for &transmitter in transmitters {
        let geometry = ArrayGeometry::new(&description.setup, transmitter);
        let edge = EDGE as f64 * step;
        let (from, to) = (start + edge, start + (samples - 1) as f64 * step - edge);
        let first = geometry.earliest.iter().copied().fold(f64::INFINITY, f64::min);
        let last = geometry.direct.iter().copied().fold(0.0, f64::max);
        let latest_start = geometry.earliest.iter().copied().fold(0.0, f64::max);
        if from > first || to < latest_start {
            return Err(SignalFault::disagrees(
                "signals.start",
                format!(
                    "or another key is wrong: the record is from {start:e} s to {:e} s after the pulse begins, \
                     and first arrivals are between {first:.2e} s and {last:.2e} s, before and after which \
                     {EDGE} samples are needed",
                    to + edge
                ),
            ));
        }
    }
    Ok(())
}

/// Checks that a filter keeps the pulse.
fn band(description: &ProbeDescription, step: f64) -> Result<(), SignalFault> {
    let fc = description.setup.probe.center_frequency;
    let &[low, high] = description.signals.band.as_slice() else { return Ok(()) };
    let (most_low, least_high) = (KEPT_BAND.0 * fc, KEPT_BAND.1 * fc);
    let most_high = 0.5 / step;
    let is_low = low == 0.0 || (LOWEST * fc..=most_low).contains(&low);
    if is_low && (least_high..=most_high).contains(&high) {
        return Ok(());
    }
    Err(SignalFault::disagrees(
        "signals.band",
        format!(
            "is [{low:?}, {high:?}]; with probe.center_frequency = {fc:?} Hz and the sampling interval {step:e} s \
             it must begin at 0 or between {:?} and {most_low:?} Hz, and end between {least_high:?} and {most_high:?} \
             Hz",
            LOWEST * fc
        ),
    ))
}
