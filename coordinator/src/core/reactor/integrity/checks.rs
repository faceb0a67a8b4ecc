//! Checks of answers against each other: batches that are computed twice, and disputes between
//! answers that differ.

use std::time::Duration;

use osteon_common::outcome::RealizationResult;

use super::bans;
use crate::core::audit;
use crate::core::ballot::{Ballot, BallotResult, Cast, Contradiction, Vote};
use crate::core::batch::Assignment;
use crate::core::dispute::Dispute;
use crate::core::evaluation::{Audit, PendingEvaluation};
use crate::core::failure::{RunFailure, describe_answer};
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::job::Job;
use crate::core::proofs::SetupKey;
use crate::core::reactor::dispatch::{
    batches, clearance, new_proof, overdue, poison, sizing, votes,
};
use crate::core::reactor::lifecycle::jobs;
use crate::core::reactor::turn::Turn;
use crate::core::state::State;
use crate::core::worker_name::WorkerName;

/// Number of hosts that the reason for a ban names.
const HOSTS_SHOWN_MAX: usize = 3;

/// Queues an audit of a part of a batch that a worker has just answered, if one is due and another host
/// can compute it.
pub(crate) fn audit(state: &mut State, worker: WorkerId, batch: BatchId, assignment: &Assignment) {
    let (key, fraction) = (state.config.audit_key, state.config.audit_fraction);
    let Some(host) = state.workers.get(&worker).map(|attached| attached.name.host()) else {
        return;
    };
    if fraction <= 0.0 || !state.can_check(host) {
        return;
    }
    let Some(attached) = state.workers.get_mut(&worker) else {
        return;
    };
    let least = sizing::audit_least(attached, assignment.job);
    let due = attached.next_audit;
    let (chosen, next) = audit::choose((&key, fraction), (batch, least), assignment.indices, due);
    attached.next_audit = next;
    let by = attached.name.clone();
    if let Some(indices) = chosen
        && let Some(evaluation) = state.evaluation_of_mut(assignment)
    {
        if indices.end() == assignment.indices.end() {
            evaluation.vouch(&by);
        }
        evaluation.audits.push_back(Audit { indices, by, lost: 0 });
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
    let hosts = [0, 1].map(|i| votes[i].by.host().to_owned());
    let Some(dispute) = Dispute::new(indices, votes.clone(), turn.now) else {
        let mut ballot = Ballot::new(indices);
        for vote in votes {
            if let Cast::Contradicts(found) = ballot.cast(vote) {
                contradicts_itself(turn, assignment, by, *found);
            }
        }
        return;
    };
    let evaluation = turn.state.evaluation_of_mut(assignment);
    let Some(evaluation) = evaluation else {
        return;
    };
    let is_known = |it: &Dispute| hosts.iter().all(|host| it.has_vote_of(host));
    if !evaluation.disputes.iter().any(is_known) {
        tracing::warn!(job = %assignment.job, one = hosts[0], other = hosts[1],
            first = indices.first, "two hosts answer differently; others decide");
        evaluation.disputes.push(dispute);
    }
}

/// Bans a host that has given two answers to the same realization. If there is no other host, the job
/// fails instead: nobody could compute it.
pub(crate) fn contradicts_itself(
    turn: &mut Turn,
    assignment: &Assignment,
    by: &WorkerName,
    contradiction: Contradiction,
) {
    let [(_, earlier), (_, later)] = contradiction.answers;
    if turn.state.has_several_hosts() {
        let what = format!("{} and as {}", describe_answer(earlier), describe_answer(later));
        let reason = format!("answered realization {} as {what}", contradiction.index);
        bans::ban(turn, by, assignment.job, reason);
    } else if let Some(point) = turn.state.point_of(assignment) {
        let contradiction = Box::new(contradiction);
        jobs::fail(turn, assignment.job, &RunFailure::Contradiction { contradiction, point });
    }
}

/// Takes in the proof of a worker.
pub(crate) fn take_proof(
    turn: &mut Turn,
    (worker, batch): (WorkerId, BatchId),
    assignment: &Assignment,
    solved: Vec<RealizationResult>,
    by: &WorkerName,
) {
    let setup = turn.state.proofs.with_attempt(assignment.attempt).map(|(setup, _)| setup);
    turn.state.settle(batch);
    let Some(setup) = setup else {
        return;
    };
    if let Some(attached) = turn.state.workers.get_mut(&worker) {
        attached.proven.insert(setup);
    }
    let Some(proofs) = turn.state.proofs.for_setup_mut(&setup) else {
        return;
    };
    let count = proofs.indices().count;
    proofs.give(by, turn.now);
    let cast = proofs.ballot.cast(Vote { by: by.clone(), solved });
    turn.state.count_checked(by, count);
    match cast {
        Cast::Counted => decide_proofs(turn, &setup),
        Cast::Contradicts(found) => contradicts_itself(turn, assignment, by, *found),
    }
}

/// Bans the hosts whose proofs of a setup differ from that of the majority, and lets evaluations continue
/// that waited for it.
pub(crate) fn decide_proofs(turn: &mut Turn, setup: &SetupKey) {
    ban_outvoted_by_proofs(turn, setup);
    let jobs: Vec<JobId> = turn.state.active_jobs_of(setup).collect();
    for id in jobs {
        let attempts = turn.state.jobs.get(&id).into_iter().flat_map(Job::needed_evaluations);
        let attempts: Vec<u64> = attempts.map(|evaluation| evaluation.attempt).collect();
        for attempt in attempts {
            jobs::settle(turn, id, attempt);
        }
    }
}

/// Bans the hosts whose proofs of a setup differ from that of the majority.
fn ban_outvoted_by_proofs(turn: &mut Turn, setup: &SetupKey) {
    let Some(proofs) = turn.state.proofs.for_setup(setup) else {
        return;
    };
    if proofs.ballot.is_unanimous() {
        // Saves counting the voters among a thousand hosts after each proof.
        return;
    }
    let verdict = proofs.ballot.verdict(clearance::proof_voters(turn.state, setup, turn.now));
    let job = turn.state.active_jobs_of(setup).next();
    if let Some((verdict, job)) = verdict.zip(job) {
        ban_outvoted(turn, job, verdict);
    }
}

/// Takes in the answer of a tie-breaker.
pub(crate) fn take_tie_break(
    turn: &mut Turn,
    batch: BatchId,
    assignment: &Assignment,
    solved: Vec<RealizationResult>,
    by: &WorkerName,
) {
    let has_tie_breaker = |dispute: &Dispute| dispute.tie_breakers.contains(&batch);
    let find_dispute = |it: &mut PendingEvaluation| it.disputes.iter().position(has_tie_breaker);
    let at = turn.state.evaluation_of_mut(assignment).and_then(find_dispute);
    turn.state.settle(batch);
    let Some((at, evaluation)) = at.zip(turn.state.evaluation_of_mut(assignment)) else {
        return;
    };
    match evaluation.disputes[at].ballot.cast(Vote { by: by.clone(), solved }) {
        Cast::Counted => decide_dispute(turn, assignment.job, assignment.attempt, at),
        Cast::Contradicts(found) => contradicts_itself(turn, assignment, by, *found),
    }
}

/// Ends a dispute of an evaluation if one answer has the majority.
fn decide_dispute(turn: &mut Turn, job: JobId, attempt: u64, at: usize) {
    let has_attempt = |it: &&PendingEvaluation| it.attempt == attempt;
    let found = turn.state.jobs.get(&job).and_then(|job| job.evaluations().find(has_attempt));
    let Some(dispute) = found.and_then(|evaluation| evaluation.disputes.get(at)) else {
        return;
    };
    let is_late = |batch| overdue::is_overdue(turn.state, batch, turn.now);
    let voters = votes::voters(turn.state, dispute, is_late);
    let Some(verdict) = dispute.ballot.verdict(voters) else {
        return;
    };
    let Some(job_) = turn.state.jobs.get_mut(&job) else {
        return;
    };
    let Some(evaluation) = job_.evaluations_mut().find(|it| it.attempt == attempt) else {
        return;
    };
    let (point, Dispute { ballot, tie_breakers, .. }) =
        (evaluation.point, evaluation.disputes.remove(at));
    for tie_breaker in tie_breakers {
        batches::revoke(turn, tie_breaker);
    }
    if let Some(found) = verdict.outvoted.first() {
        new_proof::replace(turn, (job, point), found.index, &ballot);
    }
    ban_outvoted(turn, job, verdict);
}

/// Bans the hosts that were outvoted.
fn ban_outvoted(turn: &mut Turn, job: JobId, verdict: BallotResult) {
    let BallotResult { agreeing, outvoted } = verdict;
    let (first, others) = agreeing.split_at(agreeing.len().min(HOSTS_SHOWN_MAX));
    let further =
        if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
    for Contradiction { index, answers: [(_, right), (worker, wrong)], .. } in outvoted {
        let reason = format!(
            "answered realization {index} of job {job} with {}, while {}{further} agree on {}",
            describe_answer(wrong),
            first.join(", "),
            describe_answer(right)
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
    let setups: Vec<SetupKey> = turn.state.proofs.setups().copied().collect();
    for setup in setups {
        clearance::look_for_majority(turn, &setup);
        // A worker may have left that was awaited, so that the votes have a majority now.
        ban_outvoted_by_proofs(turn, &setup);
    }
    for job in active {
        // Hosts may have left whose votes a dispute waited for.
        let disputed = turn.state.jobs.get(&job).and_then(Job::evaluation);
        let disputed = disputed.map(|it| (it.attempt, it.disputes.len()));
        for at in (0..disputed.map_or(0, |(_, count)| count)).rev() {
            decide_dispute(turn, job, disputed.map_or(0, |(attempt, _)| attempt), at);
        }
        for attempt in give_up_audits(turn.state, job) {
            jobs::settle(turn, job, attempt);
        }
        if let Some((failure, ballot)) = find_undecided(turn.state, job, turn.now) {
            if let Some((RunFailure::Contradiction { contradiction, point }, ballot)) =
                Some(&failure).zip(ballot)
            {
                new_proof::replace(turn, (job, *point), contradiction.index, &ballot);
            }
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
    let attempts: Vec<u64> = job.needed_evaluations().map(|it| it.attempt).collect();
    let with = job.needed_evaluations_mut().filter(|it| !it.audits.is_empty());
    let pending: Vec<_> = with.map(|it| (it.attempt, std::mem::take(&mut it.audits))).collect();
    for (attempt, mut audits) in pending {
        audits.retain(|audit| state.can_check(audit.by.host()));
        let job = state.jobs.get_mut(&id);
        if let Some(evaluation) = job.and_then(|job| job.certain_evaluation_mut(attempt)) {
            evaluation.audits = audits;
        }
    }
    attempts
}

/// Returns the failure of a job with a dispute that cannot be decided, or with workers whose proofs
/// contradict each other, if there is one, with the votes of the dispute.
fn find_undecided(
    state: &State,
    job: JobId,
    now: Duration,
) -> Option<(RunFailure, Option<Ballot>)> {
    let evaluation = state.jobs.get(&job)?.evaluation()?;
    let setup = state.jobs.get(&job)?.setup;
    if let Some(proofs) = state.proofs.for_setup(&setup)
        && let Some(since) = proofs.undecided_since
        && now.saturating_sub(since)
            > state.config.expiry * if proofs.out.is_empty() { 1 } else { 2 }
    {
        let contradiction = Box::new(proofs.ballot.contradiction()?);
        let point = proofs.point();
        return Some((RunFailure::Contradiction { contradiction, point }, None));
    }
    let hopeless = |dispute: &&Dispute| {
        let patient = now.saturating_sub(dispute.since) <= state.config.expiry;
        let others = |name: &WorkerName| !dispute.has_vote_of(name.host());
        let nobody = !state.answers_batches(others);
        let lethal = poison::is_poison(state, &dispute.crashes, others, now);
        let is_waited_for = |tie_breaker| overdue::is_waited_for(state, tie_breaker, now);
        !dispute.tie_breakers.iter().copied().any(is_waited_for) && (lethal || (nobody && !patient))
    };
    let dispute = evaluation.disputes.iter().find(hopeless)?;
    let contradiction = Box::new(dispute.ballot.contradiction()?);
    let point = evaluation.point;
    Some((RunFailure::Contradiction { contradiction, point }, Some(dispute.ballot.clone())))
}
