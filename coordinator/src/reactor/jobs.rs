//! A job's way from acceptance to its end.

use std::cmp::Reverse;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::results::Status;
use osteon_common::version::Program;
use osteon_search::{Ending, Search, Step};

use super::{Effects, ahead, batches, expulsion, reread};
use crate::effect::{Answer, Effect, Record, Refusal};
use crate::event::RecordKey;
use crate::failure::Failure;
use crate::ids::JobId;
use crate::notice::Notice;
use crate::snapshot;
use crate::state::{EndedJob, Job, RequestName, Stage, State, Trouble};
use crate::store::{EndRecord, EvaluationRecord, JobRecord};

/// A record is durable: the job goes on.
pub(super) fn stored(
    state: &mut State,
    id: JobId,
    key: RecordKey,
    now: Duration,
    effects: &mut Effects,
) {
    if let RecordKey::Expulsion(number) = key {
        expulsion::stored(state, number, effects);
        return;
    }
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    match (key, &mut job.stage) {
        (RecordKey::Job, Stage::Accepting) => {
            job.stage = Stage::Waiting;
            job.trouble = None;
            state.waiting.push_back(id);
            effects.push(Effect::Note(accepted(&job.record)));
            for token in std::mem::take(&mut job.tokens) {
                effects.push(Effect::Answer { token, answer: Answer::Submitted(id) });
            }
            if has_room(state, id) {
                begin_waiting(state, now, effects);
            }
        }
        (RecordKey::Evaluation(number), Stage::Storing { record, is_last })
            if record.number == number =>
        {
            let (outcomes, estimated_error) = (record.outcomes.clone(), record.estimated_error);
            job.stored = if *is_last { number + 1 } else { job.stored.max(number + 1) };
            job.workers.append(&mut record.workers);
            job.trouble = None;
            job.search.tell(outcomes, estimated_error);
            if job.rewind {
                reread::rewind(state, id, now, effects);
            } else {
                advance(state, id, now, effects);
            }
        }
        (RecordKey::End, Stage::Finishing(_)) => {
            ended(state, id, now, effects);
            return;
        }
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
    if let RecordKey::Expulsion(number) = key {
        expulsion::store_failed(state, number, error, now, effects);
        return;
    }
    let retry_at = now + state.config.store_retry;
    let Some(job) = state.jobs.get_mut(&id).filter(|job| job.awaits() == Some(key)) else {
        return;
    };
    if matches!(job.stage, Stage::Accepting) {
        for token in std::mem::take(&mut job.tokens) {
            let answer = Answer::Refused(Refusal::Store { error: error.clone() });
            effects.push(Effect::Answer { token, answer });
        }
        if let Some(request) = RequestName::of(&job.record) {
            state.requests.remove(&request);
        }
        state.jobs.remove(&id);
        return;
    }
    let since = job.trouble.as_ref().map_or(now, |trouble| trouble.since);
    job.trouble = Some(Trouble { since, retry_at, error: error.clone(), on_its_way: false });
    state.changed.insert(id);
    if job.rewind && matches!(job.stage, Stage::Finishing(_)) {
        reopen(state, id, now, effects);
    }
    despair_if_late(state, since, error, now, effects);
}

/// Says that the store takes or gives nothing any more, once it has refused for too long.
pub(super) fn despair_if_late(
    state: &State,
    since: Duration,
    error: String,
    now: Duration,
    effects: &mut Effects,
) {
    let waited = now.saturating_sub(since);
    if state.config.store_patience.is_some_and(|patience| waited >= patience) {
        effects.push(Effect::Despair { error, waited });
    }
}

/// Writes the present record of a job again, or asks again for the one it reads.
pub(super) fn store_again(job: &mut Job, effects: &mut Effects) {
    effects.push(match &job.stage {
        Stage::Storing { record, is_last } => {
            let record = record.clone();
            Effect::Store(Record::Evaluation { record, is_last: *is_last })
        }
        Stage::Finishing(end) => {
            let summary = Arc::new(job.search.summary());
            Effect::Store(Record::End { end: end.clone(), summary })
        }
        Stage::Rereading { asked: true } => {
            Effect::Read { job: job.record.job, number: job.search.evaluations() }
        }
        Stage::Accepting
        | Stage::Waiting
        | Stage::Rereading { asked: false }
        | Stage::Computing(_) => return,
    });
}

/// Stores the evaluation of a job once it is complete and checked.
pub(super) fn store_if_complete(
    state: &mut State,
    id: JobId,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let Stage::Computing(evaluation) = &mut job.stage else {
        return;
    };
    let Some((outcomes, estimated_error)) = evaluation.complete() else {
        return;
    };
    let (number, point) = (evaluation.number, evaluation.point);
    // Only what was there and is the same leaves the path behind it as it was.
    let is_last = evaluation.changes(&outcomes);
    let workers = std::mem::take(&mut evaluation.workers).into_iter().collect();
    let record = EvaluationRecord { job: id, number, point, outcomes, estimated_error, workers };
    effects.push(Effect::Store(Record::Evaluation { record: record.clone(), is_last }));
    let outcomes = record.outcomes.clone();
    job.stage = Stage::Storing { record, is_last };
    if is_last {
        ahead::prepare(state, id, &outcomes, now, effects);
    }
}

/// Ends a job because of `failure`.
pub(super) fn fail(
    state: &mut State,
    id: JobId,
    failure: &Failure,
    now: Duration,
    effects: &mut Effects,
) {
    let ending = Ending {
        status: Status::Failed,
        failure: Some(failure.kind()),
        reason: Some(failure.to_string()),
    };
    finish(state, id, ending, now, effects);
}

/// Ends a job for a client, at once or as soon as what is being stored is stored.
pub(super) fn cancel(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    job.cancelled = true;
    match job.stage {
        Stage::Waiting if job.stored > 0 => {
            // What it leaves is in the store: nothing of it is computed, it waits for nobody.
            begin(state, id, now, effects);
        }
        Stage::Waiting | Stage::Computing(_) => finish(state, id, cancelled(), now, effects),
        // The store does not give what it would leave besides.
        Stage::Rereading { .. } if job.trouble.is_some() => {
            finish(state, id, cancelled(), now, effects);
        }
        Stage::Accepting
        | Stage::Rereading { .. }
        | Stage::Storing { .. }
        | Stage::Finishing(_) => {}
    }
}

/// Begins waiting jobs while there is room: of the clients with the fewest active jobs, the
/// highest priority first, of equal ones the oldest. A client without any active job finds room
/// beyond the usual, so that no other client keeps it waiting.
pub(super) fn begin_waiting(state: &mut State, now: Duration, effects: &mut Effects) {
    while !state.waiting.is_empty() && !state.draining {
        let Some(id) = next_waiting(state).filter(|job| has_room(state, *job)) else {
            return;
        };
        begin(state, id, now, effects);
    }
}

/// Whether a waiting job may begin: there is room for its evaluation, and a place.
fn has_room(state: &State, id: JobId) -> bool {
    let realizations = |id: &JobId| {
        let job = state.jobs.get(id);
        job.map_or(0, |job| job.record.specification.monte_carlo.realizations)
    };
    let Some(job) = state.jobs.get(&id) else {
        return false;
    };
    let beyond = if state.shares.jobs(&job.record.client) == 0 { 2 } else { 1 };
    let active = state.active.iter().map(realizations).sum::<u64>();
    let fits =
        active == 0 || active + realizations(&id) <= beyond * state.config.active_realizations_max;
    fits && (state.active.len() as u64) < beyond * state.config.active_jobs_max as u64
}

/// The job that begins next.
fn next_waiting(state: &State) -> Option<JobId> {
    let waiting = state.waiting.iter().filter_map(|id| Some((*id, state.jobs.get(id)?)));
    let rank = |(id, job): &(JobId, &Job)| {
        let JobRecord { client, priority, .. } = &job.record;
        (state.shares.jobs(client), Reverse(*priority), *id)
    };
    waiting.min_by_key(rank).map(|(id, _)| id)
}

/// Begins a waiting job.
fn begin(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    state.waiting.retain(|waiting| *waiting != id);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.progressed = now;
        state.shares.begin(&job.record.client);
        state.active.insert(id);
        effects.push(Effect::Note(Notice::JobStarted { job: id, stored: job.stored }));
        ahead::keep_bound(state, now, effects);
        advance(state, id, now, effects);
    }
}

