//! Quantities of results: their names and symbols, and the units in which people read them.

use osteon_common::parameters::Parameter;

use crate::number::{self, RoundedPlaces};

/// Significant digits of a number whose error is unknown.
const DIGITS: i32 = 5;
/// Significant digits of a parameter that the data leave free: they show where it lies.
const FREE_DIGITS: i32 = 3;

/// A unit in which numbers are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unit {
    /// The unit; empty for pure numbers.
    pub(crate) name: &'static str,
    /// What one of it is in the unit of files.
    pub(crate) size: f64,
}

/// Pure numbers.
pub(crate) const NUMBER: Unit = Unit { name: "", size: 1.0 };
/// Velocities.
pub(crate) const VELOCITY: Unit = Unit { name: "m/s", size: 1.0 };
/// Lengths.
pub(crate) const LENGTH: Unit = Unit { name: "mm", size: 1e-3 };
/// Times.
pub(crate) const TIME: Unit = Unit { name: "µs", size: 1e-6 };

/// How many digits of a number are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Precision {
    /// Those that this error leaves, in the unit of files.
    Error(f64),
    /// Those of a number whose error is unknown.
    Unknown,
    /// Those that show where a free parameter lies.
    Free,
    /// This many.
    Digits(i32),
    /// Those of a number that was given, without zeros at its end.
    Given,
}

impl Unit {
    /// Returns a number of files as text in this unit, without it.
    pub(crate) fn show(&self, value: f64, precision: Precision) -> String {
        let value = value / self.size;
        match precision {
            Precision::Error(error) => match RoundedPlaces::for_error(error / self.size) {
                Some(decimals) => decimals.show(value),
                None => number::digits(value, DIGITS),
            },
            Precision::Unknown => number::digits(value, DIGITS),
            Precision::Free => number::digits(value, FREE_DIGITS),
            Precision::Digits(digits) => number::digits(value, digits),
            Precision::Given => number::format_given(value),
        }
    }

    /// Returns a name with this unit in brackets, for an axis.
    pub(crate) fn axis_label(&self, name: &str) -> String {
        if self.name.is_empty() { name.to_owned() } else { format!("{name} ({})", self.name) }
    }
}

/// Returns the unit in which a parameter is shown.
pub(crate) fn unit(parameter: Parameter) -> Unit {
    let (name, size) = parameter.row().shown_in;
    Unit { name, size }
}

/// Returns the name of a kind of failure for people.
pub(crate) fn failure(kind: &str) -> String {
    kind.replace('_', " ")
}
