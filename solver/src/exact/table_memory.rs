//! The memory that the tables of one solver may take.

use std::sync::atomic::{AtomicU64, Ordering};

/// Memory for tables that one solver keeps, bytes; further ones are recomputed when needed, which
/// takes several times as long as what they are for.
pub(super) const TABLE_BYTES_MAX: u64 = 160_000_000;

/// Memory of the tables that all caches of a solver keep, bytes.
#[derive(Debug, Default)]
pub(crate) struct TableMemory(AtomicU64);

impl TableMemory {
    /// Reserves this much memory; returns whether the limit allows it.
    pub(crate) fn reserve(&self, bytes: u64) -> bool {
        let may = self.0.fetch_add(bytes, Ordering::Relaxed) + bytes <= TABLE_BYTES_MAX;
        if !may {
            self.0.fetch_sub(bytes, Ordering::Relaxed);
        }
        may
    }

    /// Returns the memory that is reserved, bytes.
    #[cfg(test)]
    pub(crate) fn reserved_bytes(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
