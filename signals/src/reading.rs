//! Signals from files: which kind of file it is, and whether it agrees with the description of the probe.

mod array_axes;
mod array_file;
mod array_variables;
mod description;
mod signal_content;
mod simsonic;
mod traces_csv;

use std::io::Read as _;
use std::path::{Path, PathBuf};

use osteon_common::limits::FILE_BYTES_MAX;
use osteon_files::file_kind::FileKind;
use osteon_files::probe_file::ProbeDescription;
use osteon_files::user_file;

use crate::array_signals::{ArraySignals, SignalSeries};
use crate::reading_error::{SignalFault, SignalFileError};

use self::array_file::ArrayFile;
use self::array_variables::ArrayVariables;
use self::signal_content::{Recording, SignalContent};
use self::traces_csv::TraceTable;

pub use self::array_file::RecordedGrid;
pub use self::description::RecognizedSignals;

/// Bytes by which the kind of a file is recognized.
const KIND_BYTES: u64 = 4096;

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
            SignalContent::Array(array) => RecognizedSignals::Array {
                shape: &array.axes().shape,
                usual: array.axes().usual(),
                variable: None,
                grid: array.grid(),
            },
            SignalContent::Variables(variables) => {
                let (name, axes) = variables.largest();
                RecognizedSignals::Array {
                    shape: &axes.shape,
                    usual: axes.usual(),
                    variable: variables.is_ambiguous().then_some(name),
                    grid: None,
                }
            }
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
        let mut chosen = None;
        let wanted = description.signals.variable.as_deref();
        if let (Some(name), SignalContent::Table(_) | SignalContent::Array(_)) =
            (wanted, &self.content)
        {
            let problem = format!("is {name:?}, and the file's signals have no name");
            return Err(located(SignalFault::disagrees("signals.variable", problem)));
        }
        let mut recording = match &mut self.content {
            SignalContent::Table(table) => Recording::Table(table),
            SignalContent::Array(array) => Recording::Array(array),
            SignalContent::Variables(variables) => {
                Recording::Array(chosen.insert(variables.open(wanted).map_err(located)?))
            }
        };
        let recorded = description::check(description, &recording).map_err(located)?;
        for number in 0..recorded.series {
            let directions = match &mut recording {
                Recording::Table(table) => vec![table.receivers.clone()],
                Recording::Array(array) => {
                    array.series(&recorded.axes, number).map_err(located)?.directions()
                }
            };
            let sources = description.signals.sources();
            let directions =
                directions.into_iter().zip(sources).map(|(receivers, (transmitter, offset))| {
                    ArraySignals {
                        transmitter,
                        offset,
                        start: recorded.start,
                        step: recorded.step,
                        receivers,
                    }
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
    if simsonic::is_called_so(path) {
        return simsonic::open(file).map(SignalContent::Array);
    }
    let mut begin = Vec::new();
    file.take(KIND_BYTES).read_to_end(&mut begin)?;
    let other = |what: &str| Err(SignalFault::OtherKind { what: what.to_owned() });
    let variables = match FileKind::recognize(&begin) {
        FileKind::Numpy => {
            return ArrayFile::of_numpy(user_file::open(path)?).map(SignalContent::Array);
        }
        FileKind::Text => return table(path).map(SignalContent::Table),
        FileKind::Zip => ArrayVariables::of_archive(bytes(path, array_variables::BYTES_MAX)?),
        FileKind::Matlab => ArrayVariables::of_matlab(bytes(path, array_variables::BYTES_MAX)?),
        FileKind::Hdf5 => ArrayVariables::of_hdf5(user_file::open(path)?),
        FileKind::Gzip => return other("compressed by gzip"),
        FileKind::CompoundFile => return other("a workbook of Excel before 2007"),
        FileKind::Other { what, .. } => return other(what),
    };
    variables.map(SignalContent::Variables)
}

/// Reads a whole file.
fn bytes(path: &Path, max: u64) -> Result<Vec<u8>, SignalFault> {
    user_file::read(path, max)?.ok_or(SignalFault::TooLarge { max })
}

fn table(path: &Path) -> Result<TraceTable, SignalFault> {
    let text = String::from_utf8(bytes(path, FILE_BYTES_MAX)?);
    let text = text.map_err(|_| SignalFault::OtherKind {
        what: "neither text in UTF-8 nor a file of arrays that is known".to_owned(),
    })?;
    traces_csv::parse(&text)
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
