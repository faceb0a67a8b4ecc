//! A first probe file for a file of signals, with what the file says of itself.

use std::fmt::Write as _;

use osteon_common::limits::RECEIVERS_MAX;
use osteon_common::probe::Probe;
use osteon_common::signal_layout::{SignalAxis, TimeUnit};
use osteon_files::document::Format;
use osteon_files::file_error::ContentError;
use osteon_files::probe_file::{self, ProbeDescription};

use crate::reading::{RecognizedSignals, RecordedGrid};

/// Sampling intervals, s, of usual recorders: of 4 MHz to 1 GHz.
const USUAL_INTERVALS: (f64, f64) = (0.9e-9, 2.6e-7);
/// Positions are written in whole parts of this many in a metre.
const POSITION_STEPS: f64 = 1e9;

/// Returns the text of a probe file.
pub fn template(recognized: &RecognizedSignals<'_>) -> String {
    let mut text = String::new();
    // Writing to a string fails only if a value's own formatting does, and none here does.
    let _infallible = write_template(&mut text, recognized);
    text
}

/// Returns the description that a file gives of itself: that of its template.
///
/// # Errors
/// If it is none of a probe.
pub fn own_description(
    recognized: &RecognizedSignals<'_>,
) -> Result<ProbeDescription, ContentError> {
    probe_file::parse(&template(recognized), Format::Toml)
}

fn write_template(out: &mut String, recognized: &RecognizedSignals<'_>) -> std::fmt::Result {
    let probe = Probe::default();
    let (first, pitch, count) = match recognized {
        RecognizedSignals::Table { positions, .. } => receivers_of(positions),
        RecognizedSignals::Array { shape, usual, grid, .. } => {
            let axes = likely_axes(shape, usual);
            let axis = axes.iter().position(|&axis| axis == SignalAxis::Receiver);
            let count = axis.map_or(probe.receivers.count as usize, |axis| shape[axis]);
            let pitch = grid.map_or(probe.receivers.pitch, |grid| rounded(grid.pitch));
            (probe.receivers.first_x1, pitch, count)
        }
    };
    writeln!(
        out,
        "# The probe and how its signals are recorded; for `osteon pick FILE --describe` this file."
    )?;
    writeln!(
        out,
        "# Set what your device has; what is left out has the defaults of a case file.\n"
    )?;
    writeln!(out, "[probe]")?;
    writeln!(out, "center_frequency = {:?}  # Hz", probe.center_frequency)?;
    writeln!(
        out,
        "bidirectional = {}  # whether a second source at the other end emits, too\n",
        is_bidirectional(recognized)
    )?;
    writeln!(out, "[probe.source]")?;
    writeln!(out, "x1 = {:?}  # m, along the bone", probe.source.x1)?;
    writeln!(out, "x3 = {:?}  # m, above the bone\n", probe.source.x3)?;
    writeln!(out, "[probe.receivers]")?;
    writeln!(out, "first_x1 = {first:?}  # m")?;
    writeln!(out, "pitch = {pitch:?}  # m, between neighbours")?;
    writeln!(out, "count = {count}")?;
    writeln!(out, "x3 = {:?}  # m, above the bone\n", probe.receivers.x3)?;
    writeln!(out, "[picking]")?;
    writeln!(out, "extremum = \"first\"")?;
    writeln!(out, "threshold = 0.05  # of the packet's peak\n")?;
    writeln!(out, "[signals]")?;
    write_layout(out, recognized)?;
    let transmitters =
        if is_bidirectional(recognized) { "[\"first\", \"second\"]" } else { "[\"first\"]" };
    writeln!(out, "transmitters = {transmitters}")?;
    let high = 2.5 * probe.center_frequency;
    writeln!(
        out,
        "# band = [0.0, {high:?}]  # Hz; for measured signals: 2.5 times the centre frequency"
    )?;
    writeln!(out, "# full_scale = 1.0  # the largest value that the recorder can store")
}

/// Writes how the signals are recorded, as far as the kind of file decides it.
fn write_layout(out: &mut String, recognized: &RecognizedSignals<'_>) -> std::fmt::Result {
    match recognized {
        RecognizedSignals::Table { step, .. } => {
            writeln!(out, "time_unit = \"{}\"  # of the column of times", unit_of(*step).name())?;
        }
        RecognizedSignals::Array { shape, usual, variable, grid } => {
            if let Some(name) = variable {
                let name = toml::Value::from(*name);
                writeln!(out, "variable = {name}  # the largest array of several")?;
            }
            let axes: Vec<_> = likely_axes(shape, usual)
                .iter()
                .map(|axis| format!("\"{}\"", axis.name()))
                .collect();
            writeln!(out, "axes = [{}]  # of the lengths {shape:?}", axes.join(", "))?;
            match grid {
                Some(RecordedGrid { step, .. }) => {
                    writeln!(out, "sampling_interval = {step:e}  # s, as the file says")?;
                }
                None => writeln!(out, "# sampling_interval = 5e-8  # s; must be given")?,
            }
            writeln!(out, "start = 0.0  # s, of the first sample after the pulse begins")?;
        }
    }
    Ok(())
}

