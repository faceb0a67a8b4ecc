//! Replay: stored evaluations of a job are read one by one and told to its search, after a restart, and when
//! a worker is banned whose answers are in them. An evaluation with answers of a banned
//! worker is computed again; if it changes, those after it in the store belong to another path.

use super::{jobs, records};
use crate::effect::Effect;
use crate::evaluation::{Before, Evaluation};
use crate::event::Unread;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::job::{Stage, Trouble};
use crate::reactor::turn::Turn;
use crate::store::EvaluationRecord;
use osteon_search::Step;

/// Lets jobs read on that waited for a ban to be durable.
pub(crate) fn read_on(turn: &mut Turn) {
    if turn.state.ban_pending() {
        return;
    }
    for (&id, job) in &mut turn.state.jobs {
        if let Stage::Replaying { asked: asked @ false } = &mut job.stage {
            *asked = true;
            turn.effects.push(Effect::Read { job: id, number: job.search.evaluations() });
        }
    }
}

/// Takes what the store has of an evaluation.
pub(crate) fn read(
    turn: &mut Turn,
    id: JobId,
    number: u64,
    found: Result<Option<EvaluationRecord>, Unread>,
) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    // Anything else is an answer to a question that was asked twice.
    let wanted = matches!(job.stage, Stage::Replaying { asked: true });
    if !wanted || job.search.evaluations() != number {
        return;
    }
    match found {
        Ok(Some(record)) => {
            job.trouble = None;
            replay(turn, id, record);
        }
        Ok(None) => jobs::fail(turn, id, &Failure::Missing { number }),
        Err(Unread::Refused { error }) => read_failed(turn, id, error),
        Err(Unread::Damaged) => recompute(turn, id),
    }
}

/// Has an evaluation computed again whose record is damaged. A point's outcomes are the same each
/// time, so what is stored after it is on the same path, or is found not to be.
fn recompute(turn: &mut Turn, id: JobId) {
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.trouble = None;
    job.progressed = turn.now;
    turn.state.changed.insert(id);
    if job.cancelled {
        jobs::finish(turn, id, jobs::cancelled());
        return;
    }
    match job.search.ask() {
        Step::Evaluate(point) => {
            let realizations = job.record.specification.monte_carlo.realizations;
            let number = job.search.evaluations();
            let mut evaluation = Evaluation::new(number, attempt, point, realizations);
            evaluation.before = Before::Damaged;
            job.stage = Stage::Computing(evaluation);
            job.recomputed = true;
        }
        Step::Done(ending) => jobs::finish(turn, id, ending),
    }
}

/// The store cannot be read: it is tried again, for as long as it takes, unless nobody waits for it.
fn read_failed(turn: &mut Turn, id: JobId, error: String) {
    let retry_at = turn.now + turn.state.config.store_retry;
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    if job.cancelled {
        // What is told so far is all that can be known.
        jobs::finish(turn, id, jobs::cancelled());
        return;
    }
    let since = job.trouble.as_ref().map_or(turn.now, |trouble| trouble.since);
    job.trouble = Some(Trouble { since, retry_at, error: error.clone(), on_its_way: false });
    turn.state.changed.insert(id);
    records::despair_if_late(turn, since, error);
}

/// Tells a search what the store has of an evaluation, or has that computed again.
fn replay(turn: &mut Turn, id: JobId, record: EvaluationRecord) {
    let doubtful = record.workers.iter().any(|worker| turn.state.ban(worker).is_some());
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    turn.state.changed.insert(id);
    job.progressed = turn.now;
    let EvaluationRecord { number, point, outcomes, estimated_error, workers, .. } = record;
    if job.recomputed && job.search.expects(point).is_err() {
        // What was damaged had been computed wrongly, and this comes of it.
        job.stored = number;
        jobs::advance(turn, id);
    } else if doubtful && !job.cancelled {
        let realizations = job.record.specification.monte_carlo.realizations;
        match job.search.expects(point) {
            Ok(()) => {
                let mut evaluation = Evaluation::new(number, attempt, point, realizations);
                evaluation.before = Before::Stored(outcomes);
                job.stage = Stage::Computing(evaluation);
            }
            Err(error) => jobs::fail(turn, id, &error.into()),
        }
    } else if doubtful {
        // What is told so far is all that is known to be right.
        jobs::finish(turn, id, jobs::cancelled());
    } else {
        match job.search.retell(point, outcomes, estimated_error) {
            Ok(()) => {
                job.workers.extend(workers);
                jobs::advance(turn, id);
            }
            Err(error) => jobs::fail(turn, id, &error.into()),
        }
    }
}
