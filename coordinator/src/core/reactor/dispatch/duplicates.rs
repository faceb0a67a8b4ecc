//! Duplicates of slow batches for idle workers: the first answer counts.

use std::time::Duration;

use super::{batches, eta};
use crate::core::batch::{Batch, Purpose};
use crate::core::ids::{BatchId, WorkerId};
use crate::core::policy::{COPIES_MAX, LATE_FACTOR};
use crate::core::reactor::turn::Turn;
use crate::core::service_order::ServicePlace;
use crate::core::state::State;

/// Sends each worker that holds no batches but speculative ones a duplicate of a late batch, starting with the batch that has
/// been out longest.
pub(crate) fn duplicate_late_batches(turn: &mut Turn) {
    let now = turn.now;
    let is_late = |state: &State, batch: &Batch| {
        now.saturating_sub(batch.sent) >= LATE_FACTOR * eta::expected_time(state, batch)
    };
    let idle = |place: &ServicePlace| place.held == 0;
    duplicate(turn, idle, is_late);
}

/// Sends each worker that holds nothing a duplicate of the batch that has been out longest.
pub(crate) fn duplicate_slow_batches(turn: &mut Turn) {
    duplicate(turn, |place| place.in_flight == 0, |_, _| true);
}

/// Sends each worker that is `idle` a duplicate of the batch that has been out longest among those
/// `worth` it. Young batches are not duplicated, because they are about to be answered: those out for
/// less than half the target time plus some mean delays of answers.
fn duplicate(
    turn: &mut Turn,
    idle: impl Fn(&ServicePlace) -> bool,
    worth: impl Fn(&State, &Batch) -> bool,
) {
    let patience = turn.state.config.batch_target / 2 + LATE_FACTOR * turn.state.delay.mean();
    let is_old = |batch: &Batch, now: Duration| now.saturating_sub(batch.sent) >= patience;
    loop {
        let (state, now) = (&*turn.state, turn.now);
        if !open_batches(state).next().is_some_and(|(_, oldest)| is_old(oldest, now)) {
            return;
        }
        // The worker that holds least comes first, and its duplicate makes it busy.
        let first = state.order.iter().next();
        let answers = |place: &ServicePlace| {
            state.workers.get(&place.worker).is_some_and(|worker| !state.may_be_silent(worker))
        };
        let Some(idle) = first.filter(|place| !place.on_probation && idle(place)) else {
            return;
        };
        let surely_answers = answers(&idle);
        // This walks over all batches, so it is done only when a worker is idle. A batch with duplicates
        // is out at workers that may be silent; only a worker that surely answers gets a further copy.
        let is_worth = |(_, batch): &(BatchId, &Batch)| {
            is_old(batch, now)
                && worth(state, batch)
                && (surely_answers || batch.duplicates.is_empty())
        };
        let Some((slowest, _)) = open_batches(state).find(is_worth) else {
            return;
        };
        if send(turn, slowest, idle.worker).is_none() {
            return;
        }
    }
}

/// Returns the batches that may be duplicated before they are overdue, in the order in which they were
/// sent: those without duplicates, and those of which all copies are at workers that may be silent.
fn open_batches(state: &State) -> impl Iterator<Item = (BatchId, &Batch)> {
    let batches = state.batches.iter().map(|(id, batch)| (*id, batch));
    batches.filter(|(id, batch)| {
        batch.purpose == Purpose::Fill
            && (batch.duplicates.is_empty()
                || (batch.duplicates.len() + 1 < COPIES_MAX
                    && batch.duplicates.iter().chain([id]).all(|copy| may_be_silent(state, *copy))))
    })
}

fn may_be_silent(state: &State, batch: BatchId) -> bool {
    let holder = state.batches.get(&batch).and_then(|batch| state.workers.get(&batch.worker));
    holder.is_some_and(|holder| state.may_be_silent(holder))
}

/// Sends a worker a duplicate of a batch and returns its number, if its evaluation is under way.
pub(crate) fn send(turn: &mut Turn, of: BatchId, to: WorkerId) -> Option<BatchId> {
    let Batch { assignment, purpose, .. } = *turn.state.batches.get(&of)?;
    let duplicate = batches::send(turn, to, assignment, purpose)?;
    let mut others = turn.state.batches.get(&of)?.duplicates.clone();
    others.push(of);
    for id in &others {
        turn.state.overdue.remove(id);
        if let Some(other) = turn.state.batches.get_mut(id) {
            other.duplicates.push(duplicate);
        }
    }
    turn.state.batches.get_mut(&duplicate)?.duplicates = others;
    Some(duplicate)
}
