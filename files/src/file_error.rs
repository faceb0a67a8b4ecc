//! Reading a file within limits, and the errors that can occur.

use std::fmt;
use std::path::{Path, PathBuf};

use osteon_common::violations::Violation;
use osteon_common::visible;
use thiserror::Error;

use crate::document::{Format, Node, SyntaxError};
use crate::user_file;

/// Reason why a job or case file cannot be used.
///
/// A message is complete: it includes that of its cause.
#[derive(Debug, Error)]
pub enum FileError {
    /// The operating system cannot read the file.
    #[error("cannot read {}: {error}", visible::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        error: std::io::Error,
    },
    /// The extension of the name denotes no known format.
    #[error("{}: the name of a job or case file must end in .toml or .json", visible::path(path))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file is longer than any file of its kind needs to be.
    #[error("{} is longer than {max_bytes} bytes, more than {purpose}", visible::path(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Maximum number of bytes.
        max_bytes: u64,
        /// The kind of content for which this is sufficient.
        purpose: &'static str,
    },
    /// The text is refused.
    #[error("{}{}{content}", visible::path(path), if matches!(content, ContentError::Malformed(_)) { ", " } else { ": " })]
    Content {
        /// The file.
        path: PathBuf,
        /// The reason.
        content: ContentError,
    },
}

/// Reason why a text is not a valid job or case.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ContentError {
    /// The text is not valid TOML or JSON.
    #[error(transparent)]
    Malformed(#[from] SyntaxError),
    /// The text violates rules.
    #[error(transparent)]
    Invalid(#[from] Invalid),
}

/// All violations of a well-formed text, in the order of its lines.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct Invalid {
    found: Vec<(Option<usize>, Violation)>,
}

impl Invalid {
    /// Returns the violations, each with the line of the field, or of the table where it should be;
    /// without line if the format provides none, or if no such table exists.
    pub fn iter(&self) -> impl Iterator<Item = (Option<usize>, &Violation)> {
        self.found.iter().map(|(line, violation)| (*line, violation))
    }

    /// Adds the lines of `root` to `violations`.
    pub(crate) fn locate<'v>(violations: impl Iterator<Item = &'v Violation>, root: &Node) -> Self {
        let locate = |violation: &Violation| (root.line_of(&violation.field), violation.clone());
        let mut found: Vec<_> = violations.map(locate).collect();
        // The sort is stable: violations of one line stay in the order in which they were found.
        // Those without line come last.
        found.sort_by_key(|(line, _)| line.unwrap_or(usize::MAX));
        Self { found }
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed = self.found.iter().filter(|(_, violation)| !violation.more).count();
        let errors = if listed == 1 { "error" } else { "errors" };
        if listed < self.found.len() {
            write!(f, "more than {listed} {errors} (the first {listed} of them shown)")?;
        } else {
            write!(f, "{listed} {errors}")?;
        }
        for (line, violation) in &self.found {
            match line {
                Some(line) => write!(f, "\n  line {line}: {violation}")?,
                None => write!(f, "\n  {violation}")?,
            }
        }
        Ok(())
    }
}

/// Maximum length of a kind of file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bound {
    /// Maximum number of bytes.
    pub(crate) bytes: u64,
    /// The kind of content for which this is sufficient, as it follows "more than" in a message.
    pub(crate) purpose: &'static str,
}

/// Returns the text of the file at `path` and its format.
pub(crate) fn read(path: &Path, bound: Bound) -> Result<(String, Format), FileError> {
    let Some(format) = Format::from_extension(path) else {
        return Err(FileError::UnknownFormat { path: path.to_owned() });
    };
    match user_file::read(path, bound.bytes) {
        Ok(Some(bytes)) => match String::from_utf8(bytes) {
            Ok(text) => Ok((text, format)),
            Err(error) => Err(FileError::Content {
                path: path.to_owned(),
                content: ContentError::Malformed(not_utf8(error, format)),
            }),
        },
        Ok(None) => {
            let Bound { bytes: max_bytes, purpose } = bound;
            Err(FileError::TooLarge { path: path.to_owned(), max_bytes, purpose })
        }
        Err(error) => Err(FileError::Unreadable { path: path.to_owned(), error }),
    }
}

fn not_utf8(error: std::string::FromUtf8Error, format: Format) -> SyntaxError {
    let valid = error.utf8_error().valid_up_to();
    let before = String::from_utf8_lossy(&error.as_bytes()[..valid]).into_owned();
    let (line, column) = crate::document::position(&before, valid);
    let byte = error.as_bytes().get(valid).copied().unwrap_or_default();
    SyntaxError {
        format,
        line,
        column,
        message: format!("the byte 0x{byte:02x} is not valid UTF-8"),
    }
}

/// Returns a text without its byte order mark, if it has one.
pub(crate) fn without_byte_order_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}
