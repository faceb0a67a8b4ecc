//! Batches that are out much longer than they should be, whatever they are computed for, and the
//! workers that hold them.
//!
//! A worker may give signs of life and never answer. So what is overdue is given to another worker
//! too, and the first answer counts; if that one is overdue in its turn, to one more. Each waits
//! twice as long as the one before, so that realizations that are slow everywhere are computed a
//! few times at most. Where other work waits, a job has one such duplicate out at a time: its answer
//! shows how long the others should take.
//!
//! A worker that misses batches in a row is on probation until it answers one (`probation.rs`).

use std::collections::BTreeSet;
use std::time::Duration;

use super::poison::{self, Reputation};
use super::{batches, duplicates, schedule};
use crate::batch::{Assignment, Batch, Purpose};
use crate::crashes::Crashes;
use crate::dispute::Dispute;
use crate::fairness;
use crate::ids::{BatchId, JobId, WorkerId};
use crate::reactor::turn::Turn;
use crate::state::{State, Worker};
use crate::worker_name::WorkerName;

/// No batch is overdue before. A worker, a network or a machine may falter for a second or two
/// without anything being wrong.
const OVERDUE_MIN: Duration = Duration::from_secs(3);
/// Nor before it has taken so many times as long as it should: a machine may have other things to
/// do, and one point may take some times as long as another.
const OVERDUE_FACTOR: u32 = 4;
/// How many batches may have the same indices at a time. The last of so many would be sent after six minutes at the
/// soonest.
pub(crate) const DUPLICATES_MAX: usize = 8;
/// Duplicates that are sent on one event; the others follow on the next.
const SENT_AT_ONCE_MAX: usize = 64;
/// So many batches in a row that others answered, over [`OVERDUE_MIN`] at least, put a worker on
/// probation. It holds two at a time, so one moment of standing still is not enough.
const MISSED_MAX: u32 = 3;
/// A worker that holds something overdue for so long is on probation too: there may be nobody else
/// to answer it.
const SILENT_MAX: Duration = Duration::from_secs(60);

/// Looks for batches that are overdue.
pub(crate) fn tick(turn: &mut Turn) {
    turn.state.probation.forget(turn.now);
    let late = turn.state.batches.keys().filter(|id| is_overdue(turn.state, **id, turn.now));
    let late: Vec<BatchId> = late.copied().collect();
    for id in &late {
        accuse(turn.state, *id, turn.now);
    }
    let waits = |id: &BatchId| {
        turn.state.batches.get(id).is_some_and(|batch| {
            let newest = batch.duplicates.iter().all(|duplicate| duplicate < id);
            let asked_for = batch.purpose != Purpose::Speculative;
            newest && asked_for && batch.duplicates.len() + 1 < DUPLICATES_MAX
        })
    };
    turn.state.overdue = late.into_iter().filter(waits).collect();
    for id in Vec::from_iter(turn.state.overdue.iter().copied()) {
        give_up_audit(turn, id);
    }
}

/// Whether a batch should have been answered long ago.
fn is_overdue(state: &State, id: BatchId, now: Duration) -> bool {
    state.batches.get(&id).is_some_and(|batch| {
        let waited = now.saturating_sub(batch.begun);
        let factor = 2_u32.saturating_pow(batch.retries);
        // Most are young; of the others it is found out how long they should take.
        waited >= OVERDUE_MIN * factor
            && waited >= expected(state, id).unwrap_or_default() * OVERDUE_FACTOR * factor
    })
}

/// Whether the answer to a batch may be hoped for: it is not overdue, or its worker is not known for
/// not answering.
pub(crate) fn is_waited_for(state: &State, id: BatchId, now: Duration) -> bool {
    let worker = state.batches.get(&id).and_then(|batch| state.workers.get(&batch.worker));
    worker.is_some_and(|worker| !state.probation.has(&worker.name) || !is_overdue(state, id, now))
}

