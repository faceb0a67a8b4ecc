//! Replay: the stored evaluations of a job are read one by one and passed to its search, after a
//! restart and when a worker is banned whose answers are in them. An evaluation with answers of a
//! banned worker is computed again; if it changes, those after it in the store belong to another
//! path.

use super::{jobs, records};
use crate::core::effect::{Effect, Record};
use crate::core::evaluation::{PendingEvaluation, StoredRecord};
use crate::core::event::ReadFailure;
use crate::core::failure::RunFailure;
use crate::core::ids::JobId;
use crate::core::job::{After, Stage, StoreRetry};
use crate::core::reactor::turn::Turn;
use crate::store::EvaluationRecord;
use osteon_search::Step;

/// Continues replays that waited for a ban to be durable.
pub(crate) fn continue_replays(turn: &mut Turn) {
    if turn.state.has_pending_ban() {
        return;
    }
    for (&id, job) in &mut turn.state.jobs {
        if let Stage::Replaying { asked: asked @ false } = &mut job.stage {
            *asked = true;
            turn.effects.push(Effect::Read { job: id, number: job.search.evaluations() });
        }
    }
}

/// Takes in the stored record of an evaluation.
pub(crate) fn on_read(
    turn: &mut Turn,
    id: JobId,
    number: u64,
    found: Result<Option<EvaluationRecord>, ReadFailure>,
) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    // Anything else is the second answer to a repeated request.
    let wanted = matches!(job.stage, Stage::Replaying { asked: true });
    if !wanted || job.search.evaluations() != number {
        return;
    }
    match found {
        Ok(Some(record)) => {
            job.store_retry = None;
            replay(turn, id, record);
        }
        Ok(None) => jobs::fail(turn, id, &RunFailure::Missing { number }),
        Err(ReadFailure::Refused { error }) => retry_read_later(turn, id, error),
        Err(ReadFailure::Damaged) => recompute(turn, id),
    }
}

/// Computes an evaluation again whose record is damaged. A point has the same outcomes each time,
/// so the stored evaluations after it are on the same path, unless replay finds otherwise.
fn recompute(turn: &mut Turn, id: JobId) {
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.store_retry = None;
    job.last_progress = turn.now;
    turn.state.changed.insert(id);
    if job.cancelled {
        jobs::finish(turn, id, jobs::cancelled_ending());
        return;
    }
    match job.search.ask() {
        Step::Evaluate(point) => {
            let realizations = job.record.specification.monte_carlo.realizations;
            let number = job.search.evaluations();
            let mut evaluation = PendingEvaluation::new(number, attempt, point, realizations);
            evaluation.stored = StoredRecord::Damaged;
            job.stage = Stage::Computing(evaluation);
            job.recomputed = true;
        }
        Step::Done(ending) => jobs::finish(turn, id, ending),
    }
}

/// Schedules another read after the store could not be read. Reads are repeated for as long as
/// necessary, unless the job is cancelled.
fn retry_read_later(turn: &mut Turn, id: JobId, error: String) {
    let retry_at = turn.now + turn.state.config.store_retry;
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    if job.cancelled {
        // No more than the evaluations replayed so far can be known.
        jobs::finish(turn, id, jobs::cancelled_ending());
        return;
    }
    let since = job.store_retry.as_ref().map_or(turn.now, |store_retry| store_retry.since);
    job.store_retry = Some(StoreRetry { since, retry_at, error: error.clone(), in_flight: false });
    turn.state.changed.insert(id);
    records::report_store_failure_if_persistent(turn, since, error);
}

/// Passes a stored evaluation to the search, or has it computed again.
fn replay(turn: &mut Turn, id: JobId, record: EvaluationRecord) {
    let known = turn.state.jobs.get(&id).map(|job| &job.record);
    let is_doubtful = |job| record.workers.iter().any(|it| turn.state.is_doubtful(it, job));
    let doubtful = known.is_some_and(is_doubtful);
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    turn.state.changed.insert(id);
    job.last_progress = turn.now;
    let copy = job.recomputed.then(|| record.clone());
    let EvaluationRecord { number, point, outcomes, estimated_error, workers, .. } = record;
    if job.recomputed && job.search.expects(point).is_err() {
        // The damaged record held wrong outcomes, so the stored path ends here.
        end_path(turn, id);
    } else if doubtful && !job.cancelled {
        let realizations = job.record.specification.monte_carlo.realizations;
        match job.search.expects(point) {
            Ok(()) => {
                let mut evaluation = PendingEvaluation::new(number, attempt, point, realizations);
                evaluation.stored = StoredRecord::Outcomes(outcomes);
                job.stage = Stage::Computing(evaluation);
            }
            Err(error) => jobs::fail(turn, id, &error.into()),
        }
    } else if doubtful {
        // Only the evaluations replayed so far are known to be right.
        jobs::finish(turn, id, jobs::cancelled_ending());
    } else {
        match job.search.replay(point, outcomes, estimated_error) {
            Ok(()) => {
                job.received = copy;
                job.workers.extend(workers);
                jobs::advance(turn, id);
            }
            Err(error) => jobs::fail(turn, id, &error.into()),
        }
    }
}

/// Deletes the stored evaluations that the search will not come to, by storing the last one that it has
/// received once more: after a restart nobody would know that they belong to another path.
fn end_path(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.stored = job.search.evaluations();
    // Without any, the whole path is computed again, and its first evaluation replaces the stored one.
    let Some(last) = job.received.clone() else {
        jobs::advance(turn, id);
        return;
    };
    let records = vec![last];
    turn.effects.push(Effect::Store(Record::of_evaluations(records.clone(), true)));
    let after = After::Ready(Box::new(job.search.clone()));
    job.stage = Stage::StoringPrepared { records, deletes_later: true, after };
}
