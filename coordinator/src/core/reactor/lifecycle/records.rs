//! Handles the store's reports on the records of a job: a record has become durable, or could not be
//! stored.

use std::sync::Arc;
use std::time::Duration;

use super::jobs;
use crate::core::completion::Completed;
use crate::core::effect::{Answer, Effect, Record, RecordKey, Refusal};
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::JobId;
use crate::core::job::{After, EndedJob, Job, RequestName, Stage, StoreRetry};
use crate::core::notice::Notice;
use crate::core::reactor::turn::Turn;
use crate::core::snapshot;
use crate::store::JobRecord;

/// Handles the report that a record is durable: continues the job.
pub(crate) fn on_record_stored(turn: &mut Turn, id: JobId, key: RecordKey) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    match (key, &mut job.stage) {
        (RecordKey::Job, Stage::StoringSubmission) => {
            job.stage = Stage::Waiting;
            job.store_retry = None;
            turn.state.waiting.push_back(id);
            turn.effects.push(Effect::Note(accepted_notice(&job.record)));
            for reply_id in std::mem::take(&mut job.pending_replies) {
                turn.effects.push(Effect::Answer { reply_id, answer: Answer::Submitted(id) });
            }
            if jobs::has_room(turn.state, id) {
                jobs::begin_waiting(turn);
            }
        }
        (RecordKey::Evaluation(number), Stage::StoringEvaluation { record, deletes_later })
            if record.number == number =>
        {
            let (outcomes, estimated_error) = (record.outcomes.clone(), record.estimated_error);
            job.stored = if *deletes_later { number + 1 } else { job.stored.max(number + 1) };
            job.received = job.recomputed.then(|| record.clone());
            job.workers.append(&mut record.workers);
            job.store_retry = None;
            job.search.tell(outcomes, estimated_error);
            go_on(turn, id);
        }
        (
            RecordKey::Evaluation(number),
            Stage::StoringPrepared { records, deletes_later, after },
        ) if records.last().is_some_and(|last| last.number == number) => {
            job.stored = if *deletes_later { number + 1 } else { job.stored.max(number + 1) };
            job.received = records.last().filter(|_| job.recomputed).cloned();
            let workers = records.iter_mut().map(|record| std::mem::take(&mut record.workers));
            job.workers.extend(workers.flatten());
            job.store_retry = None;
            match after {
                After::Awaited { durable, .. } if !job.restart_pending => *durable = true,
                After::Awaited { .. } => jobs::restart(turn, id),
                After::Ready(after) => {
                    // The search is moved out of a stage that ends here.
                    std::mem::swap(&mut job.search, after);
                    go_on(turn, id);
                }
            }
        }
        (RecordKey::End, Stage::StoringEnd(_)) => {
            on_end_stored(turn, id);
            return;
        }
        // Nothing waits for parts.
        (RecordKey::Part, _) => return,
        (RecordKey::Piece(attempt), stage) => {
            forget_piece(stage, attempt);
            return;
        }
        // Ignore the report of a write that has since been repeated.
        _ => {}
    }
    turn.state.changed.insert(id);
}

/// Takes over the search that was told of an evaluation beside the core; the job continues if the
/// evaluation is durable.
pub(crate) fn on_completed(turn: &mut Turn, completed: Completed) {
    let Completed { job: id, attempt, search } = completed;
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let Stage::StoringPrepared { after, .. } = &mut job.stage else {
        return;
    };
    match after {
        After::Awaited { attempt: awaited, durable } if *awaited == attempt => {
            if *durable {
                job.search = *search;
                jobs::advance(turn, id);
            } else {
                *after = After::Ready(search);
            }
        }
        // It was begun again meanwhile.
        _ => {}
    }
}

/// Handles the report on a piece, whether it was stored or not: the record of the evaluation has it too.
fn forget_piece(stage: &mut Stage, of_attempt: u64) {
    if let Stage::Computing(PendingEvaluation { attempt, pieces, .. }) = stage
        && *attempt == of_attempt
    {
        pieces.count_report();
    }
}

/// Continues a job whose search has taken in what was stored.
fn go_on(turn: &mut Turn, id: JobId) {
    if turn.state.jobs.get(&id).is_some_and(|job| job.restart_pending) {
        jobs::restart(turn, id);
    } else {
        jobs::advance(turn, id);
    }
}

