//! Files that other programs wrote.

use std::path::{Path, PathBuf};

use osteon_files::probe_file::ProbeDescription;
use osteon_signals::SignalSeries;
use osteon_signals::reading::SignalFile;

/// Returns the path of a fixture; `files/make_fixtures.py` wrote it.
pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

/// The probe of the fixtures.
pub(crate) fn description(variable: Option<&str>) -> ProbeDescription {
    let mut probe = ProbeDescription::default();
    probe.setup.probe.receivers.count = 4;
    probe.signals.sampling_interval = Some(62.5e-9);
    probe.signals.variable = variable.map(str::to_owned);
    probe
}

/// Reads a file; returns the series, or the message without the file's name.
pub(crate) fn open(path: &Path, probe: &ProbeDescription) -> Result<Vec<SignalSeries>, String> {
    let mut series = Vec::new();
    let opened = SignalFile::open(path);
    let read = opened.and_then(|mut file| file.for_each_series(probe, |one| series.push(one)));
    let shown = format!("{}: ", path.display());
    read.map(|()| series).map_err(|error| error.to_string().replace(&shown, ""))
}
