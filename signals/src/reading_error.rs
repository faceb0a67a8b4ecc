//! Why a file of signals cannot be used.

use std::io;
use std::path::{Path, PathBuf};

use osteon_common::visible;
use osteon_files::arrays::DamagedArray;
use thiserror::Error;

/// An error in a file of signals; the message names the file.
#[derive(Debug, Error)]
#[error("{}: {fault}", visible::path(path))]
pub struct SignalFileError {
    path: PathBuf,
    fault: SignalFault,
}

impl SignalFileError {
    pub(crate) fn new(path: &Path, fault: SignalFault) -> Self {
        Self { path: path.to_owned(), fault }
    }

    /// Returns what is wrong.
    pub fn fault(&self) -> &SignalFault {
        &self.fault
    }
}

/// What is wrong with a file of signals.
#[derive(Debug, Error)]
pub enum SignalFault {
    /// The operating system cannot read it.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// It is larger than any file of signals that is read.
    #[error("has more than {max} bytes; split it, or store a smaller type of numbers")]
    TooLarge {
        /// Most bytes.
        max: u64,
    },
    /// It is of no kind that is read.
    #[error(
        "is {what}; signals are read from CSV, NumPy (NPY, NPZ), MATLAB, HDF5 and SimSonic (rcv2D) files"
    )]
    OtherKind {
        /// What it is, or seems to be.
        what: String,
    },
    /// It is damaged, or ends too early.
    #[error("is damaged: {reason}")]
    Damaged {
        /// How this shows.
        reason: String,
    },
    /// A line of a table is wrong.
    #[error("line {line}: {problem}")]
    Line {
        /// Its number, from 1.
        line: usize,
        /// What is wrong, and what is allowed.
        problem: String,
    },
    /// A sample is not finite.
    #[error(
        "series {series}, receiver {receiver}, sample {sample} is {value}; every sample must be a finite number"
    )]
    NotFinite {
        /// Number of the series, from 1.
        series: u64,
        /// Number of the receiver, from 1.
        receiver: usize,
        /// Number of the sample, from 1.
        sample: usize,
        /// Its value.
        value: f64,
    },
    /// All signals of a series are constant.
    #[error("series {series}: all {receivers} signals are constant, so that nothing was recorded")]
    Constant {
        /// Number of the series, from 1.
        series: u64,
        /// Number of receivers.
        receivers: usize,
    },
    /// Shape and description do not agree, or a value of the description is missing or wrong.
    #[error("{field} {problem}")]
    Disagrees {
        /// The key of the probe file.
        field: &'static str,
        /// What is wrong, and what is allowed.
        problem: String,
    },
}

impl From<DamagedArray> for SignalFault {
    fn from(error: DamagedArray) -> Self {
        Self::damaged(error.to_string())
    }
}

impl SignalFault {
    pub(crate) fn damaged(reason: impl Into<String>) -> Self {
        Self::Damaged { reason: reason.into() }
    }

    pub(crate) fn line(line: usize, problem: impl Into<String>) -> Self {
        Self::Line { line, problem: problem.into() }
    }

    pub(crate) fn disagrees(field: &'static str, problem: impl Into<String>) -> Self {
        Self::Disagrees { field, problem: problem.into() }
    }
}
