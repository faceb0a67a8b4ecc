//! One array of signals of a file: one series at a time, where the file has them one after the other.

use std::fs::File;
use std::io::Read as _;
use std::os::unix::fs::FileExt as _;

use osteon_common::limits::SIGNAL_SAMPLES_MAX;
use osteon_common::signal_layout::SignalAxis;
use osteon_files::arrays::NumberType;
use osteon_files::arrays::hdf5::HdfDataset;
use osteon_files::arrays::npy;

use super::array_axes::{ArrayAxes, AxisOrder};
use crate::reading_error::SignalFault;

/// Where the numbers of an array are, in the order of the file.
#[derive(Debug)]
enum ArraySource {
    /// In a file, from which they are read when they are needed: their type, and where they begin.
    File(File, NumberType, usize),
    /// In memory.
    Memory(Vec<u8>, NumberType, usize),
    /// In a data set.
    Dataset(Box<HdfDataset>),
}

/// What a file says of the signals in its array, beside their values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedGrid {
    /// Time between samples, s.
    pub step: f64,
    /// Distance of neighbouring receivers, m.
    pub pitch: f64,
}

/// An array that is read when it is needed.
#[derive(Debug)]
pub(crate) struct ArrayFile {
    source: ArraySource,
    axes: ArrayAxes,
    grid: Option<RecordedGrid>,
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
    /// Takes a file that is an array of NumPy.
    ///
    /// # Errors
    /// If it is damaged.
    pub(crate) fn of_numpy(file: File) -> Result<Self, SignalFault> {
        let mut start = Vec::new();
        (&file).take(npy::HEADER_BYTES).read_to_end(&mut start)?;
        let header = npy::header(&start)?;
        header.check_length(file.metadata()?.len())?;
        let axes = ArrayAxes::of_numpy(header.shape, header.is_by_columns);
        Ok(Self::new(ArraySource::File(file, header.numbers, header.data), axes))
    }

    /// Takes the bytes of an array of NumPy.
    ///
    /// # Errors
    /// If they are none, or damaged.
    pub(crate) fn of_numpy_bytes(bytes: Vec<u8>) -> Result<Self, SignalFault> {
        let header = npy::header(&bytes)?;
        header.check_length(bytes.len() as u64)?;
        let axes = ArrayAxes::of_numpy(header.shape, header.is_by_columns);
        Ok(Self::new(ArraySource::Memory(bytes, header.numbers, header.data), axes))
    }

    /// Takes the numbers of a variable of MATLAB.
    pub(crate) fn of_matlab(bytes: Vec<u8>, numbers: NumberType, shape: Vec<usize>) -> Self {
        let axes = ArrayAxes { shape, order: AxisOrder::Matlab };
        Self::new(ArraySource::Memory(bytes, numbers, 0), axes)
    }

    /// Takes a data set.
    pub(crate) fn of_dataset(dataset: HdfDataset, axes: ArrayAxes) -> Self {
        Self::new(ArraySource::Dataset(Box::new(dataset)), axes)
    }

    /// Takes the doubles at `data` of a file that are, for each receiver, its samples.
    pub(crate) fn of_simulation(
        file: File,
        data: usize,
        shape: Vec<usize>,
        grid: RecordedGrid,
    ) -> Self {
        let axes = ArrayAxes { shape, order: AxisOrder::Matlab };
        let source = ArraySource::File(file, NumberType::DOUBLE, data);
        Self { grid: Some(grid), ..Self::new(source, axes) }
    }

    fn new(source: ArraySource, axes: ArrayAxes) -> Self {
        Self { source, axes, grid: None, whole: None }
    }

    /// Returns its axes.
    pub(crate) fn axes(&self) -> &ArrayAxes {
        &self.axes
    }

    /// Returns what the file says of its signals.
    pub(crate) fn grid(&self) -> Option<RecordedGrid> {
        self.grid
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
        let (shape, strides) = (&self.axes.shape, self.axes.strides());
        let place = |axis| axes.iter().position(|&one| one == axis);
        let along = |axis| place(axis).map_or((1, 0), |index| (shape[index], strides[index]));
        let three = [SignalAxis::Transmitter, SignalAxis::Receiver, SignalAxis::Time].map(along);
        let (series, between) = along(SignalAxis::Series);
        let length = three.iter().fold(1_usize, |count, (length, _)| count.saturating_mul(*length));
        // Series one after the other are read one after the other.
        if place(SignalAxis::Series).is_none() || between == length {
            let numbers = self.read(number, length, series)?;
            return Ok(SeriesBlock { numbers, axes: three });
        }
        let whole = match self.whole.take() {
            Some(whole) => whole,
            None => self.read(0, self.axes.count(), 1)?,
        };
        let first = number * between;
        let last = three.iter().fold(first, |last, (length, stride)| last + (length - 1) * stride);
        let numbers = whole.get(first..=last).unwrap_or_default().to_vec();
        self.whole = Some(whole);
        Ok(SeriesBlock { numbers, axes: three })
    }

    /// Reads part `index` of `parts` of the array, each of `count` numbers.
    fn read(&self, index: usize, count: usize, parts: usize) -> Result<Vec<f64>, SignalFault> {
        if count as u64 > SIGNAL_SAMPLES_MAX {
            return Err(SignalFault::disagrees(
                "signals.axes",
                format!(
                    "asks for {count} samples at once, and at most {SIGNAL_SAMPLES_MAX} are read; make the axis \
                     of series the slowest of the file, or split the file"
                ),
            ));
        }
        match &self.source {
            ArraySource::File(file, numbers, data) => {
                let mut bytes = vec![0; count * numbers.size()];
                let offset = data + index * bytes.len();
                file.read_exact_at(&mut bytes, offset as u64)?;
                Ok(numbers.decode(&bytes))
            }
            ArraySource::Memory(bytes, numbers, data) => {
                let length = count * numbers.size();
                let part = bytes.get(data + index * length..).unwrap_or_default();
                Ok(numbers.decode(part.get(..length).unwrap_or_default()))
            }
            // The axis of the series is then the slowest one.
            ArraySource::Dataset(set) => Ok(set.numbers((parts > 1).then_some(index))?),
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
