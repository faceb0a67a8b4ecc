//! The data sets of a file of HDF5, which is also what MATLAB 7.3 writes.

use std::fmt;
use std::fs::File;
use std::sync::Arc;

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::Datatype;
use hdf5_reader::storage::{DynStorage, FileStorage};
use hdf5_reader::{Dataset, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem};

use super::DamagedArray;

/// Most data sets, and groups, that are looked at.
const OBJECTS_MAX: usize = 1000;
/// How deep groups are followed.
const DEPTH_MAX: usize = 8;
/// Most bytes of the description of one object.
const DESCRIPTION_BYTES_MAX: usize = 1 << 20;
/// Attribute by which MATLAB says what an array was, and another one of those without elements.
const CLASS: &str = "MATLAB_class";
const EMPTY: &str = "MATLAB_empty";

/// A data set, whose numbers are read when they are needed.
#[derive(Clone)]
pub struct HdfDataset {
    path: String,
    dataset: Dataset,
}

/// Returns all data sets of the bytes of a file; of each at most `bytes_max` are read at once.
///
/// # Errors
/// If the file is damaged.
pub fn of_bytes(bytes: Vec<u8>, bytes_max: u64) -> Result<Vec<HdfDataset>, DamagedArray> {
    let found = bytes.len() as u64;
    let opened = Hdf5File::from_shared_bytes_with_options(Arc::from(bytes), options(bytes_max));
    datasets(&opened.map_err(damaged)?, found)
}

/// Returns all data sets of a file, which is read when its numbers are; of each at most `bytes_max` are read at
/// once.
///
/// # Errors
/// If the file cannot be read, or is damaged.
pub fn of_file(file: File, bytes_max: u64) -> Result<Vec<HdfDataset>, DamagedArray> {
    let found = file.metadata().map_err(|error| damaged(error.into()))?.len();
    let opened = FileStorage::from_file(file).and_then(|storage| {
        let storage: DynStorage = Arc::new(storage);
        Hdf5File::from_storage_with_options(storage, options(bytes_max))
    });
    datasets(&opened.map_err(damaged)?, found)
}

impl HdfDataset {
    /// Returns the names of the groups that lead to it, and its own, with slashes between them and none before.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns the lengths of its axes, the slowest first; `None` if no memory could hold so many.
    pub fn shape(&self) -> Option<Vec<usize>> {
        self.dataset.shape().iter().map(|&length| usize::try_from(length).ok()).collect()
    }

    /// Returns whether MATLAB wrote it, whose dimensions are the axes from the last to the first.
    pub fn is_of_matlab(&self) -> bool {
        self.class().is_some()
    }