/// Time that a batch should take with what its worker was sent before it, by the rate of the worker
/// and by the pace of the job, whichever is slower; `None` if nothing is known of the job.
fn expected(state: &State, id: BatchId) -> Option<Duration> {
    let worker = state.workers.get(&state.batches.get(&id)?.worker)?;
    let alone = |id: &BatchId| {
        let Assignment { job, indices, .. } = state.batches.get(id)?.assignment;
        let pace = state.jobs.get(&job)?.pace.expected(indices.count, worker.hello.slots);
        let rate = worker.rates.get(&job);
        pace.max(rate.map(|rate| fairness::slot_time(indices.count as f64 / rate, 1)))
    };
    let before = worker.in_flight.iter().filter(|held| **held < id);
    let before: Duration = before.filter_map(alone).sum();
    Some(before + alone(&id)?)
}

/// Puts a worker on probation that holds something overdue for too long.
fn accuse(state: &mut State, id: BatchId, now: Duration) {
    let Some(batch) = state.batches.get(&id) else {
        return;
    };
    // While nobody has answered anything, it may be that it takes so long.
    let long = now.saturating_sub(batch.begun) >= SILENT_MAX && expected(state, id).is_some();
    if let Some(worker) =
        state.workers.get(&batch.worker).filter(|worker| long && state.is_sound(worker))
    {
        let name = worker.name.clone();
        begin_probation(state, &name, now, now);
    }
}

/// Takes back an audit that two workers did not answer in time, or one where nobody else is there for
/// it who holds nothing overdue: an answer that nobody checks is believed.
fn give_up_audit(turn: &mut Turn, id: BatchId) {
    let Some(batch) = turn.state.batches.get(&id) else {
        return;
    };
    let audit = matches!(batch.purpose, Purpose::Audit { .. });
    let other =
        || turn.state.workers.values().any(|worker| is_fit(turn.state, id, worker, turn.now));
    if !audit || (batch.retries == 0 && other()) {
        return;
    }
    let mut given_up = batch.duplicates.clone();
    given_up.push(id);
    for id in given_up {
        missed(turn.state, id, turn.now);
        batches::revoke(turn, id);
    }
}

/// Has other workers compute what is overdue, before anything else is handed out. Adds those to
/// `kept` that must not be refilled, so that they hold nothing soon.
pub(crate) fn hand_out(turn: &mut Turn, kept: &mut BTreeSet<WorkerId>) {
    if turn.state.overdue.is_empty() {
        return;
    }
    let busy = schedule::work_waits(turn.state);
    let mut free = schedule::free_workers(turn.state, kept);
    let mut sent = 0;
    for id in Vec::from_iter(turn.state.overdue.iter().copied()) {
        let Some(batch) = turn.state.batches.get(&id) else {
            continue;
        };
        let (job, alone) = (batch.assignment.job, batch.purpose == Purpose::Exclusive);
        // Since time was looked at last it may have become known that the job is slow.
        if sent >= SENT_AT_ONCE_MAX
            || (free.is_empty() && !alone)
            || !is_overdue(turn.state, id, turn.now)
            || (busy && has_scout(turn.state, job, turn.now))
        {
            continue;
        }
        let Some(taker) = (if alone {
            taker_alone(turn.state, id, turn.now)
        } else {
            taker(turn.state, id, &free, turn.now)
        }) else {
            continue;
        };
        if alone && holds_anything(turn.state, taker) {
            kept.insert(taker);
        } else {
            send(turn, id, taker);
            free.retain(|free| *free != taker);
            sent += 1;
        }
    }
}

/// Whether a job has a duplicate of an overdue batch out that is not overdue itself.
fn has_scout(state: &State, job: JobId, now: Duration) -> bool {
    let scout = state.jobs.get(&job).and_then(|job| job.scout);
    scout.is_some_and(|scout| state.batches.contains_key(&scout) && !is_overdue(state, scout, now))
}