/// Goes where the search wants to go, after it was told what the store has.
pub(super) fn advance(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    state.changed.insert(id);
    if job.search.evaluations() < job.stored {
        reread::read_next(state, id, effects);
        return;
    }
    let ending = match job.search.ask() {
        Step::Evaluate(_) if job.cancelled => cancelled(),
        Step::Evaluate(point) => {
            ahead::begin(state, id, point, now, effects);
            return;
        }
        Step::Done(ending) => ending,
    };
    finish(state, id, ending, now, effects);
}

/// Stores the end of a job; the world hears of it when it is durable.
pub(super) fn finish(
    state: &mut State,
    id: JobId,
    ending: Ending,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let search = &job.search;
    // Of groups none is the job's.
    let best = search.best().filter(|_| !search.is_grouped());
    let program = Program::this(state.config.commit);
    let record = EndRecord::new(id, ending, program, now, search.evaluations(), best);
    let summary = Arc::new(search.summary());
    effects.push(Effect::Store(Record::End { end: record.clone(), summary }));
    job.stage = Stage::Finishing(record);
    job.trouble = None;
    leave(state, id, now, effects);
}

/// Takes back an end that is not durable and not on its way to be: its answers are not to be
/// relied on. The job waits for its turn and reads its stored evaluations again.
pub(super) fn reopen(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    job.trouble = None;
    job.rewind = false;
    job.workers.clear();
    job.search = Search::new(job.record.specification.clone());
    job.stage = Stage::Waiting;
    state.waiting.push_back(id);
    begin_waiting(state, now, effects);
}

