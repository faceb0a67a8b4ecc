//! Stored evaluations of a job, read one by one and told to its search: after a restart, and when
//! a worker is expelled whose answers are in them. An evaluation with answers of an expelled
//! worker is computed again; if it changes, those after it in the store belong to another path.

use std::time::Duration;

use osteon_search::{Search, Step};

use super::{Effects, batches, jobs};
use crate::effect::Effect;
use crate::evaluation::{Before, Evaluation};
use crate::event::Unread;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::state::{Expelled, Stage, State, Trouble};
use crate::store::EvaluationRecord;

/// Asks for the next stored evaluation of a job, unless an expulsion is not durable yet.
pub(super) fn read_next(state: &mut State, id: JobId, effects: &mut Effects) {
    let may = !expulsion_pending(&state.expelled);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.stage = Stage::Rereading { asked: may };
        if may {
            effects.push(Effect::Read { job: id, number: job.search.evaluations() });
        }
    }
}

/// An expulsion is durable: whoever waited for it reads on.
pub(super) fn read_on(state: &mut State, effects: &mut Effects) {
    if expulsion_pending(&state.expelled) {
        return;
    }
    for (&id, job) in &mut state.jobs {
        if let Stage::Rereading { asked: asked @ false } = &mut job.stage {
            *asked = true;
            effects.push(Effect::Read { job: id, number: job.search.evaluations() });
        }
    }
}

fn expulsion_pending(expelled: &[Expelled]) -> bool {
    expelled.iter().any(|expelled| expelled.store_at.is_some())
}

/// Takes what the store has of an evaluation.
pub(super) fn read(
    state: &mut State,
    id: JobId,
    number: u64,
    found: Result<Option<EvaluationRecord>, Unread>,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    // Anything else is an answer to a question that was asked twice.
    let wanted = matches!(job.stage, Stage::Rereading { asked: true });
    if !wanted || job.search.evaluations() != number {
        return;
    }
    match found {
        Ok(Some(record)) => {
            job.trouble = None;
            told(state, id, record, now, effects);
        }
        Ok(None) => jobs::fail(state, id, &Failure::Missing { number }, now, effects),
        Err(Unread::Refused { error }) => read_failed(state, id, error, now, effects),
        Err(Unread::Damaged) => mend(state, id, now, effects),
    }
}

/// Has an evaluation computed again whose record is damaged. A point's outcomes are the same each
/// time, so what is stored after it is on the same path, or is found not to be.
fn mend(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let round = state.round();
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    job.trouble = None;
    job.progressed = now;
    state.changed.insert(id);
    if job.cancelled {
        jobs::finish(state, id, jobs::cancelled(), now, effects);
        return;
    }
    match job.search.ask() {
        Step::Evaluate(point) => {
            let realizations = job.record.specification.monte_carlo.realizations;
            let number = job.search.evaluations();
            let mut evaluation = Evaluation::new(number, round, point, realizations);
            evaluation.before = Before::Damaged;
            job.stage = Stage::Computing(evaluation);
            job.mended = true;
        }
        Step::Done(ending) => jobs::finish(state, id, ending, now, effects),
    }
}

/// The store cannot be read: it is tried again, for as long as it takes, unless nobody waits for it.
fn read_failed(state: &mut State, id: JobId, error: String, now: Duration, effects: &mut Effects) {
    let retry_at = now + state.config.store_retry;
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    if job.cancelled {
        // What is told so far is all that can be known.
        jobs::finish(state, id, jobs::cancelled(), now, effects);
        return;
    }
    let since = job.trouble.as_ref().map_or(now, |trouble| trouble.since);
    job.trouble = Some(Trouble { since, retry_at, error: error.clone(), on_its_way: false });
    state.changed.insert(id);
    jobs::despair_if_late(state, since, error, now, effects);
}

/// Tells a search what the store has, or has it computed again.
fn told(
    state: &mut State,
    id: JobId,
    record: EvaluationRecord,
    now: Duration,
    effects: &mut Effects,
) {
    let doubtful = record.workers.iter().any(|worker| state.expulsion(worker).is_some());
    let round = state.round();
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    state.changed.insert(id);
    job.progressed = now;
    let EvaluationRecord { number, point, outcomes, estimated_error, workers, .. } = record;
    if job.mended && job.search.expects(point).is_err() {
        // What was damaged had been computed wrongly, and this comes of it.
        job.stored = number;
        jobs::advance(state, id, now, effects);
    } else if doubtful && !job.cancelled {
        let realizations = job.record.specification.monte_carlo.realizations;
        match job.search.expects(point) {
            Ok(()) => {
                let mut evaluation = Evaluation::new(number, round, point, realizations);
                evaluation.before = Before::Stored(outcomes);
                job.stage = Stage::Computing(evaluation);
            }
            Err(error) => jobs::fail(state, id, &error.into(), now, effects),
        }
    } else if doubtful {
        // What is told so far is all that is known to be right.
        jobs::finish(state, id, jobs::cancelled(), now, effects);
    } else {
        match job.search.retell(point, outcomes, estimated_error) {
            Ok(()) => {
                job.workers.extend(workers);
                jobs::advance(state, id, now, effects);
            }
            Err(error) => jobs::fail(state, id, &error.into(), now, effects),
        }
    }
}

/// Begins the search of an active job again, from its stored evaluations.
pub(super) fn rewind(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    batches::revoke_all(state, id, now, effects);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.rewind = false;
        job.workers.clear();
        job.search = Search::new(job.record.specification.clone());
        jobs::advance(state, id, now, effects);
    }
}
