//! Workers that were lost over one task, and the rule for when the task is poison, that is, to
//! blame for the losses.
//!
//! Machines fail for more reasons than poison tasks: a bad node crashes whatever it is given, and a
//! stopped coordinator loses all workers at once. So a realization is blamed for workers that had
//! answered something before, whose streams broke while they held nothing else and that did not come
//! back, on different hosts if there are any. After [`LOSSES_MAX`] losses of any kind it is blamed, too,
//! so that retries end.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::core::policy::{CRASHES_MAX, LOSSES_MAX};
use crate::core::worker_name::WorkerName;

/// Reason why the stay of a worker ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The departure was announced: no task is to blame.
    Announced,
    /// Its stream broke: the process may have died.
    StreamBroke,
    /// It sent nothing until its lease expired.
    LeaseExpired,
    /// It is alive, but does not answer, or its answers cannot be used.
    Misbehaviour,
}

/// A worker whose stay has ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LostWorker {
    pub(crate) worker: WorkerName,
    pub(crate) cause: Cause,
    /// Time when its stay ended.
    pub(crate) at: Duration,
    /// It held exactly one batch, maybe beside its proof.
    pub(crate) alone: bool,
    /// It was computing its proof, which may be to blame as well.
    pub(crate) owed_proof: bool,
    /// It had answered something in this stay.
    pub(crate) has_answered: bool,
}

impl LostWorker {
    /// Returns whether the loss counts as evidence against the batch that the worker held.
    fn is_credible(&self) -> bool {
        self.has_answered && !self.owed_proof && self.cause == Cause::StreamBroke
    }
}

/// Losses of workers that held one task and nothing else but perhaps their proof.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Crashes(Vec<LostWorker>);

impl Crashes {
    /// Adds a loss, unless it is irrelevant.
    pub(crate) fn add(&mut self, loss: &LostWorker) {
        if loss.alone && loss.cause != Cause::Announced {
            self.0.push(loss.clone());
        }
    }

    /// Removes the losses of a worker that is back: it did not die. Misbehaviour is still counted.
    pub(crate) fn forget(&mut self, name: &WorkerName) {
        self.0.retain(|loss| loss.worker != *name || loss.cause == Cause::Misbehaviour);
    }

    /// Changes the times of all crashes.
    pub(crate) fn shift(&mut self, shift: impl Fn(&mut Duration)) {
        self.0.iter_mut().for_each(|loss| shift(&mut loss.at));
    }

    /// Returns whether no worker was lost.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the number of losses.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// Returns the number of losses after a time.
    pub(crate) fn count_after(&self, time: Duration) -> usize {
        self.0.iter().filter(|loss| loss.at > time).count()
    }

    /// Returns the hosts of the lost workers.
    pub(crate) fn hosts(&self) -> BTreeSet<&str> {
        self.0.iter().map(|loss| loss.worker.host()).collect()
    }

    /// Returns whether a lost worker ran on `host`.
    pub(crate) fn include_host(&self, host: &str) -> bool {
        self.0.iter().any(|loss| loss.worker.host() == host)
    }

    /// Returns the time of the first loss.
    pub(crate) fn first(&self) -> Option<Duration> {
        self.0.iter().map(|loss| loss.at).min()
    }

    /// Returns the time of the last loss.
    pub(crate) fn last(&self) -> Option<Duration> {
        self.0.iter().map(|loss| loss.at).max()
    }

    /// Returns whether one more loss makes the task poison, whatever its kind.
    pub(crate) fn permit_only_one_more(&self) -> bool {
        self.0.len() + 1 >= LOSSES_MAX
    }

    /// Returns whether enough workers were lost that the task is poison. `untried` returns whether
    /// there is a worker that may be expected to do better: one on another host, or one that has outlived
    /// all these losses.
    pub(crate) fn reach_limit(&self, untried: impl FnOnce() -> bool) -> bool {
        let credible = || self.0.iter().filter(|loss| loss.is_credible());
        let hosts: BTreeSet<&str> = credible().map(|loss| loss.worker.host()).collect();
        self.0.len() >= LOSSES_MAX
            || (credible().count() >= CRASHES_MAX && (hosts.len() >= CRASHES_MAX || !untried()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loses workers on these hosts, and checks whether the limit is reached while another host is
    /// there, and while none is.
    fn check(hosts: &[&str], change: impl Fn(usize, &mut LostWorker), expected: [bool; 2]) {
        let mut crashes = Crashes::default();
        for (process, host) in hosts.iter().enumerate() {
            let mut loss = LostWorker {
                worker: WorkerName::new(host, process as u32, 0),
                cause: Cause::StreamBroke,
                at: Duration::ZERO,
                alone: true,
                owed_proof: false,
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
        let little: [fn(usize, &mut LostWorker); 4] = [
            |_, loss| loss.has_answered = false,
            |_, loss| loss.owed_proof = true,
            |_, loss| loss.cause = Cause::LeaseExpired,
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
            owed_proof: false,
            has_answered: true,
        };
        for (cause, left) in
            [(Cause::StreamBroke, 0), (Cause::LeaseExpired, 0), (Cause::Misbehaviour, 1)]
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
