//! Who computes what next.
//!
//! Workers are served in the order of how little they hold, clients in the order of how little
//! computing time they have had, jobs of one client by priority and in turn, batch by batch. A batch
//! is sized from the worker's measured rate to the target time, and to at most a quarter of the
//! worker's share of what remains of the evaluation, so that all workers end together; but while
//! its share allows, no batch is smaller than the worker's threads, be it longer than the target
//! or more than the quarter. What is overdue goes to another worker before anything else (`overdue.rs`).
//! A worker that has nothing to do gets a copy of a batch that is late, then what may be done ahead
//! (`ahead.rs`), then a copy of the batch that is out longest. Whom a realization waits for that is to
//! be computed alone is not refilled. A worker on probation gets one realization at a time.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::limits::BATCH_REALIZATIONS_MAX;

use super::{Effects, ahead, checks, copies, overdue, suspects};
use crate::effect::Effect;
use crate::fairness;
use crate::ids::{BatchId, JobId, WorkerId};
use crate::state::{Assignment, BATCHES_IN_FLIGHT_MAX, Batch, Job, Purpose, Stage, State, Worker};
use crate::store::JobRecord;

/// Realizations for each thread in a worker's first batch of a job: enough to measure its rate,
/// little enough to be soon answered.
const FIRST_BATCH_PER_THREAD: u32 = 4;
/// A batch holds at most one in so many of a worker's share of what remains, and more only to
/// give each of the worker's threads one realization; never more than the share.
const SHARE_DIVISOR: f64 = 4.0;

/// Hands out batches while there is credit and work, then copies.
pub(super) fn hand_out(state: &mut State, now: Duration, effects: &mut Effects) {
    if state.draining {
        return;
    }
    let mut kept = suspects::hand_out(state, now, effects);
    overdue::hand_out(state, &mut kept, now, effects);
    while work_waits(state) && hand_one(state, &kept, now, effects) {}
    copies::of_late_ones(state, now, effects);
    if kept.is_empty() && !work_waits(state) {
        ahead::hand_out(state, now, effects);
    }
    copies::of_slow_ones(state, now, effects);
}

/// Whether there is anything to hand out but suspects.
pub(super) fn work_waits(state: &State) -> bool {
    next_job(state).is_some() || checks::any_wait(state)
}

/// Gives the first worker that may have something what it may have; whether there is one. Those
/// in `kept` are not refilled.
fn hand_one(
    state: &mut State,
    kept: &BTreeSet<WorkerId>,
    now: Duration,
    effects: &mut Effects,
) -> bool {
    let mut free = free_workers(state, kept);
    let first = free.first().and_then(|first| state.workers.get(first));
    if !checks::any_wait(state) && first.is_some_and(|first| state.is_sound(first)) {
        // What one of them may not have, no other may.
        free.truncate(1);
    }
    free.into_iter().any(|worker| {
        checks::hand_check(state, worker, now, effects) || hand_batch(state, worker, now, effects)
    })
}

/// The workers with credit, those that hold least first; of equal ones the first. Those on probation
/// come last, and only if they hold nothing.
pub(super) fn free_workers(state: &State, kept: &BTreeSet<WorkerId>) -> Vec<WorkerId> {
    let exclusive = |worker| state.held_for(worker, Purpose::Exclusive).next().is_some();
    let free = state
        .workers
        .iter()
        .filter(|(id, worker)| !worker.draining && !kept.contains(id))
        .filter(|(_, worker)| !exclusive(worker))
        .map(|(id, worker)| {
            (!state.is_sound(worker), held(state, worker), worker.in_flight.len(), *id)
        });
    let mut free: Vec<(bool, usize, usize, WorkerId)> = free.collect();
    free.sort_unstable();
    let most = |on_probation| if on_probation { 1 } else { BATCHES_IN_FLIGHT_MAX };
    let free = free.into_iter().filter(|(on_probation, held, ..)| *held < most(*on_probation));
    free.map(|(.., worker)| worker).collect()
}

/// Batches that a worker holds, what is done ahead aside.
pub(super) fn held(state: &State, worker: &Worker) -> usize {
    worker.in_flight.len() - state.held_for(worker, Purpose::Speculative).count()
}

