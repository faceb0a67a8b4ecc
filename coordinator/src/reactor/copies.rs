//! Copies of slow batches for workers that have nothing to do: the first answer wins.

use std::time::Duration;

use super::{Effects, dispatch, due};
use crate::ids::{BatchId, WorkerId};
use crate::state::{Batch, Purpose, State, Worker};

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
    let old = |state: &State, id: &BatchId| {
        state.batches.get(id).is_some_and(|batch| now.saturating_sub(batch.sent) >= patience)
    };
    if !state.copyable.first().is_some_and(|oldest| old(state, oldest)) {
        return;
    }
    let idle = |worker: &Worker| state.is_sound(worker) && idle(state, worker);
    let idle: Vec<WorkerId> =
        state.workers.iter().filter(|(_, worker)| idle(worker)).map(|(id, _)| *id).collect();
    for worker in idle {
        let is_worth = |id: &&BatchId| {
            old(state, id) && state.batches.get(id).is_some_and(|batch| worth(state, batch))
        };
        let Some(slowest) = state.copyable.iter().find(is_worth).copied() else {
            return;
        };
        let Some(assignment) = state.batches.get(&slowest).map(|batch| batch.assignment) else {
            return;
        };
        let copy = dispatch::send(state, worker, assignment, Purpose::Fill, now, effects);
        if let Some(copy) = copy {
            join(state, slowest, copy);
        }
    }
}

/// Makes a batch that was just sent a copy of another, and of the copies of that.
pub(super) fn join(state: &mut State, of: BatchId, copy: BatchId) {
    let Some(original) = state.batches.get(&of) else {
        return;
    };
    let mut twins = original.twins.clone();
    twins.push(of);
    for id in &twins {
        if let Some(twin) = state.batches.get_mut(id) {
            twin.twins.push(copy);
        }
    }
    for id in twins.iter().chain([&copy]) {
        state.copyable.remove(id);
        state.overdue.remove(id);
    }
    if let Some(batch) = state.batches.get_mut(&copy) {
        batch.twins = twins;
    }
}
