//! Counts the hosts that may decide a dispute.

use std::collections::BTreeSet;

use crate::core::dispute::Dispute;
use crate::core::ids::{BatchId, WorkerId};
use crate::core::policy::VOTERS_MAX;
use crate::core::state::{AttachedWorker, State};

/// Returns whether a dispute needs more votes than are on their way.
pub(crate) fn are_lacking(state: &State, dispute: &Dispute) -> bool {
    // An open dispute lacks at least one vote: otherwise it would be decided.
    let lacks = dispute.ballot.lacks(voters(state, dispute, |_| false)).max(1);
    dispute.tie_breakers.len() < lacks
}

/// Returns the number of hosts that may decide a dispute: those that have voted, and those with workers that
/// answer batches; at most [`VOTERS_MAX`]. A worker that was asked by a batch which `is_late` does not count.
pub(crate) fn voters(state: &State, dispute: &Dispute, is_late: impl Fn(BatchId) -> bool) -> usize {
    let late = dispute.tie_breakers.iter().filter(|id| is_late(**id));
    let late = late.filter_map(|id| state.batches.get(id)).map(|batch| batch.worker);
    let late: Vec<WorkerId> = late.collect();
    let answers = |(id, worker): &(&WorkerId, &AttachedWorker)| {
        state.is_checker(worker) && worker.missed.count == 0 && !late.contains(id)
    };
    let attached = state.workers.iter().filter(answers).map(|(_, worker)| worker.name.host());
    let hosts: BTreeSet<&str> = attached.chain(dispute.ballot.hosts()).collect();
    hosts.len().min(VOTERS_MAX)
}
