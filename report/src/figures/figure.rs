//! A chart with the words that belong to it.

use crate::chart::Chart;

/// A chart, and how to read it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Figure {
    pub(crate) chart: Chart,
    /// Two sentences on how to read it.
    pub(crate) reading: String,
}
