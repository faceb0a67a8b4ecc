//! Points that a search may ask for next, computed by workers that nobody else has work for.
//!
//! Nothing of it is stored, checked or shown before the search asks for the point; then what is
//! there becomes the job's evaluation, and goes on as if it had been begun now. What the search
//! can no longer ask for is dropped. So results, store and digest are those of a search without it.
//!
//! It takes nothing from anybody: a worker gets a batch of it only for threads that are idle, one at
//! a time, and gives it back when there is anything else for these threads. That is why nobody is
//! charged for it.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;

use super::{Effects, batches, dispatch, jobs};
use crate::evaluation::Evaluation;
use crate::ids::{BatchId, JobId, WorkerId};
use crate::search::same_point;
use crate::state::{Ahead, Assignment, BATCHES_IN_FLIGHT_MAX, Job, Purpose, Stage, State, Worker};
use crate::worker_name::WorkerName;

pub(super) use self::idle::hand_out;

mod idle;

/// Points that are known for each job, at most.
pub(crate) const LIKELY_MAX: usize = 8;
/// Evaluations with more realizations leave no worker idle for long; nothing is done ahead of them.
const REALIZATIONS_MAX: u64 = 20_000;

/// Begins the evaluation of the point that a job's search asks for, with what is known of it.
pub(super) fn begin(
    state: &mut State,
    id: JobId,
    point: Point,
    now: Duration,
    effects: &mut Effects,
) {
    let round = state.round();
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let number = job.search.evaluations();
    let known = job.ahead.evaluations.iter().position(|known| same_point(&known.point, &point));
    let evaluation = match known.map(|at| job.ahead.evaluations.remove(at)) {
        Some(mut known) => {
            known.number = number;
            // Nobody could decide them before.
            known.disputes.iter_mut().for_each(|dispute| dispute.since = now);
            job.rate.add(known.filled(), now);
            known
        }
        None => {
            let realizations = job.record.specification.monte_carlo.realizations;
            Evaluation::new(number, round, point, realizations)
        }
    };
    let likely = if speculates(job) { job.search.likely(LIKELY_MAX) } else { Vec::new() };
    let round = evaluation.round;
    job.stage = Stage::Computing(evaluation);
    adopt_batches(state, id, round);
    keep(state, id, likely, now, effects);
    jobs::store_if_complete(state, id, now, effects);
}

/// The outcomes of a job's evaluation are there, and on their way to the store: where its search
/// will go is known, though it is not told yet.
pub(super) fn prepare(
    state: &mut State,
    id: JobId,
    outcomes: &Arc<[Outcome]>,
    now: Duration,
    effects: &mut Effects,
) {
    if let Some(job) = state.jobs.get_mut(&id).filter(|job| speculates(job)) {
        let likely = job.search.likely_after(outcomes, LIKELY_MAX);
        keep(state, id, likely, now, effects);
    }
}

/// Takes back what a worker does ahead, if it has no room for `count` realizations besides.
pub(super) fn make_way(
    state: &mut State,
    worker: WorkerId,
    count: u64,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(attached) = state.workers.get(&worker) else {
        return;
    };
    let full = attached.in_flight.len() >= BATCHES_IN_FLIGHT_MAX;
    if full || realizations_held(state, attached) + count > attached.hello.threads.into() {
        give_back(state, worker, now, effects);
    }
}

/// Takes back what a worker does ahead.
pub(super) fn give_back(state: &mut State, worker: WorkerId, now: Duration, effects: &mut Effects) {
    let Some(attached) = state.workers.get(&worker) else {
        return;
    };
    let held: Vec<BatchId> = state.held_for(attached, Purpose::Speculative).collect();
    for batch in held {
        if let Some(assignment) = state.batches.get(&batch).map(|batch| batch.assignment)
            && let Some(evaluation) = state.attempt_mut(&assignment)
        {
            evaluation.put_back(assignment.indices);
        }
        batches::revoke(state, batch, now, effects);
    }
}

/// Drops all that a job is ahead with.
pub(super) fn drop_all(state: &mut State, id: JobId, now: Duration, effects: &mut Effects) {
    keep(state, id, Vec::new(), now, effects);
}

