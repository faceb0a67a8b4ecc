//! Chooses the workers for audits and tie-breakers.

use super::{batches, poison, schedule, sizing, votes};
use crate::core::batch::{Assignment, Purpose};
use crate::core::dispute::Dispute;
use crate::core::evaluation::Audit;
use crate::core::ids::{JobId, WorkerId};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, State};
use crate::core::worker_name::WorkerName;

/// Sends a worker a tie-breaker or an audit that it is eligible for, if there is one; disputes come
/// first.
pub(crate) fn hand_check(turn: &mut Turn, worker: WorkerId) -> bool {
    let Some(attached) = turn.state.workers.get(&worker) else {
        return false;
    };
    let (name, is_checker) = (attached.name.clone(), turn.state.is_checker(attached));
    let active: Vec<JobId> = turn.state.active.iter().copied().collect();
    for job in active {
        if let Some(at) = dispute_for(turn.state, job, worker) {
            return hand_dispute(turn, job, at, worker);
        }
        if !is_checker {
            continue;
        }
        if let Some((audit, attempt)) = audit_for(turn.state, job, worker, &name) {
            let assignment = Assignment { job, attempt, indices: audit.indices };
            let purpose = Purpose::Audit { lost: audit.lost };
            batches::send(turn, worker, assignment, purpose);
            return true;
        }
    }
    false
}

/// Takes the first audit of a job's evaluations that this worker may compute, or a part of it if nothing
/// else is left to send; returns it with the attempt at the evaluation.
fn audit_for(
    state: &mut State,
    job: JobId,
    worker: WorkerId,
    name: &WorkerName,
) -> Option<(Audit, u64)> {
    let is_of_other_host = |audit: &Audit| audit.by.host() != name.host();
    let (attempt, at, audited) =
        state.jobs.get(&job)?.needed_evaluations().find_map(|evaluation| {
            let at = evaluation.audits.iter().position(is_of_other_host)?;
            Some((evaluation.attempt, at, evaluation.audits.get(at)?.indices.count))
        })?;
    let most = if schedule::next_job(state).is_some() {
        audited
    } else {
        let fleet = sizing::fleet_rate(state, job);
        let all =
            state.jobs.get(&job)?.needed_evaluations().flat_map(|evaluation| &evaluation.audits);
        let waiting = all.map(|audit| audit.indices.count).sum();
        sizing::audit_size(state.workers.get(&worker)?, job, fleet, (audited, waiting))
    };
    let evaluation = state.jobs.get_mut(&job)?.certain_evaluation_mut(attempt)?;
    evaluation.audits_out += 1;
    let audit = evaluation.audits.get_mut(at)?;
    let part = Audit { indices: audit.indices.take(most), ..audit.clone() };
    if audit.indices.count == 0 {
        evaluation.audits.remove(at);
    }
    Some((part, attempt))
}

/// Returns the first dispute of a job on which the host of this worker shall vote: one that lacks votes,
/// and for which no eligible worker has a better reputation.
fn dispute_for(state: &State, job: JobId, worker: WorkerId) -> Option<usize> {
    let evaluation = state.jobs.get(&job)?.evaluation()?;
    let worker = state.workers.get(&worker)?;
    let is_for = |dispute: &Dispute| {
        let reputation =
            |worker: &AttachedWorker| poison::reputation(state, worker, &dispute.crashes);
        let asked = dispute.tie_breakers.iter().filter_map(|id| state.batches.get(id));
        let asked: Vec<&str> =
            asked.filter_map(|batch| Some(state.workers.get(&batch.worker)?.name.host())).collect();
        let may_vote = |worker: &&AttachedWorker| {
            let host = worker.name.host();
            !worker.draining && !dispute.has_vote_of(host) && !asked.contains(&host)
        };
        let best = state.workers.values().filter(may_vote).map(reputation).min();
        votes::are_lacking(state, dispute) && may_vote(&worker) && best == Some(reputation(worker))
    };
    evaluation.disputes.iter().position(is_for)
}

/// Sends a worker the tie-breaker of a dispute.
fn hand_dispute(turn: &mut Turn, job: JobId, at: usize, worker: WorkerId) -> bool {
    let Some(evaluation) = turn.state.evaluation_mut(job) else {
        return false;
    };
    let (attempt, indices) = (evaluation.attempt, evaluation.disputes[at].indices());
    let assignment = Assignment { job, attempt, indices };
    let batch = batches::send(turn, worker, assignment, Purpose::TieBreak);
    if let Some(evaluation) = turn.state.evaluation_mut(job) {
        evaluation.disputes[at].tie_breakers.extend(batch);
    }
    batch.is_some()
}
