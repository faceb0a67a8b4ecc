//! Reads a file up to a maximum size; the errors of job and case files.

use std::fmt;
use std::path::{Path, PathBuf};

use osteon_common::violations::Violation;
use osteon_common::visible;
use thiserror::Error;

use crate::document::{Format, Node, SyntaxError};
use crate::document_text::DocumentText;
use crate::excerpt::Excerpt;
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
    #[error("{}", unknown_format(path))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A case file was given where a job file is needed.
    #[error(
        "{} is not a job file but a case file, which describes one bone; `osteon simulate` solves it, \
         and `osteon init` writes a job file",
        visible::path(path)
    )]
    CaseForJob {
        /// The file.
        path: PathBuf,
    },
    /// A job file was given where a case file is needed.
    #[error(
        "{} is not a case file, which describes one bone, but a job file; `osteon identify` and `osteon \
         propagate` run it, and `osteon draw` writes the case file of one of its realizations",
        visible::path(path)
    )]
    JobForCase {
        /// The file.
        path: PathBuf,
    },
    /// The file is longer than any file of its kind needs to be.
    #[error("{} is longer than {max_bytes} bytes, more than {suffices_for}", visible::path(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Maximum number of bytes.
        max_bytes: u64,
        /// End of the message, after "more than", such as `any case file needs`.
        suffices_for: &'static str,
    },
    /// The text is refused.
    #[error("{}", content.located(path))]
    Content {
        /// The file.
        path: PathBuf,
        /// The reason.
        content: ContentError,
    },
}

/// Extensions of files that contain data rather than a job.
const DATA_EXTENSIONS: [&str; 6] = ["csv", "tsv", "txt", "dat", "xls", "xlsx"];

fn unknown_format(path: &Path) -> String {
    let shown = visible::path(path);
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let extension = extension.to_ascii_lowercase();
    if !DATA_EXTENSIONS.contains(&extension.as_str()) {
        return format!("{shown}: the name of a job or case file must end in .toml or .json");
    }
    if extension.starts_with("xls") {
        return format!(
            "{shown} is a spreadsheet; save the velocities as CSV, and `osteon init FILE.csv` writes a job \
             file for them"
        );
    }
    format!(
        "{shown} is not a job or case file but data; `osteon init {shown}` writes a job file for it"
    )
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

impl ContentError {
    /// Returns the message for the file at `path`, with the lines of the text that it is about.
    fn located(&self, path: &Path) -> String {
        let path = visible::path(path);
        match self {
            Self::Malformed(error) => {
                format!("{}\n{}", at(&path, &error.excerpt, &error.cause()), error.excerpt)
            }
            Self::Invalid(invalid) => format!("{path}: {}", invalid.located(&path)),
        }
    }
}

/// Maximum number of violations that are shown with the text of their lines; of those after them only the
/// place is shown.
const EXCERPTS_MAX: usize = 10;

/// Returns `PATH:LINE:COLUMN: message`.
fn at(path: &str, excerpt: &Excerpt, message: &str) -> String {
    format!("{path}:{}:{}: {message}", excerpt.line, excerpt.column)
}

/// Where a violation is.
#[derive(Debug, Clone, PartialEq, Eq)]
enum ErrorPlace {
    /// In this line of a file.
    Line(Excerpt),
    /// In this setting of the command line.
    Setting(String),
    /// In no line that is known.
    Unknown,
}

impl ErrorPlace {
    fn line(&self) -> Option<usize> {
        match self {
            Self::Line(excerpt) => Some(excerpt.line),
            Self::Setting(_) | Self::Unknown => None,
        }
    }

    /// Returns `message` after its place, which `in_line` writes where it is a line.
    fn entry(&self, message: &str, in_line: impl FnOnce(&Excerpt) -> String) -> String {
        match self {
            Self::Line(excerpt) => in_line(excerpt),
            Self::Setting(option) => format!("{}: {message}", visible::line(option)),
            Self::Unknown => message.to_owned(),
        }
    }
}

/// All violations of a well-formed text, in the order of its lines.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct Invalid {
    found: Vec<(ErrorPlace, Violation)>,
}

impl Invalid {
    /// Returns the violations, each with the line of the field, or of the table where it should be;
    /// without line if the format provides none, or if no such table exists.
    pub fn iter(&self) -> impl Iterator<Item = (Option<usize>, &Violation)> {
        self.found.iter().map(|(place, violation)| (place.line(), violation))
    }

