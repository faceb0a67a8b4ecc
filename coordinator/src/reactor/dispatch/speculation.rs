//! Speculative evaluations: points that a search may ask for next, computed by workers that nobody
//! else has work for.
//!
//! Nothing of it is stored, checked or shown before the search asks for the point; then what is
//! there becomes the job's evaluation, and goes on as if it had been begun now. What the search
//! can no longer ask for is dropped. So results, store and digest are those of a search without it.
//!
//! They take nothing from anybody: a worker gets a speculative batch only for slots that are idle, one
//! at a time, and it is taken back (preempted) when there is anything else for these slots. That is
//! why nobody is charged for it.

use std::sync::Arc;

use osteon_common::job::JobKind;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;

use super::batches;
use crate::batch::{Assignment, Purpose};
use crate::config::Config;
use crate::evaluation::Evaluation;
use crate::ids::{BatchId, JobId};
use crate::job::{Job, Speculation, Stage};
use crate::reactor::turn::Turn;
use crate::state::State;
use crate::worker_name::WorkerName;
use osteon_search::same_point;

/// The most candidates of each job.
pub(crate) const CANDIDATES_MAX: usize = 8;
/// Evaluations with more realizations leave no worker idle for long; none is speculative.
const REALIZATIONS_MAX: u64 = 20_000;

/// Begins the evaluation of the point that a job's search asks for, with what is known of it.
pub(crate) fn begin(turn: &mut Turn, id: JobId, point: Point) {
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let number = job.search.evaluations();
    let known =
        job.speculation.evaluations.iter().position(|known| same_point(&known.point, &point));
    let evaluation = match known.map(|at| job.speculation.evaluations.remove(at)) {
        Some(mut known) => {
            known.number = number;
            // Nobody could decide them before.
            known.disputes.iter_mut().for_each(|dispute| dispute.since = turn.now);
            job.rate.add(known.filled(), turn.now);
            known
        }
        None => {
            let realizations = job.record.specification.monte_carlo.realizations;
            Evaluation::new(number, attempt, point, realizations)
        }
    };
    let speculates = speculates(&turn.state.config, job);
    let candidates = if speculates { job.search.likely(CANDIDATES_MAX) } else { Vec::new() };
    let attempt = evaluation.attempt;
    job.stage = Stage::Computing(evaluation);
    adopt_batches(turn.state, id, attempt);
    keep(turn, id, candidates);
}

/// The outcomes of a job's evaluation are there, and on their way to the store: where its search
/// will go is known, though it is not told yet.
pub(crate) fn prepare(turn: &mut Turn, id: JobId, outcomes: &Arc<[Outcome]>) {
    let config = &turn.state.config;
    if let Some(job) = turn.state.jobs.get_mut(&id).filter(|job| speculates(config, job)) {
        let candidates = job.search.likely_after(outcomes, CANDIDATES_MAX);
        keep(turn, id, candidates);
    }
}

/// Drops all speculative evaluations of a job.
pub(crate) fn drop_all(turn: &mut Turn, id: JobId) {
    keep(turn, id, Vec::new());
}

/// Drops the speculative evaluations of a job with answers of a banned worker.
pub(crate) fn forget(turn: &mut Turn, id: JobId, name: &WorkerName) {
    let involves = |evaluation: &Evaluation| {
        evaluation.workers.contains(name)
            || evaluation.disputes.iter().any(|dispute| dispute.involves(name))
    };
    retain(turn, id, |evaluation| !involves(evaluation));
}

/// Drops the speculative evaluations that were begun last, until the bound on realizations in memory
/// is kept.
pub(crate) fn keep_bound(turn: &mut Turn) {
    while realizations(turn.state) > turn.state.config.active_realizations_max {
        let newest = |id: &JobId| {
            let evaluations = &turn.state.jobs.get(id)?.speculation.evaluations;
            evaluations.last().map(|last| (evaluations.len(), *id, last.attempt))
        };
        let Some((_, job, attempt)) = turn.state.active.iter().filter_map(newest).max() else {
            return;
        };
        retain(turn, job, |evaluation| evaluation.attempt != attempt);
    }
}

/// Whether points of a job are computed speculatively.
fn speculates(config: &Config, job: &Job) -> bool {
    let specification = &job.record.specification;
    config.speculation
        && specification.kind == JobKind::Identification
        && specification.monte_carlo.realizations <= REALIZATIONS_MAX
        && !job.cancelled
}

/// Makes the batches of an evaluation that was speculative batches as any other.
fn adopt_batches(state: &mut State, job: JobId, attempt: u64) {
    let of_attempt =
        |assignment: &Assignment| assignment.job == job && assignment.attempt == attempt;
    let held = state.batches.iter().filter(|(_, batch)| of_attempt(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for id in held {
        if let Some(batch) = state.batches.get_mut(&id) {
            batch.purpose = Purpose::Fill;
            batches::charge(state, id);
        }
    }
}

/// Replaces the candidates of a job, and drops the evaluations of all others.
fn keep(turn: &mut Turn, id: JobId, candidates: Vec<Point>) {
    let stays =
        |evaluation: &Evaluation| candidates.iter().any(|at| same_point(at, &evaluation.point));
    retain(turn, id, stays);
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.speculation.candidates = candidates;
    }
}

/// Drops the speculative evaluations of a job that do not meet `stays`.
fn retain(turn: &mut Turn, id: JobId, stays: impl Fn(&Evaluation) -> bool) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let goes = |evaluation: &Evaluation| !stays(evaluation);
    let gone: Vec<u64> = job
        .speculation
        .evaluations
        .extract_if(.., |it| goes(it))
        .map(|gone| gone.attempt)
        .collect();
    if gone.is_empty() {
        return;
    }
    let of_gone =
        |assignment: &Assignment| assignment.job == id && gone.contains(&assignment.attempt);
    let held = turn.state.batches.iter().filter(|(_, batch)| of_gone(&batch.assignment));
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for batch in held {
        batches::revoke(turn, batch);
    }
}

/// Counts the realizations of the evaluations of all active jobs, with speculative ones.
pub(crate) fn realizations(state: &State) -> u64 {
    let of_job = |id: &JobId| {
        let job = state.jobs.get(id)?;
        let each = job.record.specification.monte_carlo.realizations;
        Some(each * (1 + job.speculation.evaluations.len() as u64))
    };
    state.active.iter().filter_map(of_job).sum()
}

impl Speculation {
    /// The speculative evaluation of a point.
    pub(crate) fn at(&self, point: &Point) -> Option<&Evaluation> {
        self.evaluations.iter().find(|begun| same_point(&begun.point, point))
    }

    /// As [`Speculation::at`].
    pub(crate) fn at_mut(&mut self, point: &Point) -> Option<&mut Evaluation> {
        self.evaluations.iter_mut().find(|begun| same_point(&begun.point, point))
    }
}
