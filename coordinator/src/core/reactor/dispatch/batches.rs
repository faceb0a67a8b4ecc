//! Sends batches, revokes them, and returns the indices of lost workers' batches to the queue.

use super::{departures, proofs};
use crate::core::ahead::Ahead;
use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::bounded_duration::bounded_duration;
use crate::core::crashes::{Cause, LostWorker};
use crate::core::effect::Effect;
use crate::core::evaluation::Audit;
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::job::Speculation;
use crate::core::policy::{AUDIT_LOSSES_MAX, BATCHES_IN_FLIGHT_MAX};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, State};

/// Sends a batch to a worker and returns its number, if its evaluation is under way.
pub(crate) fn send(
    turn: &mut Turn,
    worker: WorkerId,
    assignment: Assignment,
    purpose: Purpose,
) -> Option<BatchId> {
    let work = turn.state.work(&assignment)?;
    proofs::ask_before(turn, worker, assignment.job);
    preempt_if_full(turn, worker, assignment.indices.count);
    let id = BatchId(turn.state.next_batch);
    turn.state.next_batch += 1;
    turn.state.batches.insert(id, Batch::new(assignment, purpose, worker, turn.now));
    if let Some(worker) = turn.state.workers.get_mut(&worker) {
        worker.in_flight.push(id);
    }
    turn.state.reorder(worker);
    turn.effects.push(Effect::Send { worker, batch: id, work });
    Some(id)
}

/// Charges the client of a batch for its expected computing time, or for the target time of a batch
/// if the rate of the worker is unknown.
pub(crate) fn charge(state: &mut State, id: BatchId) {
    let target = state.config.batch_target.as_secs_f64();
    let Some(batch) = state.batches.get_mut(&id) else {
        return;
    };
    let Some(worker) = state.workers.get(&batch.worker) else {
        return;
    };
    let Some(job) = state.jobs.get(&batch.assignment.job) else {
        return;
    };
    let count = batch.assignment.indices.count as f64;
    let seconds = worker.rates.get(&batch.assignment.job).map_or(target, |rate| count / rate);
    batch.charged = bounded_duration(seconds * f64::from(worker.hello.slots));
    state.shares.charge(&job.record.client, batch.charged);
}

pub(crate) fn revoke(turn: &mut Turn, batch: BatchId) {
    if let Some(revoked) = turn.state.settle(batch) {
        turn.effects.push(Effect::Revoke { worker: revoked.worker, batch });
        departures::dismiss_if_drained(turn, revoked.worker);
    }
}

/// Revokes every batch of a job, and drops all evaluations that its search has not asked for.
pub(crate) fn revoke_all(turn: &mut Turn, job: JobId) {
    let of_job = turn.state.batches.iter().filter(|(_, batch)| batch.assignment.job == job);
    let batches: Vec<BatchId> = of_job.map(|(id, _)| *id).collect();
    for batch in batches {
        revoke(turn, batch);
    }
    if let Some(job) = turn.state.jobs.get_mut(&job) {
        job.speculation = Speculation::default();
        job.ahead = Ahead::default();
    }
}

