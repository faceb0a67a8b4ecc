//! Arrays of signals in a file: one series at a time, where the file has them one after the other.

use std::fs::File;
use std::io::Read as _;
use std::os::unix::fs::FileExt as _;

use osteon_common::limits::SIGNAL_SAMPLES_MAX;
use osteon_common::signal_layout::SignalAxis;

use super::npy::{self, ArrayHeader};
use crate::reading_error::SignalFault;

/// Bytes that contain the header of every array.
const HEADER_BYTES: u64 = (1 << 16) + 16;

/// Where the bytes of an array are.
#[derive(Debug)]
enum ArrayBytes {
    /// In a file, from which they are read when they are needed.
    File(File),
    /// In memory.
    Memory(Vec<u8>),
}

/// An array that is read when it is needed.
#[derive(Debug)]
pub(crate) struct ArrayFile {
    bytes: ArrayBytes,
    header: ArrayHeader,
    /// All numbers, if the series are not one after the other.
    whole: Option<Vec<f64>>,
}

/// The numbers of one series, with the axes that they have.
#[derive(Debug)]
pub(crate) struct SeriesBlock {
    numbers: Vec<f64>,
    /// Length and stride of each of transmitter, receiver and time.
    axes: [(usize, usize); 3],
}

impl ArrayFile {
    /// Takes a file if it is an array of NumPy.
    ///
    /// # Errors
    /// If it is one, and damaged or too large.
    pub(crate) fn recognize(file: File) -> Result<Option<Self>, SignalFault> {
        let mut start = Vec::new();
        (&file).take(HEADER_BYTES).read_to_end(&mut start)?;
        if !start.starts_with(b"\x93NUMPY") {
            return Ok(None);
        }
        let found = file.metadata()?.len();
        Self::new(&start, found, ArrayBytes::File(file)).map(Some)
    }

    /// Takes the bytes of an array of NumPy.
    ///
    /// # Errors
    /// If they are none, or damaged.
    pub(crate) fn of_bytes(bytes: Vec<u8>) -> Result<Self, SignalFault> {
        let start = bytes[..bytes.len().min(HEADER_BYTES as usize)].to_vec();
        Self::new(&start, bytes.len() as u64, ArrayBytes::Memory(bytes))
    }

    /// Takes an array of `found` bytes that begins with those of `start`.
    fn new(start: &[u8], found: u64, bytes: ArrayBytes) -> Result<Self, SignalFault> {
        let header = npy::header(start)?;
        let expected = header
            .count()
            .and_then(|count| count.checked_mul(header.numbers.size)?.checked_add(header.data));
        match expected {
            Some(expected) if expected as u64 == found => Ok(Self { bytes, header, whole: None }),
            Some(expected) => Err(SignalFault::damaged(format!(
                "it has {found} bytes, and an array of the shape {:?} has {expected}",
                header.shape
            ))),
            None => Err(SignalFault::damaged(format!(
                "its shape is {:?}, more than any file has",
                header.shape
            ))),
        }
    }

    pub(crate) fn shape(&self) -> &[usize] {
        &self.header.shape
    }

    /// Reads series `number`, where `axes` are those of the shape.
    ///
    /// # Errors
    /// If it cannot be read, or would take too much memory.
    pub(crate) fn series(
        &mut self,
        axes: &[SignalAxis],
        number: u64,
    ) -> Result<SeriesBlock, SignalFault> {
        let number = number as usize;
        let strides = self.strides();
        let place = |axis| axes.iter().position(|&one| one == axis);
        let along =
            |axis| place(axis).map_or((1, 0), |index| (self.header.shape[index], strides[index]));
        let three = [SignalAxis::Transmitter, SignalAxis::Receiver, SignalAxis::Time].map(along);
        let length: usize = three.iter().map(|(length, _)| length).product();
        let (_, between) = along(SignalAxis::Series);
        // Series one after the other are read one after the other.
        if place(SignalAxis::Series).is_none() || between == length {
            let numbers = self.read(number * length, length)?;
            return Ok(SeriesBlock { numbers, axes: three });
        }
        let count = self.header.count().unwrap_or(usize::MAX);
        let whole = match self.whole.take() {
            Some(whole) => whole,
            None => self.read(0, count)?,
        };
        let first = number * between;
        let last = three.iter().fold(first, |last, (length, stride)| last + (length - 1) * stride);
        let numbers = whole.get(first..=last).unwrap_or_default().to_vec();
        self.whole = Some(whole);
        Ok(SeriesBlock { numbers, axes: three })
    }

    /// Returns how many numbers apart neighbours along each axis are.
    fn strides(&self) -> Vec<usize> {
        let shape = &self.header.shape;
        let mut strides = vec![1; shape.len()];
        match self.header.is_by_columns {
            true => {
                for index in 1..shape.len() {
                    strides[index] = strides[index - 1] * shape[index - 1];
                }
            }
            false => {
                for index in (1..shape.len()).rev() {
                    strides[index - 1] = strides[index] * shape[index];
                }
            }
        }
        strides
    }

    fn read(&self, first: usize, count: usize) -> Result<Vec<f64>, SignalFault> {
        if count as u64 > SIGNAL_SAMPLES_MAX {
            return Err(SignalFault::disagrees(
                "signals.axes",
                format!(
                    "asks for {count} samples at once, and at most {SIGNAL_SAMPLES_MAX} are read; put the axis \
                     of series first, or split the file"
                ),
            ));
        }
        let size = self.header.numbers.size;
        let offset = self.header.data + first * size;
        match &self.bytes {
            ArrayBytes::File(file) => {
                let mut bytes = vec![0; count * size];
                file.read_exact_at(&mut bytes, offset as u64)?;
                Ok(self.header.numbers.decode(&bytes))
            }
            ArrayBytes::Memory(bytes) => {
                let part = bytes.get(offset..offset + count * size).unwrap_or_default();
                Ok(self.header.numbers.decode(part))
            }
        }
    }
}

impl SeriesBlock {
    /// Returns the samples of each receiver for each transmitter.
    pub(crate) fn directions(&self) -> Vec<Vec<Vec<f64>>> {
        let [(transmitters, by_transmitter), (receivers, by_receiver), (times, by_time)] =
            self.axes;
        let sample = |t: usize, r: usize, j: usize| {
            let place = t * by_transmitter + r * by_receiver + j * by_time;
            self.numbers.get(place).copied().unwrap_or(f64::NAN)
        };
        let signal = |t, r| (0..times).map(|j| sample(t, r, j)).collect();
        (0..transmitters).map(|t| (0..receivers).map(|r| signal(t, r)).collect()).collect()
    }
}
