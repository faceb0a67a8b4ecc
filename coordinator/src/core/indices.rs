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

    /// Takes at most `most` indices, at least one, from the front; `self` may be empty afterwards.
    pub(crate) fn take(&mut self, most: u64) -> Self {
        let taken = Self { first: self.first, count: self.count.min(most.max(1)) };
        self.first += taken.count;
        self.count -= taken.count;
        taken
    }
}
