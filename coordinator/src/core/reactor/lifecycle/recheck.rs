//! Computes ended jobs again that a banned host contributed to. The store keeps their evaluations: those
//! with answers of that host are computed again, and the search continues from the first that changes.

use crate::core::effect::{Answer, Effect, Refusal};
use crate::core::ids::{JobId, ReplyId};
use crate::core::job::{Job, Stage, sequence};
use crate::core::reactor::turn::Turn;
use crate::core::snapshot;
use crate::store::{DoubtRecord, StoredJob};

use super::jobs;

/// Notes that ended jobs are doubtful because of a ban.
pub(crate) fn note_doubts(turn: &mut Turn, ban: u64, jobs: Vec<JobId>) {
    for job in jobs {
        if let Some(ended) = turn.state.ended.get_mut(&job) {
            ended.doubts.add(DoubtRecord { job, ban, digest: None });
            ended.sequence = sequence(ended.sequence, turn.now);
            tracing::error!(%job, ban, "a host that computed a part of this ended job is banned; compute the \
                job again with `osteon job recheck`");
        }
    }
}

/// Begins a job again that has ended; the client is answered when that is durable.
pub(crate) fn recheck_on_request(turn: &mut Turn, reply_id: ReplyId, id: JobId) -> Option<Answer> {
    if let Some(job) = turn.state.jobs.get(&id) {
        // It is computed again already.
        return Some(match job.doubts.is_empty() {
            true => Answer::Refused(Refusal::NotEnded { job: id }),
            false => answer(turn, id),
        });
    }
    match turn.state.ended.get(&id) {
        None => Some(Answer::Refused(Refusal::NoJob { job: id })),
        Some(_) if turn.state.draining => Some(Answer::Refused(Refusal::Draining)),
        Some(job) if job.doubts.is_empty() => Some(Answer::Refused(Refusal::NoDoubt { job: id })),
        Some(job) if !job.doubts.is_open() => Some(answer(turn, id)),
        Some(_) => {
            turn.effects.push(Effect::Reopen { reply_id, job: id });
            None
        }
    }
}

/// Takes in a job that is unfinished again in the store.
pub(crate) fn on_reopened(
    turn: &mut Turn,
    reply_id: ReplyId,
    id: JobId,
    outcome: Result<Option<StoredJob>, String>,
) {
    let reply = match outcome {
        Ok(Some(StoredJob { record, evaluations, .. })) => {
            if let Some(ended) = turn.state.ended.remove(&id) {
                let mut job = Job::new(record, Stage::Waiting, evaluations, turn.now);
                job.sequence = ended.sequence;
                job.doubts = ended.doubts;
                job.doubts.reopen();
                turn.state.jobs.insert(id, job);
                turn.state.waiting.push_back(id);
                turn.state.changed.insert(id);
                jobs::begin_waiting(turn);
            }
            answer(turn, id)
        }
        Ok(None) => Answer::Refused(Refusal::NoJob { job: id }),
        Err(error) => Answer::Refused(Refusal::NotReopened { job: id, error }),
    };
    turn.effects.push(Effect::Answer { reply_id, answer: reply });
}

fn answer(turn: &Turn, id: JobId) -> Answer {
    snapshot::job_snapshot(turn.state, id, turn.now)
        .map_or(Answer::Refused(Refusal::NoJob { job: id }), Answer::Snapshot)
}
