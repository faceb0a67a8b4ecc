//! Case files: one deterministic problem, in TOML or JSON.

mod bone;
mod porosity;

use std::path::Path;

use osteon_common::case::Case;
use osteon_common::check;
use osteon_common::limits;

use crate::document::{Format, Node};
use crate::document_text::DocumentText;
use crate::file_error::{ContentError, FileError, Invalid, SizeLimit};
use crate::input_file::InputFile;
use crate::job_file;
use crate::reader::Reader;
use crate::setting::Setting;

pub use crate::toml_text::case as to_toml;

/// Limit of a case file's length; one with a matrix and all keys has a few kilobytes.
const SIZE_LIMIT: SizeLimit =
    SizeLimit { bytes: limits::CASE_FILE_BYTES_MAX, suffices_for: "any case file needs" };

/// Reads the case file at `path`, or standard input if that is `-`, with `settings` that replace values
/// of it; its extension determines the format.
///
/// # Errors
/// If the file cannot be read.
pub fn open(path: &Path, settings: Vec<Setting>) -> Result<InputFile, FileError> {
    InputFile::open(path, SIZE_LIMIT, settings)
}

/// Reads and validates the case file at `path`; its extension determines the format.
///
/// # Errors
/// If the file cannot be read, is malformed, or violates a rule; all violations are reported at
/// once.
pub fn read(path: &Path) -> Result<Case, FileError> {
    of_input(&open(path, Vec::new())?)
}

/// Validates a case file that has been opened.
///
/// # Errors
/// If it is malformed, or violates a rule; all violations are reported at once.
pub fn of_input(input: &InputFile) -> Result<Case, FileError> {
    let path = input.path().to_owned();
    let document = input.document();
    match document.tree() {
        Ok(root) if root.has("parameters") && !root.has("bone") => {
            Err(FileError::JobForCase { path })
        }
        Ok(root) => of_tree(document, &root, input.directory())
            .map_err(|invalid| FileError::Content { path, content: invalid.into() }),
        Err(error) => Err(FileError::Content { path, content: error.into() }),
    }
}

/// Reads and validates the text of a case file. Names of files in it are relative to the current directory.
///
/// # Errors
/// If the text is malformed or violates a rule; all violations are reported at once.
pub fn parse(text: &str, format: Format) -> Result<Case, ContentError> {
    let document = DocumentText::new(text, format);
    Ok(of_tree(document, &document.tree()?, Path::new(""))?)
}

fn of_tree(document: DocumentText<'_>, root: &Node, directory: &Path) -> Result<Case, Invalid> {
    let mut reader = Reader::default();
    let keys = ["layers", "probe", "picking", "solver", "bone"];
    let table = reader.root(root, &keys);
    if !table.is_table() {
        return Err(reader.refuse(document, root));
    }
    let mut setup = job_file::setup(&mut reader, &table, directory);
    let bone = bone::read(&mut reader, &table, &mut setup);
    check::setup(&setup, &mut reader.violations);
    match bone {
        Some(bone) if reader.violations.is_empty() => Ok(Case { setup, bone }),
        _ => Err(reader.refuse(document, root)),
    }
}
