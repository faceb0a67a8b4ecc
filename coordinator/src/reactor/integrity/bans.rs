//! Bans of workers that compute wrongly: such a worker is refused from now on, and what it answered
//! is computed again.

use crate::close_reason::CloseReason;
use crate::effect::{Effect, Record};
use crate::evaluation::Evaluation;
use crate::ids::{JobId, WorkerId};
use crate::job::Stage;
use crate::reactor::dispatch::{batches, speculation};
use crate::reactor::lifecycle::{jobs, records, replay, workers};
use crate::reactor::turn::Turn;
use crate::state::Banned;
use crate::store::BanRecord;
use crate::worker_name::WorkerName;

/// Bans a worker for what was found in `job`; `reason` completes "it …".
pub(crate) fn ban(turn: &mut Turn, name: &WorkerName, job: JobId, reason: String) {
    if turn.state.ban(name).is_some() {
        return;
    }
    tracing::error!(worker = %name, %job, %reason, "a worker is expelled");
    let number = turn.state.banned.last().map_or(1, |last| last.record.number + 1);
    let worker = name.clone();
    let record = BanRecord { number, worker, job, reason: reason.clone(), at: turn.now };
    turn.effects.push(Effect::Store(Record::Ban(record.clone())));
    let store_at = Some(turn.now + turn.state.config.store_retry);
    turn.state.banned.push(Banned { record, store_at, refused: false });
    let unfinished: Vec<JobId> = turn.state.jobs.keys().copied().collect();
    for job in unfinished {
        forget(turn, job, name);
    }
    let stays = turn.state.workers.iter().filter(|(_, worker)| worker.name == *name);
    let stays: Vec<WorkerId> = stays.map(|(id, _)| *id).collect();
    for stay in stays {
        // A realization is not to blame for the end of such a worker.
        if let Some(worker) = turn.state.workers.get_mut(&stay) {
            worker.draining = true;
        }
        let reason = CloseReason::Banned { reason: reason.clone() };
        workers::close(turn, stay, reason);
    }
}

/// Takes the answers of a worker out of a job.
fn forget(turn: &mut Turn, id: JobId, name: &WorkerName) {
    speculation::forget(turn, id, name);
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    turn.state.changed.insert(id);
    let contributed = job.workers.contains(name);
    match &mut job.stage {
        Stage::Computing(_) | Stage::Replaying { .. } if contributed => {
            jobs::restart(turn, id);
        }
        Stage::Computing(evaluation) if evaluation.workers.contains(name) => {
            compute_again(turn, id);
        }
        Stage::Computing(evaluation) => {
            let mut over = Vec::new();
            evaluation.disputes.retain_mut(|dispute| {
                let stays = dispute.forget(name);
                if !stays {
                    over.append(&mut dispute.tie_breakers);
                }
                stays
            });
            for tie_breaker in over {
                batches::revoke(turn, tie_breaker);
            }
        }
        Stage::Storing { record, .. } => {
            job.restart_pending |= contributed || record.workers.contains(name);
            if job.restart_pending {
                // Where the search goes after that is another matter.
                speculation::drop_all(turn, id);
            }
        }
        Stage::Finishing(_) if contributed => {
            // What is on its way to the store as the end of a job has ended, unless it is refused.
            let on_its_way = job.trouble.as_ref().is_none_or(|trouble| trouble.on_its_way);
            job.restart_pending = true;
            if !on_its_way {
                jobs::reopen(turn, id);
            }
        }
        Stage::Accepting | Stage::Waiting | Stage::Replaying { .. } | Stage::Finishing(_) => {}
    }
}

/// Begins the evaluation of a job again, from nothing.
fn compute_again(turn: &mut Turn, id: JobId) {
    batches::revoke_all(turn, id);
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let realizations = job.record.specification.monte_carlo.realizations;
    if let Stage::Computing(evaluation) = &mut job.stage {
        let mut fresh = Evaluation::new(evaluation.number, attempt, evaluation.point, realizations);
        fresh.before = std::mem::take(&mut evaluation.before);
        *evaluation = fresh;
    }
}

/// The ban with this number is durable.
pub(crate) fn stored(turn: &mut Turn, number: u64) {
    let found = turn.state.banned.iter_mut().find(|banned| banned.record.number == number);
    if let Some(banned) = found {
        banned.store_at = None;
        replay::read_on(turn);
    }
}

/// The ban with this number could not be stored; it is tried again.
pub(crate) fn store_failed(turn: &mut Turn, number: u64, error: String) {
    let found = turn.state.banned.iter_mut().find(|banned| banned.record.number == number);
    if let Some(banned) = found {
        banned.refused = true;
        let since = banned.record.at;
        records::despair_if_late(turn, since, error);
    }
}

/// Writes refused bans again whose time has come.
pub(crate) fn store_again(turn: &mut Turn) {
    let retry_in = turn.state.config.store_retry;
    for banned in &mut turn.state.banned {
        // What is on its way is reported; a second time it may still be on its way at the end.
        if banned.refused && banned.store_at.is_some_and(|at| turn.now >= at) {
            banned.store_at = Some(turn.now + retry_in);
            banned.refused = false;
            turn.effects.push(Effect::Store(Record::Ban(banned.record.clone())));
        }
    }
}
