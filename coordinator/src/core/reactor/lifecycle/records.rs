//! Reports of the store about the records of a job: one is durable, or was refused.

use std::sync::Arc;
use std::time::Duration;

use super::jobs;
use crate::core::effect::{Answer, Effect, Record, RecordKey, Refusal};
use crate::core::ids::JobId;
use crate::core::job::{EndedJob, Job, RequestName, Stage, StoreRetry};
use crate::core::notice::Notice;
use crate::core::reactor::turn::Turn;
use crate::core::snapshot;
use crate::store::JobRecord;

/// Notes that a record is durable, and continues the job.
pub(crate) fn stored(turn: &mut Turn, id: JobId, key: RecordKey) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    match (key, &mut job.stage) {
        (RecordKey::Job, Stage::Accepting) => {
            job.stage = Stage::Waiting;
            job.store_trouble = None;
            turn.state.waiting.push_back(id);
            turn.effects.push(Effect::Note(accepted(&job.record)));
            for token in std::mem::take(&mut job.tokens) {
                turn.effects.push(Effect::Answer { token, answer: Answer::Submitted(id) });
            }
            if jobs::has_room(turn.state, id) {
                jobs::begin_waiting(turn);
            }
        }
        (RecordKey::Evaluation(number), Stage::Storing { record, is_last })
            if record.number == number =>
        {
            let (outcomes, estimated_error) = (record.outcomes.clone(), record.estimated_error);
            job.stored = if *is_last { number + 1 } else { job.stored.max(number + 1) };
            job.workers.append(&mut record.workers);
            job.store_trouble = None;
            job.search.tell(outcomes, estimated_error);
            if job.restart_pending {
                jobs::restart(turn, id);
            } else {
                jobs::advance(turn, id);
            }
        }
        (RecordKey::End, Stage::Finishing(_)) => {
            ended(turn, id);
            return;
        }
        // The report of a write that has been repeated meanwhile.
        _ => {}
    }
    turn.state.changed.insert(id);
}

/// Handles a record that could not be stored. A submission is refused. Anything else is repeated
/// for as long as necessary: a change takes effect only when it is durable, and a job ends in no
/// other way.
pub(crate) fn store_failed(turn: &mut Turn, id: JobId, key: RecordKey, error: String) {
    let retry_at = turn.now + turn.state.config.store_retry;
    let Some(job) = turn.state.jobs.get_mut(&id).filter(|job| job.awaits() == Some(key)) else {
        return;
    };
    if matches!(job.stage, Stage::Accepting) {
        for token in std::mem::take(&mut job.tokens) {
            let answer = Answer::Refused(Refusal::Store { error: error.clone() });
            turn.effects.push(Effect::Answer { token, answer });
        }
        if let Some(request) = RequestName::from_record(&job.record) {
            turn.state.requests.remove(&request);
        }
        turn.state.jobs.remove(&id);
        return;
    }
    let since = job.store_trouble.as_ref().map_or(turn.now, |store_trouble| store_trouble.since);
    job.store_trouble =
        Some(StoreRetry { since, retry_at, error: error.clone(), on_its_way: false });
    turn.state.changed.insert(id);
    if job.restart_pending && matches!(job.stage, Stage::Finishing(_)) {
        jobs::reopen(turn, id);
    }
    give_up_if_late(turn, since, error);
}

/// Reports that the store no longer works, once it has refused for too long.
pub(crate) fn give_up_if_late(turn: &mut Turn, since: Duration, error: String) {
    let waited = turn.now.saturating_sub(since);
    if turn.state.config.store_give_up_after.is_some_and(|patience| waited >= patience) {
        turn.effects.push(Effect::GiveUp { error, waited });
    }
}

/// Sends the current record of a job to the store again, or repeats the request for the one it
/// reads.
pub(crate) fn store_again(job: &mut Job, effects: &mut Vec<Effect>) {
    effects.push(match &job.stage {
        Stage::Storing { record, is_last } => {
            let record = record.clone();
            Effect::Store(Record::Evaluation { record, is_last: *is_last })
        }
        Stage::Finishing(end) => {
            let summary = Arc::new(job.search.summary());
            Effect::Store(Record::End { end: end.clone(), summary })
        }
        Stage::Replaying { asked: true } => {
            Effect::Read { job: job.record.job, number: job.search.evaluations() }
        }
        Stage::Accepting
        | Stage::Waiting
        | Stage::Replaying { asked: false }
        | Stage::Computing(_) => return,
    });
}

/// Notes that the end of a job is durable.
fn ended(turn: &mut Turn, id: JobId) {
    let Some(Job { record, stage: Stage::Finishing(end), tokens, sequence, .. }) =
        turn.state.jobs.remove(&id)
    else {
        return;
    };
    turn.effects.push(Effect::Note(Notice::JobEnded {
        job: id,
        client: record.client.clone(),
        kind: record.specification.kind,
        ending: end.ending.clone(),
        evaluations: end.evaluations,
        elapsed: end.ended.saturating_sub(record.accepted),
    }));
    turn.state.ended.insert(id, EndedJob::new(&record, end, sequence));
    turn.state.changed.remove(&id);
    let Some(snapshot) = snapshot::job_snapshot(turn.state, id, turn.now) else {
        return;
    };
    for token in tokens {
        let answer = Answer::Snapshot(snapshot.clone());
        turn.effects.push(Effect::Answer { token, answer });
    }
    // Published at once instead of with the other jobs, because clients wait for it.
    turn.effects.push(Effect::Publish { job: id, snapshot });
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

impl Job {
    /// Returns the key of the record whose report the job waits for.
    fn awaits(&self) -> Option<RecordKey> {
        match &self.stage {
            Stage::Accepting => Some(RecordKey::Job),
            Stage::Storing { record, .. } => Some(RecordKey::Evaluation(record.number)),
            Stage::Finishing(_) => Some(RecordKey::End),
            Stage::Waiting | Stage::Replaying { .. } | Stage::Computing(_) => None,
        }
    }
}
