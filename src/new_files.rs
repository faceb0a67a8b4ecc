//! Creation of files that are never overwritten.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use osteon_common::visible;
use osteon_files::user_file;
use zeroize::Zeroizing;

use crate::exit_status::CommandFailure;

/// A file to be created.
pub(crate) struct NewFile {
    /// Path of the file.
    pub(crate) path: PathBuf,
    /// Content of the file; overwritten in memory when it is dropped.
    pub(crate) content: Zeroizing<Vec<u8>>,
    /// Whether only its owner may read it.
    pub(crate) secret: bool,
}

/// Creates all files, or none.
///
/// # Errors
/// If one of them already exists (bad input), or cannot be written.
pub(crate) fn create(files: &[NewFile]) -> Result<(), CommandFailure> {
    for NewFile { path, .. } in files {
        refuse_existing(path)?;
    }
    for (made, file) in files.iter().enumerate() {
        if let Err(error) = write(file) {
            for earlier in &files[..made] {
                // Report the first error, not one of the clean-up.
                drop(fs::remove_file(&earlier.path));
            }
            let context = format!("cannot write {}", visible::path(&file.path));
            return Err(CommandFailure::unusable_path(error, context));
        }
    }
    Ok(())
}

/// Refuses a path at which there is something already.
///
/// # Errors
/// If there is.
pub(crate) fn refuse_existing(path: &Path) -> Result<(), CommandFailure> {
    if path.symlink_metadata().is_ok() {
        return Err(CommandFailure::bad_input(anyhow!(
            "{} already exists and is not overwritten; remove it, or choose another path",
            visible::path(path)
        )));
    }
    Ok(())
}

/// Creates a directory that only its owner can enter; an existing directory is left as it is.
///
/// # Errors
/// If it cannot be created.
pub(crate) fn private_directory(path: &Path) -> Result<(), CommandFailure> {
    directory_with(0o700, path)
}

/// Creates a directory; an existing one is left as it is.
///
/// # Errors
/// If it cannot be created.
pub(crate) fn directory(path: &Path) -> Result<(), CommandFailure> {
    directory_with(0o777, path)
}

fn directory_with(mode: u32, path: &Path) -> Result<(), CommandFailure> {
    let made = fs::DirBuilder::new().recursive(true).mode(mode).create(path);
    made.map_err(|error| {
        CommandFailure::unusable_path(
            error,
            format!("cannot create the directory {}", visible::path(path)),
        )
    })
}

/// Appends a line to a secret file, which is created if necessary.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn append(path: &Path, line: &str) -> Result<(), CommandFailure> {
    let write = || -> std::io::Result<()> {
        let mut options = OpenOptions::new();
        let options = options.read(true).append(true).create(true).mode(0o600);
        let mut file = user_file::open_with(options, path)?;
        let whole = ends_with_newline(&file)?;
        // Written in a single call, because others may append lines at the same time.
        file.write_all(format!("{}{line}\n", if whole { "" } else { "\n" }).as_bytes())?;
        file.sync_all()
    };
    write().map_err(|error| {
        CommandFailure::unusable_path(error, format!("cannot add to {}", visible::path(path)))
    })
}

fn write(file: &NewFile) -> std::io::Result<()> {
    let mode = if file.secret { 0o600 } else { 0o644 };
    let mut options = OpenOptions::new();
    let mut opened = options.write(true).create_new(true).mode(mode).open(&file.path)?;
    let written = opened.write_all(&file.content).and_then(|()| opened.sync_all());
    if written.is_err() {
        // An incomplete file is useless.
        drop(fs::remove_file(&file.path));
    }
    written
}

/// Returns whether the file is empty or ends with a newline, so that a line can be appended.
fn ends_with_newline(file: &fs::File) -> std::io::Result<bool> {
    use std::os::unix::fs::FileExt as _;
    let length = file.metadata()?.len();
    if length == 0 {
        return Ok(true);
    }
    let mut last = [0];
    file.read_exact_at(&mut last, length - 1)?;
    Ok(last == *b"\n")
}
