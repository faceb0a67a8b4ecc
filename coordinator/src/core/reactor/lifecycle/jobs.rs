//! Life cycle of a job, from acceptance to end.

use std::cmp::Reverse;
use std::sync::Arc;

use osteon_common::results::Status;
use osteon_common::version::Program;

use crate::core::ahead::PreparedEvaluation;
use crate::core::completion::{Completion, Gathered};
use crate::core::effect::{Effect, Record};
use crate::core::evaluation::PendingEvaluation;
use crate::core::failure::RunFailure;
use crate::core::ids::JobId;
use crate::core::job::{After, Job, Settled, Stage};
use crate::core::notice::Notice;
use crate::core::reactor::dispatch::{ahead, batches, clearance, speculation};
use crate::core::reactor::turn::Turn;
use crate::core::state::State;
use crate::store::{EndRecord, EvaluationRecord, JobRecord};
use osteon_search::{Ending, Search, Step};

/// Maximum number of evaluations, and of realizations in them, that are stored together.
const STORED_TOGETHER_MAX: (usize, usize) = (256, 1 << 20);

/// Stores the evaluation of a job once it is complete and checked. A large one is completed beside
/// the core first, and so is one after which the search may draw points of a posterior.
pub(crate) fn store_if_complete(turn: &mut Turn, id: JobId) {
    let aside_min = turn.state.config.completed_aside_min;
    if let Some(attempt) = turn.state.jobs.get(&id).and_then(Job::evaluation).map(|it| it.attempt) {
        clearance::clear(turn, id, attempt);
    }
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let Stage::Computing(evaluation) = &mut job.stage else {
        return;
    };
    if evaluation.is_settled()
        && (evaluation.realizations() >= aside_min || job.search.takes_long())
    {
        complete_aside(turn, id);
        return;
    }
    let Some((outcomes, estimated_error)) = evaluation.complete(job.search.observables()) else {
        return;
    };
    let (number, point) = (evaluation.number, evaluation.point);
    // Only an evaluation that was stored before, with the same outcomes, leaves those after it
    // valid.
    let deletes_later = evaluation.diverges_from_store(&outcomes);
    let workers = std::mem::take(&mut evaluation.workers).into_iter().collect();
    let record = EvaluationRecord { job: id, number, point, outcomes, estimated_error, workers };
    ahead::keep_if_awaited(job, &record);
    turn.effects.push(Effect::Store(Record::Evaluation { record: record.clone(), deletes_later }));
    let outcomes = record.outcomes.clone();
    job.stage = Stage::StoringEvaluation { record, deletes_later };
    if deletes_later {
        speculation::prepare(turn, id, &outcomes);
    }
    ahead::refresh(turn, id);
}

/// Hands out the settled evaluation of a job to be completed beside the core.
fn complete_aside(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let Stage::Computing(evaluation) = &mut job.stage else {
        return;
    };
    let PendingEvaluation { number, attempt, point, .. } = *evaluation;
    let (workers, stored) = (evaluation.workers.clone(), evaluation.stored.clone());
    let settled = Settled { number, attempt, point, workers, stored };
    let Stage::Computing(evaluation) =
        std::mem::replace(&mut job.stage, Stage::Completing(settled))
    else {
        return;
    };
    let (evaluation, search) = (Box::new(evaluation), Box::new(job.search.clone()));
    turn.effects.push(Effect::Complete(Completion { job: id, evaluation, search }));
    ahead::refresh(turn, id);
}

/// Stores an evaluation while its search takes it in, beside the core.
pub(crate) fn store_gathered(turn: &mut Turn, gathered: Gathered) {
    let Gathered { job: id, attempt, record, deletes_later } = gathered;
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    // Anything else was begun again, or has ended, meanwhile.
    if !matches!(&job.stage, Stage::Completing(settled) if settled.attempt == attempt) {
        return;
    }
    ahead::keep_if_awaited(job, &record);
    job.last_progress = turn.now;
    let records = vec![record];
    turn.effects.push(Effect::Store(Record::of_evaluations(records.clone(), deletes_later)));
    let after = After::Awaited { attempt, durable: false };
    job.stage = Stage::StoringPrepared { records, deletes_later, after };
    ahead::refresh(turn, id);
}

