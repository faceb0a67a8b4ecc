//! Tells case files from job files by their sections, before they are read.

use std::path::Path;

use osteon_common::job::JobKind;

use super::BOUND;
use crate::document::{self, Value};
use crate::file_error::{self, FileError};

/// The kind of a file, as its sections show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePurpose {
    /// A job: an identification if it has `[data]`, otherwise a propagation.
    Job(JobKind),
    /// A case, which has `[bone]`.
    Case,
}

/// Returns what the file at `path` describes. Nothing else in it is checked.
///
/// # Errors
/// If the file cannot be read, or is malformed.
pub fn purpose(path: &Path) -> Result<FilePurpose, FileError> {
    let (text, format) = file_error::read(path, BOUND)?;
    let root = document::parse(file_error::without_byte_order_mark(&text), format)
        .map_err(|error| FileError::Content { path: path.to_owned(), content: error.into() })?;
    let has = |key: &str| match &root.value {
        Value::Table(entries) => entries.iter().any(|(name, _)| name == key),
        _ => false,
    };
    Ok(match (has("data"), has("bone") && !has("parameters")) {
        (_, true) => FilePurpose::Case,
        (true, false) => FilePurpose::Job(JobKind::Identification),
        (false, false) => FilePurpose::Job(JobKind::Propagation),
    })
}
