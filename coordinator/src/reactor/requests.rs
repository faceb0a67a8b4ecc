//! What clients ask for.

use std::ops::Bound;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::limits::JOBS_MAX;
use osteon_common::version;

use super::{Effects, jobs};
use crate::effect::{Answer, Effect, Record, Refusal};
use crate::event::Request;
use crate::ids::{JobId, Token};
use crate::search::Search;
use crate::snapshot;
use crate::state::{Job, Stage, State};
use crate::store::JobRecord;

pub(super) fn requested(
    state: &mut State,
    token: Token,
    request: Request,
    now: Duration,
    effects: &mut Effects,
) {
    let answer = match request {
        Request::Submit { specification, request_id } => {
            match submit(state, token, specification, request_id, now, effects) {
                Ok(answer) => answer,
                Err(refusal) => Some(Answer::Refused(refusal)),
            }
        }
        Request::Get(job) => Some(get(state, job, now)),
        Request::List { after, limit } => Some(list(state, after, limit, now)),
        Request::Cancel(job) => cancel(state, token, job, now, effects),
        Request::Fetch(job) => Some(fetch(state, job)),
    };
    if let Some(answer) = answer {
        effects.push(Effect::Answer { token, answer });
    }
}

/// Accepts a job; the answer comes when it is durable.
fn submit(
    state: &mut State,
    token: Token,
    specification: Arc<JobSpecification>,
    request_id: String,
    now: Duration,
    effects: &mut Effects,
) -> Result<Option<Answer>, Refusal> {
    if state.draining {
        return Err(Refusal::Draining);
    }
    if let Some(known) = state.requests.get(&request_id) {
        return resubmit(state, token, *known, &specification, request_id);
    }
    if state.unfinished() >= JOBS_MAX {
        return Err(Refusal::TooManyJobs { limit: JOBS_MAX });
    }
    let id = JobId(state.next_job);
    state.next_job += 1;
    if !request_id.is_empty() {
        state.requests.insert(request_id.clone(), id);
    }
    let search = Search::new(specification.clone());
    let fingerprint = version::fingerprint();
    let record = JobRecord { job: id, request_id, specification, accepted: now, fingerprint };
    effects.push(Effect::Store(Record::Job(record.clone())));
    let mut job = Job::new(record, Stage::Accepting, Some(search), now);
    job.tokens.push(token);
    state.jobs.insert(id, job);
    Ok(None)
}

fn resubmit(
    state: &mut State,
    token: Token,
    id: JobId,
    specification: &JobSpecification,
    request_id: String,
) -> Result<Option<Answer>, Refusal> {
    match state.jobs.get_mut(&id) {
        Some(job) if *job.record.specification != *specification => {
            Err(Refusal::RequestIdTaken { request_id, job: id })
        }
        Some(job) if matches!(job.stage, Stage::Accepting) => {
            job.tokens.push(token);
            Ok(None)
        }
        _ => Ok(Some(Answer::Submitted(id))),
    }
}

fn get(state: &State, job: JobId, now: Duration) -> Answer {
    snapshot::of(state, job, now).map_or(Answer::Refused(Refusal::NoJob { job }), Answer::Snapshot)
}

fn list(state: &State, after: Option<JobId>, limit: usize, now: Duration) -> Answer {
    let from = after.map_or(Bound::Unbounded, Bound::Excluded);
    let mut listed = state
        .jobs
        .range((from, Bound::Unbounded))
        .filter_map(|(id, _)| Some((*id, snapshot::of(state, *id, now)?)));
    let page: Vec<_> = listed.by_ref().take(limit).collect();
    let more_after = listed.next().and_then(|_| page.last().map(|(id, _)| *id));
    Answer::Page { snapshots: page.into_iter().map(|(_, snapshot)| snapshot).collect(), more_after }
}

/// Cancels a job; the answer comes when its end is durable.
fn cancel(
    state: &mut State,
    token: Token,
    id: JobId,
    now: Duration,
    effects: &mut Effects,
) -> Option<Answer> {
    match state.jobs.get_mut(&id) {
        None => Some(Answer::Refused(Refusal::NoJob { job: id })),
        Some(job) => match &job.stage {
            Stage::Accepting => Some(Answer::Refused(Refusal::NoJob { job: id })),
            Stage::Ended(_) => Some(get(state, id, now)),
            Stage::Waiting | Stage::Computing(_) | Stage::Storing(_) | Stage::Finishing(_) => {
                job.tokens.push(token);
                jobs::cancel(state, id, now, effects);
                None
            }
        },
    }
}

fn fetch(state: &State, id: JobId) -> Answer {
    match state.jobs.get(&id).map(|job| (&job.record, &job.stage)) {
        None | Some((_, Stage::Accepting)) => Answer::Refused(Refusal::NoJob { job: id }),
        Some((record, Stage::Ended(end))) => {
            Answer::Ended { record: record.clone(), end: end.clone() }
        }
        Some(_) => Answer::Refused(Refusal::NotEnded { job: id }),
    }
}
