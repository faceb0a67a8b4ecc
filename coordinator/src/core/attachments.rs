//! Bound on the attachments of each host: workers that come and go all the time take time of the coordinator, and
//! jobs lose the batches that they held.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;

use crate::core::policy::{ATTACHMENT_BURST, ATTACHMENTS_PER_SECOND};

/// How many more times each host that attached in the last minute may attach.
#[derive(Debug, Default)]
pub(crate) struct Attachments(BTreeMap<String, Allowance>);

/// How many more times a host could attach after its last attempt.
#[derive(Debug, Clone, Copy)]
struct Allowance {
    attachments: f64,
    /// Time of the last attempt.
    at: Duration,
}

impl Allowance {
    /// Returns how many times the host may attach at `now`.
    fn attachments_at(self, now: Duration) -> f64 {
        let regained = ATTACHMENTS_PER_SECOND * now.saturating_sub(self.at).as_secs_f64();
        (self.attachments + regained).min(ATTACHMENT_BURST)
    }
}

impl Attachments {
    /// Counts an attachment of a host; returns whether it is one too many.
    pub(crate) fn exceed(&mut self, host: &str, now: Duration) -> bool {
        if self.0.len() >= WORKERS_MAX && !self.0.contains_key(host) {
            self.0.retain(|_, allowance| allowance.attachments_at(now) < ATTACHMENT_BURST);
            if self.0.len() >= WORKERS_MAX {
                self.0.pop_first();
            }
        }
        let allowed =
            self.0.get(host).map_or(ATTACHMENT_BURST, |allowance| allowance.attachments_at(now));
        let exceeds = allowed < 1.0;
        let attachments = if exceeds { allowed } else { allowed - 1.0 };
        self.0.insert(host.to_owned(), Allowance { attachments, at: now });
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
