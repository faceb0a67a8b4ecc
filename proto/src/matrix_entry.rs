//! Places in the elasticity matrix as messages.

use crate::malformed::Malformed;

/// Rows and columns of the elasticity matrix.
const ROWS: u32 = 6;

/// Converts an index that starts at 0 into a row or column number from 1.
pub(crate) fn entry_number(place: usize) -> u32 {
    u32::try_from(place + 1).unwrap_or(u32::MAX)
}

/// Converts a row or column number from `least` to 6 into an index that starts at 0.
pub(crate) fn place(number: u32, least: u32, field: &'static str) -> Result<usize, Malformed> {
    let place = (least..=ROWS).contains(&number).then(|| number as usize - 1);
    let allowed = "it must be 1 to 6, and a column at least its row";
    let refused = Malformed::OutOfRange { field, value: number.into(), allowed };
    place.ok_or(refused)
}
