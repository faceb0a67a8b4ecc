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

use osteon_common::job::JobKind;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;

use super::batches;
use crate::evaluation::Evaluation;
use crate::ids::{BatchId, JobId};
use crate::reactor::turn::Turn;
use crate::search::same_point;
use crate::state::{Ahead, Assignment, Job, Purpose, Stage, State};
use crate::worker_name::WorkerName;

/// Points that are known for each job, at most.
pub(crate) const LIKELY_MAX: usize = 8;
/// Evaluations with more realizations leave no worker idle for long; nothing is done ahead of them.
const REALIZATIONS_MAX: u64 = 20_000;

/// Begins the evaluation of the point that a job's search asks for, with what is known of it.
pub(crate) fn begin(turn: &mut Turn, id: JobId, point: Point) {
    let round = turn.state.round();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let number = job.search.evaluations();
    let known = job.ahead.evaluations.iter().position(|known| same_point(&known.point, &point));
    let evaluation = match known.map(|at| job.ahead.evaluations.remove(at)) {
        Some(mut known) => {
            known.number = number;
            // Nobody could decide them before.
            known.disputes.iter_mut().for_each(|dispute| dispute.since = turn.now);
            job.rate.add(known.filled(), turn.now);
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
    adopt_batches(turn.state, id, round);
    keep(turn, id, likely);
}

/// The outcomes of a job's evaluation are there, and on their way to the store: where its search
/// will go is known, though it is not told yet.
pub(crate) fn prepare(turn: &mut Turn, id: JobId, outcomes: &Arc<[Outcome]>) {
    if let Some(job) = turn.state.jobs.get_mut(&id).filter(|job| speculates(job)) {
        let likely = job.search.likely_after(outcomes, LIKELY_MAX);
        keep(turn, id, likely);
    }
}

/// Drops all that a job is ahead with.
pub(crate) fn drop_all(turn: &mut Turn, id: JobId) {
    keep(turn, id, Vec::new());
}

/// Drops what an expelled worker has done ahead.
pub(crate) fn forget(turn: &mut Turn, id: JobId, name: &WorkerName) {
    let involves = |evaluation: &Evaluation| {
        evaluation.workers.contains(name)
            || evaluation.disputes.iter().any(|dispute| dispute.involves(name))
    };
    retain(turn, id, |evaluation| !involves(evaluation));
}

/// Drops what is furthest ahead, until the bound on realizations in memory is kept.
pub(crate) fn keep_bound(turn: &mut Turn) {
    while realizations(turn.state) > turn.state.config.active_realizations_max {
        let ahead = |id: &JobId| {
            let evaluations = &turn.state.jobs.get(id)?.ahead.evaluations;
            evaluations.last().map(|last| (evaluations.len(), *id, last.round))
        };
        let Some((_, job, round)) = turn.state.active.iter().filter_map(ahead).max() else {
            return;
        };
        retain(turn, job, |evaluation| evaluation.round != round);
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
            batches::charge(state, id);
        }
    }
}

/// Makes `likely` the points that a job may be ahead with, and drops all others.
fn keep(turn: &mut Turn, id: JobId, likely: Vec<Point>) {
    let stays = |evaluation: &Evaluation| likely.iter().any(|at| same_point(at, &evaluation.point));
    retain(turn, id, stays);
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.ahead.likely = likely;
    }
}

/// Drops what does not meet `stays` of what a job is ahead with.
fn retain(turn: &mut Turn, id: JobId, stays: impl Fn(&Evaluation) -> bool) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
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
    let held = turn.state.batches.iter().filter(|(_, batch)| of_gone(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for batch in held {
        batches::revoke(turn, batch);
    }
}

/// Realizations of the evaluations of all active jobs, those ahead included.
pub(crate) fn realizations(state: &State) -> u64 {
    let of_job = |id: &JobId| {
        let job = state.jobs.get(id)?;
        let each = job.record.specification.monte_carlo.realizations;
        Some(each * (1 + job.ahead.evaluations.len() as u64))
    };
    state.active.iter().filter_map(of_job).sum()
}

impl Ahead {
    /// What is computed of a point.
    pub(crate) fn at(&self, point: &Point) -> Option<&Evaluation> {
        self.evaluations.iter().find(|begun| same_point(&begun.point, point))
    }

    /// As [`Ahead::at`].
    pub(crate) fn at_mut(&mut self, point: &Point) -> Option<&mut Evaluation> {
        self.evaluations.iter_mut().find(|begun| same_point(&begun.point, point))
    }
}