/// Takes in an evaluation that may be complete: that of the search, or one ahead of it.
pub(crate) fn settle(turn: &mut Turn, id: JobId, attempt: u64) {
    ahead::settle(turn, id, attempt);
    store_if_complete(turn, id);
}

/// Ends a job because of `failure`.
pub(crate) fn fail(turn: &mut Turn, id: JobId, failure: &RunFailure) {
    let ending = Ending {
        status: Status::Failed,
        failure: Some(failure.kind()),
        reason: Some(failure.to_string()),
    };
    finish(turn, id, ending);
}

/// Cancels a job for a client, at once or as soon as the record being stored is durable.
pub(crate) fn cancel(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.cancelled = true;
    match job.stage {
        Stage::Waiting if job.stored > 0 => {
            // Its output is in the store and is only read, not computed, so it need not wait for
            // its turn.
            begin(turn, id);
        }
        Stage::Waiting | Stage::Computing(_) | Stage::Completing(_) => {
            finish(turn, id, cancelled_ending());
        }
        // The store cannot read the evaluations that would still belong to its output.
        Stage::Replaying { .. } if job.store_retry.is_some() => {
            finish(turn, id, cancelled_ending());
        }
        Stage::StoringSubmission
        | Stage::Replaying { .. }
        | Stage::StoringEvaluation { .. }
        | Stage::StoringPrepared { .. }
        | Stage::StoringEnd(_) => {}
    }
}

/// Begins waiting jobs while there is room. Jobs of the clients with the fewest active jobs come
/// first, of these the highest priority, of equal ones the oldest. A client without any active job
/// gets room beyond the limits, so that other clients cannot keep it waiting.
pub(crate) fn begin_waiting(turn: &mut Turn) {
    while !turn.state.waiting.is_empty() && !turn.state.draining {
        let Some(id) = next_waiting(turn.state).filter(|job| has_room(turn.state, *job)) else {
            return;
        };
        begin(turn, id);
    }
}

/// Returns whether a waiting job may begin, by the limits on active realizations and active jobs.
pub(crate) fn has_room(state: &State, id: JobId) -> bool {
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

/// Returns the job that begins next.
fn next_waiting(state: &State) -> Option<JobId> {
    let waiting = state.waiting.iter().filter_map(|id| Some((*id, state.jobs.get(id)?)));
    let rank = |(id, job): &(JobId, &Job)| {
        let JobRecord { client, priority, .. } = &job.record;
        (state.shares.jobs(client), Reverse(*priority), *id)
    };
    waiting.min_by_key(rank).map(|(id, _)| id)
}

/// Begins a waiting job.
fn begin(turn: &mut Turn, id: JobId) {
    turn.state.waiting.retain(|waiting| *waiting != id);
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.last_progress = turn.now;
        turn.state.shares.begin(&job.record.client);
        turn.state.active.insert(id);
        turn.effects.push(Effect::Note(Notice::JobStarted { job: id, stored: job.stored }));
        speculation::drop_excess(turn);
        advance(turn, id);
    }
}

/// Takes the next step of a job's search: replays a stored evaluation, begins a new one, or ends
/// the job.
pub(crate) fn advance(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    turn.state.changed.insert(id);
    if job.search.evaluations() < job.stored {
        read_next(turn, id);
        return;
    }
    let part = job.search.part();
    let ending = match job.search.ask() {
        Step::Evaluate(_) if job.cancelled => cancelled_ending(),
        Step::Evaluate(_) if store_prepared(turn, id) => {
            ahead::drop_before(turn, id, part);
            return;
        }
        Step::Evaluate(point) => {
            speculation::begin(turn, id, point);
            // From here on the search computes the points of this part itself.
            ahead::drop_before(turn, id, part + 1);
            ahead::refresh(turn, id);
            store_if_complete(turn, id);
            return;
        }
        Step::Done(ending) => ending,
    };
    finish(turn, id, ending);
}

