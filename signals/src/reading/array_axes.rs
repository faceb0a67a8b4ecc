//! The axes of an array: their lengths, in which order they are in the file, and what they usually count.

use osteon_common::signal_layout::SignalAxis;

/// In which order the numbers of an array are, and which program chose it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AxisOrder {
    /// The last axis is the fastest in the file.
    ByRows,
    /// The first axis is the fastest in the file.
    ByColumns,
    /// As [`Self::ByColumns`], and the usual axes are those of MATLAB.
    Matlab,
}

/// The axes of an array, as the program that wrote it shows them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ArrayAxes {
    /// Their lengths.
    pub(crate) shape: Vec<usize>,
    pub(crate) order: AxisOrder,
}

impl ArrayAxes {
    /// Returns those of an array of NumPy.
    pub(crate) fn of_numpy(shape: Vec<usize>, is_by_columns: bool) -> Self {
        let order = if is_by_columns { AxisOrder::ByColumns } else { AxisOrder::ByRows };
        Self { shape, order }
    }

    /// Returns how many numbers the array has; the largest number if that is absurd.
    pub(crate) fn count(&self) -> usize {
        self.shape.iter().fold(1, |count, &length| count.saturating_mul(length))
    }

    /// Returns how many numbers apart neighbours along each axis are.
    pub(crate) fn strides(&self) -> Vec<usize> {
        let mut strides = vec![1; self.shape.len()];
        let mut apart = 1_usize;
        let mut step = |index: usize| {
            strides[index] = apart;
            apart = apart.saturating_mul(self.shape[index]);
        };
        match self.order {
            AxisOrder::ByRows => (0..self.shape.len()).rev().for_each(&mut step),
            AxisOrder::ByColumns | AxisOrder::Matlab => (0..self.shape.len()).for_each(&mut step),
        }
        strides
    }

    /// Returns what the axes count if nobody says it; empty if nothing is usual for so many.
    pub(crate) fn usual(&self) -> Vec<SignalAxis> {
        use SignalAxis::{Receiver, Series, Time, Transmitter};
        let by_rows: &[SignalAxis] = match self.shape.len() {
            2 => return vec![Time, Receiver],
            3 => &[Series, Receiver, Time],
            4 => &[Series, Transmitter, Receiver, Time],
            _ => &[],
        };
        match self.order {
            AxisOrder::Matlab => by_rows.iter().rev().copied().collect(),
            AxisOrder::ByRows | AxisOrder::ByColumns => by_rows.to_vec(),
        }
    }
}
