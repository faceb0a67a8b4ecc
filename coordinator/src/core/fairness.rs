//! Fair shares: clients share the workers evenly, whatever the number of their jobs.
//!
//! Shares are measured in computing time of slots. The client with the least of it is served next;
//! a new client is given the smallest share among the others, so that it neither waits nor catches up on the
//! past.

use std::collections::BTreeMap;
use std::time::Duration;

/// The account of each client with a job under way.
#[derive(Debug, Default)]
pub(crate) struct Shares(BTreeMap<String, Share>);

#[derive(Debug, Default)]
struct Share {
    /// Number of its jobs under way.
    jobs: usize,
    /// Computing time charged, and what it was given at its start.
    used: Duration,
}

impl Shares {
    /// Records that a job of `client` begins.
    pub(crate) fn begin(&mut self, client: &str) {
        if let Some(share) = self.0.get_mut(client) {
            share.jobs += 1;
            return;
        }
        let used = self.0.values().map(|share| share.used).min().unwrap_or_default();
        self.0.insert(client.to_owned(), Share { jobs: 1, used });
    }

    /// Records that a job of `client` is no longer under way.
    pub(crate) fn end(&mut self, client: &str) {
        if let Some(share) = self.0.get_mut(client) {
            share.jobs = share.jobs.saturating_sub(1);
            if share.jobs == 0 {
                self.0.remove(client);
            }
        }
    }

    /// Returns the number of jobs of `client` that are under way.
    pub(crate) fn jobs(&self, client: &str) -> usize {
        self.0.get(client).map_or(0, |share| share.jobs)
    }

    /// Returns the computing time in the account of `client`.
    pub(crate) fn computing_time(&self, client: &str) -> Duration {
        self.0.get(client).map_or(Duration::ZERO, |share| share.used)
    }

    /// Charges `client` for the expected time of a batch.
    pub(crate) fn charge(&mut self, client: &str, time: Duration) {
        if let Some(share) = self.0.get_mut(client) {
            share.used += time;
        }
    }

    /// Corrects a charge when the actual time is known.
    pub(crate) fn correct(&mut self, client: &str, charged: Duration, took: Duration) {
        if let Some(share) = self.0.get_mut(client) {
            share.used = (share.used + took).saturating_sub(charged);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_comes_later_neither_waits_nor_catches_up() {
        let mut shares = Shares::default();
        let s = Duration::from_secs;
        shares.begin("a");
        shares.charge("a", s(100));
        shares.begin("b");
        assert_eq!(shares.computing_time("b"), s(100));
        shares.charge("b", s(10));
        shares.correct("b", s(10), s(4));
        assert_eq!(shares.computing_time("b"), s(104));
        shares.begin("b");
        shares.end("b");
        assert_eq!((shares.jobs("b"), shares.computing_time("b")), (1, s(104)));
        shares.end("b");
        shares.begin("b");
        assert_eq!(shares.computing_time("b"), s(100));
    }
}