fn holds_anything(state: &State, worker: WorkerId) -> bool {
    state.workers.get(&worker).is_none_or(|worker| schedule::held(state, worker) > 0)
}

/// Chooses the one of these workers that is to have a duplicate of a batch.
fn taker(state: &State, id: BatchId, free: &[WorkerId], now: Duration) -> Option<WorkerId> {
    let rank = |(worker, taker): &(&Worker, WorkerId)| {
        let doubtful = worker.missed.count > 0 || !worker.has_answered;
        let on_probation = !state.is_sound(worker);
        let of_holder = is_of_holder(state, id, worker);
        (on_probation, doubtful, of_holder, schedule::held(state, worker), *taker)
    };
    let free = free.iter().filter_map(|id| Some((state.workers.get(id)?, *id)));
    let fit = free.filter(|(worker, _)| is_fit(state, id, worker, now));
    fit.min_by_key(rank).map(|(_, taker)| taker)
}

/// Chooses the worker that is to have a duplicate of an exclusive batch, be it busy or not.
fn taker_alone(state: &State, id: BatchId, now: Duration) -> Option<WorkerId> {
    let batch = state.batches.get(&id)?;
    let crashes =
        state.evaluation_of(&batch.assignment)?.crashes.get(&batch.assignment.indices.first);
    let nobody = Crashes::default();
    let crashes = crashes.unwrap_or(&nobody);
    if poison::crash_limit_reached(state, crashes, |_| true) {
        return None;
    }
    let rank = |(taker, worker): &(&WorkerId, &Worker)| -> (Reputation, bool, usize, WorkerId) {
        let reputation = poison::reputation(state, worker, crashes);
        (reputation, is_of_holder(state, id, worker), schedule::held(state, worker), **taker)
    };
    let fit =
        |worker: &Worker| is_fit(state, id, worker, now) && !state.is_failing(worker.name.host());
    let fit = state.workers.iter().filter(|(_, worker)| fit(worker));
    fit.min_by_key(rank).map(|(taker, _)| *taker)
}

/// Whether a worker is to have a duplicate of a batch: it may, and leaves nothing unanswered itself.
fn is_fit(state: &State, id: BatchId, worker: &Worker, now: Duration) -> bool {
    let late = || worker.in_flight.iter().any(|held| is_overdue(state, *held, now));
    let trusted = state.is_sound(worker) || is_tried(state, id, worker, now);
    trusted && may_have(state, id, &worker.name) && !late()
}

/// Whether a worker on probation is tried with a duplicate of a batch. An audit is not worth it.
fn is_tried(state: &State, id: BatchId, worker: &Worker, now: Duration) -> bool {
    let purpose = state.batches.get(&id).map(|batch| batch.purpose);
    !worker.draining
        && worker.in_flight.is_empty()
        && !state.probation.rests(&worker.name, now)
        && matches!(purpose, Some(Purpose::Fill | Purpose::Exclusive | Purpose::TieBreak))
}

/// The names of the workers that hold a batch and its duplicates.
fn holders(state: &State, id: BatchId) -> impl Iterator<Item = &WorkerName> {
    let others = state.batches.get(&id).into_iter().flat_map(|batch| &batch.duplicates).copied();
    let batches = others.chain([id]).filter_map(|id| state.batches.get(&id));
    batches.filter_map(|batch| Some(&state.workers.get(&batch.worker)?.name))
}

fn is_of_holder(state: &State, id: BatchId, worker: &Worker) -> bool {
    holders(state, id).any(|holder| holder.host() == worker.name.host())
}