/// Drops what an expelled worker has done ahead.
pub(super) fn forget(
    state: &mut State,
    id: JobId,
    name: &WorkerName,
    now: Duration,
    effects: &mut Effects,
) {
    let involves = |evaluation: &Evaluation| {
        evaluation.workers.contains(name)
            || evaluation.disputes.iter().any(|dispute| dispute.involves(name))
    };
    retain(state, id, |evaluation| !involves(evaluation), now, effects);
}

/// Drops what is furthest ahead, until the bound on realizations in memory is kept.
pub(super) fn keep_bound(state: &mut State, now: Duration, effects: &mut Effects) {
    while realizations(state) > state.config.active_realizations_max {
        let ahead = |id: &JobId| {
            let evaluations = &state.jobs.get(id)?.ahead.evaluations;
            evaluations.last().map(|last| (evaluations.len(), *id, last.round))
        };
        let Some((_, job, round)) = state.active.iter().filter_map(ahead).max() else {
            return;
        };
        retain(state, job, |evaluation| evaluation.round != round, now, effects);
    }
}

/// Whether points are computed ahead for a job.
fn speculates(job: &Job) -> bool {
    let specification = &job.record.specification;
    specification.kind == JobKind::Identification
        && specification.search.speculation
        && specification.monte_carlo.realizations <= REALIZATIONS_MAX
        && !job.cancelled
}

/// The batches of an evaluation that was ahead are batches as any other from now on.
fn adopt_batches(state: &mut State, job: JobId, round: u64) {
    let of_round = |assignment: &Assignment| assignment.job == job && assignment.round == round;
    let held = state.batches.iter().filter(|(_, batch)| of_round(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for id in held {
        if let Some(batch) = state.batches.get_mut(&id) {
            batch.purpose = Purpose::Fill;
            dispatch::charge(state, id);
        }
    }
}

/// Makes `likely` the points that a job may be ahead with, and drops all others.
fn keep(state: &mut State, id: JobId, likely: Vec<Point>, now: Duration, effects: &mut Effects) {
    let stays = |evaluation: &Evaluation| likely.iter().any(|at| same_point(at, &evaluation.point));
    retain(state, id, stays, now, effects);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.ahead.likely = likely;
    }
}

/// Drops what does not meet `stays` of what a job is ahead with.
fn retain(
    state: &mut State,
    id: JobId,
    stays: impl Fn(&Evaluation) -> bool,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(job) = state.jobs.get_mut(&id) else {
        return;
    };
    let goes = |evaluation: &Evaluation| !stays(evaluation);
    let gone: Vec<u64> =
        job.ahead.evaluations.extract_if(.., |it| goes(it)).map(|gone| gone.round).collect();
    if gone.is_empty() {
        return;
    }
    let of_gone =
        |assignment: &Assignment| assignment.job == id && gone.contains(&assignment.round);
    let held = state.batches.iter().filter(|(_, batch)| of_gone(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for batch in held {
        batches::revoke(state, batch, now, effects);
    }
}

/// Realizations of all batches that a worker holds.
fn realizations_held(state: &State, worker: &Worker) -> u64 {
    let held = worker.in_flight.iter().filter_map(|held| state.batches.get(held));
    held.map(|batch| batch.assignment.indices.count).sum()
}

/// Realizations of the evaluations of all active jobs, those ahead included.
fn realizations(state: &State) -> u64 {
    let of_job = |id: &JobId| {
        let job = state.jobs.get(id)?;
        let each = job.record.specification.monte_carlo.realizations;
        Some(each * (1 + job.ahead.evaluations.len() as u64))
    };
    state.active.iter().filter_map(of_job).sum()
}

impl Ahead {
    /// What is computed of a point.
    fn at(&self, point: &Point) -> Option<&Evaluation> {
        self.evaluations.iter().find(|begun| same_point(&begun.point, point))
    }

    fn at_mut(&mut self, point: &Point) -> Option<&mut Evaluation> {
        self.evaluations.iter_mut().find(|begun| same_point(&begun.point, point))
    }
}
