//! Files of several arrays with names: which there are, and the one that has the signals.

use std::io::{Cursor, Read as _};

use osteon_common::limits::SIGNAL_SAMPLES_MAX;
use osteon_files::arrays::hdf5::{self, HdfDataset};
use osteon_files::arrays::matlab::{self, MatlabContent, MatlabVariable};
use osteon_files::arrays::npy;
use zip::ZipArchive;

use super::array_axes::{ArrayAxes, AxisOrder};
use super::array_file::ArrayFile;
use crate::reading_error::SignalFault;

/// Most bytes of a file that is read as a whole, and of its unpacked arrays together.
pub(crate) const BYTES_MAX: u64 = 256 << 20;

/// Most members of an archive.
const MEMBERS_MAX: usize = 1000;
/// Most arrays that a message names, and characters of a name.
const SHOWN_MAX: usize = 12;
const NAME_SHOWN_MAX: usize = 60;
/// The key that chooses.
const KEY: &str = "signals.variable";

/// The arrays of a file, and all else in it that has a name.
#[derive(Debug)]
pub(super) struct ArrayVariables {
    list: Vec<ArrayVariable>,
    source: VariableSource,
    /// Index of the largest array that may be one of signals.
    largest: usize,
}

/// Where the arrays are.
#[derive(Debug)]
enum VariableSource {
    /// The bytes of an archive of NumPy, and the member of each array.
    Archive(Vec<u8>, Vec<usize>),
    /// The bytes of a file of MATLAB 5 to 7.2.
    Matlab(Vec<u8>),
    /// Data sets.
    Hdf5(Vec<HdfDataset>),
}

#[derive(Debug)]
struct ArrayVariable {
    name: String,
    axes: ArrayAxes,
    /// What it is, if it is not an array of real numbers.
    other: Option<String>,
}

impl ArrayVariables {
    /// Takes an archive of NumPy.
    ///
    /// # Errors
    /// If it is damaged.
    pub(super) fn of_archive(bytes: Vec<u8>) -> Result<Self, SignalFault> {
        let mut archive = archive(&bytes)?;
        let (mut list, mut members) = (Vec::new(), Vec::new());
        for index in 0..archive.len().min(MEMBERS_MAX) {
            let file = archive.by_index(index).map_err(damaged_archive)?;
            let Some(name) =
                file.name().ok().and_then(|name| Some(name.strip_suffix(".npy")?.to_owned()))
            else {
                continue;
            };
            let mut start = Vec::new();
            file.take(npy::HEADER_BYTES).read_to_end(&mut start).map_err(damaged_member)?;
            let (axes, other) = match npy::header(&start) {
                Ok(header) => (ArrayAxes::of_numpy(header.shape, header.is_by_columns), None),
                Err(error) => (ArrayAxes::of_numpy(Vec::new(), false), Some(error.to_string())),
            };
            list.push(ArrayVariable { name, axes, other });
            members.push(index);
        }
        Self::new(list, VariableSource::Archive(bytes, members))
    }