/// Gives a worker a batch of the job whose turn it is.
fn hand_batch(state: &mut State, worker: WorkerId, now: Duration, effects: &mut Effects) -> bool {
    let Some(job) = next_job(state) else {
        return false;
    };
    let Some(Stage::Computing(evaluation)) = state.jobs.get(&job).map(|job| &job.stage) else {
        return false;
    };
    let Some(attached) = state.workers.get(&worker) else {
        return false;
    };
    let size = if state.is_sound(attached) {
        batch_size(state, attached, job, evaluation.queued())
    } else if !state.probation.rests(&attached.name, now) || !state.answers_batches(|_| true) {
        1
    } else {
        return false;
    };
    let Some(evaluation) = state.evaluation_mut(job) else {
        return false;
    };
    let round = evaluation.round;
    let Some(indices) = evaluation.take(size) else {
        return false;
    };
    state.last_served = Some(job);
    let assignment = Assignment { job, round, indices };
    let batch = send(state, worker, assignment, Purpose::Fill, now, effects);
    if let Some(batch) = batch {
        charge(state, batch);
    }
    true
}

/// Of the active jobs with work: of the client that has had least computing time those with the
/// highest priority, and of these the first after the one that was served last, in a circle.
pub(super) fn next_job(state: &State) -> Option<JobId> {
    let with_work = state.active.iter().filter_map(|id| {
        let job = state.jobs.get(id)?;
        match &job.stage {
            Stage::Computing(evaluation) if !evaluation.queue.is_empty() => Some((*id, job)),
            _ => None,
        }
    });
    let rank = |(id, job): (JobId, &Job)| {
        let JobRecord { client, priority, .. } = &job.record;
        let had = state.shares.used(client);
        let served = state.last_served.is_some_and(|last| id <= last);
        (had, client.clone(), Reverse(*priority), served, id)
    };
    with_work.map(rank).min().map(|(.., id)| id)
}

/// Charges the client of a batch for the time that it will take, as far as that is known.
pub(super) fn charge(state: &mut State, id: BatchId) {
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
    batch.charged = fairness::thread_time(seconds, worker.hello.threads);
    state.shares.charge(&job.record.client, batch.charged);
}

/// Realizations of `job`, of which `queued` are left, that `attached` should get at once: what it
/// computes in the target time, at most a quarter of its share. Both limits give way to one
/// realization for each thread (a realization may take longer than the target, and a share may
/// hold fewer than four for each thread), the share itself does not.
pub(super) fn batch_size(state: &State, attached: &Worker, job: JobId, queued: u64) -> u64 {
    let per_thread = mean_rate_per_thread(state, job);
    let weight = |worker: &Worker| {
        worker.rates.get(&job).copied().unwrap_or(f64::from(worker.hello.threads) * per_thread)
    };
    let total: f64 = state.workers.values().filter(|it| state.is_sound(it)).map(weight).sum();
    let share = queued as f64 * weight(attached) / total;
    let threads = f64::from(attached.hello.threads);
    let most = (share / SHARE_DIVISOR).max(threads.min(share)).ceil();
    let target = match attached.rates.get(&job) {
        Some(rate) => rate * state.config.batch_target.as_secs_f64(),
        None => f64::from(FIRST_BATCH_PER_THREAD) * threads,
    };
    // `as` saturates, and takes NaN for 0.
    (target.max(threads).min(most) as u64).clamp(1, BATCH_REALIZATIONS_MAX.into())
}

/// Mean rate of one thread at `job` over the workers that are measured; 1 if none is.
fn mean_rate_per_thread(state: &State, job: JobId) -> f64 {
    let measured = state
        .workers
        .values()
        .filter_map(|worker| Some((*worker.rates.get(&job)?, f64::from(worker.hello.threads))));
    let (rates, threads) = measured.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    if threads > 0.0 { rates / threads } else { 1.0 }
}

/// Sends a batch to a worker; its number, if its evaluation is under way.
pub(super) fn send(
    state: &mut State,
    worker: WorkerId,
    assignment: Assignment,
    purpose: Purpose,
    now: Duration,
    effects: &mut Effects,
) -> Option<BatchId> {
    let work = state.work(&assignment)?;
    ahead::make_way(state, worker, assignment.indices.count, now, effects);
    let id = BatchId(state.next_batch);
    state.next_batch += 1;
    let batch = Batch {
        assignment,
        purpose,
        worker,
        sent: now,
        begun: now,
        charged: Duration::ZERO,
        duplicates: Vec::new(),
        retries: 0,
    };
    state.batches.insert(id, batch);
    if let Some(worker) = state.workers.get_mut(&worker) {
        worker.in_flight.push(id);
    }
    effects.push(Effect::Send { worker, batch: id, work });
    Some(id)
}