/// Returns position of the first receiver and pitch, m, and number of receivers.
fn receivers_of(positions: &[f64]) -> (f64, f64, usize) {
    let first = positions.first().copied().unwrap_or_default();
    let last = positions.last().copied().unwrap_or_default();
    let steps = positions.len().saturating_sub(1).max(1);
    (rounded(first), rounded((last - first) / steps as f64), positions.len())
}

fn rounded(x: f64) -> f64 {
    (x * POSITION_STEPS).round() / POSITION_STEPS
}

/// Returns the unit in which a step of times is that of a usual recorder; seconds, if none is.
fn unit_of(step: f64) -> TimeUnit {
    let is_usual = |unit: &TimeUnit| {
        (USUAL_INTERVALS.0..=USUAL_INTERVALS.1).contains(&(step / unit.per_second()))
    };
    TimeUnit::ALL.into_iter().find(is_usual).unwrap_or_default()
}

/// Returns the axes that an array of this shape may have, which are usually others: the longest is that of time,
/// and a probe has at most [`RECEIVERS_MAX`] receivers.
fn likely_axes(shape: &[usize], usual: &[SignalAxis]) -> Vec<SignalAxis> {
    let mut axes = usual.to_vec();
    let index_of = |axes: &[SignalAxis], axis| axes.iter().position(|&one| one == axis);
    let longest = (0..shape.len()).max_by_key(|&index| shape[index]);
    if let (Some(time), Some(longest)) = (index_of(&axes, SignalAxis::Time), longest) {
        let is_shorter = shape[time] < shape[longest];
        if is_shorter && axes[longest] != SignalAxis::Series {
            axes.swap(time, longest);
        }
    }
    if let (Some(series), Some(receiver)) =
        (index_of(&axes, SignalAxis::Series), index_of(&axes, SignalAxis::Receiver))
        && shape[receiver] > RECEIVERS_MAX as usize
        && shape[series] <= RECEIVERS_MAX as usize
    {
        axes.swap(series, receiver);
    }
    axes
}

fn is_bidirectional(recognized: &RecognizedSignals<'_>) -> bool {
    match recognized {
        RecognizedSignals::Table { .. } => false,
        RecognizedSignals::Array { shape, usual, .. } => {
            let axes = likely_axes(shape, usual);
            axes.iter()
                .position(|&axis| axis == SignalAxis::Transmitter)
                .is_some_and(|i| shape[i] == 2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_describes_itself() {
        let positions = [0.011, 0.0118, 0.0126, 0.013399999999999999];
        let table = RecognizedSignals::Table {
            positions: &positions,
            start: 0.0,
            step: 0.01,
            samples: 900,
        };
        let description = own_description(&table).unwrap();
        let receivers = description.setup.probe.receivers;
        assert_eq!((receivers.first_x1, receivers.pitch, receivers.count), (0.011, 8e-4, 4));
        assert_eq!(description.signals.time_unit, TimeUnit::Microseconds);
        let two = RecognizedSignals::Table {
            positions: &positions[..2],
            start: 0.0,
            step: 1e-8,
            samples: 900,
        };
        let refused = own_description(&two).unwrap_err().to_string();
        assert!(refused.contains("probe.receivers.count: is 2"), "{refused}");
    }

    fn check(usual: &str, shape: &[usize], expected: &str) {
        let axis = |name: &str| SignalAxis::ALL.into_iter().find(|axis| axis.name() == name);
        let usual: Vec<_> = usual.split(' ').filter_map(axis).collect();
        let names: Vec<_> = likely_axes(shape, &usual).iter().map(|axis| axis.name()).collect();
        assert_eq!(names.join(" "), expected, "{shape:?}");
        let variable = Some("a\"b");
        let text = template(&RecognizedSignals::Array { shape, usual, variable, grid: None });
        let parsed = probe_file::parse(&text, Format::Toml).unwrap();
        assert_eq!(parsed.signals.variable.as_deref(), variable, "{text}");
    }

    #[test]
    fn axes_are_told_by_their_lengths() {
        check("time receiver", &[2000, 14], "time receiver");
        check("time receiver", &[14, 2000], "receiver time");
        check("series receiver time", &[100, 14, 2000], "series receiver time");
        check("series receiver time", &[14, 100, 2000], "receiver series time");
        check("time receiver series", &[2000, 14, 100], "time receiver series");
        let four = "series transmitter receiver time";
        check(four, &[100, 2, 14, 2000], four);
    }
}
