//! Waiting times between attempts to reach the coordinator.

use std::time::Duration;

use osteon_proto::identity::random_number;

/// Wait after the first failure before jitter, ms.
const FIRST_MS: u64 = 100;
/// Longest wait before jitter, ms.
const LONGEST_MS: u64 = 5000;
/// Longest wait that a coordinator may ask for, before jitter, ms.
const STATED_MS_MAX: u64 = 300_000;

/// Exponential backoff: each wait is twice the previous one, up to a limit, and shortened at random
/// by up to half, so that the workers of a cluster do not reconnect all at once.
#[derive(Debug, Default)]
pub(crate) struct Backoff {
    failures: u32,
}

impl Backoff {
    pub(crate) fn next_wait(&mut self) -> Duration {
        // Without random numbers the wait is merely shorter.
        self.next_wait_with(random_number().unwrap_or_default())
    }

    /// Returns the wait after a refusal by a coordinator that states when to come back: that time,
    /// and at random up to half as much again, so that those who were refused together do not all
    /// come back together.
    pub(crate) fn wait_after_refusal(delay: Duration) -> Duration {
        Self::wait_after_refusal_with(delay, random_number().unwrap_or_default())
    }

    /// Resets to the shortest wait.
    pub(crate) fn reset(&mut self) {
        self.failures = 0;
    }

    fn wait_after_refusal_with(delay: Duration, random: u64) -> Duration {
        let delay = delay.min(Duration::from_millis(STATED_MS_MAX));
        delay + Duration::from_millis(random % (delay.as_millis() as u64 / 2 + 1))
    }

    fn next_wait_with(&mut self, random: u64) -> Duration {
        let full = FIRST_MS.saturating_mul(1 << self.failures.min(16)).min(LONGEST_MS);
        self.failures = self.failures.saturating_add(1);
        Duration::from_millis(full / 2 + random % (full / 2 + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_bound() {
        let waits = |random| {
            let mut backoff = Backoff::default();
            let mut next = || backoff.next_wait_with(random).as_millis();
            [next(), next(), next(), next(), next(), next(), next(), next()]
        };
        assert_eq!(waits(0), [50, 100, 200, 400, 800, 1600, 2500, 2500]);
        assert_eq!(waits(u64::MAX)[0], 50 + u128::from(u64::MAX % 51));
        for _ in 0..100 {
            let mut backoff = Backoff { failures: u32::MAX };
            let wait = backoff.next_wait().as_millis();
            assert!((2500..=5000).contains(&wait), "{wait} ms");
        }
    }

    #[test]
    fn a_stated_wait_is_kept_within_reason() {
        for (stated_s, random, expected_ms) in [
            (0, 7, 0),
            (30, 0, 30_000),
            (30, 15_000, 45_000),
            (30, 15_001, 30_000),
            (1_000_000, 150_000, 450_000),
            (u64::MAX, 0, 300_000),
        ] {
            let wait = Backoff::wait_after_refusal_with(Duration::from_secs(stated_s), random);
            assert_eq!(wait, Duration::from_millis(expected_ms), "{stated_s} s, {random}");
        }
        assert!(Backoff::wait_after_refusal(Duration::from_secs(1)) >= Duration::from_secs(1));
    }

    #[test]
    fn a_success_begins_again() {
        let mut backoff = Backoff::default();
        backoff.next_wait();
        backoff.next_wait();
        backoff.reset();
        assert_eq!(backoff.next_wait_with(0).as_millis(), 50);
    }
}
