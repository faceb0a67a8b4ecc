//! Duration of the realizations of a job, estimated from the newest answers.

use std::time::Duration;

use crate::core::bounded_duration::bounded_duration;
use crate::core::policy::REALIZATION_TIME_KEPT;

/// Time of one realization of a job on one slot. A slow answer raises the estimate at once, a fast
/// one lowers it gradually: a search moves from points with fast realizations to points that take a
/// hundred times as long, and sending duplicates of those too early is worse than waiting a little
/// too long for the fast ones.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RealizationTime(Option<f64>);

impl RealizationTime {
    /// Takes an answer into account: `count` realizations in `seconds` from a worker with `slots`
    /// slots.
    pub(crate) fn learn(&mut self, count: u64, slots: u32, seconds: f64) {
        let one = seconds / rounds_per_slot(count, slots);
        self.0 = Some(self.0.map_or(one, |known| one.max(REALIZATION_TIME_KEPT * known)));
    }

    /// Returns whether there has been an answer.
    pub(crate) fn is_known(self) -> bool {
        self.0.is_some()
    }

    /// Returns the expected time of `count` realizations on a worker with `slots` slots; `None`
    /// before the first answer.
    pub(crate) fn expected_time(self, count: u64, slots: u32) -> Option<Duration> {
        self.0.map(|one| bounded_duration(one * rounds_per_slot(count, slots)))
    }
}

/// Returns the average number of realizations per busy slot.
fn rounds_per_slot(count: u64, slots: u32) -> f64 {
    count as f64 / (slots.max(1) as f64).min(count.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_answers_count_at_once_and_fast_ones_by_and_by() {
        let mut time = RealizationTime::default();
        assert_eq!((time.expected_time(8, 2), time.is_known()), (None, false));
        let expected = |time: RealizationTime, count, slots| {
            time.expected_time(count, slots).unwrap().as_secs_f64()
        };
        // 8 realizations on 2 slots in 2 s: 0.5 s each.
        time.learn(8, 2, 2.0);
        for (count, slots, seconds) in [(8, 2, 2.0), (1, 1, 0.5), (1, 64, 0.5), (16, 4, 2.0)] {
            assert_eq!(expected(time, count, slots), seconds, "{count} on {slots}");
        }
        time.learn(1, 64, 32.0);
        assert_eq!(expected(time, 1, 1), 32.0);
        time.learn(1, 1, 0.5);
        assert_eq!(expected(time, 1, 1), 16.0);
        for _ in 0..100 {
            time.learn(1, 1, 0.5);
        }
        assert_eq!(expected(time, 1, 1), 0.5);
    }
}
