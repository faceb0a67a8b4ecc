//! Which realizations of an evaluation a batch is about.

/// Consecutive indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indices {
    /// The first.
    pub first: u64,
    /// How many, at least one.
    pub count: u64,
}

impl Indices {
    /// The index after the last.
    pub fn end(self) -> u64 {
        self.first + self.count
    }
}