    /// Adds the places in `document`, whose tree is `root`, to `violations`; those of `unknown` keys
    /// are the keys themselves.
    pub(crate) fn locate<'v>(
        violations: impl Iterator<Item = &'v Violation>,
        unknown: &[String],
        document: DocumentText<'_>,
        root: &Node,
    ) -> Self {
        let spans = document.spans();
        let place = |field: &String| {
            if let Some(setting) = document.setting_of(field) {
                return ErrorPlace::Setting(setting.to_string());
            }
            // Only the tree knows which tables have no header line of their own.
            if root.line_of(field).is_none() {
                return ErrorPlace::Unknown;
            }
            let span = spans.span(field, unknown.contains(field));
            span.map_or(ErrorPlace::Unknown, |span| ErrorPlace::Line(document.excerpt(span)))
        };
        let locate = |violation: &Violation| (place(&violation.field), violation.clone());
        let mut found: Vec<_> = violations.map(locate).collect();
        // The sort is stable: violations of one line stay in the order in which they were found.
        // Those without line come last.
        found.sort_by_key(|(place, _)| place.line().unwrap_or(usize::MAX));
        Self { found }
    }

    /// Returns how many violations there are, in words.
    fn count(&self) -> String {
        let listed = self.found.iter().filter(|(_, violation)| !violation.more).count();
        let errors = if listed == 1 { "error" } else { "errors" };
        if listed < self.found.len() {
            return format!("more than {listed} {errors} (the first {listed} of them shown)");
        }
        format!("{listed} {errors}")
    }

    /// Returns the list for the file at `path`, with the text of the first lines.
    fn located(&self, path: &str) -> String {
        let mut text = self.count();
        for (number, (place, violation)) in self.found.iter().enumerate() {
            let message = violation.to_string();
            let entry = place.entry(&message, |excerpt| {
                let located = at(path, excerpt, &message);
                if number >= EXCERPTS_MAX {
                    return located;
                }
                format!("{located}\n  {}", excerpt.to_string().replace('\n', "\n  "))
            });
            text.push_str(&format!("\n  {entry}"));
        }
        text
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.count())?;
        for (place, violation) in &self.found {
            let message = violation.to_string();
            let in_line = |excerpt: &Excerpt| format!("line {}: {message}", excerpt.line);
            write!(f, "\n  {}", place.entry(&message, in_line))?;
        }
        Ok(())
    }
}

/// Maximum size of a kind of file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SizeLimit {
    /// Maximum number of bytes.
    pub(crate) bytes: u64,
    /// End of the message about a larger file, after "more than", such as `any case file needs`; it may also say
    /// what the user can do.
    pub(crate) suffices_for: &'static str,
}

impl SizeLimit {
    /// Returns the error of a larger file at `path`.
    pub(crate) fn exceeded(self, path: PathBuf) -> FileError {
        let Self { bytes: max_bytes, suffices_for } = self;
        FileError::TooLarge { path, max_bytes, suffices_for }
    }
}

/// Returns the text of the file at `path` and its format.
pub(crate) fn read(path: &Path, limit: SizeLimit) -> Result<(String, Format), FileError> {
    let Some(format) = Format::from_extension(path) else {
        return Err(FileError::UnknownFormat { path: path.to_owned() });
    };
    match user_file::read(path, limit.bytes) {
        Ok(Some(bytes)) => text_of(bytes, format, path).map(|text| (text, format)),
        Ok(None) => Err(limit.exceeded(path.to_owned())),
        Err(error) => Err(FileError::Unreadable { path: path.to_owned(), error }),
    }
}

/// Returns the text that `bytes`, read from `path`, are in UTF-8.
pub(crate) fn text_of(bytes: Vec<u8>, format: Format, path: &Path) -> Result<String, FileError> {
    String::from_utf8(bytes).map_err(|error| {
        let content = ContentError::Malformed(not_utf8(&error, format));
        FileError::Content { path: path.to_owned(), content }
    })
}

/// Returns the error at the first byte that is not UTF-8.
fn not_utf8(error: &std::string::FromUtf8Error, format: Format) -> SyntaxError {
    let valid = error.utf8_error().valid_up_to();
    // The valid part before it keeps its length, so that the place stays the same.
    let text = String::from_utf8_lossy(error.as_bytes());
    let byte = error.as_bytes().get(valid).copied().unwrap_or_default();
    SyntaxError {
        format,
        excerpt: Box::new(Excerpt::new(
            &text,
            valid..valid + char::REPLACEMENT_CHARACTER.len_utf8(),
        )),
        message: format!("the byte 0x{byte:02x} is not valid UTF-8"),
        help: Some("save the file as UTF-8".to_owned()),
    }
}