/// Takes a job out of everything that concerns jobs under way.
fn leave(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    if state.active.remove(&id)
        && let Some(job) = state.jobs.get(&id)
    {
        state.shares.end(&job.record.client);
    }
    state.waiting.retain(|waiting| *waiting != id);
    state.changed.insert(id);
    batches::revoke_all(state, id, now, effects);
    for worker in state.workers.values_mut() {
        worker.rates.remove(&id);
    }
    begin_waiting(state, now, effects);
}

/// The end of a job is durable.
fn ended(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    let Some(Job { record, stage: Stage::Finishing(end), tokens, sequence, .. }) =
        state.jobs.remove(&id)
    else {
        return;
    };
    effects.push(Effect::Note(Notice::JobEnded {
        job: id,
        client: record.client.clone(),
        kind: record.specification.kind,
        ending: end.ending.clone(),
        evaluations: end.evaluations,
        elapsed: end.ended.saturating_sub(record.accepted),
    }));
    state.ended.insert(id, EndedJob::new(&record, end, sequence));
    state.changed.remove(&id);
    let Some(snapshot) = snapshot::of(state, id, now) else {
        return;
    };
    for token in tokens {
        let answer = Answer::Snapshot(snapshot.clone());
        effects.push(Effect::Answer { token, answer });
    }
    // At once, and not when the others are published: somebody waits for it.
    effects.push(Effect::Publish { job: id, snapshot });
}

fn accepted(record: &JobRecord) -> Notice {
    Notice::JobAccepted {
        job: record.job,
        client: record.client.clone(),
        name: record.name.clone(),
        kind: record.specification.kind,
        priority: record.priority,
    }
}

/// The end of a job whose client does not want it any more.
pub(super) fn cancelled() -> Ending {
    Ending { status: Status::Cancelled, failure: None, reason: None }
}

impl Job {
    /// The record whose report the job waits for.
    fn awaits(&self) -> Option<RecordKey> {
        match &self.stage {
            Stage::Accepting => Some(RecordKey::Job),
            Stage::Storing { record, .. } => Some(RecordKey::Evaluation(record.number)),
            Stage::Finishing(_) => Some(RecordKey::End),
            Stage::Waiting | Stage::Rereading { .. } | Stage::Computing(_) => None,
        }
    }
}
