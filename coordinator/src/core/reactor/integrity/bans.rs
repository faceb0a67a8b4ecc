//! Bans of hosts whose workers return wrong answers: they are refused until an operator lifts the ban, and
//! the evaluations with their answers are computed again.

use crate::core::close_reason::CloseReason;
use crate::core::effect::{Effect, Record};
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::{JobId, WorkerId};
use crate::core::job::{After, Settled, Stage};
use crate::core::reactor::dispatch::{ahead, batches, speculation};
use crate::core::reactor::lifecycle::{jobs, records, replay, workers};
use crate::core::reactor::turn::Turn;
use crate::core::state::Banned;
use crate::core::worker_name::WorkerName;
use crate::store::BanRecord;

/// Bans the host of a worker for a wrong answer found in `job`; `reason` completes the sentence "it …".
pub(crate) fn ban(turn: &mut Turn, name: &WorkerName, job: JobId, reason: String) {
    let host = name.host();
    if turn.state.ban(host).is_some() {
        return;
    }
    tracing::error!(host, worker = %name, %job, %reason, "a host is banned");
    let number = turn.state.banned.last().map_or(1, |last| last.record.number + 1);
    let worker = name.clone();
    let (reason, at, lifted) = (reason.clone(), turn.now, None);
    let record = BanRecord { number, worker, job, reason: reason.clone(), at, lifted };
    turn.effects.push(Effect::Store(Record::Ban(record.clone())));
    let store_at = Some(turn.now + turn.state.config.store_retry);
    turn.state.banned.push(Banned { record, store_at, refused: false });
    turn.state.proofs.withdraw(host);
    let unfinished: Vec<JobId> = turn.state.jobs.keys().copied().collect();
    for job in unfinished {
        forget(turn, job, host);
    }
    let stays = turn.state.workers.iter().filter(|(_, worker)| worker.name.host() == host);
    let stays: Vec<WorkerId> = stays.map(|(id, _)| *id).collect();
    for stay in stays {
        // Its batches are not to blame for the end of its stay.
        workers::begin_draining(turn.state, stay);
        let reason = CloseReason::Banned { host: host.to_owned(), reason: reason.clone() };
        workers::close(turn, stay, reason);
    }
}

/// Removes the answers of a host from a job.
fn forget(turn: &mut Turn, id: JobId, host: &str) {
    speculation::forget(turn, id, host);
    ahead::forget(turn, id, host);
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.saved.forget(host);
    turn.state.changed.insert(id);
    let contributed = WorkerName::any_of(&job.workers, host);
    match &mut job.stage {
        Stage::Computing(_)
        | Stage::Completing(_)
        | Stage::Replaying { .. }
        | Stage::StoringPrepared { after: After::Awaited { durable: true, .. }, .. }
            if contributed =>
        {
            jobs::restart(turn, id);
        }
        Stage::Computing(evaluation) if WorkerName::any_of(&evaluation.workers, host) => {
            compute_again(turn, id);
        }
        Stage::Completing(settled) if WorkerName::any_of(&settled.workers, host) => {
            compute_again(turn, id);
        }
        Stage::Computing(evaluation) => {
            let mut over = Vec::new();
            evaluation.disputes.retain_mut(|dispute| {
                let stays = dispute.forget(host);
                if !stays {
                    over.append(&mut dispute.tie_breakers);
                }
                stays
            });
            for tie_breaker in over {
                batches::revoke(turn, tie_breaker);
            }
        }
        Stage::StoringEvaluation { record, .. } => {
            job.restart_pending |= contributed || WorkerName::any_of(&record.workers, host);
            if job.restart_pending {
                // The search may continue elsewhere after its restart.
                speculation::drop_all(turn, id);
                ahead::drop_all(turn, id);
            }
        }
        Stage::StoringPrepared { records, .. } => {
            let of_records = records.iter().any(|it| WorkerName::any_of(&it.workers, host));
            job.restart_pending |= contributed || of_records;
            if job.restart_pending {
                ahead::drop_all(turn, id);
            }
        }
        Stage::StoringEnd(_) if contributed => {
            // An end on its way to the store may be durable already; only a refused one can be
            // taken back.
            let in_flight =
                job.store_retry.as_ref().is_none_or(|store_retry| store_retry.in_flight);
            job.restart_pending = true;
            if !in_flight {
                jobs::reopen(turn, id);
            }
        }
        Stage::StoringSubmission
        | Stage::Waiting
        | Stage::Replaying { .. }
        | Stage::Completing(_)
        | Stage::StoringEnd(_) => {}
    }
}

/// Restarts the evaluation of a job with a new attempt.
fn compute_again(turn: &mut Turn, id: JobId) {
    batches::revoke_all(turn, id);
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let realizations = job.record.specification.monte_carlo.realizations;
    let (number, point, stored) = match &mut job.stage {
        Stage::Computing(PendingEvaluation { number, point, stored, .. })
        | Stage::Completing(Settled { number, point, stored, .. }) => {
            (*number, *point, std::mem::take(stored))
        }
        _ => return,
    };
    let mut fresh = PendingEvaluation::new(number, attempt, point, realizations);
    fresh.stored = stored;
    job.stage = Stage::Computing(fresh);
}

/// Handles the report that the ban with this number is durable.
pub(crate) fn on_ban_stored(turn: &mut Turn, number: u64) {
    let found = turn.state.banned.iter_mut().find(|banned| banned.record.number == number);
    if let Some(banned) = found {
        banned.store_at = None;
        replay::continue_replays(turn);
    }
}

/// Handles the report that the ban with this number could not be stored; the write is repeated later.
pub(crate) fn on_ban_not_stored(turn: &mut Turn, number: u64, error: String) {
    let found = turn.state.banned.iter_mut().find(|banned| banned.record.number == number);
    if let Some(banned) = found {
        banned.refused = true;
        let since = banned.record.lifted.unwrap_or(banned.record.at);
        records::report_store_failure_if_persistent(turn, since, error);
    }
}

/// Repeats the writes of refused bans that are due.
pub(crate) fn store_again(turn: &mut Turn) {
    let retry_in = turn.state.config.store_retry;
    for banned in &mut turn.state.banned {
        // The store will report a write that is on its way. A second one could still be on its way
        // at the end of a shutdown.
        if banned.refused && banned.store_at.is_some_and(|at| turn.now >= at) {
            banned.store_at = Some(turn.now + retry_in);
            banned.refused = false;
            turn.effects.push(Effect::Store(Record::Ban(banned.record.clone())));
        }
    }
}
