//! A worker that computes wrongly: refused from now on, and what it answered is computed again.

use std::time::Duration;

use super::{Effects, ahead, batches, jobs, reread, workers};
use crate::effect::{CloseReason, Effect, Record};
use crate::evaluation::Evaluation;
use crate::ids::{JobId, WorkerId};
use crate::state::{Expelled, Stage, State};
use crate::store::ExpulsionRecord;
use crate::worker_name::WorkerName;

/// Expels a worker for what was found in `job`; `reason` completes "it …".
pub(super) fn expel(
    state: &mut State,
    name: &WorkerName,
    job: JobId,
    reason: String,
    now: Duration,
    effects: &mut Effects,
) {
    if state.expulsion(name).is_some() {
        return;
    }
    tracing::error!(worker = %name, %job, %reason, "a worker is expelled");
    let number = state.expelled.last().map_or(1, |last| last.record.number + 1);
    let worker = name.clone();
    let record = ExpulsionRecord { number, worker, job, reason: reason.clone(), at: now };
    effects.push(Effect::Store(Record::Expulsion(record.clone())));
    let store_at = Some(now + state.config.store_retry);
    state.expelled.push(Expelled { record, store_at, refused: false });
    let unfinished: Vec<JobId> = state.jobs.keys().copied().collect();
    for job in unfinished {
        forget(state, job, name, now, effects);
    }
    let stays = state.workers.iter().filter(|(_, worker)| worker.name == *name);
    let stays: Vec<WorkerId> = stays.map(|(id, _)| *id).collect();
    for stay in stays {
        // A realization is not to blame for the end of such a worker.
        if let Some(worker) = state.workers.get_mut(&stay) {
            worker.draining = true;
        }
        let reason = CloseReason::Expelled { reason: reason.clone() };
        workers::close(state, stay, reason, now, effects);
    }
}

/// Takes the answers of a worker out of a job.
fn forget(state: &mut State, id: JobId, name: &WorkerName, now: Duration, effects: &mut Effects) {
    ahead::forget(state, id, name, now, effects);
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    state.changed.insert(id);
    let told = job.workers.contains(name);
    match &mut job.stage {
        Stage::Computing(_) | Stage::Rereading { .. } if told => {
            reread::rewind(state, id, now, effects);
        }
        Stage::Computing(evaluation) if evaluation.workers.contains(name) => {
            compute_again(state, id, now, effects);
        }
        Stage::Computing(evaluation) => {
            let mut over = Vec::new();
            evaluation.disputes.retain_mut(|dispute| {
                let stays = dispute.forget(name);
                if !stays {
                    over.append(&mut dispute.judges);
                }
                stays
            });
            for judge in over {
                batches::revoke(state, judge, now, effects);
            }
        }
        Stage::Storing { record, .. } => {
            job.rewind |= told || record.workers.contains(name);
            if job.rewind {
                // Where the search goes after that is another matter.
                ahead::drop_all(state, id, now, effects);
            }
        }
        Stage::Finishing(_) if told => {
            // What is on its way to the store as the end of a job has ended, unless it is refused.
            let on_its_way = job.trouble.as_ref().is_none_or(|trouble| trouble.on_its_way);
            job.rewind = true;
            if !on_its_way {
                jobs::reopen(state, id, now, effects);
            }
        }
        Stage::Accepting | Stage::Waiting | Stage::Rereading { .. } | Stage::Finishing(_) => {}
    }
}

/// Begins the evaluation of a job again, from nothing.
fn compute_again(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    batches::revoke_all(state, id, now, effects);
    let round = state.round();
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let realizations = job.record.specification.monte_carlo.realizations;
    if let Stage::Computing(evaluation) = &mut job.stage {
        let mut fresh = Evaluation::new(evaluation.number, round, evaluation.point, realizations);
        fresh.before = std::mem::take(&mut evaluation.before);
        *evaluation = fresh;
    }
}

/// The expulsion with this number is durable.
pub(super) fn stored(state: &mut State, number: u64, effects: &mut Effects) {
    let found = state.expelled.iter_mut().find(|expelled| expelled.record.number == number);
    if let Some(expelled) = found {
        expelled.store_at = None;
        reread::read_on(state, effects);
    }
}

/// The expulsion with this number could not be stored; it is tried again.
pub(super) fn store_failed(
    state: &mut State,
    number: u64,
    error: String,
    now: Duration,
    effects: &mut Effects,
) {
    let found = state.expelled.iter_mut().find(|expelled| expelled.record.number == number);
    if let Some(expelled) = found {
        expelled.refused = true;
        let since = expelled.record.at;
        jobs::despair_if_late(state, since, error, now, effects);
    }
}

/// Writes refused expulsions again whose time has come.
pub(super) fn store_again(state: &mut State, now: Duration, effects: &mut Effects) {
    let retry_in = state.config.store_retry;
    for expelled in &mut state.expelled {
        // What is on its way is reported; a second time it may still be on its way at the end.
        if expelled.refused && expelled.store_at.is_some_and(|at| now >= at) {
            expelled.store_at = Some(now + retry_in);
            expelled.refused = false;
            effects.push(Effect::Store(Record::Expulsion(expelled.record.clone())));
        }
    }
}
