//! Times of the store's writes, measured by its thread and read for monitoring.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::core::distribution::TimeDistribution;

/// The times of all writes, shared by the store's thread and those who read them. A write takes
/// a thousand times as long as the lock is held, so the lock delays nobody.
#[derive(Debug, Clone, Default)]
pub(crate) struct WriteTimes(Arc<Mutex<TimeDistribution>>);

impl WriteTimes {
    pub(crate) fn add(&self, time: Duration) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).add(time);
    }

    /// Returns the times so far.
    pub(crate) fn read(&self) -> TimeDistribution {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