    /// Takes a file of MATLAB 5 to 7.2.
    ///
    /// # Errors
    /// If it is damaged, or unpacks to too much.
    pub(super) fn of_matlab(bytes: Vec<u8>) -> Result<Self, SignalFault> {
        let mut list = Vec::new();
        let mut take = |MatlabVariable { name, shape, content }: MatlabVariable<'_>| {
            let other = match content {
                MatlabContent::Numbers(..) => None,
                MatlabContent::Other(what) => Some(what.to_owned()),
            };
            let axes = ArrayAxes { shape, order: AxisOrder::Matlab };
            list.push(ArrayVariable { name, axes, other });
        };
        matlab::visit(&bytes, BYTES_MAX, &mut take)?;
        Self::new(list, VariableSource::Matlab(bytes))
    }

    /// Takes a file of HDF5 or MATLAB 7.3.
    ///
    /// # Errors
    /// If it is damaged.
    pub(super) fn of_hdf5(file: std::fs::File) -> Result<Self, SignalFault> {
        let sets = hdf5::of_file(file, SIGNAL_SAMPLES_MAX * size_of::<f64>() as u64)?;
        let list = sets.iter().map(of_dataset).collect();
        Self::new(list, VariableSource::Hdf5(sets))
    }

    /// Returns the name and the axes of the array that most likely has the signals: the largest one.
    pub(super) fn largest(&self) -> (&str, &ArrayAxes) {
        let one = &self.list[self.largest];
        (&one.name, &one.axes)
    }

    /// Returns whether a description must name one.
    pub(super) fn is_ambiguous(&self) -> bool {
        candidates(&self.list).count() > 1
    }

    /// Opens the array of this name; without one, the only array of signals.
    ///
    /// # Errors
    /// If there is none, or several and no name, or it is damaged.
    pub(super) fn open(&self, wanted: Option<&str>) -> Result<ArrayFile, SignalFault> {
        let index = self.index(wanted)?;
        let axes = &self.list[index].axes;
        match &self.source {
            VariableSource::Archive(bytes, members) => {
                let mut archive = archive(bytes)?;
                let file = archive.by_index(members[index]).map_err(damaged_archive)?;
                let mut unpacked = Vec::new();
                file.take(BYTES_MAX + 1).read_to_end(&mut unpacked).map_err(damaged_member)?;
                match unpacked.len() as u64 > BYTES_MAX {
                    true => Err(SignalFault::TooLarge { max: BYTES_MAX }),
                    false => ArrayFile::of_numpy_bytes(unpacked),
                }
            }
            VariableSource::Matlab(bytes) => {
                let (mut at, mut found) = (0, None);
                let mut take = |variable: MatlabVariable<'_>| {
                    if let MatlabContent::Numbers(numbers, bytes) = variable.content
                        && at == index
                    {
                        found = Some(ArrayFile::of_matlab(bytes.to_vec(), numbers, variable.shape));
                    }
                    at += 1;
                };
                matlab::visit(bytes, BYTES_MAX, &mut take)?;
                found.ok_or_else(|| SignalFault::damaged("its variables changed"))
            }
            VariableSource::Hdf5(sets) => {
                Ok(ArrayFile::of_dataset(sets[index].clone(), axes.clone()))
            }
        }
    }

    fn new(list: Vec<ArrayVariable>, source: VariableSource) -> Result<Self, SignalFault> {
        // The first of equals.
        let largest = candidates(&list).rev().max_by_key(|(_, one)| one.axes.count());
        match largest.map(|(index, _)| index) {
            Some(largest) => Ok(Self { list, source, largest }),
            None => Err(SignalFault::OtherKind {
                what: format!(
                    "without an array of real numbers with several axes, which signals are (it has {})",
                    listed(&list)
                ),
            }),
        }
    }

    fn index(&self, wanted: Option<&str>) -> Result<usize, SignalFault> {
        let Some(wanted) = wanted else { return self.only() };
        let is_wanted = |one: &ArrayVariable| self.is_called(&one.name, wanted);
        let Some(index) = self.list.iter().position(is_wanted) else {
            let inside = |one: &&ArrayVariable| self.is_in(&one.name, wanted);
            let problem = match self.list.iter().find(inside) {
                Some(_) => {
                    format!("is {wanted:?}, which has parts; the file has {}", listed(&self.list))
                }
                None => format!("is {wanted:?}, and the file has {}", listed(&self.list)),
            };
            return Err(SignalFault::disagrees(KEY, problem));
        };
        match &self.list[index].other {
            None => Ok(index),
            Some(what) => {
                let problem = format!(
                    "is {wanted:?}, which is no array of real numbers: {what}; the file has {}",
                    listed(&self.list)
                );
                Err(SignalFault::disagrees(KEY, problem))
            }
        }
    }

    /// Returns the index of the only array of signals.
    fn only(&self) -> Result<usize, SignalFault> {
        if self.is_ambiguous() {
            let problem = format!("is missing, and the file has {}; name one", listed(&self.list));
            return Err(SignalFault::disagrees(KEY, problem));
        }
        Ok(self.largest)
    }

    /// Returns whether a name in a description is that of an array. Both `a.b` and `/a/b` reach what is in a group.
    fn is_called(&self, name: &str, wanted: &str) -> bool {
        match self.source {
            VariableSource::Hdf5(_) => dotted(name) == dotted(wanted),
            VariableSource::Archive(..) | VariableSource::Matlab(_) => name == wanted,
        }
    }

    /// Returns whether an array is below a group or structure of this name.
    fn is_in(&self, name: &str, wanted: &str) -> bool {
        let inner = dotted(name);
        inner.strip_prefix(&dotted(wanted)).is_some_and(|rest| rest.starts_with('.'))
    }
}

