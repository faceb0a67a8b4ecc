//! Distribution of measured times over buckets, as plain numbers.

use std::time::Duration;

/// Upper bounds of the buckets, s: from 10 µs, an event of the core, to an hour, a large evaluation.
pub(crate) const BOUNDS_S: [f64; 18] = [
    1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0,
    1000.0, 3600.0,
];

/// Counts of times by bucket.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TimeDistribution {
    /// Number of times in each bucket; the last holds those above all bounds.
    counts: [u64; BOUNDS_S.len() + 1],
    /// Sum of all times.
    sum: Duration,
}

impl TimeDistribution {
    pub(crate) fn add(&mut self, time: Duration) {
        let bucket = BOUNDS_S.partition_point(|bound| *bound < time.as_secs_f64());
        if let Some(count) = self.counts.get_mut(bucket) {
            *count += 1;
        }
        self.sum = self.sum.saturating_add(time);
    }

    /// Returns the number of all times.
    pub(crate) fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the sum of all times, s.
    pub(crate) fn sum_s(&self) -> f64 {
        self.sum.as_secs_f64()
    }

    /// Returns each bucket: its upper bound in s (infinite for the last), and the number of times in
    /// it, without those of the lower buckets.
    pub(crate) fn buckets(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        BOUNDS_S.into_iter().chain([f64::INFINITY]).zip(self.counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_the_first_bucket_whose_bound_it_does_not_exceed() {
        for (ns, bound) in [
            (0, 1e-5),
            (10_000, 1e-5),
            (10_001, 3e-5),
            (1_000_000_000, 1.0),
            (3_600_000_000_000, 3600.0),
            (3_600_000_000_001, f64::INFINITY),
            (u64::MAX, f64::INFINITY),
        ] {
            let mut times = TimeDistribution::default();
            times.add(Duration::from_nanos(ns));
            let full: Vec<(f64, u64)> = times.buckets().filter(|(_, count)| *count > 0).collect();
            assert_eq!(full, [(bound, 1)], "{ns} ns");
            assert_eq!((times.count(), times.sum_s()), (1, ns as f64 / 1e9));
        }
    }
}
