//! Positions of measured velocities in a file, for messages about one of them.

use std::path::{Path, PathBuf};

use crate::settings::Picking;

/// File and lines of a job's velocities.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Origin {
    /// The file.
    pub path: PathBuf,
    /// Line of each velocity of each set, from 1.
    pub lines: Vec<Vec<u32>>,
    /// Name of a column that seems to name the subject of each velocity, and is not used: within a
    /// set it has several values of which some repeat.
    pub unused_subjects: Option<String>,
    /// Number of rows that were left out, as a value was missing.
    pub left_out: u32,
    /// Rows that are no measurements, such as their mean, and were left out: as in `line 70 "Mean"`.
    pub no_rows: Vec<String>,
    /// Name of the column of standard errors, if they are the data's repeatability.
    pub error_column: Option<String>,
    /// The criterion by which the velocities were picked, if the file says so.
    pub picking: Option<Picking>,
}

impl Origin {
    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the line of a velocity of a set.
    pub(crate) fn line(&self, set: usize, index: usize) -> Option<u32> {
        self.lines.get(set)?.get(index).copied()
    }

    /// Returns file and line of a velocity as the beginning of a message; empty if there is no
    /// file.
    pub(crate) fn place(origin: Option<&Self>, set: usize, index: usize) -> String {
        let place = origin.and_then(|origin| {
            let line = origin.line(set, index)?;
            Some(format!("{}, line {line}: velocity ", origin.path.display()))
        });
        place.unwrap_or_default()
    }
}
