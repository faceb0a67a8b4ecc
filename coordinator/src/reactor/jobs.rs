//! A job's way from acceptance to its end.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::results::Status;

use super::{Effects, batches};
use crate::effect::{Answer, Effect, Record, Refusal};
use crate::evaluation::Evaluation;
use crate::event::RecordKey;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::search::{Ending, Search, Step, Summary};
use crate::snapshot;
use crate::state::{Job, Stage, State, Trouble};
use crate::store::{EndRecord, EvaluationRecord};

/// A record is durable: the job goes on.
pub(super) fn stored(
    state: &mut State,
    id: JobId,
    key: RecordKey,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    match (key, &mut job.stage) {
        (RecordKey::Job, Stage::Accepting) => {
            job.stage = Stage::Waiting;
            job.trouble = None;
            state.waiting.push_back(id);
            for token in std::mem::take(&mut job.tokens) {
                effects.push(Effect::Answer { token, answer: Answer::Submitted(id) });
            }
            begin_waiting(state, now, effects);
        }
        (RecordKey::Evaluation(number), Stage::Storing(record)) if record.number == number => {
            if let Some(search) = &mut job.search {
                search.tell(record.outcomes.clone(), record.estimated_error);
            }
            job.trouble = None;
            advance(state, id, now, effects);
        }
        (RecordKey::End, Stage::Finishing(_)) => ended(state, id, now, effects),
        // A report of a write that was repeated meanwhile.
        _ => {}
    }
    state.changed.insert(id);
}

/// A record could not be stored: a submission is refused, anything else is tried again, for as
/// long as it takes: what is not durable has not happened, and a job ends in no other way.
pub(super) fn store_failed(
    state: &mut State,
    id: JobId,
    key: RecordKey,
    error: String,
    now: Duration,
    effects: &mut Effects,
) {
    let retry_at = now + state.config.store_retry;
    let Some(job) = state.jobs.get_mut(&id).filter(|job| job.awaits() == Some(key)) else {
        return;
    };
    if matches!(job.stage, Stage::Accepting) {
        for token in std::mem::take(&mut job.tokens) {
            let answer = Answer::Refused(Refusal::Store { error: error.clone() });
            effects.push(Effect::Answer { token, answer });
        }
        state.requests.remove(&job.record.request_id);
        state.jobs.remove(&id);
        return;
    }
    let since = job.trouble.as_ref().map_or(now, |trouble| trouble.since);
    job.trouble = Some(Trouble { since, retry_at, error: error.clone() });
    state.changed.insert(id);
    let waited = now.saturating_sub(since);
    if state.config.store_patience.is_some_and(|patience| waited >= patience) {
        effects.push(Effect::Despair { error, waited });
    }
}

/// Writes the present record of a job again.
pub(super) fn store_again(job: &mut Job, effects: &mut Effects) {
    let record = match &job.stage {
        Stage::Storing(record) => Record::Evaluation(record.clone()),
        Stage::Finishing(end) => Record::End { end: end.clone(), summary: job.summary() },
        Stage::Accepting | Stage::Waiting | Stage::Computing(_) | Stage::Ended(_) => return,
    };
    effects.push(Effect::Store(record));
}

/// Stores the evaluation of a job once it is complete.
pub(super) fn store_if_complete(state: &mut State, id: JobId, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let Stage::Computing(evaluation) = &job.stage else {
        return;
    };
    let Some((outcomes, estimated_error)) = evaluation.complete() else {
        return;
    };
    let (number, point) = (evaluation.number, evaluation.point);
    let record = EvaluationRecord { job: id, number, point, outcomes, estimated_error };
    effects.push(Effect::Store(Record::Evaluation(record.clone())));
    job.stage = Stage::Storing(record);
}

/// Ends a job because of `failure`.
pub(super) fn fail(
    state: &mut State,
    id: JobId,
    failure: &Failure,
    now: Duration,
    effects: &mut Effects,
) {
    let ending = Ending { status: Status::Failed, reason: Some(failure.to_string()) };
    finish(state, id, ending, now, effects);
}

/// Ends a job for a client, at once or as soon as what is being stored is stored.
pub(super) fn cancel(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    job.cancelled = true;
    if matches!(job.stage, Stage::Waiting | Stage::Computing(_)) {
        finish(state, id, cancelled(), now, effects);
    }
}

/// Begins waiting jobs, oldest first, while there is room.
pub(super) fn begin_waiting(state: &mut State, now: Duration, effects: &mut Effects) {
    while state.active.len() < state.config.active_jobs_max && !state.draining {
        let Some(id) = state.waiting.pop_front() else {
            return;
        };
        let Some(job) = state.jobs.get_mut(&id) else {
            continue;
        };
        job.progressed = now;
        state.active.insert(id);
        advance(state, id, now, effects);
    }
}

/// Goes where the search wants to go.
fn advance(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let Some(search) = &job.search else {
        return;
    };
    let ending = match search.ask() {
        Step::Evaluate(_) if job.cancelled => cancelled(),
        Step::Evaluate(point) => {
            let realizations = job.record.specification.monte_carlo.realizations;
            let evaluation = Evaluation::new(search.evaluations(), point, realizations);
            job.stage = Stage::Computing(evaluation);
            state.changed.insert(id);
            return;
        }
        Step::Done(ending) => ending,
    };
    finish(state, id, ending, now, effects);
}

/// Stores the end of a job; the world hears of it when it is durable.
fn finish(state: &mut State, id: JobId, ending: Ending, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let record = job.end(ending, now);
    let summary = job.summary();
    effects.push(Effect::Store(Record::End { end: record.clone(), summary }));
    job.stage = Stage::Finishing(record);
    leave(state, id, now, effects);
}

/// Takes a job out of everything that concerns jobs under way.
fn leave(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    state.active.remove(&id);
    state.waiting.retain(|waiting| *waiting != id);
    state.changed.insert(id);
    // Those that wait are one nearer to their turn.
    state.changed.extend(&state.waiting);
    batches::revoke_all(state, id, now, effects);
    for worker in state.workers.values_mut() {
        worker.rates.remove(&id);
    }
    begin_waiting(state, now, effects);
}

/// The end of a job is durable.
fn ended(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    if let Stage::Finishing(record) = &job.stage {
        job.stage = Stage::Ended(record.clone());
        state.ended += 1;
        job.search = None;
        job.trouble = None;
    }
    for token in std::mem::take(&mut job.tokens) {
        if let Some(snapshot) = snapshot::of(state, id, now) {
            effects.push(Effect::Answer { token, answer: Answer::Snapshot(snapshot) });
        }
    }
}

fn cancelled() -> Ending {
    Ending { status: Status::Cancelled, reason: None }
}

impl Job {
    /// The record whose report the job waits for.
    fn awaits(&self) -> Option<RecordKey> {
        match &self.stage {
            Stage::Accepting => Some(RecordKey::Job),
            Stage::Storing(record) => Some(RecordKey::Evaluation(record.number)),
            Stage::Finishing(_) => Some(RecordKey::End),
            Stage::Waiting | Stage::Computing(_) | Stage::Ended(_) => None,
        }
    }

    /// What its path has come to.
    fn summary(&self) -> Arc<Summary> {
        Arc::new(self.search.as_ref().map_or_else(Summary::empty, Search::summary))
    }

    /// The record of the job's end.
    fn end(&self, ending: Ending, now: Duration) -> EndRecord {
        let search = self.search.as_ref();
        let best = search.and_then(Search::best);
        EndRecord::new(self.record.job, ending, now, search.map_or(0, Search::evaluations), best)
    }
}