/// Handles the report that a record could not be stored. A submission is refused. Any other record is
/// written again until it succeeds, because a change takes effect, and a job ends, only once its
/// record is durable.
pub(crate) fn on_record_not_stored(turn: &mut Turn, id: JobId, key: RecordKey, error: String) {
    if key == RecordKey::Part {
        if let Some(job) = turn.state.jobs.get_mut(&id) {
            job.needed_evaluations_mut().for_each(PendingEvaluation::save_again);
        }
        return;
    }
    if let RecordKey::Piece(attempt) = key {
        if let Some(job) = turn.state.jobs.get_mut(&id) {
            forget_piece(&mut job.stage, attempt);
        }
        return;
    }
    let retry_at = turn.now + turn.state.config.store_retry;
    let Some(job) =
        turn.state.jobs.get_mut(&id).filter(|job| job.record_being_stored() == Some(key))
    else {
        return;
    };
    if matches!(job.stage, Stage::StoringSubmission) {
        for reply_id in std::mem::take(&mut job.pending_replies) {
            let answer = Answer::Refused(Refusal::Store { error: error.clone() });
            turn.effects.push(Effect::Answer { reply_id, answer });
        }
        if let Some(request) = RequestName::from_record(&job.record) {
            turn.state.requests.remove(&request);
        }
        turn.state.jobs.remove(&id);
        return;
    }
    let since = job.store_retry.as_ref().map_or(turn.now, |retry| retry.since);
    job.store_retry = Some(StoreRetry { since, retry_at, error: error.clone(), in_flight: false });
    turn.state.changed.insert(id);
    if job.restart_pending && matches!(job.stage, Stage::StoringEnd(_)) {
        jobs::reopen(turn, id);
    }
    report_store_failure_if_persistent(turn, since, error);
}

/// Reports that the store has failed if it has refused records for longer than configured.
pub(crate) fn report_store_failure_if_persistent(turn: &mut Turn, since: Duration, error: String) {
    let waited = turn.now.saturating_sub(since);
    if turn.state.config.store_give_up_after.is_some_and(|limit| waited >= limit) {
        turn.effects.push(Effect::ReportStoreFailure { error, waited });
    }
}

/// Sends the record that the job is storing to the store again, or repeats the request for the
/// evaluation that it is reading.
pub(crate) fn store_again(job: &mut Job, effects: &mut Vec<Effect>) {
    effects.push(match &job.stage {
        Stage::StoringEvaluation { record, deletes_later } => {
            let record = record.clone();
            Effect::Store(Record::Evaluation { record, deletes_later: *deletes_later })
        }
        Stage::StoringPrepared { records, deletes_later, .. } => {
            Effect::Store(Record::of_evaluations(records.clone(), *deletes_later))
        }
        Stage::StoringEnd(end) => {
            let summary = Arc::new(job.search.summary());
            Effect::Store(Record::End { end: end.clone(), summary })
        }
        Stage::Replaying { asked: true } => {
            Effect::Read { job: job.record.job, number: job.search.evaluations() }
        }
        Stage::StoringSubmission
        | Stage::Waiting
        | Stage::Replaying { asked: false }
        | Stage::Computing(_)
        | Stage::Completing(_) => return,
    });
}

/// Handles the report that the end of a job is durable.
fn on_end_stored(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.remove(&id) else {
        return;
    };
    let Job {
        record,
        stage: Stage::StoringEnd(end),
        pending_replies,
        sequence,
        mut doubts,
        search,
        ..
    } = job
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
    doubts.set_digest(search.summary().digest);
    turn.state.ended.insert(id, EndedJob { doubts, ..EndedJob::new(&record, end, sequence) });
    turn.state.changed.remove(&id);
    let Some(snapshot) = snapshot::job_snapshot(turn.state, id, turn.now) else {
        return;
    };
    for reply_id in pending_replies {
        let answer = Answer::Snapshot(snapshot.clone());
        turn.effects.push(Effect::Answer { reply_id, answer });
    }
    // Published at once instead of with the other jobs, because clients wait for it.
    turn.effects.push(Effect::Publish { job: id, snapshot });
}

fn accepted_notice(record: &JobRecord) -> Notice {
    Notice::JobAccepted {
        job: record.job,
        client: record.client.clone(),
        name: record.name.clone(),
        kind: record.specification.kind,
        priority: record.priority,
    }
}

impl Job {
    /// Returns the key of the record that is being stored, if any.
    fn record_being_stored(&self) -> Option<RecordKey> {
        match &self.stage {
            Stage::StoringSubmission => Some(RecordKey::Job),
            Stage::StoringEvaluation { record, .. } => Some(RecordKey::Evaluation(record.number)),
            Stage::StoringPrepared { records, .. } => {
                records.last().map(|last| RecordKey::Evaluation(last.number))
            }
            Stage::StoringEnd(_) => Some(RecordKey::End),
            Stage::Waiting
            | Stage::Replaying { .. }
            | Stage::Computing(_)
            | Stage::Completing(_) => None,
        }
    }
}
