//! Client requests.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::limits::{CLIENT_SHARE_DIVISOR, JOBS_MAX};
use osteon_common::version;

use super::{jobs, prune, recheck, workers};
use crate::core::concerns;
use crate::core::effect::{Answer, Effect, Record, Refusal};
use crate::core::event::Request;
use crate::core::explain;
use crate::core::explain::facts::JobFacts;
use crate::core::ids::{JobId, ReplyId, WorkerId};
use crate::core::job::{Job, RequestName, Stage, bytes, identity};
use crate::core::job_pages;
use crate::core::reactor::turn::Turn;
use crate::core::snapshot;
use crate::core::state::{Banned, State};
use crate::core::worker_list;
use crate::store::JobRecord;

/// Maximum number of banned workers that are listed.
const BANNED_SHOWN_MAX: usize = 1000;

pub(crate) fn handle_request(turn: &mut Turn, reply_id: ReplyId, request: Request) {
    let answer = match request {
        Request::Submit { specification, request_id, client, priority, name } => {
            let submission = SubmittedJob { specification, request_id, client, priority, name };
            match submit(turn, reply_id, submission) {
                Ok(answer) => answer,
                Err(refusal) => Some(Answer::Refused(refusal)),
            }
        }
        Request::Get(job) => Some(get(turn.state, job, turn.now)),
        Request::Explain(job) => Some(explain(turn.state, job, turn.now)),
        Request::Concerns => {
            let concerns = concerns::concerns(turn.state, turn.now);
            Some(Answer::Concerns(concerns.iter().map(ToString::to_string).collect()))
        }
        Request::List { after, limit } => {
            Some(job_pages::oldest_first(turn.state, after, limit, turn.now))
        }
        Request::Browse { which, before, limit } => {
            Some(job_pages::newest_first(turn.state, which, before, limit, turn.now))
        }
        Request::Follow { job, from, limit } => {
            Some(job_pages::search_rows(turn.state, job, from, limit))
        }
        Request::Cancel(job) => cancel(turn, reply_id, job),
        Request::Fetch(job) => Some(job_pages::end(turn.state, job)),
        Request::Banned => Some(list_banned(turn.state, turn.now)),
        Request::Workers => Some(Answer::Workers(worker_list::all(turn.state, turn.now))),
        Request::DrainWorker(worker) => Some(drain(turn, worker)),
        Request::Unban(host) => Some(unban(turn, &host)),
        Request::Recheck(job) => recheck::recheck_on_request(turn, reply_id, job),
        Request::Prune(retention) => {
            prune::prune_on_request(turn, reply_id, retention);
            None
        }
    };
    if let Some(answer) = answer {
        turn.effects.push(Effect::Answer { reply_id, answer });
    }
}

struct SubmittedJob {
    specification: Arc<JobSpecification>,
    request_id: String,
    client: String,
    priority: u32,
    name: String,
}

/// Accepts a job; the client is answered when it is durable.
fn submit(
    turn: &mut Turn,
    reply_id: ReplyId,
    submission: SubmittedJob,
) -> Result<Option<Answer>, Refusal> {
    let SubmittedJob { specification, request_id, client, priority, name } = submission;
    if turn.state.draining {
        return Err(Refusal::Draining);
    }
    let request = RequestName::new(&client, &request_id);
    if let Some(known) = request.as_ref().and_then(|request| turn.state.requests.get(request)) {
        return resubmit(turn.state, reply_id, *known, &specification, request_id);
    }
    find_place(turn.state, &client)?;
    find_room(turn.state, &client, bytes(&specification))?;
    let id = JobId(turn.state.next_job);
    turn.state.next_job += 1;
    turn.state.requests.extend(request.map(|request| (request, id)));
    let fingerprint = version::fingerprint();
    let record = JobRecord {
        job: id,
        request_id,
        specification,
        accepted: turn.now,
        fingerprint,
        client,
        priority,
        name,
    };
    turn.effects.push(Effect::Store(Record::Job(record.clone())));
    let mut job = Job::new(record, Stage::StoringSubmission, 0, turn.now);
    job.pending_replies.push(reply_id);
    turn.state.jobs.insert(id, job);
    Ok(None)
}

