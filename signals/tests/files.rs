//! Arrays in files: their axes, and what is wrong with them.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use osteon_common::signal_layout::{SignalAxis, Transmitter};
use osteon_files::probe_file::ProbeDescription;
use osteon_signals::reading::SignalFile;
use osteon_signals::{SeriesPicker, SignalSeries};
use support::{CLEAN, description, pick};

use SignalAxis::{Receiver, Series, Time, Transmitter as Source};

/// The bytes of an array of NumPy.
fn npy(kind: &str, by_columns: bool, shape: &[usize], numbers: &[u8]) -> Vec<u8> {
    let order = if by_columns { "True" } else { "False" };
    let lengths: Vec<String> = shape.iter().map(|length| format!("{length},")).collect();
    let lengths = lengths.join(" ");
    let header =
        format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({lengths}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(numbers);
    bytes
}

fn of_arrays() -> ProbeDescription {
    let mut probe = description(None);
    probe.signals.sampling_interval = Some(CLEAN.directions[0].step);
    probe
}

/// Reads a file; returns the series, or the message without the file's name.
fn read(bytes: &[u8], probe: &ProbeDescription) -> Result<Vec<SignalSeries>, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("signals.npy");
    std::fs::write(&path, bytes).unwrap();
    let mut series = Vec::new();
    let opened = SignalFile::open(&path);
    let read = opened.and_then(|mut file| file.for_each_series(probe, |one| series.push(one)));
    let shown = format!("{}: ", path.display());
    read.map(|()| series).map_err(|error| error.to_string().replace(&shown, ""))
}

/// Writes the clean signals with two series (the second one twice as large) by these axes, and reads them.
fn check_axes(axes: &[SignalAxis], by_columns: bool) {
    let clean = &CLEAN.directions[0];
    let samples = clean.receivers[0].len();
    let length = |axis: &SignalAxis| match axis {
        Series => 2,
        Source => 1,
        Receiver => clean.receivers.len(),
        Time => samples,
    };
    let shape: Vec<usize> = axes.iter().map(length).collect();
    let order: Vec<usize> = match by_columns {
        true => (0..axes.len()).rev().collect(),
        false => (0..axes.len()).collect(),
    };
    let count: usize = shape.iter().product();
    let mut bytes = Vec::new();
    for number in 0..count {
        let (mut rest, mut at) = (number, [0; 4]);
        for &axis in order.iter().rev() {
            at[axis] = rest % shape[axis];
            rest /= shape[axis];
        }
        let place = |one| axes.iter().position(|&axis| axis == one).map_or(0, |axis| at[axis]);
        let sample = clean.receivers[place(Receiver)][place(Time)] * (1 + place(Series)) as f64;
        bytes.extend(sample.to_le_bytes());
    }
    let mut probe = of_arrays();
    probe.signals.axes = axes.to_vec();
    let series = read(&npy("<f8", by_columns, &shape, &bytes), &probe).unwrap();
    let expected = if axes.contains(&Series) { 2 } else { 1 };
    assert_eq!(series.len(), expected, "{axes:?}");
    assert_eq!(series[0], *CLEAN, "{axes:?}");
    if let Some(second) = series.get(1) {
        assert_eq!(second.directions[0].receivers[3][400], 2.0 * clean.receivers[3][400]);
    }
}

#[test]
fn arrays_are_read_by_their_axes() {
    for by_columns in [false, true] {
        check_axes(&[Time, Receiver], by_columns);
        check_axes(&[Receiver, Time], by_columns);
        check_axes(&[Series, Receiver, Time], by_columns);
        check_axes(&[Receiver, Time, Series], by_columns);
        check_axes(&[Series, Source, Receiver, Time], by_columns);
        check_axes(&[Time, Source, Series, Receiver], by_columns);
    }
}

