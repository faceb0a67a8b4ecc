//! Arrays of numbers in files of NumPy, MATLAB and HDF5: which there are, and their numbers.
//!
//! No length that a file declares is believed: it is compared with the bytes that there are before memory is
//! taken for it, and what is compressed is unpacked within a bound.

pub mod hdf5;
pub mod matlab;
pub mod npy;
mod number_type;

use thiserror::Error;

pub use self::number_type::NumberType;

/// Why arrays of a file cannot be read: a reason as a sentence without its full stop.
#[derive(Debug, Error)]
#[error("{reason}")]
pub struct DamagedArray {
    reason: String,
}

impl DamagedArray {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        Self { reason: reason.into() }
    }
}
