//! What the passing of time brings: lost leases, signs of life, writes tried again, snapshots.

use std::time::Duration;

use super::{Effects, checks, expulsion, jobs, overdue, prune, suspects, workers};
use crate::effect::{CloseReason, Effect};
use crate::ids::{JobId, WorkerId};
use crate::snapshot;
use crate::state::{State, Worker, sequence};

/// Unfinished jobs are published this often even if nothing about them changed but time.
const PUBLISH_EVERY: Duration = Duration::from_secs(1);

pub(super) fn tick(state: &mut State, now: Duration, effects: &mut Effects) {
    excuse(state, now);
    expire(state, now, effects);
    beat(state, now, effects);
    overdue::tick(state, now, effects);
    checks::give_up(state, now, effects);
    if !state.draining {
        suspects::tick(state, now, effects);
        store_again(state, now, effects);
        expulsion::store_again(state, now, effects);
        prune::tick(state, now, effects);
    }
    publish(state, now, effects);
}

/// Takes time in which this process did not run out of all that silence is measured by: what came
/// meanwhile is not read yet.
fn excuse(state: &mut State, now: Duration) {
    let gap = now.saturating_sub(std::mem::replace(&mut state.ticked, now));
    if gap <= state.config.heartbeat {
        return;
    }
    tracing::warn!(?gap, "the coordinator stood still; nobody is blamed for it");
    let excused = |since: &mut Duration| *since = (*since + gap).min(now);
    for worker in state.workers.values_mut() {
        excused(&mut worker.heard);
        excused(&mut worker.answered);
        excused(&mut worker.missed.since);
    }
    for batch in state.batches.values_mut() {
        excused(&mut batch.sent);
        excused(&mut batch.begun);
    }
    for job in state.jobs.values_mut() {
        for evaluation in job.evaluations_mut() {
            evaluation.suspects.values_mut().for_each(|losses| losses.excuse(excused));
            for dispute in &mut evaluation.disputes {
                excused(&mut dispute.since);
                dispute.lost.excuse(excused);
            }
        }
    }
}

fn expire(state: &mut State, now: Duration, effects: &mut Effects) {
    let expired: Vec<(WorkerId, CloseReason)> = state
        .workers
        .iter()
        .filter_map(|(id, worker)| Some((*id, overdue(state, worker, now)?)))
        .collect();
    for (worker, reason) in expired {
        workers::close(state, worker, reason, now, effects);
    }
}

/// Why the lease of a worker has ended, if it has.
fn overdue(state: &State, worker: &Worker, now: Duration) -> Option<CloseReason> {
    let silent = now.saturating_sub(worker.heard);
    if silent > state.config.expiry {
        return Some(CloseReason::Expired { silent });
    }
    let oldest = worker.in_flight.iter().filter_map(|held| state.batches.get(held));
    let since = oldest.map(|batch| batch.sent).min()?.max(worker.answered);
    let waited = now.saturating_sub(since);
    (waited > state.config.answer_timeout).then_some(CloseReason::Unanswering { waited })
}

fn beat(state: &mut State, now: Duration, effects: &mut Effects) {
    for (&id, worker) in &mut state.workers {
        if now.saturating_sub(worker.beat) >= state.config.heartbeat {
            worker.beat = now;
            effects.push(Effect::Heartbeat { worker: id });
        }
    }
}

fn store_again(state: &mut State, now: Duration, effects: &mut Effects) {
    for job in state.jobs.values_mut() {
        let Some(trouble) = &mut job.trouble else {
            continue;
        };
        if now >= trouble.retry_at && !trouble.on_its_way {
            trouble.on_its_way = true;
            jobs::store_again(job, effects);
        }
    }
}

fn publish(state: &mut State, now: Duration, effects: &mut Effects) {
    if now.saturating_sub(state.published) >= PUBLISH_EVERY {
        state.published = now;
        state.changed.extend(&state.active);
        state.changed.extend(&state.waiting);
    }
    let changed: Vec<JobId> = std::mem::take(&mut state.changed).into_iter().collect();
    for job in changed {
        if let Some(job) = state.jobs.get_mut(&job) {
            job.sequence = sequence(job.sequence, now);
        }
        if let Some(snapshot) = snapshot::of(state, job, now) {
            effects.push(Effect::Publish { job, snapshot });
        }
    }
}
