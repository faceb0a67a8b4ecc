//! Reading a file within bounds, and what can be wrong with it.

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::document::{Format, Malformed, Node};
use crate::violations::Violation;
use crate::{user_file, visible};

/// Why a job or case file gives nothing.
///
/// A message is complete: it contains that of its cause.
#[derive(Debug, Error)]
pub enum FileError {
    /// The operating system does not give its bytes.
    #[error("cannot read {}: {error}", visible::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The name does not say what it is.
    #[error("{}: the name of a job or case file must end in .toml or .json", visible::path(path))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Longer than any file of its kind needs to be.
    #[error("{} is longer than {max_bytes} bytes, more than {purpose}", visible::path(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Most bytes that are read.
        max_bytes: u64,
        /// Who needs no more.
        purpose: &'static str,
    },
    /// Its text is refused.
    #[error("{}{}{content}", visible::path(path), if matches!(content, ContentError::Malformed(_)) { ", " } else { ": " })]
    Content {
        /// The file.
        path: PathBuf,
        /// Why.
        content: ContentError,
    },
}

/// Why a text is not a job or case.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ContentError {
    /// It is not TOML or JSON.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// It breaks rules.
    #[error(transparent)]
    Invalid(#[from] Invalid),
}

/// Everything that is wrong with a text that is well-formed, in the order of its lines.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct Invalid {
    found: Vec<(Option<usize>, Violation)>,
}

impl Invalid {
    /// The violations, each with the line of the field, or of the table where it should be;
    /// without line where the format tells none, or no such table exists.
    pub fn iter(&self) -> impl Iterator<Item = (Option<usize>, &Violation)> {
        self.found.iter().map(|(line, violation)| (*line, violation))
    }

    /// `violations` with the lines of `root`.
    pub(crate) fn locate<'v>(violations: impl Iterator<Item = &'v Violation>, root: &Node) -> Self {
        let locate = |violation: &Violation| (root.line_of(&violation.field), violation.clone());
        let mut found: Vec<_> = violations.map(locate).collect();
        // Stable: those of one line stay in the order they were found. Those without come last.
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

/// How long a kind of file may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bound {
    /// Most bytes.
    pub(crate) bytes: u64,
    /// Who needs no more, after "more than".
    pub(crate) purpose: &'static str,
}

/// The text of the file at `path` and its format.
pub(crate) fn read(path: &Path, bound: Bound) -> Result<(String, Format), FileError> {
    let Some(format) = Format::of(path) else {
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

fn not_utf8(error: std::string::FromUtf8Error, format: Format) -> Malformed {
    let valid = error.utf8_error().valid_up_to();
    let before = String::from_utf8_lossy(&error.as_bytes()[..valid]).into_owned();
    let (line, column) = crate::document::position(&before, valid);
    let byte = error.as_bytes().get(valid).copied().unwrap_or_default();
    Malformed { format, line, column, message: format!("the byte 0x{byte:02x} is not valid UTF-8") }
}

/// What an optional byte order mark leaves of a text.
pub(crate) fn without_byte_order_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}
