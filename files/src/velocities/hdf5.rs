//! The data sets of a file of HDF5, which is also what MATLAB 7.3 writes.
//!
//! Vectors of numbers are columns, those in groups, too; all else is passed over.

use osteon_common::limits;

use super::content::{Content, NumberColumn, is_vector, tables_of};
use super::names::ColumnName;
use super::problem::{Problem, shortened};
use super::units;
use crate::arrays::hdf5::{self, HdfDataset};

const WHAT: &str = "an HDF5 or MATLAB 7.3 file";
/// Attributes that change what the numbers of a data set are, and that of their unit.
const OF_VALUES: [&str; 4] = ["scale_factor", "add_offset", "_FillValue", "missing_value"];
const UNITS: &str = "units";

/// Returns a table of the file's vectors for each length.
pub(super) fn tables(bytes: Vec<u8>) -> Result<Vec<Content>, Problem> {
    let datasets = hdf5::of_bytes(bytes, limits::FILE_BYTES_MAX)
        .map_err(|error| Problem::Damaged { what: WHAT, reason: error.to_string() })?;
    let (mut columns, mut bytes) = (Vec::new(), 0_u64);
    for dataset in datasets {
        bytes = bytes.saturating_add(dataset.bytes());
        let is_within = bytes <= limits::FILE_BYTES_MAX;
        let is_vector = dataset.shape().is_some_and(|shape| is_vector(&shape));
        if is_within
            && is_vector
            && let Ok(numbers) = dataset.numbers(None)
        {
            let name = dataset.path().rsplit('/').next().unwrap_or_default();
            if let Some(problem) = attribute_of_values(&dataset, name) {
                return Err(problem);
            }
            columns.push(NumberColumn { name: dataset.path().replace('/', "."), numbers });
        }
    }
    if columns.is_empty() {
        return Err(Problem::NoVectors { what: WHAT });
    }
    Ok(tables_of(&columns, WHAT))
}

/// Returns the attribute by which the numbers of a data set of velocities are none in m/s, as they stand.
fn attribute_of_values(dataset: &HdfDataset, name: &str) -> Option<Problem> {
    let is_of_velocities = ColumnName::parse(name).is_of_velocities();
    let found = OF_VALUES.into_iter().find(|attribute| dataset.has_attribute(attribute));
    let unit = dataset.text_attribute(UNITS);
    let is_other = |unit: &String| units::of_velocity(unit).is_none() && !unit.trim().is_empty();
    let found = found.or(unit.filter(is_other).map(|_| UNITS));
    found
        .filter(|_| is_of_velocities)
        .map(|attribute| Problem::Attribute { name: shortened(name), attribute })
}
