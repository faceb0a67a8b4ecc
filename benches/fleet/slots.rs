//! When a worker's slots would have computed its batches, first in, first out.

use std::collections::VecDeque;
use std::time::Duration;

use osteon_common::outcome::RealizationResult;
use tokio::time::Instant;

/// A batch that a worker holds.
#[derive(Debug)]
pub(crate) struct Held {
    pub(crate) batch: u64,
    pub(crate) solved: Vec<RealizationResult>,
    /// Time at which its first realization begins.
    begins: Instant,
    /// Time at which its last realization ends.
    pub(crate) ends: Instant,
}

impl Held {
    /// Returns the time that it takes from its first realization to its last, s.
    pub(crate) fn elapsed_s(&self) -> f64 {
        (self.ends - self.begins).as_secs_f64()
    }
}

/// The slots of a worker.
#[derive(Debug)]
pub(crate) struct Slots {
    each: Duration,
    /// When each is free, the earliest first.
    free: VecDeque<Instant>,
    held: VecDeque<Held>,
}

impl Slots {
    pub(crate) fn new(slots: u32, each: Duration) -> Self {
        let free = (0..slots).map(|_| Instant::now()).collect();
        Self { each, free, held: VecDeque::new() }
    }

    /// Takes a batch.
    pub(crate) fn take(&mut self, now: Instant, batch: u64, solved: Vec<RealizationResult>) {
        let begins = self.free.front().map_or(now, |free| now.max(*free));
        let mut ends = begins;
        for _ in &solved {
            // All realizations take the same time, so what begins last ends last.
            if let Some(free) = self.free.pop_front() {
                ends = now.max(free) + self.each;
                self.free.push_back(ends);
            }
        }
        self.held.push_back(Held { batch, solved, begins, ends });
    }

    /// Returns when the next batch ends.
    pub(crate) fn next_end(&self) -> Option<Instant> {
        self.held.front().map(|held| held.ends)
    }

    /// Returns the batch that ends next, if it has ended.
    pub(crate) fn take_ended(&mut self, now: Instant) -> Option<Held> {
        self.held.pop_front_if(|held| held.ends <= now)
    }

    /// Forgets a batch. What has begun goes on to its end.
    pub(crate) fn revoke(&mut self, now: Instant, batch: u64) {
        let Some(at) = self.held.iter().position(|held| held.batch == batch) else { return };
        let Some(revoked) = self.held.remove(at) else { return };
        let begins = revoked.begins.max(now);
        let saved = revoked.ends.saturating_duration_since(begins + self.each);
        for later in self.held.range_mut(at..) {
            later.begins -= saved.min(later.begins.saturating_duration_since(now));
            later.ends -= saved.min(later.ends.saturating_duration_since(now));
        }
        for free in &mut self.free {
            *free -= saved.min(free.saturating_duration_since(now));
        }
    }
}
