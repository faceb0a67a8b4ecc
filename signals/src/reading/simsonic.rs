//! Files of the receivers of a simulation by SimSonic2D (`.rcv2D`): one measurement.
//!
//! A header without padding, little-endian: the direction normal to the array (one character, `1` or `2`); number
//! of receivers, position along both axes, pitch and width in steps of the grid (32 bits each); the grid's step
//! in mm (double); number of times (32 bits); time between them in µs (double). The samples of each receiver
//! follow, in double precision.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use super::array_file::{ArrayFile, RecordedGrid};
use crate::reading_error::SignalFault;

/// Bytes of the header.
const HEADER: usize = 41;
/// Ending of the names of such files, which do not begin with a mark of their own.
const EXTENSION: &str = "rcv2D";

/// Returns whether a file is called as one of SimSonic.
pub(super) fn is_called_so(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Takes a file of SimSonic.
///
/// # Errors
/// If it cannot be read, or is none, or damaged.
pub(super) fn open(file: File) -> Result<ArrayFile, SignalFault> {
    let mut header = [0; HEADER];
    let found = file.metadata()?.len();
    if found < HEADER as u64 {
        return Err(SignalFault::damaged("it ends within its header"));
    }
    (&file).read_exact(&mut header)?;
    let whole = |at: usize| header[at..].first_chunk().map_or(0, |four| i32::from_le_bytes(*four));
    let number =
        |at: usize| header[at..].first_chunk().map_or(0.0, |eight| f64::from_le_bytes(*eight));
    let (receivers, pitch, times) = (whole(1), whole(13), whole(29));
    let (grid_step, step) = (number(21) * 1e-3, number(33) * 1e-6);
    let is_one = matches!(header[0], b'1' | b'2') && receivers > 0 && times > 0 && pitch >= 0;
    let is_finite = [grid_step, step].iter().all(|one| one.is_finite() && *one > 0.0);
    if !is_one || !is_finite {
        return Err(SignalFault::damaged(
            "its header is none of a file of receivers of SimSonic2D, by whose extension it is called",
        ));
    }
    let (receivers, times) = (receivers.unsigned_abs() as usize, times.unsigned_abs() as usize);
    let expected = HEADER + receivers * times * size_of::<f64>();
    if expected as u64 != found {
        return Err(SignalFault::damaged(format!(
            "it has {found} bytes, and {receivers} receivers with {times} samples each have {expected}"
        )));
    }
    let grid = RecordedGrid { step, pitch: f64::from(pitch) * grid_step };
    Ok(ArrayFile::of_simulation(file, HEADER, vec![times, receivers], grid))
}
