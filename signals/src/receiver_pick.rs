//! What is known of the signal of one receiver.

use serde::Serialize;

use crate::pick_failure::PickFailure;

/// What one receiver contributed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReceiverPick {
    /// Time of the picked extremum, s, if there is one.
    pub time: Option<f64>,
    /// Standard error of the time from the signal's noise, s; 0 if the noise is unknown.
    pub standard_error: f64,
    /// Size of the extremum, in the unit of the signals, if there is one; its standard error is 0 if the noise is
    /// unknown.
    pub amplitude: Option<MeasuredValue>,
    /// Why the time is not used.
    pub failure: Option<PickFailure>,
}

/// A measured number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeasuredValue {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}