/// Checks that one more job of a client fits beside those that have not ended.
fn find_place(state: &State, client: &str) -> Result<(), Refusal> {
    if state.unfinished_jobs() >= JOBS_MAX {
        return Err(Refusal::TooManyJobs { limit: JOBS_MAX });
    }
    let limit = JOBS_MAX / CLIENT_SHARE_DIVISOR as usize;
    if state.jobs.values().filter(|job| job.record.client == client).count() >= limit {
        let client = client.to_owned();
        return Err(Refusal::ClientHasTooManyJobs { client, limit, all: JOBS_MAX });
    }
    Ok(())
}

/// Checks that a specification of `more` bytes fits beside those of the jobs that have not ended.
fn find_room(state: &State, client: &str, more: u64) -> Result<(), Refusal> {
    let held_bytes = |whose: &dyn Fn(&str) -> bool| -> u64 {
        let jobs = state.jobs.values().filter(|job| whose(&job.record.client));
        jobs.map(|job| job.bytes).sum()
    };
    let limit = state.config.jobs_bytes_max;
    for (whose, held, limit) in [
        (
            "this client's",
            held_bytes(&|name| name == client),
            limit / u64::from(CLIENT_SHARE_DIVISOR),
        ),
        ("all", held_bytes(&|_| true), limit),
    ] {
        if held + more > limit {
            return Err(Refusal::TooMuchQueued { whose, held, more, limit });
        }
    }
    Ok(())
}

fn resubmit(
    state: &mut State,
    reply_id: ReplyId,
    id: JobId,
    specification: &JobSpecification,
    request_id: String,
) -> Result<Option<Answer>, Refusal> {
    let ended = state.ended.get(&id).map(|ended| ended.identity);
    let known = ended.or_else(|| Some(state.jobs.get(&id)?.identity));
    if known != Some(identity(specification)) {
        return Err(Refusal::RequestIdTaken { request_id, job: id });
    }
    match state.jobs.get_mut(&id) {
        Some(job) if matches!(job.stage, Stage::StoringSubmission) => {
            job.pending_replies.push(reply_id);
            Ok(None)
        }
        _ => Ok(Some(Answer::Submitted(id))),
    }
}

fn get(state: &State, job: JobId, now: Duration) -> Answer {
    snapshot::job_snapshot(state, job, now)
        .map_or(Answer::Refused(Refusal::NoJob { job }), Answer::Snapshot)
}

fn explain(state: &State, job: JobId, now: Duration) -> Answer {
    JobFacts::new(state, job, now).map_or(Answer::Refused(Refusal::NoJob { job }), |facts| {
        Answer::Explained(explain::explanation(&facts))
    })
}

/// Cancels a job; the client is answered when its end is durable.
fn cancel(turn: &mut Turn, reply_id: ReplyId, id: JobId) -> Option<Answer> {
    match turn.state.jobs.get_mut(&id) {
        Some(job) if !matches!(job.stage, Stage::StoringSubmission) => {
            job.pending_replies.push(reply_id);
            jobs::cancel(turn, id);
            None
        }
        _ => Some(get(turn.state, id, turn.now)),
    }
}

/// Drains a worker, and returns its snapshot.
fn drain(turn: &mut Turn, worker: WorkerId) -> Answer {
    match workers::drain_worker(turn, worker) {
        Ok(()) => worker_list::worker_snapshot(turn.state, worker, turn.now)
            .map_or(Answer::Refused(Refusal::NoWorker { worker }), Answer::Worker),
        Err(refusal) => Answer::Refused(refusal),
    }
}

/// Lifts the ban of a host.
fn unban(turn: &mut Turn, host: &str) -> Answer {
    let now = turn.now;
    let is_of = |it: &&mut Banned| it.record.lifted.is_none() && it.record.worker.host() == host;
    let Some(banned) = turn.state.banned.iter_mut().find(is_of) else {
        return Answer::Refused(Refusal::NotBanned { host: host.to_owned() });
    };
    banned.record.lifted = Some(now);
    banned.refused = false;
    banned.store_at = Some(now + turn.state.config.store_retry);
    let record = banned.record.clone();
    tracing::warn!(host, "the ban of this host is lifted");
    turn.effects.push(Effect::Store(Record::Ban(record.clone())));
    Answer::Unbanned(record)
}

fn list_banned(state: &State, now: Duration) -> Answer {
    let in_force = || state.banned.iter().filter(|banned| banned.record.lifted.is_none());
    let newest = in_force().count().saturating_sub(BANNED_SHOWN_MAX);
    let shown = in_force()
        .skip(newest)
        .map(|banned| (banned.record.clone(), now.saturating_sub(banned.record.at)));
    Answer::Banned(shown.collect())
}
