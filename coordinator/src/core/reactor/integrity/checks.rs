//! Checks of answers against each other: batches that are computed twice, and disputes between
//! answers that differ.

use std::time::Duration;

use osteon_common::outcome::RealizationResult;

use super::bans;
use crate::core::audit;
use crate::core::batch::Assignment;
use crate::core::dispute::{Contradiction, Dispute, Vote, VoteResult};
use crate::core::evaluation::{Audit, PendingEvaluation};
use crate::core::failure::{RunFailure, shown};
use crate::core::ids::{BatchId, JobId};
use crate::core::job::Job;
use crate::core::reactor::dispatch::{overdue, poison};
use crate::core::reactor::lifecycle::jobs;
use crate::core::reactor::turn::Turn;
use crate::core::state::State;
use crate::core::worker_name::WorkerName;

/// Queues an audit of a batch that `by` has just answered, if the batch is chosen for one and
/// another worker can compute it.
pub(crate) fn audit(state: &mut State, assignment: &Assignment, by: &WorkerName) {
    let (key, fraction) = (state.config.audit_key, state.config.audit_fraction);
    if !state.answers_batches(|name| name != by) {
        return;
    }
    let Assignment { job, indices, .. } = *assignment;
    if let Some(evaluation) = state.evaluation_of_mut(assignment)
        && audit::is_chosen(&key, job, evaluation.number, indices.first, fraction)
    {
        evaluation.audits.push_back(Audit { indices, by: by.clone(), lost: 0 });
    }
}

/// Compares an answer with the known results of its indices.
pub(crate) fn compare(
    turn: &mut Turn,
    assignment: &Assignment,
    solved: &[RealizationResult],
    by: &WorkerName,
) {
    let Some(evaluation) = turn.state.evaluation_of_mut(assignment) else {
        return;
    };
    let Some((indices, votes)) = evaluation.compare(assignment.indices, solved, by) else {
        return;
    };
    let [earlier, later] = &votes;
    if earlier.by == later.by {
        let dispute = Dispute::new(indices, votes.clone(), turn.now);
        let what = dispute.contradiction().map_or_else(String::new, |it| {
            let [(_, earlier), (_, later)] = it.answers;
            format!("realization {} as {} and as {}", it.index, shown(earlier), shown(later))
        });
        let reason = format!("answered {what}");
        bans::ban(turn, by, assignment.job, reason);
        return;
    }
    let known =
        |dispute: &Dispute| dispute.has_vote_of(&earlier.by) && dispute.has_vote_of(&later.by);
    if !evaluation.disputes.iter().any(known) {
        tracing::warn!(job = %assignment.job, one = %earlier.by, other = %later.by,
            first = indices.first, "two workers answer differently; a third decides");
        evaluation.disputes.push(Dispute::new(indices, votes, turn.now));
    }
}

/// Takes in the answer of a tie-breaker.
pub(crate) fn tie_broken(
    turn: &mut Turn,
    batch: BatchId,
    assignment: &Assignment,
    solved: Vec<RealizationResult>,
    by: &WorkerName,
) {
    let of_batch = |dispute: &Dispute| dispute.tie_breakers.contains(&batch);
    let found = |it: &mut PendingEvaluation| it.disputes.iter().position(of_batch);
    let at = turn.state.evaluation_of_mut(assignment).and_then(found);
    turn.state.settle(batch);
    let Some((at, evaluation)) = at.zip(turn.state.evaluation_of_mut(assignment)) else {
        return;
    };
    let dispute = &mut evaluation.disputes[at];
    if let Some(result) = dispute.vote(Vote { by: by.clone(), solved }) {
        evaluation.disputes.remove(at);
        ban_outvoted(turn, assignment.job, result);
    }
}

/// Bans the workers that were outvoted.
fn ban_outvoted(turn: &mut Turn, job: JobId, result: VoteResult) {
    let VoteResult { agreeing: [one, other], outvoted } = result;
    for Contradiction { index, answers: [(_, right), (worker, wrong)] } in outvoted {
        let reason = format!(
            "answered realization {index} of job {job} with {}, while {one} and {other} agree on \
             {}",
            shown(wrong),
            shown(right)
        );
        bans::ban(turn, &worker, job, reason);
    }
}

/// Gives up audits that no other worker can compute, and fails jobs whose disputes cannot be
/// decided. An answer whose audit is given up is accepted; two different answers without a third
/// worker end their job.
pub(crate) fn give_up(turn: &mut Turn) {
    if turn.state.draining {
        // The next coordinator checks them.
        return;
    }
    let active: Vec<JobId> = turn.state.active.iter().copied().collect();
    for job in active {
        for attempt in give_up_audits(turn.state, job) {
            jobs::settle(turn, job, attempt);
        }
        if let Some(failure) = undecided(turn.state, job, turn.now) {
            jobs::fail(turn, job, &failure);
        }
    }
}

/// Gives up the audits of a job that no other worker can compute. Returns the attempts at its
/// evaluations, which may be complete now.
fn give_up_audits(state: &mut State, id: JobId) -> Vec<u64> {
    let Some(job) = state.jobs.get_mut(&id) else {
        return Vec::new();
    };
    let attempts: Vec<u64> = job.certain().map(|it| it.attempt).collect();
    let with = job.certain_mut().filter(|it| !it.audits.is_empty());
    let pending: Vec<_> = with.map(|it| (it.attempt, std::mem::take(&mut it.audits))).collect();
    for (attempt, mut audits) in pending {
        audits.retain(|audit| state.answers_batches(|name| *name != audit.by));
        let mut evaluations = state.jobs.get_mut(&id).into_iter().flat_map(Job::certain_mut);
        if let Some(evaluation) = evaluations.find(|it| it.attempt == attempt) {
            evaluation.audits = audits;
        }
    }
    attempts
}

/// Returns the failure of a job with a dispute that cannot be decided, if there is one.
fn undecided(state: &State, job: JobId, now: Duration) -> Option<RunFailure> {
    let evaluation = state.jobs.get(&job)?.evaluation()?;
    let hopeless = |dispute: &&Dispute| {
        let patient = now.saturating_sub(dispute.since) <= state.config.expiry;
        let nobody = !state.answers_batches(|name| !dispute.has_vote_of(name));
        let others = |name: &WorkerName| !dispute.has_vote_of(name);
        let lethal = poison::is_poison(state, &dispute.crashes, others, now);
        let waited_for = |tie_breaker| overdue::is_waited_for(state, tie_breaker, now);
        !dispute.tie_breakers.iter().copied().any(waited_for) && (lethal || (nobody && !patient))
    };
    let dispute = evaluation.disputes.iter().find(hopeless)?;
    let contradiction = Box::new(dispute.contradiction()?);
    Some(RunFailure::Contradiction { contradiction, point: evaluation.point })
}
