//! Ranges of realizations of an evaluation.

/// Consecutive indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indices {
    /// The first index.
    pub first: u64,
    /// Number of indices, at least one.
    pub count: u64,
}

impl Indices {
    /// Returns the index after the last.
    pub fn end(self) -> u64 {
        self.first + self.count
    }
}
