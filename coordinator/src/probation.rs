//! Workers that take batches and do not answer them, over all their stays.
//!
//! Such a worker gives signs of life, so its lease does not end. It gets one realization at a time
//! and nothing that others depend on, until it answers one. Where its host's other processes attach,
//! they begin in the same way: a machine that stalls one process may well stall the next.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;

use crate::worker_name::WorkerName;

/// What the first unanswered batch on probation costs a worker in time without any other; each
/// further one doubles it.
const REST_MIN: Duration = Duration::from_secs(3);
/// And at most so much: every trial may delay an evaluation by some seconds, and a worker that is
/// in order again should not stand idle for long.
const REST_MAX: Duration = Duration::from_secs(60);
/// For how long a worker is remembered that has missed nothing more.
const MEMORY: Duration = Duration::from_secs(600);

/// The workers that are on probation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Probation(BTreeMap<WorkerName, Trial>);

/// What is known of one of them.
#[derive(Debug, Clone, PartialEq)]
struct Trial {
    /// Batches in a row that it has not answered since its probation began.
    missed: u32,
    /// Nothing is tried with it before.
    rests_until: Duration,
    /// When it gave the last reason.
    last: Duration,
}

impl Probation {
    /// Whether a worker is on probation.
    pub(crate) fn has(&self, name: &WorkerName) -> bool {
        !self.0.is_empty() && self.0.contains_key(name)
    }

    /// Whether nothing is to be tried with a worker yet.
    pub(crate) fn rests(&self, name: &WorkerName, now: Duration) -> bool {
        self.0.get(name).is_some_and(|trial| now < trial.rests_until)
    }

    /// A worker has not answered what it was sent at `sent`; whether its probation begins with that.
    /// What it had been sent before it gave the last reason is no further reason.
    pub(crate) fn miss(&mut self, name: &WorkerName, sent: Duration, now: Duration) -> bool {
        let begins = !self.has(name);
        if self.0.get(name).is_some_and(|trial| sent < trial.last) {
            return false;
        }
        if begins && self.0.len() >= WORKERS_MAX {
            self.0.pop_first();
        }
        let trial =
            self.0.entry(name.clone()).or_insert(Trial { missed: 0, rests_until: now, last: now });
        let rest = REST_MIN * 2_u32.saturating_pow(trial.missed.min(31));
        trial.missed = trial.missed.saturating_add(1);
        trial.rests_until = now + rest.min(REST_MAX);
        trial.last = now;
        begins
    }

    /// A worker attaches: it is on probation if another process of its host is.
    pub(crate) fn attach(&mut self, name: &WorkerName, now: Duration) {
        if self.0.is_empty() || self.0.len() >= WORKERS_MAX || self.has(name) {
            return;
        }
        let first = WorkerName::new(name.host(), 0, 0);
        let mut of_host =
            self.0.range(first..).take_while(|(other, _)| other.host() == name.host());
        if of_host.any(|(_, trial)| trial.missed > 0) {
            let trial = Trial { missed: 0, rests_until: now, last: now };
            self.0.insert(name.clone(), trial);
        }
    }

    /// A worker has answered what it holds; whether that ends its probation.
    pub(crate) fn end(&mut self, name: &WorkerName) -> bool {
        !self.0.is_empty() && self.0.remove(name).is_some()
    }

    /// Forgets those who gave no reason for long.
    pub(crate) fn forget(&mut self, now: Duration) {
        self.0.retain(|_, trial| now.saturating_sub(trial.last) < MEMORY);
    }

    /// Whether a worker has not answered since its probation began.
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
            assert!(probation.rests(&name, s(rest) - Duration::from_nanos(1)), "{rest}");
            assert!(!probation.rests(&name, s(rest)), "{rest}");
        }
        for _ in 0..100 {
            probation.miss(&name, s(0), s(0));
        }
        assert!(!probation.rests(&name, s(60)));
        assert!(probation.end(&name) && !probation.end(&name));
        assert!(probation.miss(&name, s(0), s(2)) && !probation.rests(&name, s(5)));
        assert!(!probation.miss(&name, s(1), s(2)) && !probation.rests(&name, s(5)));
    }

    #[test]
    fn a_host_is_remembered() {
        let mut probation = Probation::default();
        let [bad, same, other] = [("b", 7, 7), ("b", 1, 2), ("a", 9, 9)]
            .map(|(host, process, instance)| WorkerName::new(host, process, instance));
        probation.miss(&bad, s(0), s(0));
        probation.attach(&same, s(1));
        probation.attach(&other, s(1));
        assert_eq!([&bad, &same, &other].map(|name| probation.has(name)), [true, true, false]);
        // It has done nothing wrong, and is tried at once.
        assert!(!probation.rests(&same, s(1)));
        let silent = [&bad, &same, &other].map(|name| probation.is_silent(name));
        assert_eq!(silent, [true, false, false]);
        // One that answers says nothing of the other.
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
