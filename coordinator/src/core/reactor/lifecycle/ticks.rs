//! Periodic work: expired leases, heartbeats, repeated writes and snapshots.

use std::time::Duration;

use super::{jobs, records, workers};
use crate::core::close_reason::CloseReason;
use crate::core::concerns;
use crate::core::effect::{Effect, Record};
use crate::core::ids::{JobId, WorkerId};
use crate::core::job::{Stage, sequence};
use crate::core::notice::Notice;
use crate::core::policy::{SAVE_AFTER, SAVE_EVERY, SAVED_AT_ONCE_MAX};
use crate::core::reactor::dispatch::{clearance, poison};
use crate::core::reactor::turn::Turn;
use crate::core::saved;
use crate::core::snapshot;
use crate::core::state::{AttachedWorker, State};

/// Interval at which unfinished jobs are published even if nothing but the time has changed.
const PUBLISH_EVERY: Duration = Duration::from_secs(1);

/// Excludes a gap in which this process did not run from all measured silences: messages that
/// arrived meanwhile have not been read yet.
pub(crate) fn compensate_gap(state: &mut State, now: Duration) {
    let gap = now.saturating_sub(std::mem::replace(&mut state.ticked, now));
    if gap <= state.config.heartbeat {
        return;
    }
    tracing::warn!(?gap, "the coordinator was paused; all leases are extended by the gap");
    let excuse = |since: &mut Duration| *since = (*since + gap).min(now);
    for worker in state.workers.values_mut() {
        excuse(&mut worker.last_seen);
        excuse(&mut worker.answered);
        excuse(&mut worker.missed.since);
    }
    for batch in state.batches.values_mut() {
        excuse(&mut batch.sent);
        excuse(&mut batch.begun);
    }
    for job in state.jobs.values_mut() {
        if let Some(retry) = &mut job.store_retry {
            excuse(&mut retry.since);
        }
        for evaluation in job.evaluations_mut() {
            evaluation.crashes.values_mut().for_each(|crashes| crashes.shift(excuse));
            for dispute in &mut evaluation.disputes {
                excuse(&mut dispute.since);
                dispute.crashes.shift(excuse);
            }
        }
    }
}

/// Ends the leases of workers that have been silent, or have not answered, for too long.
pub(crate) fn expire(turn: &mut Turn) {
    let expired: Vec<(WorkerId, CloseReason)> = turn
        .state
        .workers
        .iter()
        .filter_map(|(id, worker)| Some((*id, lease_end_reason(turn.state, worker, turn.now)?)))
        .collect();
    for (worker, reason) in expired {
        workers::close(turn, worker, reason);
    }
}

/// Returns the reason why the lease of a worker has ended, if it has.
fn lease_end_reason(state: &State, worker: &AttachedWorker, now: Duration) -> Option<CloseReason> {
    let silent = now.saturating_sub(worker.last_seen);
    if silent > state.config.expiry {
        return Some(CloseReason::Expired { silent });
    }
    let oldest = worker.in_flight.iter().filter_map(|held| state.batches.get(held));
    let since = oldest.map(|batch| batch.sent).min()?.max(worker.answered);
    let waited = now.saturating_sub(since);
    (waited > state.config.answer_timeout).then_some(CloseReason::Unanswering { waited })
}

/// Sends heartbeats to workers for which one is due.
pub(crate) fn send_heartbeats(turn: &mut Turn) {
    for (&id, worker) in &mut turn.state.workers {
        if turn.now.saturating_sub(worker.heartbeat_sent) >= turn.state.config.heartbeat {
            worker.heartbeat_sent = turn.now;
            turn.effects.push(Effect::Heartbeat { worker: id });
        }
    }
}

/// Fails jobs with poison realizations.
pub(crate) fn fail_poisoned(turn: &mut Turn) {
    poison::forget_old_crashes(turn.state, turn.now);
    let active: Vec<JobId> = turn.state.active.iter().copied().collect();
    for job in active {
        if let Some(failure) = poison::failure(turn.state, job, turn.now) {
            jobs::fail(turn, job, &failure);
        }
    }
}

