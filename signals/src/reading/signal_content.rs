//! What is in a file of signals.

use super::array_file::ArrayFile;
use super::array_variables::ArrayVariables;
use super::traces_csv::TraceTable;

/// The content of a file, as far as it has been read.
#[derive(Debug)]
pub(super) enum SignalContent {
    /// A table of one series.
    Table(TraceTable),
    /// An array of any number of series.
    Array(ArrayFile),
    /// Arrays with names.
    Variables(ArrayVariables),
}

/// The part of a content that a description describes.
#[derive(Debug)]
pub(super) enum Recording<'a> {
    /// A table of one series.
    Table(&'a TraceTable),
    /// The array that has the signals.
    Array(&'a mut ArrayFile),
}
