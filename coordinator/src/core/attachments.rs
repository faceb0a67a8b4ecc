//! Bound on the attachments of each host: workers that come and go all the time cost the coordinator time, and
//! the jobs their batches.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;

/// Number of attachments of a host in quick succession: as many processes as a large machine has cores may
/// start at the same moment, and once more after a restart of the coordinator.
const BURST: f64 = 512.0;
/// Number of further attachments per second.
const PER_SECOND: f64 = 8.0;

/// Attachments of the last minute, by host.
#[derive(Debug, Default)]
pub(crate) struct Attachments(BTreeMap<String, Recent>);

/// What is left of a host's burst.
#[derive(Debug, Clone, Copy)]
struct Recent {
    left: f64,
    at: Duration,
}

impl Recent {
    fn left(self, now: Duration) -> f64 {
        (self.left + PER_SECOND * now.saturating_sub(self.at).as_secs_f64()).min(BURST)
    }
}

impl Attachments {
    /// Counts an attachment of a host; returns whether it is one too many.
    pub(crate) fn exceed(&mut self, host: &str, now: Duration) -> bool {
        if self.0.len() >= WORKERS_MAX && !self.0.contains_key(host) {
            self.0.retain(|_, recent| recent.left(now) < BURST);
            if self.0.len() >= WORKERS_MAX {
                self.0.pop_first();
            }
        }
        let left = self.0.get(host).map_or(BURST, |recent| recent.left(now));
        let exceeds = left < 1.0;
        let left = if exceeds { left } else { left - 1.0 };
        self.0.insert(host.to_owned(), Recent { left, at: now });
        exceeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_attaches_often_at_once_and_seldom_later() {
        let mut attachments = Attachments::default();
        let mut attach = |host, s: f64| !attachments.exceed(host, Duration::from_secs_f64(s));
        let at_once = (0..2000).filter(|_| attach("a", 1.0)).count();
        assert_eq!((at_once, attach("b", 1.0)), (512, true));
        let later = (0..1000).filter(|i| attach("a", 1.0 + 0.01 * f64::from(*i))).count();
        assert!((78..=81).contains(&later), "{later}");
        // After a minute all is forgotten.
        assert_eq!((0..2000).filter(|_| attach("a", 100.0)).count(), 512);
    }

    #[test]
    fn not_more_hosts_are_remembered_than_there_may_be_workers() {
        let mut attachments = Attachments::default();
        for host in 0..2 * WORKERS_MAX {
            attachments.exceed(&host.to_string(), Duration::ZERO);
        }
        assert!(attachments.0.len() <= WORKERS_MAX);
    }
}
