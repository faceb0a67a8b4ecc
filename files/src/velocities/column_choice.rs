//! How the column of velocities is read.

use super::csv_format::{CsvFormat, DecimalMark, VelocityUnit};

/// Velocities of sound in bone, m/s, as wide as the program accepts them.
pub(super) const POSSIBLE: std::ops::Range<f64> = 100.0..20_000.0;
/// Usual velocities of sound in bone, m/s.
pub(super) const USUAL: std::ops::Range<f64> = 1000.0..8000.0;

/// How the column of velocities is read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ColumnChoice {
    pub(super) place: usize,
    pub(super) decimal: DecimalMark,
    pub(super) unit: VelocityUnit,
    /// Whether the unit follows from the size of the numbers alone.
    pub(super) is_unit_guessed: bool,
    /// Texts that stand for missing values.
    pub(super) missing: Vec<String>,
}

impl ColumnChoice {
    /// Returns the column that the keys name, read as they say.
    pub(super) fn from_keys(format: &CsvFormat, place: usize) -> Self {
        Self {
            place,
            decimal: format.decimal.unwrap_or_default(),
            unit: format.unit.unwrap_or_default(),
            is_unit_guessed: false,
            missing: format.missing.clone().unwrap_or_default(),
        }
    }
}
