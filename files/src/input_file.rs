//! A job or case file before it is parsed: its text, and the settings of a command line.

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use crate::document::Format;
use crate::document_text::DocumentText;
use crate::file_error::{self, FileError, SizeLimit};
use crate::setting::Setting;

/// The name that denotes standard input.
const STANDARD_INPUT: &str = "-";
/// What messages call it.
const STANDARD_INPUT_SHOWN: &str = "<stdin>";

/// The text of a job or case file, and the settings that apply to it.
#[derive(Debug, Clone, PartialEq)]
pub struct InputFile {
    path: PathBuf,
    directory: PathBuf,
    format: Format,
    text: String,
    settings: Vec<Setting>,
}

impl InputFile {
    /// Reads the file at `path`, or standard input if that is `-`.
    pub(crate) fn open(
        path: &Path,
        limit: SizeLimit,
        settings: Vec<Setting>,
    ) -> Result<Self, FileError> {
        if path == Path::new(STANDARD_INPUT) {
            let (text, format) = standard_input(limit)?;
            let path = PathBuf::from(STANDARD_INPUT_SHOWN);
            return Ok(Self { path, directory: PathBuf::new(), format, text, settings });
        }
        let (text, format) = file_error::read(path, limit)?;
        let directory = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self { path: path.to_owned(), directory, format, text, settings })
    }

    /// Returns the path for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the directory to which names in the file are relative.
    pub(crate) fn directory(&self) -> &Path {
        &self.directory
    }

    /// Returns the text with its settings.
    pub(crate) fn document(&self) -> DocumentText<'_> {
        DocumentText::new(&self.text, self.format).with_settings(&self.settings)
    }
}

/// Reads standard input to its end: JSON if it begins with a brace, which no TOML does.
///
/// How long it takes is up to whoever writes it; a signal ends the program meanwhile.
fn standard_input(limit: SizeLimit) -> Result<(String, Format), FileError> {
    let path = || PathBuf::from(STANDARD_INPUT_SHOWN);
    let mut bytes = Vec::new();
    let read = io::stdin().lock().take(limit.bytes + 1).read_to_end(&mut bytes);
    read.map_err(|error| FileError::Unreadable { path: path(), error })?;
    if bytes.len() as u64 > limit.bytes {
        return Err(limit.exceeded(path()));
    }
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    let format = if first == Some(&b'{') { Format::Json } else { Format::Toml };
    file_error::text_of(bytes, format, &path()).map(|text| (text, format))
}