/// Sixteen bits suffice: rounding is noise as any other.
#[test]
fn whole_numbers_of_a_converter_are_read() {
    let clean = &CLEAN.directions[0];
    let largest = clean.receivers.iter().flatten().fold(0.0, |max: f64, p| max.max(p.abs()));
    let count = |sample: &f64| (sample / largest * 32_000.0).round() as i16;
    let bytes: Vec<u8> =
        clean.receivers.iter().flatten().flat_map(|sample| count(sample).to_le_bytes()).collect();
    let shape = [1, clean.receivers.len(), clean.receivers[0].len()];
    let mut probe = of_arrays();
    probe.signals.band = vec![0.0, 3e6];
    let series = read(&npy("<i2", false, &shape, &bytes), &probe).unwrap();
    let exact = pick(&description(None), &CLEAN).estimate.unwrap();
    let found = SeriesPicker::new(probe).pick(&series[0]).estimate.unwrap();
    let error = (found.velocity - exact.velocity).abs();
    assert!(error < 3.0 * found.standard_error && found.standard_error < 10.0, "{found:?}");
}

fn refused(bytes: &[u8], change: impl Fn(&mut ProbeDescription), expected: &str) {
    let mut probe = of_arrays();
    change(&mut probe);
    let message = read(bytes, &probe).unwrap_err();
    assert!(message.starts_with(expected), "{message}\n{expected}");
}

#[test]
fn what_is_wrong_with_an_array_is_said() {
    let array = |shape: &[usize], value: f64| {
        let count: usize = shape.iter().product();
        let mut bytes: Vec<u8> = value.to_le_bytes().repeat(count);
        if let Some(first) = bytes.get_mut(..8) {
            first.copy_from_slice(&1.0_f64.to_le_bytes());
        }
        npy("<f8", false, shape, &bytes)
    };
    let good = array(&[800, 14], 0.0);
    let none = |_: &mut ProbeDescription| ();
    refused(&[], none, "is damaged: it has no lines");
    refused(&good[..60], none, "is damaged: it ends within its header");
    refused(
        &good[..5000],
        none,
        "is damaged: it has 5000 bytes, and an array of the shape [800, 14] has",
    );
    refused(&[good.clone(), vec![0]].concat(), none, "is damaged: it has ");
    refused(
        &array(&[800, 14], f64::NAN),
        none,
        "series 1, receiver 1, sample 2 is NaN; every sample",
    );
    refused(
        &npy("<f8", false, &[800, 14], &[0; 8 * 800 * 14]),
        none,
        "series 1: all 14 signals are constant",
    );
    refused(
        &array(&[14, 800], 0.0),
        none,
        "probe.receivers.count is 14, and the file has 800 elements",
    );
    refused(&array(&[800, 0], 0.0), none, "signals.axes has the axis \"receiver\" of length 0");
    refused(&array(&[11_200], 0.0), none, "signals.axes is [], and the array has 1 axes");
    refused(
        &array(&[2, 14, 800], 0.0),
        |probe| probe.signals.axes = vec![Time, Receiver],
        "signals.axes is [\"time\", \"receiver\"], and the array has 3 axes, of the lengths [2, 14, 800]",
    );
    refused(
        &good,
        |probe| probe.signals.sampling_interval = None,
        "signals.sampling_interval is missing",
    );
    refused(
        &good,
        |probe| probe.signals.sampling_interval = Some(2e-7),
        "signals.sampling_interval is 2e-7 s; with probe.center_frequency = 1e6 Hz it must be at most 1.25e-7 s",
    );
    refused(&good, |probe| probe.signals.start = 1.0, "signals.start or another key is wrong");
    refused(
        &good,
        |probe| probe.signals.transmitters = vec![Transmitter::First, Transmitter::Second],
        "signals.transmitters names 2, and the file has the signals of 1",
    );
    refused(&good, |probe| probe.signals.band = vec![1.0, 3e6], "signals.band is [1.0, 3000000.0]");
    let absurd = npy("<f8", false, &[usize::MAX / 4, 14, 800], &[]);
    refused(&absurd, none, "is damaged: its shape is");
}

#[test]
fn what_is_no_array_is_named() {
    let none = |_: &mut ProbeDescription| ();
    refused(b"PK\x03\x04", none, "is damaged: its directory of arrays is missing or damaged");
    refused(
        b"MATLAB 5.0 MAT-file",
        none,
        "is damaged: it is of a big-endian machine, or damaged; save it again",
    );
    refused(
        b"TDSm\x0e\x00",
        none,
        "is a TDMS file of LabVIEW; signals are read from CSV, NumPy (NPY, NPZ), MATLAB, HDF5 and",
    );
    refused(b"\xff\xfe\x00", none, "is neither text in UTF-8 nor a file of arrays that is known");
}
