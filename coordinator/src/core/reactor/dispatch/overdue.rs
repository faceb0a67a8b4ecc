//! Batches of any purpose that are out much longer than expected, and the workers that hold them.
//!
//! A worker may send heartbeats and never answer. So another worker gets a duplicate of an overdue
//! batch, and the first answer counts; if the duplicate becomes overdue too, a third worker gets
//! one. Each duplicate may take twice as long as the one before, so that realizations that are slow
//! everywhere are computed only a few times. While other work waits, a job has only one such duplicate
//! out at a time, the scout: its answer shows how long the other batches should take.
//!
//! A worker that misses batches in a row is on probation until it answers one (`probation.rs`).

use std::collections::BTreeSet;
use std::time::Duration;

use super::poison::{self, Reputation};
use super::{batches, duplicates, schedule};
use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::bounded_duration::bounded_duration;
use crate::core::crashes::Crashes;
use crate::core::dispute::Dispute;
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::policy::{
    COPIES_MAX, MISSED_MAX, OVERDUE_AT_ONCE_MAX, OVERDUE_FACTOR, OVERDUE_MIN, SILENT_MAX,
};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, State};
use crate::core::worker_name::WorkerName;

/// Lists the overdue batches that wait for a duplicate, puts workers that hold one for too long on probation,
/// and gives up audits that nobody else can answer.
pub(crate) fn tick(turn: &mut Turn) {
    if turn.state.probation.forget(turn.now) {
        follow_probation(turn.state);
    }
    let late = turn.state.batches.keys().filter(|id| is_overdue(turn.state, **id, turn.now));
    let late: Vec<BatchId> = late.copied().collect();
    for id in &late {
        suspect_silent(turn.state, *id, turn.now);
    }
    let waits = |id: &BatchId| {
        turn.state.batches.get(id).is_some_and(|batch| {
            let newest = batch.duplicates.iter().all(|duplicate| duplicate < id);
            // Nobody else can give the proof of a worker.
            let asked_for = !matches!(batch.purpose, Purpose::Speculative | Purpose::Proof);
            newest && asked_for && batch.duplicates.len() + 1 < COPIES_MAX
        })
    };
    turn.state.overdue = late.into_iter().filter(waits).collect();
    for id in Vec::from_iter(turn.state.overdue.iter().copied()) {
        give_up_audit(turn, id);
    }
}

pub(crate) fn is_overdue(state: &State, id: BatchId, now: Duration) -> bool {
    state.batches.get(&id).is_some_and(|batch| {
        let waited = now.saturating_sub(batch.begun);
        let factor = 2_u32.saturating_pow(batch.retries);
        // Most batches are young; the expected time is computed only for the others.
        waited >= OVERDUE_MIN * factor
            && waited >= expected_time(state, id).unwrap_or_default() * OVERDUE_FACTOR * factor
    })
}

/// Returns whether an answer to a batch may still be expected: the batch is not overdue, or its
/// worker is not on probation.
pub(crate) fn is_waited_for(state: &State, id: BatchId, now: Duration) -> bool {
    let worker = state.batches.get(&id).and_then(|batch| state.workers.get(&batch.worker));
    worker.is_some_and(|worker| !state.probation.has(&worker.name) || !is_overdue(state, id, now))
}

/// Returns the expected time of a batch, together with those that its worker was sent before it, by
/// the rate of the worker or the job's time of a realization, whichever is slower; `None` if both are
/// unknown.
fn expected_time(state: &State, id: BatchId) -> Option<Duration> {
    let worker = state.workers.get(&state.batches.get(&id)?.worker)?;
    let own_time = |id: &BatchId| {
        let Assignment { job, indices, .. } = state.batches.get(id)?.assignment;
        let realization_time = state.jobs.get(&job)?.realization_time;
        let expected = realization_time.expected_time(indices.count, worker.hello.slots);
        let rate = worker.rates.get(&job);
        expected.max(rate.map(|rate| bounded_duration(indices.count as f64 / rate)))
    };
    let before = worker.in_flight.iter().filter(|held| **held < id);
    let before: Duration = before.filter_map(own_time).sum();
    Some(before + own_time(&id)?)
}

/// Puts a worker on probation that has held an overdue batch for too long.
fn suspect_silent(state: &mut State, id: BatchId, now: Duration) {
    let Some(batch) = state.batches.get(&id) else {
        return;
    };
    // Before the first answer of the job, its realizations may simply take this long.
    let long = now.saturating_sub(batch.begun) >= SILENT_MAX && expected_time(state, id).is_some();
    if let Some(worker) =
        state.workers.get(&batch.worker).filter(|worker| long && state.is_sound(worker))
    {
        let name = worker.name.clone();
        begin_probation(state, &name, now, now);
    }
}

/// Gives up an audit that two workers did not answer in time, or that no other worker without
/// overdue batches can compute: the answer is then accepted unchecked.
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
        count_missed(turn.state, id, turn.now);
        batches::revoke(turn, id);
    }
}

