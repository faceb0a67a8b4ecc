//! Files of arrays by other programs: the same signals come out of each of them, and what is no array of signals
//! is refused with its name.

#[path = "support/fixtures.rs"]
mod fixtures;

use fixtures::{description, fixture, open};
use osteon_common::signal_layout::SignalAxis;
use osteon_signals::reading::SignalFile;
use osteon_signals::{SeriesPicker, SignalSeries, template};

use SignalAxis::{Receiver, Series, Time};

/// Reads an array of a file; returns the series, or the message without the file's name.
fn read(
    name: &str,
    variable: Option<&str>,
    axes: &[SignalAxis],
) -> Result<Vec<SignalSeries>, String> {
    let mut probe = description(variable);
    probe.signals.axes = axes.to_vec();
    open(&fixture(name), &probe)
}

#[test]
fn every_format_gives_the_same_signals_and_picks() {
    let expected = read("signals.npy", None, &[]).unwrap();
    let picker = SeriesPicker::new(description(None));
    let picks = |all: &[SignalSeries]| all.iter().map(|one| picker.pick(one)).collect::<Vec<_>>();
    let expected_picks = picks(&expected);
    // What the simulation says, as far as the rounding leaves it.
    for pick in &expected_picks {
        let found = pick.estimate.as_ref().unwrap();
        assert!((found.velocity - 3886.8).abs() < 3.0, "{found:?}");
    }
    for (name, variable, axes) in [
        ("signals.npz", Some("signals"), &[][..]),
        ("scipy-6.mat", None, &[]),
        ("scipy-7.mat", Some("rf"), &[]),
        ("scipy-7.mat", Some("probe.data.rf"), &[Time, Receiver, Series]),
        ("octave-6.mat", None, &[]),
        ("octave-7.mat", None, &[]),
        ("octave-7.mat", Some("probe.rf"), &[]),
        ("matlab-7.3.mat", None, &[]),
        ("matlab-7.3.mat", Some("probe.rf"), &[]),
        ("matlab-7.3.mat", Some("/probe/rf"), &[Time, Receiver, Series]),
        ("arrays.h5", Some("/raw/rf"), &[]),
        ("arrays.h5", Some("raw/time_first"), &[Time, Receiver, Series]),
    ] {
        let found = read(name, variable, axes).unwrap();
        assert_eq!(found, expected, "{name} {variable:?}");
        assert_eq!(format!("{:?}", picks(&found)), format!("{expected_picks:?}"), "{name}");
    }
    // A file of a simulation has one series, and a step of its own.
    let found = read("receivers.rcv2D", None, &[]).unwrap();
    assert_eq!(found[..], expected[..1]);
}

#[test]
fn what_is_no_array_of_signals_is_refused_by_its_name() {
    let of_scipy =
        "the file has \"rf\" [160, 4, 2], \"noise\" [2, 3], \"probe.data.rf\" [160, 4, 2]";
    for (name, variable, expected) in [
        ("scipy-7.mat", None, format!("is missing, and {of_scipy}")),
        ("scipy-7.mat", Some("rg"), format!("is \"rg\", and {of_scipy}")),
        (
            "scipy-7.mat",
            Some("label"),
            "which is no array of real numbers: a text; the file".into(),
        ),
        ("scipy-7.mat", Some("mixture"), "real numbers: an array of complex numbers; the".into()),
        ("scipy-7.mat", Some("cells"), "real numbers: a cell array; the file has".into()),
        ("scipy-7.mat", Some("sparse"), "real numbers: a sparse matrix; the file has".into()),
        ("scipy-7.mat", Some("flags"), "real numbers: an array of truth values; the".into()),
        ("scipy-7.mat", Some("probe"), "is \"probe\", which has parts; the file has".into()),
        ("octave-7.mat", Some("many"), "real numbers: an array of structures; the".into()),
        ("octave-7.mat", Some("deep"), "is \"deep\", and the file has \"probe.rf\"".into()),
        ("signals.npz", Some("label"), "its numbers are \"<U6\"; they must be integers".into()),
        (
            "signals.npz",
            None,
            "is missing, and the file has \"signals\" [2, 4, 160], \"noise\"".into(),
        ),
        ("signals.npy", Some("x"), "is \"x\", and the file's signals have no name".into()),
        ("matlab-7.3.mat", Some("probe.label"), "real numbers: a text; the file".into()),
        ("arrays.h5", None, "is missing, and the file has \"/raw/rf\" [2, 4, 160], \"/raw/".into()),
        ("arrays.h5", Some("/raw/mixture"), "an array of complex numbers; the".into()),
        ("arrays.h5", Some("/raw/label"), "real numbers: a text; the file has".into()),
        ("arrays.h5", Some("raw/half"), "an array of numbers of another type; the".into()),
        ("arrays.h5", Some("raw"), "is \"raw\", which has parts; the file has".into()),
    ] {
        let message = read(name, variable, &[]).unwrap_err();
        assert!(message.starts_with("signals.variable is "), "{name} {variable:?}: {message}");
        assert!(message.contains(&expected), "{name} {variable:?}: {message}\n{expected}");
    }
    let huge = ("odd.h5", Some("huge"));
    for ((name, variable), axes, expected) in [
        (huge, &[][..], "series 1: all 4 signals are constant"),
        (
            huge,
            &[Time, Receiver, Series],
            "is damaged: each signal has 20000000 samples; there must be",
        ),
        (huge, &[Receiver, Series, Time], "probe.receivers.count is 4, and the file has 20000000"),
        (
            ("odd.h5", None),
            &[],
            "signals.variable is missing, and the file has \"/huge\" [20000000, 4, 4000], \"/lzf\" [1, 4, 128]; name",
        ),
        (
            ("scipy-6.mat", None),
            &[Time, Receiver],
            "signals.axes is [\"time\", \"receiver\"], and the array has 3",
        ),
    ] {
        let message = read(name, variable, axes).unwrap_err();
        assert!(message.starts_with(expected), "{name}: {message}");
    }
    // A compression that no program but h5py has.
    let message = read("odd.h5", Some("/lzf"), &[]).unwrap_err();
    assert!(message.starts_with("is damaged: \"lzf\" cannot be read: unsupported filter"));
}

#[test]
fn a_template_chooses_the_largest_array_and_the_axes() {
    for (name, expected) in [
        ("scipy-7.mat", &["variable = \"rf\"", "axes = [\"time\", \"receiver\", \"series\"]"][..]),
        ("octave-6.mat", &["axes = [\"time\", \"receiver\", \"series\"]"]),
        ("arrays.h5", &["variable = \"/raw/", "count = 4\n"]),
        ("receivers.rcv2D", &["sampling_interval = 6.25e-8", "pitch = 0.0008 ", "count = 4\n"]),
    ] {
        let file = SignalFile::open(&fixture(name)).unwrap();
        let text = template(&file.recognized());
        for part in expected {
            assert!(text.contains(part), "{name}: {part}\n{text}");
        }
    }
}
