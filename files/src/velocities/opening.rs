//! From the bytes of a file to the text in it.

use std::io::Read as _;
use std::path::Path;

use flate2::read::MultiGzDecoder;
use osteon_common::limits;

use super::content::Content;
use super::csv_format::CsvFormat;
use super::problem::{LocatedProblem, Problem};
use super::{encodings, hdf5, matlab, workbook};
use crate::file_kind::FileKind;
use crate::user_file;

/// Reads a file; returns the text in it, or those of its several tables.
pub(super) fn of_file(path: &Path, format: &CsvFormat) -> Result<Vec<Content>, LocatedProblem> {
    let read = user_file::read(path, limits::FILE_BYTES_MAX);
    let bytes = read.map_err(|error| (None, Problem::Unreadable(error)))?;
    let bytes = bytes.ok_or((None, Problem::TooLarge))?;
    let bytes = match FileKind::recognize(&bytes) {
        FileKind::Gzip => unpacked(&bytes).map_err(|problem| (None, problem))?,
        _ => bytes,
    };
    of_bytes(bytes, format)
}

fn of_bytes(bytes: Vec<u8>, format: &CsvFormat) -> Result<Vec<Content>, LocatedProblem> {
    let no_line = |problem| (None, problem);
    match FileKind::recognize(&bytes) {
        FileKind::Text => {
            let decoded = encodings::decoded(bytes, format.encoding, format.is_found_out)?;
            let encodings::Decoded { text, encoding, had_invisible } = decoded;
            Ok(vec![Content { text, encoding, had_invisible, origin: None }])
        }
        FileKind::Zip => workbook::tables(bytes).map_err(no_line),
        FileKind::Matlab => matlab::tables(&bytes).map_err(no_line),
        FileKind::Hdf5 => hdf5::tables(bytes).map_err(no_line),
        FileKind::Numpy => Err(no_line(Problem::OtherKind {
            what: "an array of NumPy",
            cure: "use the Python package, or save it by numpy.savetxt as CSV",
        })),
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