/// Sends duplicates of overdue batches, before any other work is sent. Workers that get no further
/// batches, so that they are soon free for an exclusive duplicate, are added to `kept`.
pub(crate) fn dispatch(turn: &mut Turn, kept: &mut BTreeSet<WorkerId>) {
    if turn.state.overdue.is_empty() {
        return;
    }
    let busy = schedule::work_waits(turn.state);
    let mut free: Vec<WorkerId> = schedule::free_workers(turn.state, kept).collect();
    let mut sent = 0;
    for id in Vec::from_iter(turn.state.overdue.iter().copied()) {
        let Some(batch) = turn.state.batches.get(&id) else {
            continue;
        };
        let (job, alone) = (batch.assignment.job, batch.purpose == Purpose::Exclusive);
        // Since the last tick an answer may have shown that the job is slow.
        if sent >= OVERDUE_AT_ONCE_MAX
            || (free.is_empty() && !alone)
            || !is_overdue(turn.state, id, turn.now)
            || (busy && has_scout(turn.state, job, turn.now))
        {
            continue;
        }
        let chosen = match alone {
            true => choose_exclusive_worker(turn.state, id, turn.now),
            false => choose_worker(turn.state, id, &free, turn.now),
        };
        let Some(chosen) = chosen else {
            continue;
        };
        if alone && holds_anything(turn.state, chosen) {
            kept.insert(chosen);
        } else {
            send(turn, id, chosen);
            free.retain(|free| *free != chosen);
            sent += 1;
        }
    }
}

/// Returns whether a scout of a job is out: a duplicate of an overdue batch that is not overdue itself.
fn has_scout(state: &State, job: JobId, now: Duration) -> bool {
    let newest_overdue_duplicate =
        state.jobs.get(&job).and_then(|job| job.newest_overdue_duplicate);
    newest_overdue_duplicate.is_some_and(|newest_overdue_duplicate| {
        state.batches.contains_key(&newest_overdue_duplicate)
            && !is_overdue(state, newest_overdue_duplicate, now)
    })
}

fn holds_anything(state: &State, worker: WorkerId) -> bool {
    state.workers.get(&worker).is_none_or(|worker| state.batches_held(worker) > 0)
}

/// Chooses which of the workers in `free` gets a duplicate of a batch.
fn choose_worker(
    state: &State,
    batch: BatchId,
    free: &[WorkerId],
    now: Duration,
) -> Option<WorkerId> {
    let rank = |(worker, id): &(&AttachedWorker, WorkerId)| {
        let doubtful = state.may_be_silent(worker);
        let on_probation = !state.is_sound(worker);
        let of_holder = is_of_holder(state, batch, worker);
        (on_probation, doubtful, of_holder, state.batches_held(worker), *id)
    };
    // Who has never answered anything gets no copy while another worker is there that has, busy or not.
    let answers = |worker: &AttachedWorker| {
        worker.has_answered && state.is_sound(worker) && may_have(state, batch, &worker.name)
    };
    let any_answers = state.workers.values().any(answers);
    let free = free.iter().filter_map(|id| Some((state.workers.get(id)?, *id)));
    let known = free.filter(|(worker, _)| worker.has_answered || !any_answers);
    let fit = known.filter(|(worker, _)| is_fit(state, batch, worker, now));
    fit.min_by_key(rank).map(|(_, id)| id)
}

/// Chooses the worker that gets a duplicate of an exclusive batch, whether it is busy or not.
fn choose_exclusive_worker(state: &State, id: BatchId, now: Duration) -> Option<WorkerId> {
    let batch = state.batches.get(&id)?;
    let crashes =
        state.evaluation_of(&batch.assignment)?.crashes.get(&batch.assignment.indices.first);
    let nobody = Crashes::default();
    let crashes = crashes.unwrap_or(&nobody);
    if poison::crash_limit_reached(state, crashes, |_| true) {
        return None;
    }
    let rank =
        |(other, worker): &(&WorkerId, &AttachedWorker)| -> (Reputation, bool, usize, WorkerId) {
            let reputation = poison::reputation(state, worker, crashes);
            (reputation, is_of_holder(state, id, worker), state.batches_held(worker), **other)
        };
    let may_use_failing_host = may_use_failing_host(state, batch, crashes, now);
    let fit = |worker: &AttachedWorker| {
        is_fit(state, id, worker, now)
            && (may_use_failing_host || !state.is_failing(worker.name.host()))
    };
    let fit = state.workers.iter().filter(|(_, worker)| fit(worker));
    fit.min_by_key(rank).map(|(chosen, _)| *chosen)
}

/// Returns whether an exclusive batch may go to a host whose workers are lost whatever they hold. It may
/// once the holder has had the time of a lease to answer, because the holder's host may be even worse.
/// Each loss since the batch was begun doubles the wait. The last loss, which would make the realization poison, is not
/// risked here, so that a bad node does not fail a job because another one is silent.
fn may_use_failing_host(state: &State, batch: &Batch, crashes: &Crashes, now: Duration) -> bool {
    let lost = crashes.count_after(batch.begun);
    let since = crashes.last().unwrap_or_default().max(batch.begun);
    let wait = state.config.expiry * 2_u32.saturating_pow(u32::try_from(lost).unwrap_or(u32::MAX));
    now.saturating_sub(since) >= wait && !crashes.permit_only_one_more()
}

