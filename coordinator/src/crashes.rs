//! Workers that were lost over one task, and when the task is poison: when it is to blame.
//!
//! Machines fail in more ways than realizations kill: one bad node dies over whatever it is given,
//! a stopped coordinator loses everybody at once. So a realization is only blamed for workers that
//! had shown that they work, whose streams broke, and that did not come back, on different hosts if
//! there are any.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::worker_name::WorkerName;

/// So many crashes of workers that had shown that they work make a task poison.
const CRASH_LIMIT: usize = 3;
/// And so many lost workers of any kind, so that nothing is tried for ever.
const LOSS_LIMIT: usize = 10;

/// How the stay of a worker ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// It was to end: nothing is to blame.
    Announced,
    /// Its stream broke: it may have died.
    StreamBroke,
    /// Nothing was heard of it.
    Silence,
    /// It lives, but does not answer, or answers what cannot be used.
    Misbehaviour,
}

/// A worker whose stay has ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LostWorker {
    /// Who is gone.
    pub(crate) worker: WorkerName,
    /// How.
    pub(crate) cause: Cause,
    /// Since when.
    pub(crate) at: Duration,
    /// It held one batch and nothing else.
    pub(crate) alone: bool,
    /// It had answered something in this stay.
    pub(crate) has_answered: bool,
}

impl LostWorker {
    /// Whether it may be a sign against what the worker held.
    fn is_credible(&self) -> bool {
        self.has_answered && self.cause == Cause::StreamBroke
    }
}

/// Workers that were lost while they held one task and nothing else.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Crashes(Vec<LostWorker>);

impl Crashes {
    /// Takes a loss into account, unless it means nothing.
    pub(crate) fn add(&mut self, loss: &LostWorker) {
        if loss.alone && loss.cause != Cause::Announced {
            self.0.push(loss.clone());
        }
    }

    /// Forgets the crashes of a worker that is back: it did not die.
    pub(crate) fn forget(&mut self, name: &WorkerName) {
        self.0.retain(|loss| loss.worker != *name || loss.cause == Cause::Misbehaviour);
    }

    /// Changes the times of all crashes.
    pub(crate) fn shift(&mut self, shift: impl Fn(&mut Duration)) {
        self.0.iter_mut().for_each(|loss| shift(&mut loss.at));
    }

    /// Whether nobody was lost.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many were lost.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The hosts of those that were lost.
    pub(crate) fn hosts(&self) -> BTreeSet<&str> {
        self.0.iter().map(|loss| loss.worker.host()).collect()
    }

    /// Whether one of them was of `host`.
    pub(crate) fn are_of(&self, host: &str) -> bool {
        self.0.iter().any(|loss| loss.worker.host() == host)
    }

    /// When the first was lost.
    pub(crate) fn first(&self) -> Option<Duration> {
        self.0.iter().map(|loss| loss.at).min()
    }

    /// When the last was lost.
    pub(crate) fn last(&self) -> Option<Duration> {
        self.0.iter().map(|loss| loss.at).max()
    }

    /// Whether so many were lost that the task is poison. `untried` says whether there is a worker that may be expected to
    /// do better, on another host or there since before the first loss.
    pub(crate) fn reach_limit(&self, untried: impl FnOnce() -> bool) -> bool {
        let credible = || self.0.iter().filter(|loss| loss.is_credible());
        let hosts: BTreeSet<&str> = credible().map(|loss| loss.worker.host()).collect();
        self.0.len() >= LOSS_LIMIT
            || (credible().count() >= CRASH_LIMIT && (hosts.len() >= CRASH_LIMIT || !untried()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Workers on these hosts are lost; whether that is enough while another host is there, and
    /// while none is.
    fn check(hosts: &[&str], change: impl Fn(usize, &mut LostWorker), expected: [bool; 2]) {
        let mut crashes = Crashes::default();
        for (process, host) in hosts.iter().enumerate() {
            let mut loss = LostWorker {
                worker: WorkerName::new(host, process as u32, 0),
                cause: Cause::StreamBroke,
                at: Duration::ZERO,
                alone: true,
                has_answered: true,
            };
            change(process, &mut loss);
            crashes.add(&loss);
        }
        let found = [true, false].map(|untried| crashes.reach_limit(|| untried));
        assert_eq!(found, expected, "{crashes:?}");
    }

    #[test]
    fn three_hosts_or_three_of_the_only_host() {
        check(&["a", "b"], |_, _| {}, [false, false]);
        check(&["a", "b", "c"], |_, _| {}, [true, true]);
        check(&["a", "a", "a"], |_, _| {}, [false, true]);
        check(&["a", "a", "b"], |_, _| {}, [false, true]);
        check(&["a"; 9], |_, _| {}, [false, true]);
        check(&["a"; 10], |_, _| {}, [true, true]);
    }

    #[test]
    fn what_is_no_death_over_it_counts_little_or_nothing() {
        let hosts = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
        let eleven = ["a"; 11];
        let nothing: [fn(usize, &mut LostWorker); 2] =
            [|_, loss| loss.alone = false, |_, loss| loss.cause = Cause::Announced];
        for change in nothing {
            check(&hosts, change, [false, false]);
            check(&eleven, change, [false, false]);
        }
        let little: [fn(usize, &mut LostWorker); 3] = [
            |_, loss| loss.has_answered = false,
            |_, loss| loss.cause = Cause::Silence,
            |_, loss| loss.cause = Cause::Misbehaviour,
        ];
        for change in little {
            check(&hosts, change, [false, false]);
            check(&eleven, change, [true, true]);
        }
        check(&hosts[..4], |i, loss| loss.has_answered = i < 2, [false, false]);
        check(&hosts[..4], |i, loss| loss.has_answered = i < 3, [true, true]);
    }

    #[test]
    fn who_comes_back_did_not_die() {
        let name = WorkerName::new("a", 1, 7);
        let loss = |cause| LostWorker {
            worker: name.clone(),
            cause,
            at: Duration::ZERO,
            alone: true,
            has_answered: true,
        };
        for (cause, left) in
            [(Cause::StreamBroke, 0), (Cause::Silence, 0), (Cause::Misbehaviour, 1)]
        {
            let mut crashes = Crashes::default();
            crashes.add(&loss(cause));
            crashes.forget(&WorkerName::new("a", 1, 8));
            assert_eq!(crashes.count(), 1);
            crashes.forget(&name);
            assert_eq!(crashes.count(), left, "{cause:?}");
        }
    }
}
