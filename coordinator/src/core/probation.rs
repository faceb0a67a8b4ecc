//! Probation: workers that accept batches and do not answer them, over all their stays.
//!
//! Such a worker sends heartbeats, so its lease does not expire. Until it answers, it receives one
//! realization at a time and nothing that others depend on. Other processes of its host are on
//! probation from their attachment: a machine that stalls one process may well stall the next.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;

use crate::core::policy::{PROBATION_MEMORY, PROBATION_PAUSE_MAX, PROBATION_PAUSE_MIN};
use crate::core::worker_name::WorkerName;

#[derive(Debug, Clone, Default)]
pub(crate) struct Probation(BTreeMap<WorkerName, ProbationRecord>);

/// Record of one worker.
#[derive(Debug, Clone, PartialEq)]
struct ProbationRecord {
    /// Number of consecutive batches that it has not answered since its probation began.
    missed: u32,
    /// It receives no work before this time.
    rests_until: Duration,
    /// Time of the last reason for its probation.
    last: Duration,
}

impl Probation {
    /// Returns whether a worker is on probation.
    pub(crate) fn has(&self, name: &WorkerName) -> bool {
        !self.0.is_empty() && self.0.contains_key(name)
    }

    /// Returns whether a worker may not receive work yet.
    pub(crate) fn is_paused(&self, name: &WorkerName, now: Duration) -> bool {
        self.0.get(name).is_some_and(|trial| now < trial.rests_until)
    }

    /// Records that a worker has not answered the batch that was sent at `sent`, and returns whether
    /// its probation begins with that. A batch sent before the last reason is not counted as a
    /// further one.
    pub(crate) fn miss(&mut self, name: &WorkerName, sent: Duration, now: Duration) -> bool {
        let begins = !self.has(name);
        if self.0.get(name).is_some_and(|trial| sent < trial.last) {
            return false;
        }
        if begins && self.0.len() >= WORKERS_MAX {
            self.0.pop_first();
        }
        let trial = self.0.entry(name.clone()).or_insert(ProbationRecord {
            missed: 0,
            rests_until: now,
            last: now,
        });
        let rest = PROBATION_PAUSE_MIN * 2_u32.saturating_pow(trial.missed.min(31));
        trial.missed = trial.missed.saturating_add(1);
        trial.rests_until = now + rest.min(PROBATION_PAUSE_MAX);
        trial.last = now;
        begins
    }

    /// Puts a worker that attaches on probation if another process of its host is, and returns whether
    /// it does.
    pub(crate) fn attach(&mut self, name: &WorkerName, now: Duration) -> bool {
        if self.0.is_empty() || self.0.len() >= WORKERS_MAX || self.has(name) {
            return false;
        }
        let first = WorkerName::new(name.host(), 0, 0);
        let mut of_host =
            self.0.range(first..).take_while(|(other, _)| other.host() == name.host());
        let begins = of_host.any(|(_, trial)| trial.missed > 0);
        if begins {
            let trial = ProbationRecord { missed: 0, rests_until: now, last: now };
            self.0.insert(name.clone(), trial);
        }
        begins
    }

    /// Ends the probation of a worker that has answered a batch that it holds, and returns whether
    /// it was on probation.
    pub(crate) fn end(&mut self, name: &WorkerName) -> bool {
        !self.0.is_empty() && self.0.remove(name).is_some()
    }

    /// Forgets workers that have given no reason for a long time, and returns whether there were any.
    pub(crate) fn forget(&mut self, now: Duration) -> bool {
        let before = self.0.len();
        self.0.retain(|_, trial| now.saturating_sub(trial.last) < PROBATION_MEMORY);
        self.0.len() < before
    }

    /// Returns whether a worker has left a batch unanswered since its probation began.
    pub(crate) fn is_silent(&self, name: &WorkerName) -> bool {
        self.0.get(name).is_some_and(|trial| trial.missed > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn rests_double_up_to_a_bound() {
        let name = WorkerName::new("a", 1, 1);
        let mut probation = Probation::default();
        for (missed, rest) in [3, 6, 12, 24, 48, 60, 60].into_iter().enumerate() {
            assert_eq!(probation.miss(&name, s(0), s(0)), missed == 0);
            assert!(probation.is_paused(&name, s(rest) - Duration::from_nanos(1)), "{rest}");
            assert!(!probation.is_paused(&name, s(rest)), "{rest}");
        }
        for _ in 0..100 {
            probation.miss(&name, s(0), s(0));
        }
        assert!(!probation.is_paused(&name, s(60)));
        assert!(probation.end(&name) && !probation.end(&name));
        assert!(probation.miss(&name, s(0), s(2)) && !probation.is_paused(&name, s(5)));
        assert!(!probation.miss(&name, s(1), s(2)) && !probation.is_paused(&name, s(5)));
    }

    #[test]
    fn a_host_is_remembered() {
        let mut probation = Probation::default();
        let [bad, same, other] = [("b", 7, 7), ("b", 1, 2), ("a", 9, 9)]
            .map(|(host, process, instance)| WorkerName::new(host, process, instance));
        probation.miss(&bad, s(0), s(0));
        assert!(probation.attach(&same, s(1)) && !probation.attach(&other, s(1)));
        assert_eq!([&bad, &same, &other].map(|name| probation.has(name)), [true, true, false]);
        // It has missed nothing itself, and receives work at once.
        assert!(!probation.is_paused(&same, s(1)));
        let silent = [&bad, &same, &other].map(|name| probation.is_silent(name));
        assert_eq!(silent, [true, false, false]);
        // An answer of one worker says nothing about another.
        assert!(probation.end(&same) && probation.has(&bad));
        probation.forget(s(600));
        assert!(probation.0.is_empty());
    }

    #[test]
    fn not_more_are_remembered_than_there_may_be() {
        let mut probation = Probation::default();
        for process in 0..WORKERS_MAX as u32 + 10 {
            probation.miss(&WorkerName::new("a", process, 1), s(0), s(0));
        }
        probation.attach(&WorkerName::new("a", 0, 0), s(0));
        assert_eq!(probation.0.len(), WORKERS_MAX);
    }
}