/// Returns whether a worker may get a duplicate of a batch: it is eligible ([`may_have`]), sound or to be
/// tried, and holds no overdue batch itself.
fn is_fit(state: &State, id: BatchId, worker: &AttachedWorker, now: Duration) -> bool {
    let has_overdue = || worker.in_flight.iter().any(|held| is_overdue(state, *held, now));
    let trusted = state.is_sound(worker) || may_be_tried(state, id, worker, now);
    trusted && may_have(state, id, &worker.name) && !has_overdue()
}

/// Returns whether a worker on probation may be tried with a duplicate of this batch. Audits are not
/// used for that.
fn may_be_tried(state: &State, id: BatchId, worker: &AttachedWorker, now: Duration) -> bool {
    let purpose = state.batches.get(&id).map(|batch| batch.purpose);
    !worker.draining
        && worker.in_flight.is_empty()
        && !state.probation.is_paused(&worker.name, now)
        && matches!(purpose, Some(Purpose::Fill | Purpose::Exclusive | Purpose::TieBreak))
}

/// Returns the names of the workers that hold a batch and its duplicates.
fn holders(state: &State, id: BatchId) -> impl Iterator<Item = &WorkerName> {
    let others = state.batches.get(&id).into_iter().flat_map(|batch| &batch.duplicates).copied();
    let batches = others.chain([id]).filter_map(|id| state.batches.get(&id));
    batches.filter_map(|batch| Some(&state.workers.get(&batch.worker)?.name))
}

fn is_of_holder(state: &State, id: BatchId, worker: &AttachedWorker) -> bool {
    holders(state, id).any(|holder| holder.host() == worker.name.host())
}

/// Returns whether a worker is eligible for a duplicate of a batch. A worker that holds the batch
/// or a duplicate is not, nor is one of the host that the batch audits, nor one of a host that has voted in
/// the dispute that it decides.
fn may_have(state: &State, id: BatchId, name: &WorkerName) -> bool {
    let Some(batch) = state.batches.get(&id) else {
        return false;
    };
    let Some(evaluation) = state.evaluation_of(&batch.assignment) else {
        return false;
    };
    let has_tie_breaker = |it: &&Dispute| it.tie_breakers.contains(&id);
    let in_question = match batch.purpose {
        Purpose::Fill | Purpose::Exclusive | Purpose::Speculative => false,
        Purpose::Proof => true,
        Purpose::Audit { .. } => {
            let by = evaluation.owner(batch.assignment.indices.first);
            by.is_none_or(|by| by.host() == name.host())
        }
        Purpose::TieBreak => evaluation
            .disputes
            .iter()
            .find(has_tie_breaker)
            .is_none_or(|it| it.has_vote_of(name.host())),
    };
    let is_check = !batch.purpose.fills();
    let in_common =
        |holder: &WorkerName| holder == name || (is_check && holder.host() == name.host());
    !in_question && !holders(state, id).any(in_common)
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
            Purpose::Fill | Purpose::Exclusive | Purpose::Speculative | Purpose::Proof => {}
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
        job.newest_overdue_duplicate = Some(duplicate);
    }
}

/// Counts a batch as missed if its worker should have answered it long ago. Called when the batch is
/// revoked, because another worker has answered it or because it is no longer needed.
pub(crate) fn count_missed(state: &mut State, id: BatchId, now: Duration) {
    let Some(batch) = state.batches.get(&id) else {
        return;
    };
    let waited = now.saturating_sub(batch.begun);
    let expected = expected_time(state, id).unwrap_or_default();
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

/// Puts a worker on probation that does not answer the batch sent at `sent`, or notes one more
/// reason for its probation.
pub(crate) fn begin_probation(state: &mut State, name: &WorkerName, sent: Duration, now: Duration) {
    if state.probation.miss(name, sent, now) {
        follow_probation(state);
        tracing::warn!(worker = %name, "this worker gives signs of life and does not answer what it \
            holds; until it does it gets one realization at a time");
    }
}

/// Records that a worker has answered a batch that it holds.
pub(crate) fn note_answer(state: &mut State, worker: WorkerId, batch: BatchId, now: Duration) {
    let Some(worker) = state.workers.get_mut(&worker) else {
        return;
    };
    worker.missed.count = 0;
    let ended = state.probation.end(&worker.name);
    if ended {
        tracing::info!(worker = %worker.name, "this worker answers again");
    }
    for later in worker.in_flight.iter().filter(|held| **held > batch) {
        if let Some(later) = state.batches.get_mut(later) {
            later.begun = now;
        }
    }
    if ended {
        follow_probation(state);
    }
}

/// Updates what depends on which workers are on probation. That changes rarely.
pub(crate) fn follow_probation(state: &mut State) {
    state.reorder_all();
    state.fleet_changes += 1;
}