/// Revokes the batches of a job that belong to these attempts at evaluations.
pub(crate) fn revoke_attempts(turn: &mut Turn, job: JobId, attempts: &[u64]) {
    if attempts.is_empty() {
        return;
    }
    let is_of =
        |assignment: &Assignment| assignment.job == job && attempts.contains(&assignment.attempt);
    let held = turn.state.batches.iter().filter(|(_, batch)| is_of(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for batch in held {
        revoke(turn, batch);
    }
}

/// Returns the indices of a lost worker's batch to the queue, unless a duplicate of it is still
/// out.
pub(crate) fn give_back_orphan(state: &mut State, batch: BatchId, loss: &LostWorker) {
    let assignment = state.batches.get(&batch).map(|batch| (batch.purpose, batch.assignment));
    if let Some((Purpose::TieBreak, assignment)) = assignment {
        tie_breaker_lost(state, &assignment, batch, loss);
    }
    let Some(settled) = state.settle(batch) else {
        return;
    };
    if !settled.purpose.fills() {
        give_back_audit(state, &settled, loss);
        return;
    }
    let Batch { assignment, purpose, duplicates, .. } = settled;
    let is_blameless = purpose != Purpose::Exclusive && is_blameless(state, loss);
    let Some(evaluation) = state.evaluation_of_mut(&assignment) else {
        return;
    };
    let indices = assignment.indices;
    if is_blameless && duplicates.is_empty() {
        evaluation.put_back(indices);
        return;
    }
    evaluation.has_crashed_worker |= loss.cause != Cause::Announced;
    if !duplicates.is_empty() {
        if purpose == Purpose::Exclusive {
            evaluation.count_crash(indices.first, loss);
        }
        return;
    }
    if indices.count > 1 || loss.cause == Cause::Announced {
        evaluation.put_back_in_halves(indices);
    } else {
        evaluation.quarantine(indices.first, loss);
    }
}

/// Returns whether no batch is to blame for a loss: the workers of this host are lost whatever they hold, while
/// others answer. Their batches are not made smaller, so that a host whose workers come and go leaves no
/// evaluation in pieces.
fn is_blameless(state: &State, loss: &LostWorker) -> bool {
    let answers = |worker: &AttachedWorker| {
        worker.has_answered && state.is_sound(worker) && !state.is_failing(worker.name.host())
    };
    !loss.has_answered
        && state.is_failing(loss.worker.host())
        && state.workers.values().any(answers)
}

/// Revokes the speculative batches of a worker that has no free slots for `count` more realizations
/// beside them.
pub(crate) fn preempt_if_full(turn: &mut Turn, worker: WorkerId, count: u64) {
    let Some(attached) = turn.state.workers.get(&worker) else {
        return;
    };
    let full = attached.in_flight.len() >= BATCHES_IN_FLIGHT_MAX;
    if full || realizations_held(turn.state, attached) + count > attached.hello.slots.into() {
        preempt(turn, worker);
    }
}

/// Revokes the speculative batches of a worker.
pub(crate) fn preempt(turn: &mut Turn, worker: WorkerId) {
    let Some(attached) = turn.state.workers.get(&worker) else {
        return;
    };
    let held: Vec<BatchId> = turn.state.held_for(attached, Purpose::Speculative).collect();
    for batch in held {
        if let Some(assignment) = turn.state.batches.get(&batch).map(|batch| batch.assignment)
            && let Some(evaluation) = turn.state.evaluation_of_mut(&assignment)
        {
            evaluation.put_back(assignment.indices);
        }
        revoke(turn, batch);
    }
}

/// Counts the realizations of all batches that a worker holds.
pub(crate) fn realizations_held(state: &State, worker: &AttachedWorker) -> u64 {
    let held = worker.in_flight.iter().filter_map(|held| state.batches.get(held));
    held.map(|batch| batch.assignment.indices.count).sum()
}

/// Queues a lost worker's audit again, unless too many workers were lost over it.
fn give_back_audit(state: &mut State, batch: &Batch, loss: &LostWorker) {
    let crashed = u32::from(loss.cause != Cause::Announced);
    let Assignment { indices, .. } = batch.assignment;
    let Purpose::Audit { lost } = batch.purpose else {
        return;
    };
    if !batch.duplicates.is_empty() {
        return;
    }
    if let Some(evaluation) = state.evaluation_of_mut(&batch.assignment)
        && lost + crashed < AUDIT_LOSSES_MAX
        && let Some(by) = evaluation.owner(indices.first)
    {
        evaluation.audits.push_front(Audit { indices, by, lost: lost + crashed });
    }
}

/// Records that the worker of a tie-breaker was lost.
fn tie_breaker_lost(state: &mut State, assignment: &Assignment, batch: BatchId, loss: &LostWorker) {
    if let Some(evaluation) = state.evaluation_of_mut(assignment)
        && let Some(dispute) =
            evaluation.disputes.iter_mut().find(|it| it.tie_breakers.contains(&batch))
    {
        dispute.crashes.add(loss);
    }
}
