//! The data sets of a file of HDF5, which is also what MATLAB 7.3 writes.
//!
//! Vectors of numbers are columns, those in groups, too; all else is passed over.

use std::sync::Arc;

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::Datatype;
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};
use osteon_common::limits;

use super::content::{Content, NumberColumn, tables_of};
use super::names::ColumnName;
use super::problem::{Problem, shortened};
use super::units;

const WHAT: &str = "an HDF5 or MATLAB 7.3 file";
/// Most data sets that are looked at.
const DATASETS_MAX: usize = 1000;
/// How deep groups are followed.
const DEPTH_MAX: usize = 4;
/// Attribute by which MATLAB says what an array was, and its value for text.
const CLASS: &str = "MATLAB_class";
const CLASS_OF_TEXT: &str = "char";
/// Attributes that change what the numbers of a data set are, and that of their unit.
const OF_VALUES: [&str; 4] = ["scale_factor", "add_offset", "_FillValue", "missing_value"];
const UNITS: &str = "units";

/// Returns a table of the file's vectors for each length.
pub(super) fn tables(bytes: Vec<u8>) -> Result<Vec<Content>, Problem> {
    let damaged = |error: Error| Problem::Damaged { what: WHAT, reason: error.to_string() };
    let bound = usize::try_from(limits::FILE_BYTES_MAX).unwrap_or(usize::MAX);
    let options = OpenOptions::default()
        .with_max_read_bytes(bound)
        .with_max_chunk_bytes(bound)
        .with_max_object_header_bytes(1 << 20)
        .with_chunk_cache_bytes(1 << 20);
    let file =
        Hdf5File::from_shared_bytes_with_options(Arc::from(bytes), options).map_err(damaged)?;
    let mut found = Vectors { columns: Vec::new(), bytes: 0, looked_at: 0, problem: None };
    found.group(&file.root_group().map_err(damaged)?, "", 0).map_err(damaged)?;
    if let Some(problem) = found.problem {
        return Err(problem);
    }
    if found.columns.is_empty() {
        return Err(Problem::NoVectors { what: WHAT });
    }
    Ok(tables_of(&found.columns, WHAT))
}

/// Vectors that were found, and how many bytes they have.
struct Vectors {
    columns: Vec<NumberColumn>,
    bytes: usize,
    looked_at: usize,
    /// Why velocities are refused: an attribute of theirs changes their numbers, or names another unit.
    problem: Option<Problem>,
}

impl Vectors {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), Error> {
        let (groups, datasets) = group.members()?;
        for dataset in datasets {
            self.looked_at += 1;
            if self.looked_at > DATASETS_MAX {
                return Ok(());
            }
            let name = last_part(dataset.name());
            let is_vector = dataset.shape().iter().filter(|&&length| length != 1).count() == 1;
            self.bytes = self.bytes.saturating_add(dataset.raw_byte_len().unwrap_or(usize::MAX));
            let is_within = self.bytes as u64 <= limits::FILE_BYTES_MAX;
            if is_vector
                && is_within
                && !is_text(&dataset)
                && let Some(numbers) = numbers(&dataset)
            {
                self.problem = self.problem.take().or(attribute_of_values(&dataset, name));
                self.columns.push(NumberColumn { name: format!("{path}{name}"), numbers });
            }
        }
        for group in groups.iter().filter(|_| depth < DEPTH_MAX) {
            let name = last_part(group.name());
            // What MATLAB keeps for itself begins so.
            if !name.starts_with('#') {
                self.group(group, &format!("{path}{name}."), depth + 1)?;
            }
        }
        Ok(())
    }
}

fn last_part(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Returns the attribute by which the numbers of a data set of velocities are none in m/s, as they stand.
fn attribute_of_values(dataset: &Dataset, name: &str) -> Option<Problem> {
    let is_of_velocities = ColumnName::parse(name).is_of_velocities();
    let found = OF_VALUES.into_iter().find(|attribute| dataset.attribute(attribute).is_ok());
    let unit = dataset.attribute(UNITS).and_then(|attribute| attribute.read_string()).ok();
    let is_other = |unit: &String| units::of_velocity(unit).is_none() && !unit.trim().is_empty();
    let found = found.or(unit.filter(is_other).map(|_| UNITS));
    found
        .filter(|_| is_of_velocities)
        .map(|attribute| Problem::Attribute { name: shortened(name), attribute })
}

fn is_text(dataset: &Dataset) -> bool {
    let class = dataset.attribute(CLASS).and_then(|attribute| attribute.read_string());
    class.is_ok_and(|class| class == CLASS_OF_TEXT)
}

/// Returns the numbers of a data set; `None` if it has others, or cannot be read.
fn numbers(dataset: &Dataset) -> Option<Vec<f64>> {
    /// The numbers of one type.
    fn of<T: hdf5_reader::H5Type>(
        dataset: &Dataset,
        number: impl FnMut(T) -> f64,
    ) -> Option<Vec<f64>> {
        Some(dataset.read_array::<T>().ok()?.into_iter().map(number).collect())
    }
    match dataset.dtype() {
        Datatype::FloatingPoint { size: 8, .. } => of(dataset, |number: f64| number),
        Datatype::FloatingPoint { size: 4, .. } => of(dataset, |number: f32| f64::from(number)),
        Datatype::FixedPoint { size: 1, signed: true, .. } => of(dataset, |n: i8| f64::from(n)),
        Datatype::FixedPoint { size: 1, signed: false, .. } => of(dataset, |n: u8| f64::from(n)),
        Datatype::FixedPoint { size: 2, signed: true, .. } => of(dataset, |n: i16| f64::from(n)),
        Datatype::FixedPoint { size: 2, signed: false, .. } => of(dataset, |n: u16| f64::from(n)),
        Datatype::FixedPoint { size: 4, signed: true, .. } => of(dataset, |n: i32| f64::from(n)),
        Datatype::FixedPoint { size: 4, signed: false, .. } => of(dataset, |n: u32| f64::from(n)),
        Datatype::FixedPoint { size: 8, signed: true, .. } => of(dataset, |n: i64| n as f64),
        Datatype::FixedPoint { size: 8, signed: false, .. } => of(dataset, |n: u64| n as f64),
        _ => None,
    }
}