/// Stores the evaluations that a job's search asks for next, as far as they are complete already.
/// Returns whether there are any.
fn store_prepared(turn: &mut Turn, id: JobId) -> bool {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return false;
    };
    let Step::Evaluate(first) = job.search.ask() else {
        return false;
    };
    if job.ahead.prepared_evaluation(&first).is_none() {
        return false;
    }
    let mut after = Box::new(job.search.clone());
    let mut records = Vec::new();
    let (records_max, realizations_max) = STORED_TOGETHER_MAX;
    let mut realizations = 0;
    while let Step::Evaluate(point) = after.ask()
        && records.len() < records_max
        && realizations < realizations_max
        && let Some(prepared) = job.ahead.take_prepared(&point, after.part())
    {
        let PreparedEvaluation { outcomes, estimated_error, workers, assessment, .. } = prepared;
        realizations += outcomes.len();
        let number = after.evaluations();
        if let Some(assessment) = assessment {
            after.anticipate(assessment);
        }
        after.tell(outcomes.clone(), estimated_error);
        records.push(EvaluationRecord {
            job: id,
            number,
            point,
            outcomes,
            estimated_error,
            workers,
        });
    }
    turn.effects.push(Effect::Store(Record::of_evaluations(records.clone(), true)));
    job.last_progress = turn.now;
    let after = After::Ready(after);
    job.stage = Stage::StoringPrepared { records, deletes_later: true, after };
    // Its candidates were those of another point.
    speculation::drop_all(turn, id);
    ahead::refresh(turn, id);
    true
}

/// Stores the end of a job; clients see it when it is durable.
pub(crate) fn finish(turn: &mut Turn, id: JobId, ending: Ending) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let search = &job.search;
    // A grouped search has no best evaluation of the whole job.
    let best = search.best().filter(|_| !search.is_grouped());
    let program = Program::current(turn.state.config.commit);
    let record = EndRecord::new(id, ending, program, turn.now, search.evaluations(), best);
    let summary = Arc::new(search.summary());
    turn.effects.push(Effect::Store(Record::End { end: record.clone(), summary }));
    job.stage = Stage::StoringEnd(record);
    job.store_retry = None;
    leave(turn, id);
}

/// Takes back an end that is neither durable nor on its way to the store, because answers in it are
/// not reliable. The job waits for its turn and reads its stored evaluations again.
pub(crate) fn reopen(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.store_retry = None;
    job.restart_pending = false;
    job.workers.clear();
    job.received = None;
    job.search = Search::new(job.record.specification.clone());
    job.stage = Stage::Waiting;
    turn.state.waiting.push_back(id);
    begin_waiting(turn);
}

/// Removes a job from the active jobs and the shares of its client.
fn leave(turn: &mut Turn, id: JobId) {
    if turn.state.active.remove(&id)
        && let Some(job) = turn.state.jobs.get(&id)
    {
        turn.state.shares.end(&job.record.client);
    }
    turn.state.waiting.retain(|waiting| *waiting != id);
    turn.state.changed.insert(id);
    batches::revoke_all(turn, id);
    for worker in turn.state.workers.values_mut() {
        worker.rates.remove(&id);
    }
    begin_waiting(turn);
}

/// Returns the end of a cancelled job.
pub(crate) fn cancelled_ending() -> Ending {
    Ending { status: Status::Cancelled, failure: None, reason: None }
}

/// Requests the next stored evaluation of a job, unless a ban is not durable yet.
pub(crate) fn read_next(turn: &mut Turn, id: JobId) {
    let may = !turn.state.has_pending_ban();
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.stage = Stage::Replaying { asked: may };
        if may {
            turn.effects.push(Effect::Read { job: id, number: job.search.evaluations() });
        }
    }
}

/// Restarts the search of an active job, which replays its stored evaluations.
pub(crate) fn restart(turn: &mut Turn, id: JobId) {
    batches::revoke_all(turn, id);
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.restart_pending = false;
        job.workers.clear();
        job.received = None;
        job.search = Search::new(job.record.specification.clone());
        advance(turn, id);
    }
}
