//! A first job file for a CSV file of velocities, as people have them.
//!
//! The file is looked at as a whole: its encoding, separator, decimal mark, the column of velocities
//! and their unit, texts that stand for missing values, columns of groups and subjects. What was
//! understood is said in words, and written as keys of `[data]`, so that nothing is guessed again when
//! the job is run.

mod layout;
mod roles;
mod template;

use std::io::Read as _;
use std::path::{Path, PathBuf};

use osteon_common::{limits, visible};
use thiserror::Error;

use crate::user_file;

use self::layout::Layout;
use self::roles::Roles;

pub use self::template::without_data;

/// Why no job file can be written for a CSV file.
#[derive(Debug, Error)]
pub enum InitError {
    /// The file cannot be read.
    #[error("{} cannot be read: {cause}", visible::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        cause: std::io::Error,
    },
    /// It is not understood.
    #[error("{}: {reason}", visible::path(path))]
    NotUnderstood {
        /// The file.
        path: PathBuf,
        /// The reason, and what to do.
        reason: String,
    },
}

/// A job file for a CSV file.
#[derive(Debug)]
pub struct FirstJob {
    /// The text of the job file.
    pub text: String,
    /// Findings about the CSV file, a sentence each.
    pub understood: Vec<String>,
}

/// Looks at the CSV file at `path`, and returns a job file that names it `name`.
///
/// # Errors
/// If the file cannot be read, or if it has no header or no column that may be one of velocities.
pub fn of_csv(path: &Path, name: &str) -> Result<FirstJob, InitError> {
    let unreadable = |cause| InitError::Unreadable { path: path.to_owned(), cause };
    let refused = |reason| InitError::NotUnderstood { path: path.to_owned(), reason };
    let mut file = user_file::open(path).map_err(unreadable)?.take(limits::FILE_BYTES_MAX + 1);
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > limits::FILE_BYTES_MAX {
        return Err(refused(format!("it is longer than {} bytes", limits::FILE_BYTES_MAX)));
    }
    let layout = Layout::of(&bytes).map_err(refused)?;
    let roles = Roles::of(&layout).map_err(refused)?;
    let mut understood = layout.described();
    understood.extend(roles.described());
    Ok(FirstJob {
        text: template::of_data(&template::data_section(name, &layout, &roles)),
        understood,
    })
}
