//! Copies of slow batches for workers that have nothing to do: the first answer wins.

use std::time::Duration;

use super::{Effects, dispatch, due};
use crate::ids::{BatchId, WorkerId};
use crate::state::{Batch, State, Worker};

/// A batch that takes so many times as long as it should is copied before anything is done ahead.
const LATE: u32 = 2;

/// Gives each worker that nobody else has work for a copy of a batch that is late, and that which is
/// out longest first.
pub(super) fn of_late_ones(state: &mut State, now: Duration, effects: &mut Effects) {
    let late = |state: &State, batch: &Batch| {
        now.saturating_sub(batch.sent) >= LATE * due::expected(state, batch)
    };
    let idle = |state: &State, worker: &Worker| dispatch::held(state, worker) == 0;
    copy(state, idle, late, now, effects);
}

/// Gives each worker that holds nothing a copy of the batch that is out longest.
pub(super) fn of_slow_ones(state: &mut State, now: Duration, effects: &mut Effects) {
    copy(state, |_, worker| worker.in_flight.is_empty(), |_, _| true, now, effects);
}

/// Gives each worker in `idle` a copy of the batch that is out longest of those in `worth`. Batches
/// younger than half the target time are about to be answered and are not worth a copy.
fn copy(
    state: &mut State,
    idle: impl Fn(&State, &Worker) -> bool,
    worth: impl Fn(&State, &Batch) -> bool,
    now: Duration,
    effects: &mut Effects,
) {
    let patience = state.config.batch_target / 2;
    let old = |batch: &Batch| now.saturating_sub(batch.sent) >= patience;
    if !copyable(state).next().is_some_and(|(_, oldest)| old(oldest)) {
        return;
    }
    let idle = |worker: &Worker| state.is_sound(worker) && idle(state, worker);
    let idle: Vec<WorkerId> =
        state.workers.iter().filter(|(_, worker)| idle(worker)).map(|(id, _)| *id).collect();
    for worker in idle {
        let is_worth = |(_, batch): &(BatchId, &Batch)| old(batch) && worth(state, batch);
        let Some((slowest, _)) = copyable(state).find(is_worth) else {
            return;
        };
        send(state, slowest, worker, now, effects);
    }
}

/// The batches that may be duplicated before they are overdue, in the order they were sent.
fn copyable(state: &State) -> impl Iterator<Item = (BatchId, &Batch)> {
    let batches = state.batches.iter().map(|(id, batch)| (*id, batch));
    batches.filter(|(_, batch)| batch.may_be_duplicated())
}

/// Sends a worker a duplicate of a batch; its number, if its evaluation is under way.
pub(super) fn send(
    state: &mut State,
    of: BatchId,
    to: WorkerId,
    now: Duration,
    effects: &mut Effects,
) -> Option<BatchId> {
    let Batch { assignment, purpose, .. } = *state.batches.get(&of)?;
    let copy = dispatch::send(state, to, assignment, purpose, now, effects)?;
    let mut others = state.batches.get(&of)?.duplicates.clone();
    others.push(of);
    for id in &others {
        state.overdue.remove(id);
        if let Some(other) = state.batches.get_mut(id) {
            other.duplicates.push(copy);
        }
    }
    state.batches.get_mut(&copy)?.duplicates = others;
    Some(copy)
}
