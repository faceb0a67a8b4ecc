//! Signals from files: which kind of file it is, and whether it agrees with the description of the probe.

mod array_file;
mod description;
mod npy;
mod npz;
mod signal_content;
mod traces_csv;

use std::io::Read as _;
use std::path::{Path, PathBuf};

use osteon_common::limits::FILE_BYTES_MAX;
use osteon_files::probe_file::ProbeDescription;
use osteon_files::user_file;

use crate::array_signals::{ArraySignals, SignalSeries};
use crate::reading_error::{SignalFault, SignalFileError};

use self::array_file::{ArrayFile, SeriesBlock};
use self::signal_content::SignalContent;

pub use self::description::RecognizedSignals;
pub(crate) use self::description::usual_axes;

/// How files begin that are recognized and not read, and what they are.
const OTHERS: [(&[u8], &str); 5] = [
    (b"\x1f\x8b", "compressed by gzip"),
    (b"MATLAB", "a MATLAB file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"TDSm", "a TDMS file of LabVIEW"),
    (b"version https://git-lfs", "a pointer of Git LFS and not the file itself"),
];

/// An open file of signals.
#[derive(Debug)]
pub struct SignalFile {
    path: PathBuf,
    content: SignalContent,
}

impl SignalFile {
    /// Opens the file at `path`, and reads it as far as its kind requires.
    ///
    /// # Errors
    /// If it is of no kind that is read, damaged or too large.
    pub fn open(path: &Path) -> Result<Self, SignalFileError> {
        let located = |fault| SignalFileError::new(path, fault);
        let content = content(path).map_err(located)?;
        Ok(Self { path: path.to_owned(), content })
    }

    /// Returns what the file says of itself.
    pub fn recognized(&self) -> RecognizedSignals<'_> {
        match &self.content {
            SignalContent::Table(table) => RecognizedSignals::Table {
                positions: &table.positions,
                start: table.start,
                step: table.step,
                samples: table.receivers.first().map_or(0, Vec::len),
            },
            SignalContent::Array(array) => RecognizedSignals::Array { shape: array.shape() },
        }
    }

    /// Calls `each` with every series of the file, in order, as `description` says how it is recorded.
    ///
    /// # Errors
    /// If file and description do not agree, or a sample is not finite; `each` may have been called before.
    pub fn for_each_series(
        &mut self,
        description: &ProbeDescription,
        mut each: impl FnMut(SignalSeries),
    ) -> Result<(), SignalFileError> {
        let path = &self.path;
        let located = |fault| SignalFileError::new(path, fault);
        let recorded = description::check(description, &self.content).map_err(located)?;
        for number in 0..recorded.series {
            let directions = match &mut self.content {
                SignalContent::Table(table) => vec![table.receivers.clone()],
                SignalContent::Array(array) => {
                    let block: SeriesBlock =
                        array.series(&recorded.axes, number).map_err(located)?;
                    block.directions()
                }
            };
            let transmitters = &description.signals.transmitters;
            let directions =
                directions.into_iter().zip(transmitters).map(|(receivers, &one)| ArraySignals {
                    transmitter: one,
                    start: recorded.start,
                    step: recorded.step,
                    receivers,
                });
            let series = SignalSeries { directions: directions.collect() };
            usable(number + 1, &series).map_err(located)?;
            each(series);
        }
        Ok(())
    }
}

fn content(path: &Path) -> Result<SignalContent, SignalFault> {
    let file = user_file::open(path)?;
    if let Some(array) = ArrayFile::recognize(file)? {
        return Ok(SignalContent::Array(array));
    }
    let mut begin = Vec::new();
    user_file::open(path)?.take(2).read_to_end(&mut begin)?;
    if begin.as_slice() == b"PK" {
        let max = npz::ARCHIVE_BYTES_MAX;
        let archive = user_file::read(path, max)?.ok_or(SignalFault::TooLarge { max })?;
        return archived(&archive).map(SignalContent::Array);
    }
    let bytes = user_file::read(path, FILE_BYTES_MAX)?
        .ok_or(SignalFault::TooLarge { max: FILE_BYTES_MAX })?;
    if let Some((_, what)) = OTHERS.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(SignalFault::OtherKind { what: (*what).to_owned() });
    }
    let text = String::from_utf8(bytes).map_err(|_| SignalFault::OtherKind {
        what: "neither text in UTF-8 nor an array".to_owned(),
    })?;
    traces_csv::parse(&text).map(SignalContent::Table)
}

/// Returns the array of signals in an archive: the only one, or the only one with several axes.
fn archived(archive: &[u8]) -> Result<ArrayFile, SignalFault> {
    let arrays = npz::arrays(archive)?;
    let names: Vec<String> = arrays.iter().map(|array| array.name.clone()).collect();
    let arrays: Vec<_> = arrays.into_iter().map(|array| ArrayFile::of_bytes(array.bytes)).collect();
    let mut arrays: Vec<ArrayFile> = arrays.into_iter().collect::<Result<_, _>>()?;
    if arrays.len() > 1 {
        arrays.retain(|array| array.shape().len() > 1);
    }
    match (arrays.pop(), arrays.is_empty()) {
        (Some(only), true) => Ok(only),
        _ => Err(SignalFault::damaged(format!(
            "it has the arrays [{}]; it must have one with several axes, that of the signals",
            names.join(", ")
        ))),
    }
}

/// Refuses a series with numbers that are none, or without any signal.
fn usable(number: u64, series: &SignalSeries) -> Result<(), SignalFault> {
    for array in &series.directions {
        for (receiver, samples) in array.receivers.iter().enumerate() {
            if let Some(sample) = samples.iter().position(|sample| !sample.is_finite()) {
                return Err(SignalFault::NotFinite {
                    series: number,
                    receiver: receiver + 1,
                    sample: sample + 1,
                    value: samples[sample],
                });
            }
        }
        let is_constant = |samples: &Vec<f64>| samples.iter().all(|&sample| sample == samples[0]);
        if array.receivers.iter().all(is_constant) {
            let receivers = array.receivers.len();
            return Err(SignalFault::Constant { series: number, receivers });
        }
    }
    Ok(())
}
