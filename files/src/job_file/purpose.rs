//! Tells case files from job files by their sections, before they are read.

use osteon_common::job::JobKind;

use crate::document::Node;
use crate::file_error::FileError;
use crate::input_file::InputFile;

/// The kind of a file, as its sections show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePurpose {
    /// A job: an identification if it has `[data]`, otherwise a propagation.
    Job(JobKind),
    /// A case, which has `[bone]`.
    Case,
}

/// Returns what a file describes. Nothing else in it is checked.
///
/// # Errors
/// If the file is malformed.
pub fn purpose(input: &InputFile) -> Result<FilePurpose, FileError> {
    match input.document().tree() {
        Ok(root) => Ok(of_tree(&root)),
        Err(error) => {
            Err(FileError::Content { path: input.path().to_owned(), content: error.into() })
        }
    }
}

/// Returns what the tree of a file describes.
pub(super) fn of_tree(root: &Node) -> FilePurpose {
    match (root.has("data"), root.has("bone") && !root.has("parameters")) {
        (_, true) => FilePurpose::Case,
        (true, false) => FilePurpose::Job(JobKind::Identification),
        (false, false) => FilePurpose::Job(JobKind::Propagation),
    }
}
