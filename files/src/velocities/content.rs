//! What is in a file: its text, or tables that were made text of, with tabs between their fields.

use std::io::Read as _;
use std::path::Path;

use encoding_rs::Encoding;
use flate2::read::MultiGzDecoder;
use osteon_common::limits;

use super::csv_format::{CsvFormat, Separator};
use super::file_kind::FileKind;
use super::problem::{LocatedProblem, Problem};
use super::{encodings, hdf5, matlab, workbook};
use crate::user_file;

/// The text of a file.
#[derive(Debug)]
pub(super) struct Content {
    pub(super) text: String,
    /// The encoding, if it was found out and a job file must name it.
    pub(super) encoding: Option<&'static Encoding>,
    /// Whether characters without width were dropped.
    pub(super) had_invisible: bool,
    /// Where the table comes from, if it was no text.
    pub(super) origin: Option<String>,
}

impl Content {
    /// Returns a table that was no text.
    pub(super) fn of_table(text: String, origin: String) -> Self {
        Self { text, encoding: None, had_invisible: false, origin: Some(origin) }
    }

    /// Returns what separates the fields, if the file itself does not say it.
    pub(super) fn separator(&self) -> Option<Separator> {
        self.origin.is_some().then_some(Separator::Tab)
    }
}

/// Reads a file; returns the text in it, or those of its several tables.
pub(super) fn of_file(path: &Path, format: &CsvFormat) -> Result<Vec<Content>, LocatedProblem> {
    let read = user_file::read(path, limits::FILE_BYTES_MAX);
    let bytes = read.map_err(|error| (None, Problem::Unreadable(error)))?;
    let bytes = bytes.ok_or((None, Problem::TooLarge))?;
    let bytes = match FileKind::of(&bytes) {
        FileKind::Gzip => unpacked(&bytes).map_err(|problem| (None, problem))?,
        _ => bytes,
    };
    of_bytes(bytes, format)
}

fn of_bytes(bytes: Vec<u8>, format: &CsvFormat) -> Result<Vec<Content>, LocatedProblem> {
    let no_line = |problem| (None, problem);
    match FileKind::of(&bytes) {
        FileKind::Text => {
            let decoded = encodings::decoded(bytes, format.encoding, format.is_found_out)?;
            let encodings::Decoded { text, encoding, had_invisible } = decoded;
            Ok(vec![Content { text, encoding, had_invisible, origin: None }])
        }
        FileKind::Zip => workbook::tables(bytes).map_err(no_line),
        FileKind::Matlab => matlab::tables(&bytes).map_err(no_line),
        FileKind::Hdf5 => hdf5::tables(bytes).map_err(no_line),
        FileKind::Gzip => Err(no_line(Problem::OtherKind {
            what: "compressed by gzip twice",
            cure: "unpack it first",
        })),
        FileKind::CompoundFile => Err(no_line(Problem::OtherKind {
            what: "a workbook of Excel before 2007 (.xls), or another document of that time",
            cure: "save it as .xlsx or CSV",
        })),
        FileKind::Other { what, cure } => Err(no_line(Problem::OtherKind { what, cure })),
    }
}

/// Unpacks a file of gzip, as far as a file may be long.
fn unpacked(bytes: &[u8]) -> Result<Vec<u8>, Problem> {
    let mut unpacked = Vec::new();
    let mut file = MultiGzDecoder::new(bytes).take(limits::FILE_BYTES_MAX + 1);
    let read = file.read_to_end(&mut unpacked);
    read.map_err(|error| Problem::Damaged { what: "a gzip file", reason: error.to_string() })?;
    match unpacked.len() as u64 > limits::FILE_BYTES_MAX {
        true => Err(Problem::TooLarge),
        false => Ok(unpacked),
    }
}

/// Returns a field of a table as text between tabs, on one line.
pub(super) fn field(text: &str) -> String {
    let text = text.replace(['\n', '\r', '\t', '\0'], " ");
    match text.contains('"') {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

/// A column of numbers with a name.
#[derive(Debug)]
pub(super) struct NumberColumn {
    pub(super) name: String,
    pub(super) numbers: Vec<f64>,
}

/// Returns tables of columns: those of one length are beside each other, in the order in which they come.
pub(super) fn tables_of(columns: &[NumberColumn], origin: &str) -> Vec<Content> {
    let mut lengths: Vec<usize> = Vec::new();
    for column in columns {
        if !lengths.contains(&column.numbers.len()) {
            lengths.push(column.numbers.len());
        }
    }
    lengths
        .into_iter()
        .map(|length| {
            let of_length: Vec<_> =
                columns.iter().filter(|column| column.numbers.len() == length).collect();
            let line = |cells: Vec<String>| cells.join("\t") + "\n";
            let mut text = line(of_length.iter().map(|column| field(&column.name)).collect());
            for row in 0..length {
                text += &line(of_length.iter().map(|column| cell(column.numbers[row])).collect());
            }
            Content::of_table(encodings::normalised(text), origin.to_owned())
        })
        .collect()
}

/// Returns a number as text; not a number is a gap.
fn cell(number: f64) -> String {
    if number.is_nan() { String::new() } else { format!("{number:?}") }
}
