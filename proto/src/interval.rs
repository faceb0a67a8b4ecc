//! Intervals as messages.

use crate::malformed::{Malformed, present};
use crate::v1;

/// Returns the message of an interval with these ends.
pub(crate) fn interval_to_message([lower, upper]: [f64; 2]) -> v1::Interval {
    v1::Interval { lower: Some(lower), upper: Some(upper) }
}

/// Reads an interval, of which both ends are required.
pub(crate) fn interval_from_message(message: Option<&v1::Interval>) -> Result<[f64; 2], Malformed> {
    let message = present(message, "interval")?;
    Ok([present(message.lower, "lower")?, present(message.upper, "upper")?])
}
