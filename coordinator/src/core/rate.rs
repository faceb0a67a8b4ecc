//! Rate of realizations over the last seconds.

use std::collections::VecDeque;
use std::time::Duration;

/// Length of the window over which the rate is averaged.
const WINDOW: Duration = Duration::from_secs(5);
/// Counts closer together than this share an entry, which limits the number of entries.
const GRAIN: Duration = Duration::from_millis(100);

/// Counts of realizations in the last seconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Rate {
    /// Time of the very first count.
    begun: Option<Duration>,
    counts: VecDeque<(Duration, u64)>,
}

impl Rate {
    /// Counts realizations that were answered at `now`.
    pub(crate) fn add(&mut self, count: u64, now: Duration) {
        self.begun.get_or_insert(now);
        match self.counts.back_mut() {
            Some((at, sum)) if now.saturating_sub(*at) < GRAIN => *sum += count,
            _ => self.counts.push_back((now, count)),
        }
        while self.counts.front().is_some_and(|(at, _)| now.saturating_sub(*at) > WINDOW) {
            self.counts.pop_front();
        }
    }

    /// Returns the rate in realizations per second over the window that ends at `now`, or over the
    /// time since the first answer while that is shorter.
    pub(crate) fn per_second(&self, now: Duration) -> f64 {
        let Some(begun) = self.begun else {
            return 0.0;
        };
        let recent = self.counts.iter().filter(|(at, _)| now.saturating_sub(*at) <= WINDOW);
        let sum: u64 = recent.map(|(_, count)| count).sum();
        // The realizations of the first answer were computed before it, so the span is at least one
        // grain.
        let span = now.saturating_sub(begun).clamp(GRAIN, WINDOW);
        sum as f64 / span.as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn the_rate_is_that_of_the_window() {
        let mut rate = Rate::default();
        assert_eq!(rate.per_second(ms(0)), 0.0);
        for i in 0..100 {
            rate.add(10, ms(1000 + 100 * i));
        }
        assert_eq!(rate.per_second(ms(1000 + 9900)), 102.0);
        assert_eq!(rate.per_second(ms(20_000)), 0.0);
        assert!(rate.counts.len() <= 51);
    }

    #[test]
    fn a_young_rate_is_over_the_time_since_the_first_answer() {
        let mut rate = Rate::default();
        rate.add(50, ms(1000));
        assert_eq!(rate.per_second(ms(1000)), 500.0);
        rate.add(50, ms(2000));
        assert_eq!(rate.per_second(ms(2000)), 100.0);
    }
}