    /// Returns what it is, with its article, if it is not an array of real numbers.
    pub fn other(&self) -> Option<&'static str> {
        if self.dataset.attribute(EMPTY).is_ok() {
            return Some("an array without elements");
        }
        match self.class().as_deref() {
            Some("char") => return Some("a text"),
            Some("cell") => return Some("a cell array"),
            Some("logical") => return Some("an array of truth values"),
            Some("struct") => return Some("an array of structures"),
            _ => {}
        }
        match self.dataset.dtype() {
            Datatype::FloatingPoint { size: 4 | 8, .. }
            | Datatype::FixedPoint { size: 1 | 2 | 4 | 8, .. } => None,
            Datatype::Compound { fields, .. } if fields.len() == 2 => {
                Some("an array of complex numbers")
            }
            Datatype::Compound { .. } => Some("a table of records"),
            Datatype::String { .. } | Datatype::VarLen { .. } => Some("a text"),
            Datatype::Reference { .. } => Some("an array of references"),
            Datatype::Enum { .. } => Some("an array of truth values or names"),
            _ => Some("an array of numbers of another type"),
        }
    }

    /// Returns a text that is an attribute of it.
    pub(crate) fn text_attribute(&self, name: &str) -> Option<String> {
        self.dataset.attribute(name).and_then(|attribute| attribute.read_string()).ok()
    }

    /// Returns whether it has an attribute.
    pub(crate) fn has_attribute(&self, name: &str) -> bool {
        self.dataset.attribute(name).is_ok()
    }

    /// Returns the bytes of all its numbers; the largest number if there are more.
    pub(crate) fn bytes(&self) -> u64 {
        self.dataset.raw_byte_len().map_or(u64::MAX, |bytes| bytes as u64)
    }

    /// Returns its numbers in the order of the file: those of the element `index` of the slowest axis, or all.
    ///
    /// # Errors
    /// If they cannot be read, are none, or more than may be read at once.
    pub fn numbers(&self, index: Option<usize>) -> Result<Vec<f64>, DamagedArray> {
        if let Some(other) = self.other() {
            return Err(DamagedArray::new(format!("{:?} is {other}", self.path)));
        }
        let mut part = SliceInfo::all(self.dataset.ndim());
        if let (Some(index), Some(slowest)) = (index, part.selections.first_mut()) {
            *slowest = SliceInfoElem::Index(index as u64);
        }
        let part = &part;
        let numbers = match self.dataset.dtype() {
            Datatype::FloatingPoint { size: 8, .. } => self.decoded(part, |number: f64| number),
            Datatype::FloatingPoint { .. } => self.decoded(part, |n: f32| f64::from(n)),
            Datatype::FixedPoint { size: 1, signed: true, .. } => {
                self.decoded(part, |n: i8| f64::from(n))
            }
            Datatype::FixedPoint { size: 1, .. } => self.decoded(part, |n: u8| f64::from(n)),
            Datatype::FixedPoint { size: 2, signed: true, .. } => {
                self.decoded(part, |n: i16| f64::from(n))
            }
            Datatype::FixedPoint { size: 2, .. } => self.decoded(part, |n: u16| f64::from(n)),
            Datatype::FixedPoint { size: 4, signed: true, .. } => {
                self.decoded(part, |n: i32| f64::from(n))
            }
            Datatype::FixedPoint { size: 4, .. } => self.decoded(part, |n: u32| f64::from(n)),
            Datatype::FixedPoint { signed: true, .. } => self.decoded(part, |n: i64| n as f64),
            _ => self.decoded(part, |n: u64| n as f64),
        };
        numbers
            .map_err(|error| DamagedArray::new(format!("{:?} cannot be read: {error}", self.path)))
    }

    fn decoded<T: hdf5_reader::H5Type>(
        &self,
        part: &SliceInfo,
        number: impl FnMut(T) -> f64,
    ) -> Result<Vec<f64>, Error> {
        // A scalar has no axes to select from.
        let read = match self.dataset.ndim() {
            0 => self.dataset.read_array::<T>(),
            _ => self.dataset.read_slice::<T>(part),
        };
        Ok(read?.into_iter().map(number).collect())
    }

    fn class(&self) -> Option<String> {
        self.text_attribute(CLASS)
    }
}

impl fmt::Debug for HdfDataset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("HdfDataset").field("path", &self.path).finish_non_exhaustive()
    }
}

fn damaged(error: Error) -> DamagedArray {
    DamagedArray::new(error.to_string())
}

/// Bounds all that is read at once by the numbers that are wanted.
fn options(bytes_max: u64) -> OpenOptions {
    let bound = usize::try_from(bytes_max).unwrap_or(usize::MAX);
    OpenOptions::default()
        .with_max_read_bytes(bound)
        .with_max_chunk_bytes(bound)
        .with_max_object_header_bytes(DESCRIPTION_BYTES_MAX)
}

/// Returns the data sets of a file that has `found` bytes.
fn datasets(file: &Hdf5File, found: u64) -> Result<Vec<HdfDataset>, DamagedArray> {
    let expected = file.superblock().eof_address;
    if found < expected {
        return Err(DamagedArray::new(format!("it has {found} bytes of {expected}")));
    }
    let mut walk = DatasetWalk::default();
    let root = file.root_group().map_err(damaged)?;
    walk.group(&root, "", 0).map_err(damaged)?;
    Ok(walk.found)
}

/// A pass over the groups of a file.
#[derive(Default)]
struct DatasetWalk {
    found: Vec<HdfDataset>,
    /// Addresses of the groups that were seen: links may lead back to one.
    groups: Vec<u64>,
}

impl DatasetWalk {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), Error> {
        let is_known = self.groups.contains(&group.address());
        if is_known || depth > DEPTH_MAX || self.groups.len() >= OBJECTS_MAX {
            return Ok(());
        }
        self.groups.push(group.address());
        let (groups, datasets) = group.members()?;
        for dataset in datasets.into_iter().take(OBJECTS_MAX - self.found.len()) {
            let path = format!("{path}{}", last_part(dataset.name()));
            self.found.push(HdfDataset { path, dataset });
        }
        for inner in groups {
            let name = last_part(inner.name());
            // What MATLAB keeps for itself begins so.
            if !name.starts_with('#') {
                self.group(&inner, &format!("{path}{name}/"), depth + 1)?;
            }
        }
        Ok(())
    }
}

fn last_part(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}