/// Repeats the writes of refused records that are due.
pub(crate) fn store_again(turn: &mut Turn) {
    for job in turn.state.jobs.values_mut() {
        let Some(store_retry) = &mut job.store_retry else {
            continue;
        };
        if turn.now >= store_retry.retry_at && !store_retry.in_flight {
            store_retry.in_flight = true;
            records::store_again(job, &mut turn.effects);
        }
    }
}

/// Saves the results of evaluations that take long, or that wait long for their search; before a stop,
/// of all.
pub(crate) fn save_parts(turn: &mut Turn, before_stop: bool) {
    let now = turn.now;
    let age = if before_stop { Duration::ZERO } else { SAVE_AFTER };
    let most = if before_stop { u64::MAX } else { SAVED_AT_ONCE_MAX };
    for id in &turn.state.active {
        let unproven = clearance::unproven_attempts(turn.state, *id, now);
        let Some(job) = turn.state.jobs.get_mut(id) else {
            continue;
        };
        for evaluation in job.needed_evaluations_mut().filter(|it| !unproven.contains(&it.attempt))
        {
            let save_at = *evaluation.save_at.get_or_insert(now + SAVE_AFTER);
            if (before_stop || now >= save_at)
                && let Some(part) = saved::take_unsaved(evaluation, *id, most)
            {
                let next = if evaluation.unsaved.is_empty() { now + SAVE_EVERY } else { now };
                evaluation.save_at = Some(next);
                turn.effects.push(Effect::Store(Record::Part(part)));
            }
        }
        for mut complete in job.ahead.take_unsaved(now.saturating_sub(age)) {
            let part = saved::take_unsaved(&mut complete, *id, u64::MAX);
            turn.effects.extend(part.map(|part| Effect::Store(Record::Part(part))));
        }
    }
}

/// Stores pieces of large evaluations that have all their outcomes.
pub(crate) fn store_pieces(turn: &mut Turn) {
    for id in &turn.state.active {
        let Some(job) = turn.state.jobs.get_mut(id) else {
            continue;
        };
        // The numbers of evaluations that the search has not asked for may still change.
        if let Stage::Computing(evaluation) = &mut job.stage {
            let attempt = evaluation.attempt;
            let pieces = saved::take_pieces(evaluation, *id, job.search.observables()).into_iter();
            let stored = pieces.map(|record| Effect::Store(Record::Piece { record, attempt }));
            turn.effects.extend(stored);
        }
    }
}

/// Writes new warnings for the operator to the log.
pub(crate) fn tell_concerns(turn: &mut Turn) {
    if turn.now.saturating_sub(turn.state.condition.looked) < PUBLISH_EVERY {
        return;
    }
    turn.state.condition.looked = turn.now;
    let concerns = concerns::new_ones(turn.state, turn.now).into_iter();
    turn.effects.extend(concerns.map(|it| Effect::Note(Notice::Concern { text: it.to_string() })));
}

/// Publishes the jobs that changed, and periodically all unfinished ones.
pub(crate) fn publish(turn: &mut Turn) {
    if turn.now.saturating_sub(turn.state.published) >= PUBLISH_EVERY {
        turn.state.published = turn.now;
        turn.state.changed.extend(&turn.state.active);
        turn.state.changed.extend(&turn.state.waiting);
    }
    let changed: Vec<JobId> = std::mem::take(&mut turn.state.changed).into_iter().collect();
    for job in changed {
        if let Some(job) = turn.state.jobs.get_mut(&job) {
            job.sequence = sequence(job.sequence, turn.now);
        }
        if let Some(snapshot) = snapshot::job_snapshot(turn.state, job, turn.now) {
            turn.effects.push(Effect::Publish { job, snapshot });
        }
    }
}