/// Whether a worker may have a duplicate of a batch: who holds one may not, nor who is to be checked by
/// it, nor who has already said what is to be decided.
fn may_have(state: &State, id: BatchId, name: &WorkerName) -> bool {
    let Some(batch) = state.batches.get(&id) else {
        return false;
    };
    let Some(evaluation) = state.evaluation_of(&batch.assignment) else {
        return false;
    };
    let about = |it: &&Dispute| it.tie_breakers.contains(&id);
    let in_question = match batch.purpose {
        Purpose::Fill | Purpose::Exclusive | Purpose::Speculative => false,
        Purpose::Audit { .. } => {
            evaluation.owner(batch.assignment.indices.first).is_none_or(|by| by == *name)
        }
        Purpose::TieBreak => {
            evaluation.disputes.iter().find(about).is_none_or(|it| it.involves(name))
        }
    };
    !in_question && holders(state, id).all(|holder| holder != name)
}

/// Sends a worker a duplicate of an overdue batch.
fn send(turn: &mut Turn, id: BatchId, to: WorkerId) {
    let Some(batch) = turn.state.batches.get(&id) else {
        return;
    };
    let Batch { assignment, purpose, retries, worker, .. } = *batch;
    if purpose == Purpose::Exclusive {
        batches::preempt(turn, to);
    }
    let Some(duplicate) = duplicates::send(turn, id, to) else {
        return;
    };
    tracing::info!(job = %assignment.job, first = assignment.indices.first, overdue = %worker, %to,
        "a batch is overdue; another worker computes the same");
    if let Some(batch) = turn.state.batches.get_mut(&duplicate) {
        batch.retries = retries + 1;
    }
    if let Some(evaluation) = turn.state.evaluation_of_mut(&assignment) {
        match purpose {
            Purpose::Fill | Purpose::Exclusive | Purpose::Speculative => {}
            Purpose::Audit { .. } => evaluation.audits_out += 1,
            Purpose::TieBreak => {
                for dispute in &mut evaluation.disputes {
                    if dispute.tie_breakers.contains(&id) {
                        dispute.tie_breakers.push(duplicate);
                    }
                }
            }
        }
    }
    if let Some(job) = turn.state.jobs.get_mut(&assignment.job) {
        job.scout = Some(duplicate);
    }
}

/// A batch is taken back from its worker because another has answered it, or because nobody waits
/// for it any longer: that counts, if the worker should have answered it long ago.
pub(crate) fn missed(state: &mut State, id: BatchId, now: Duration) {
    let Some(batch) = state.batches.get(&id) else {
        return;
    };
    let waited = now.saturating_sub(batch.begun);
    let expected = expected(state, id).unwrap_or_default();
    if waited < (state.config.batch_target / 2).max(expected * OVERDUE_FACTOR) {
        return;
    }
    let (sent, begun) = (batch.sent, batch.begun);
    let Some(worker) = state.workers.get_mut(&batch.worker) else {
        return;
    };
    let missed = &mut worker.missed;
    if missed.count == 0 {
        missed.since = begun;
    }
    missed.count = missed.count.saturating_add(1);
    let many = missed.count >= MISSED_MAX && now.saturating_sub(missed.since) >= OVERDUE_MIN;
    let name = worker.name.clone();
    if many || state.probation.has(&name) {
        begin_probation(state, &name, sent, now);
    }
}

/// Puts a worker on probation that does not answer what it was sent at `sent`, or notes one more
/// reason for it.
pub(crate) fn begin_probation(state: &mut State, name: &WorkerName, sent: Duration, now: Duration) {
    if state.probation.miss(name, sent, now) {
        tracing::warn!(worker = %name, "this worker gives signs of life and does not answer what it \
            holds; until it does it gets one realization at a time");
    }
}

/// A worker has answered a batch that it holds.
pub(crate) fn answered(state: &mut State, worker: WorkerId, batch: BatchId, now: Duration) {
    let Some(worker) = state.workers.get_mut(&worker) else {
        return;
    };
    worker.missed.count = 0;
    if state.probation.end(&worker.name) {
        tracing::info!(worker = %worker.name, "this worker answers again");
    }
    for later in worker.in_flight.iter().filter(|held| **held > batch) {
        if let Some(later) = state.batches.get_mut(later) {
            later.begun = now;
        }
    }
}
