//! Speculative evaluations: points that a search may ask for next, computed by workers without
//! other work.
//!
//! Nothing of a speculative evaluation is stored, checked or shown before the search asks for its
//! point. Then its results become the job's evaluation, which continues as if it had just begun.
//! Points that the search can no longer ask for are dropped. So results, store and digest are the
//! same as without speculation.
//!
//! Speculation takes no slot from other work: a worker gets a speculative batch only for idle
//! slots, one at a time, and the batch is revoked (preempted) when there is other work for these
//! slots. Therefore no client is charged for it.

use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;

use super::{ahead, batches};
use crate::config::Config;
use crate::core::batch::{Assignment, Purpose};
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::{BatchId, JobId};
use crate::core::job::{Job, Speculation, Stage};
use crate::core::policy::{CANDIDATES_MAX, SPECULATIVE_REALIZATIONS_MAX};
use crate::core::reactor::turn::Turn;
use crate::core::state::State;
use crate::core::worker_name::WorkerName;
use osteon_search::same_point;

/// Begins the evaluation of the point that a job's search asks for, with any speculative results.
pub(crate) fn begin(turn: &mut Turn, id: JobId, point: Point) {
    let attempt = turn.state.new_attempt();
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let number = job.search.evaluations();
    let known =
        job.speculation.evaluations.iter().position(|known| same_point(&known.point, &point));
    let evaluation = match known.map(|at| job.speculation.evaluations.remove(at)) {
        Some(known) => {
            job.rate.add(known.filled(), turn.now);
            renumber(known, number, turn.now)
        }
        None => match ahead::adopt(job, &point) {
            Some(known) => renumber(known, number, turn.now),
            None => job.new_evaluation(number, attempt, point, &turn.state.config),
        },
    };
    let speculates = speculates(&turn.state.config, job);
    let candidates = if speculates { job.search.candidates(CANDIDATES_MAX) } else { Vec::new() };
    let attempt = evaluation.attempt;
    job.stage = Stage::Computing(evaluation);
    adopt_batches(turn.state, id, attempt);
    keep(turn, id, candidates);
}

/// Returns an evaluation that was begun before the search asked for it, as its evaluation `number`.
fn renumber(mut known: PendingEvaluation, number: u64, now: Duration) -> PendingEvaluation {
    known.number = number;
    // Disputes could not be decided before.
    known.disputes.iter_mut().for_each(|dispute| dispute.since = now);
    known
}

/// Updates the candidates of a job whose evaluation is complete and on its way to the store: the
/// next points of its search are already known, although it has not received the outcomes yet.
pub(crate) fn prepare(turn: &mut Turn, id: JobId, outcomes: &Outcomes) {
    let config = &turn.state.config;
    if let Some(job) = turn.state.jobs.get_mut(&id).filter(|job| speculates(config, job)) {
        let candidates = job.search.candidates_after(outcomes, CANDIDATES_MAX);
        keep(turn, id, candidates);
    }
}

/// Drops all speculative evaluations of a job.
pub(crate) fn drop_all(turn: &mut Turn, id: JobId) {
    keep(turn, id, Vec::new());
}

/// Drops the speculative evaluations of a job that contain answers of a banned host.
pub(crate) fn forget(turn: &mut Turn, id: JobId, host: &str) {
    let has_contribution = |evaluation: &PendingEvaluation| {
        WorkerName::any_of(&evaluation.workers, host)
            || evaluation.disputes.iter().any(|dispute| dispute.has_vote_of(host))
    };
    retain(turn, id, |evaluation| !has_contribution(evaluation));
}

/// Drops the newest speculative evaluations, then those of the last branches, until the limit on
/// realizations in memory is kept.
pub(crate) fn drop_excess(turn: &mut Turn) {
    while turn.state.realizations() > turn.state.config.active_realizations_max {
        let newest = |id: &JobId| {
            let evaluations = &turn.state.jobs.get(id)?.speculation.evaluations;
            evaluations.last().map(|last| (evaluations.len(), *id, last.attempt))
        };
        if let Some((_, job, attempt)) = turn.state.active.iter().filter_map(newest).max() {
            retain(turn, job, |evaluation| evaluation.attempt != attempt);
        } else if !ahead::drop_last(turn) {
            return;
        }
    }
}

/// Returns whether points of a job are computed speculatively.
fn speculates(config: &Config, job: &Job) -> bool {
    let specification = &job.record.specification;
    config.speculation
        && specification.kind == JobKind::Identification
        && specification.monte_carlo.realizations <= SPECULATIVE_REALIZATIONS_MAX
        && !job.cancelled
        // Other parts of the search are certain work.
        && job.ahead.branches.is_empty()
}

/// Turns the speculative batches of an evaluation into ordinary ones.
fn adopt_batches(state: &mut State, job: JobId, attempt: u64) {
    let of_attempt =
        |assignment: &Assignment| assignment.job == job && assignment.attempt == attempt;
    let held = state.batches.iter().filter(|(_, batch)| {
        batch.purpose == Purpose::Speculative && of_attempt(&batch.assignment)
    });
    let held: Vec<BatchId> = held.map(|(id, _)| *id).collect();
    for id in held {
        if let Some(batch) = state.batches.get_mut(&id) {
            batch.purpose = Purpose::Fill;
            let worker = batch.worker;
            state.reorder(worker);
            batches::charge(state, id);
        }
    }
}

/// Replaces the candidates of a job, and drops the evaluations of all other points.
fn keep(turn: &mut Turn, id: JobId, candidates: Vec<Point>) {
    let stays = |evaluation: &PendingEvaluation| {
        candidates.iter().any(|at| same_point(at, &evaluation.point))
    };
    retain(turn, id, stays);
    if let Some(job) = turn.state.jobs.get_mut(&id) {
        job.speculation.candidates = candidates;
    }
}

/// Drops the speculative evaluations of a job for which `stays` is false.
fn retain(turn: &mut Turn, id: JobId, stays: impl Fn(&PendingEvaluation) -> bool) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let goes = |evaluation: &PendingEvaluation| !stays(evaluation);
    let gone: Vec<u64> = job
        .speculation
        .evaluations
        .extract_if(.., |it| goes(it))
        .map(|gone| gone.attempt)
        .collect();
    batches::revoke_attempts(turn, id, &gone);
}

impl Speculation {
    /// Returns the speculative evaluation of a point.
    pub(crate) fn evaluation_at(&self, point: &Point) -> Option<&PendingEvaluation> {
        self.evaluations.iter().find(|begun| same_point(&begun.point, point))
    }

    pub(crate) fn evaluation_at_mut(&mut self, point: &Point) -> Option<&mut PendingEvaluation> {
        self.evaluations.iter_mut().find(|begun| same_point(&begun.point, point))
    }
}
