//! Recorded signals in memory.

use osteon_common::signal_layout::Transmitter;

/// The signals of all receivers while one source emits; all begin at the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySignals {
    /// The source.
    pub transmitter: Transmitter,
    /// How much farther from the receivers than that source the one is that emitted, m.
    pub offset: f64,
    /// Time of the first sample after the pulse begins, s.
    pub start: f64,
    /// Time between samples, s, above 0.
    pub step: f64,
    /// The samples of each receiver, in any one unit; all have the same number of them, and are finite.
    pub receivers: Vec<Vec<f64>>,
}

/// One measurement: the signals of one source, or of both.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalSeries {
    /// The signals of each source.
    pub directions: Vec<ArraySignals>,
}
