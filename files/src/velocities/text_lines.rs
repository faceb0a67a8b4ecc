//! The lines of a CSV file, as text.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use encoding_rs::{Encoding, UTF_8};
use encoding_rs_io::DecodeReaderBytesBuilder;
use osteon_common::limits;

use super::problem::{LocatedProblem, Problem};
use crate::document_text::without_byte_order_mark;
use crate::user_file;

/// Opens a file as UTF-8 text, whatever its encoding is: that of its byte order mark, or else the
/// one given. Text that is said to be UTF-8 may be none.
pub(super) fn open(
    path: &Path,
    encoding: Option<&'static Encoding>,
) -> Result<impl BufRead + use<>, Problem> {
    let open = || -> io::Result<(File, u64)> {
        let file = user_file::open(path)?;
        let length = file.metadata()?.len();
        Ok((file, length))
    };
    let (file, length) = open().map_err(Problem::Unreadable)?;
    if length > limits::FILE_BYTES_MAX {
        return Err(Problem::TooLarge);
    }
    let decoded = DecodeReaderBytesBuilder::new()
        .encoding(encoding.filter(|&encoding| encoding != UTF_8))
        .bom_override(true)
        .strip_bom(true)
        .utf8_passthru(true)
        // Data appended while the file is read are ignored.
        .build(file.take(length));
    Ok(BufReader::new(decoded))
}

/// The lines of a file, of which one is in memory at a time.
pub(super) struct LineReader<R> {
    file: R,
    /// Number of the last line, from 1.
    number: usize,
    bytes: Vec<u8>,
}

impl<R: BufRead> LineReader<R> {
    pub(super) fn new(file: R) -> Self {
        Self { file, number: 0, bytes: Vec::new() }
    }

    /// Returns the next line that is neither empty nor a comment, without its end, and its number.
    pub(super) fn next(&mut self) -> Result<Option<(usize, &str)>, LocatedProblem> {
        loop {
            self.bytes.clear();
            // The line end takes at most two bytes.
            let most = limits::LINE_BYTES_MAX as u64 + 2;
            let mut line = self.file.by_ref().take(most);
            let read = line.read_until(b'\n', &mut self.bytes);
            if read.map_err(|error| (None, Problem::Unreadable(error)))? == 0 {
                return Ok(None);
            }
            self.number += 1;
            if self.bytes.last() == Some(&b'\n') {
                self.bytes.pop();
            }
            if self.bytes.last() == Some(&b'\r') {
                self.bytes.pop();
            }
            if self.bytes.len() > limits::LINE_BYTES_MAX {
                return Err((Some(self.number), Problem::LongLine));
            }
            // Checked here and borrowed after the loop: a borrow that is returned would last for
            // all iterations.
            let text = str::from_utf8(&self.bytes);
            let text = text.map_err(|_| (Some(self.number), Problem::NotUtf8))?;
            if text.contains('\0') {
                return Err((Some(self.number), Problem::NotUtf8));
            }
            let begin = without_byte_order_mark(text).trim_start();
            if !begin.is_empty() && !begin.starts_with('#') {
                break;
            }
        }
        // Was already checked to be UTF-8.
        let text = str::from_utf8(&self.bytes).unwrap_or_default();
        let text = if self.number == 1 { without_byte_order_mark(text) } else { text };
        Ok(Some((self.number, text)))
    }
}
