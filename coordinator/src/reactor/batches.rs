//! Answers to batches, and batches whose worker is lost.

use std::time::Duration;

use osteon_common::outcome::Solved;

use super::{Effects, checks, jobs, overdue, workers};
use crate::effect::{CloseReason, Effect};
use crate::fairness;
use crate::ids::{BatchId, JobId, WorkerId};
use crate::losses::{Cause, Loss};
use crate::state::{Ahead, Assignment, Batch, Job, Purpose, State};
use crate::worker_name::WorkerName;

/// Weight of the newest measurement in a worker's rate.
const RATE_WEIGHT: f64 = 0.5;
/// A shorter computing time than this is not believed, s.
const ELAPSED_MIN_S: f64 = 1e-6;

/// Takes a worker's answer. Of a batch that was settled before (a copy was faster, or the answer
/// came twice) it is only compared with what is known; of an unknown batch it means nothing.
pub(super) fn answered(
    state: &mut State,
    worker: WorkerId,
    batch: BatchId,
    solved: Vec<Solved>,
    elapsed_s: f64,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(attached) = state.workers.get_mut(&worker) else {
        return;
    };
    attached.heard = now;
    attached.answered = now;
    attached.rate.add(solved.len() as u64, now);
    let name = attached.name.clone();
    let held = state.batches.get(&batch).filter(|held| held.worker == worker);
    let late = || attached.settled.iter().find(|(id, _)| *id == batch).map(|(_, about)| *about);
    let Some(assignment) = held.map(|held| held.assignment).or_else(late) else {
        return;
    };
    let (purpose, twins) = held.map(|held| (held.purpose, held.duplicates.clone())).unzip();
    let twins = twins.unwrap_or_default();
    let (found, expected) = (solved.len(), assignment.indices.count);
    if found as u64 != expected {
        let reason = CloseReason::WrongCount { batch, found, expected };
        workers::close(state, worker, reason, now, effects);
        return;
    }
    state.prove(worker);
    if purpose.is_some() {
        overdue::answered(state, worker, batch, now);
    }
    match purpose {
        Some(Purpose::Fill | Purpose::Exclusive | Purpose::Speculative) => {
            if let Some(held) = state.settle(batch) {
                measure(state, &held, elapsed_s, now);
            }
            take_back(state, twins, now, effects);
            fill(state, &assignment, &solved, &name, now);
            checks::audit(state, &assignment, &name);
        }
        Some(Purpose::Audit { .. }) => {
            state.settle(batch);
            take_back(state, twins, now, effects);
            checks::compare(state, &assignment, &solved, &name, now, effects);
        }
        Some(Purpose::TieBreak) => {
            take_back(state, twins, now, effects);
            checks::judged(state, batch, &assignment, solved, &name, now, effects);
        }
        None => checks::compare(state, &assignment, &solved, &name, now, effects),
    }
    jobs::store_if_complete(state, assignment.job, now, effects);
    workers::dismiss_if_drained(state, worker, now, effects);
}

/// Takes back the copies of a batch that is answered.
fn take_back(state: &mut State, copies: Vec<BatchId>, now: Duration, effects: &mut Effects) {
    for copy in copies {
        overdue::missed(state, copy, now);
        revoke(state, copy, now, effects);
    }
}

/// Takes back a batch, telling its worker to forget it.
pub(super) fn revoke(state: &mut State, batch: BatchId, now: Duration, effects: &mut Effects) {
    if let Some(revoked) = state.settle(batch) {
        effects.push(Effect::Revoke { worker: revoked.worker, batch });
        workers::dismiss_if_drained(state, revoked.worker, now, effects);
    }
}

/// Takes back every batch of a job, and drops what it is ahead with.
pub(super) fn revoke_all(state: &mut State, job: JobId, now: Duration, effects: &mut Effects) {
    let of_job = state.batches.iter().filter(|(_, batch)| batch.assignment.job == job);
    let batches: Vec<BatchId> = of_job.map(|(id, _)| *id).collect();
    for batch in batches {
        revoke(state, batch, now, effects);
    }
    if let Some(job) = state.jobs.get_mut(&job) {
        job.ahead = Ahead::default();
    }
}

/// Hands the indices of a lost worker's batch back, unless a copy of it lives.
pub(super) fn orphaned(state: &mut State, batch: BatchId, loss: &Loss) {
    let assignment = state.batches.get(&batch).map(|batch| (batch.purpose, batch.assignment));
    if let Some((Purpose::TieBreak, assignment)) = assignment {
        checks::judge_lost(state, &assignment, batch, loss);
    }
    let Some(settled) = state.settle(batch) else {
        return;
    };
    if !settled.purpose.fills() {
        checks::orphaned(state, &settled, loss);
        return;
    }
    let Batch { assignment, purpose, duplicates, .. } = settled;
    let Some(evaluation) = state.attempt_mut(&assignment) else {
        return;
    };
    let indices = assignment.indices;
    evaluation.lost_over |= loss.cause != Cause::Announced;
    if !duplicates.is_empty() {
        if purpose == Purpose::Exclusive {
            evaluation.blame(indices.first, loss);
        }
        return;
    }
    if indices.count > 1 || loss.cause == Cause::Announced {
        evaluation.put_back_in_halves(indices);
    } else {
        evaluation.suspect(indices.first, loss);
    }
}

fn fill(
    state: &mut State,
    assignment: &Assignment,
    solved: &[Solved],
    by: &WorkerName,
    now: Duration,
) {
    let Some(evaluation) = state.attempt_mut(assignment) else {
        return;
    };
    let before = evaluation.filled();
    evaluation.fill(assignment.indices, solved, by);
    let news = evaluation.filled() - before;
    let asked_for =
        |job: &&mut Job| job.evaluation().is_some_and(|it| it.round == assignment.round);
    if let Some(job) = state.jobs.get_mut(&assignment.job).filter(asked_for) {
        job.rate.add(news, now);
        job.progressed = now;
    }
    state.changed.insert(assignment.job);
}

/// Learns from an answer how fast its worker is at its job.
fn measure(state: &mut State, batch: &Batch, elapsed_s: f64, now: Duration) {
    let believed = elapsed_s.is_finite() && elapsed_s >= ELAPSED_MIN_S;
    let waited_s = now.saturating_sub(batch.sent).as_secs_f64().max(ELAPSED_MIN_S);
    let rate = batch.assignment.indices.count as f64 / if believed { elapsed_s } else { waited_s };
    let Some(worker) = state.workers.get_mut(&batch.worker) else {
        return;
    };
    let known = worker.rates.entry(batch.assignment.job).or_insert(rate);
    *known += RATE_WEIGHT * (rate - *known);
    let count = batch.assignment.indices.count;
    let seconds = count as f64 / rate;
    let threads = worker.hello.threads;
    let took = fairness::thread_time(seconds, threads);
    if let Some(job) = state.jobs.get_mut(&batch.assignment.job) {
        // Whatever a worker says, it has not computed for longer than it was waited for.
        job.pace.learn(count, threads, seconds.min(waited_s));
    }
    if let Some(job) =
        state.jobs.get(&batch.assignment.job).filter(|_| batch.purpose != Purpose::Speculative)
    {
        state.shares.correct(&job.record.client, batch.charged, took);
    }
}