/// Returns those that may be arrays of signals: no axis is empty, and at least two are longer than 1.
fn candidates(list: &[ArrayVariable]) -> impl DoubleEndedIterator<Item = (usize, &ArrayVariable)> {
    list.iter().enumerate().filter(|(_, one)| {
        let long = one.axes.shape.iter().filter(|&&length| length > 1).count();
        one.other.is_none() && long > 1 && one.axes.count() > 0
    })
}

/// Returns a list of names and lengths for a message: the arrays that may be of signals, or all if there are none.
fn listed(list: &[ArrayVariable]) -> String {
    let described = |one: &ArrayVariable| match &one.other {
        None => format!("{} {:?}", shown(&one.name), one.axes.shape),
        Some(what) => format!("{} ({what})", shown(&one.name)),
    };
    let mut all: Vec<String> = candidates(list).map(|(_, one)| described(one)).collect();
    if all.is_empty() {
        all = list.iter().map(described).collect();
    }
    let more = all.len().saturating_sub(SHOWN_MAX);
    let first = all.iter().take(SHOWN_MAX).cloned().collect::<Vec<_>>().join(", ");
    match (all.is_empty(), more) {
        (true, _) => "no arrays".to_owned(),
        (false, 0) => first,
        (false, _) => format!("{first} and {more} more"),
    }
}

fn of_dataset(set: &HdfDataset) -> ArrayVariable {
    let shape = set.shape();
    let other = match shape {
        Some(_) => set.other().map(str::to_owned),
        None => Some("an array of more numbers than any memory holds".to_owned()),
    };
    let mut shape = shape.unwrap_or_default();
    // MATLAB's dimensions are in the file from the last to the first.
    let order = if set.is_of_matlab() { AxisOrder::Matlab } else { AxisOrder::ByRows };
    if order == AxisOrder::Matlab {
        shape.reverse();
    }
    let name = match order {
        AxisOrder::Matlab => set.path().replace('/', "."),
        AxisOrder::ByRows | AxisOrder::ByColumns => format!("/{}", set.path()),
    };
    ArrayVariable { name, axes: ArrayAxes { shape, order }, other }
}

fn archive(bytes: &[u8]) -> Result<ZipArchive<Cursor<&[u8]>>, SignalFault> {
    ZipArchive::new(Cursor::new(bytes)).map_err(damaged_archive)
}

fn damaged_archive(error: zip::result::ZipError) -> SignalFault {
    SignalFault::damaged(format!("its directory of arrays is missing or damaged ({error})"))
}

fn damaged_member(error: std::io::Error) -> SignalFault {
    SignalFault::damaged(format!("an array of it does not unpack ({error})"))
}

/// Returns a path in a file of HDF5 as MATLAB writes fields of structures.
fn dotted(path: &str) -> String {
    path.trim_matches('/').replace('/', ".")
}

fn shown(name: &str) -> String {
    let short: String = name.chars().take(NAME_SHOWN_MAX).collect();
    let more = if short.len() < name.len() { "…" } else { "" };
    format!("{short:?}{more}")
}
