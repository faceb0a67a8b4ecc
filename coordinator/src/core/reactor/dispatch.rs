//! Dispatch: decides which worker computes what next.
//!
//! Workers are served in ascending order of the batches they hold, clients in ascending order of
//! the computing time they have received, and the jobs of a client by priority, then in turn, batch
//! by batch. `sizing.rs` decides how large a batch is. The order of service is:
//!
//! 1. quarantined realizations, each alone on a worker (`poison.rs`). A worker that is reserved for
//!    one gets no other new work;
//! 2. duplicates of overdue batches (`overdue.rs`);
//! 3. audits and tie-breakers (`audits.rs`), then the queues of the evaluations under way;
//! 4. when no batch waits, for idle workers: duplicates of late batches, speculative batches (`idle.rs`),
//!    and duplicates of the batches that have been out longest (`duplicates.rs`).
//!
//! A worker on probation gets one realization at a time.

use std::collections::BTreeSet;

use crate::core::batch::{Assignment, Purpose};
use crate::core::ids::{BatchId, WorkerId};
use crate::core::job::Job;
use crate::core::reactor::turn::Turn;

pub(super) mod ahead;
mod audits;
pub(super) mod batches;
pub(super) mod clearance;
pub(super) mod departures;
pub(super) mod duplicates;
mod eta;
mod idle;
pub(super) mod new_proof;
pub(super) mod overdue;
pub(super) mod poison;
pub(super) mod proofs;
mod schedule;
pub(super) mod sizing;
pub(super) mod speculation;
pub(super) mod votes;

/// Sends batches while workers can accept more and work waits, then duplicates.
pub(crate) fn dispatch(turn: &mut Turn) {
    if turn.state.draining {
        return;
    }
    let mut kept = poison::dispatch(turn);
    overdue::dispatch(turn, &mut kept);
    while schedule::work_waits(turn.state) && hand_one(turn, &kept) {}
    if schedule::next_job(turn.state).is_some() {
        // The batches that wait are sent after one of the next events. Until then no worker gets a
        // duplicate.
        return;
    }
    duplicates::duplicate_late_batches(turn);
    if kept.is_empty() && !schedule::work_waits(turn.state) {
        idle::dispatch(turn);
    }
    duplicates::duplicate_slow_batches(turn);
}

/// Sends one check or batch to the first free worker that may have one; returns whether any may. The
/// workers in `kept` receive nothing.
fn hand_one(turn: &mut Turn, kept: &BTreeSet<WorkerId>) -> bool {
    let Some(first) = schedule::free_workers(turn.state, kept).next() else {
        return false;
    };
    if hand(turn, first) {
        return true;
    }
    let is_sound =
        |worker| turn.state.workers.get(&worker).is_some_and(|it| turn.state.is_sound(it));
    let others: Vec<WorkerId> = if !schedule::checks_wait(turn.state) && is_sound(first) {
        // No check waits, and the sound worker with the fewest batches gets none: then no other sound one
        // does, and only those on probation remain.
        turn.state.order.on_probation().filter(|worker| !kept.contains(worker)).collect()
    } else {
        schedule::free_workers(turn.state, kept).skip(1).collect()
    };
    others.into_iter().any(|worker| hand(turn, worker))
}

/// Sends a worker a check or a batch; returns whether it gets one.
fn hand(turn: &mut Turn, worker: WorkerId) -> bool {
    (schedule::checks_wait(turn.state) && audits::hand_check(turn, worker))
        || hand_batch(turn, worker).is_some()
}

/// Sends a worker a batch of the job that is next in turn; `None` if it gets none now.
fn hand_batch(turn: &mut Turn, worker: WorkerId) -> Option<BatchId> {
    let attached = turn.state.workers.get(&worker)?;
    let job = schedule::next_job(turn.state)?;
    let (attempt, queued) = turn.state.jobs.get(&job).and_then(next_evaluation)?;
    let size = if turn.state.is_sound(attached) {
        let fleet = sizing::fleet_rate(turn.state, job);
        let attached = turn.state.workers.get(&worker)?;
        let further = turn.state.jobs.get(&job).map_or(0, ahead::remaining_realizations);
        let size = sizing::batch_size(turn.state, attached, job, fleet, (queued, further));
        // A worker that holds only speculative batches counts as idle, because other batches replace them.
        let is_busy = turn.state.order.place(worker).is_some_and(|place| place.held > 0);
        if is_busy && sizing::is_one_batch_each(turn.state, attached, job, fleet, size) {
            return None;
        }
        size
    } else if !turn.state.probation.is_paused(&attached.name, turn.now)
        || !turn.state.answers_batches(|_| true)
    {
        1
    } else {
        return None;
    };
    let indices = turn.state.jobs.get_mut(&job)?.certain_evaluation_mut(attempt)?.take(size)?;
    turn.state.last_served = Some(job);
    ahead::refresh(turn, job);
    let assignment = Assignment { job, attempt, indices };
    let batch = batches::send(turn, worker, assignment, Purpose::Fill)?;
    batches::charge(turn.state, batch);
    Some(batch)
}

/// Returns the attempt at the evaluation whose realizations are sent next, and the number of those that
/// wait. The evaluation that the search asked for comes first.
fn next_evaluation(job: &Job) -> Option<(u64, u64)> {
    let evaluation = job.needed_evaluations().find(|evaluation| !evaluation.queue.is_empty())?;
    Some((evaluation.attempt, evaluation.queued()))
}
