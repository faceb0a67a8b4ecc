//! Answers against answers: batches that are computed twice, and a third worker where two differ.

use std::time::Duration;

use osteon_common::outcome::Solved;

use super::{Effects, dispatch, expulsion, jobs, overdue, suspects};
use crate::audit;
use crate::dispute::{Contradiction, Dispute, Verdict, Vote};
use crate::evaluation::{Audit, Evaluation};
use crate::failure::{Failure, shown};
use crate::ids::{BatchId, JobId, WorkerId};
use crate::losses::{Cause, Loss};
use crate::state::{Assignment, Batch, Purpose, Stage, State, Worker};
use crate::worker_name::WorkerName;

/// Workers that may be lost over one audit before it is given up.
const LOST_MAX: u32 = 3;

/// Has a batch that `by` has just answered computed a second time, if it is chosen and there is
/// somebody else.
pub(super) fn audit(state: &mut State, assignment: &Assignment, by: &WorkerName) {
    let (key, fraction) = (state.config.audit_key, state.config.audit_fraction);
    if !state.answers_batches(|name| name != by) {
        return;
    }
    let Assignment { job, indices, .. } = *assignment;
    if let Some(evaluation) = state.attempt_mut(assignment)
        && audit::is_chosen(&key, job, evaluation.number, indices.first, fraction)
    {
        evaluation.audits.push_back(Audit { indices, by: by.clone(), lost: 0 });
    }
}

/// Whether anything waits to be checked.
pub(super) fn any_wait(state: &State) -> bool {
    state.active.iter().any(|id| match state.jobs.get(id).map(|job| &job.stage) {
        Some(Stage::Computing(evaluation)) => {
            !evaluation.audits.is_empty()
                || evaluation.disputes.iter().any(|dispute| dispute.judges.is_empty())
        }
        _ => false,
    })
}

/// Gives a worker something to check, if there is something that it may: disputes first.
pub(super) fn hand_check(
    state: &mut State,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) -> bool {
    let Some(name) = state.workers.get(&worker).map(|worker| worker.name.clone()) else {
        return false;
    };
    let on_probation = state.probation.has(&name);
    let active: Vec<JobId> = state.active.iter().copied().collect();
    for job in active {
        if let Some(at) = to_judge(state, job, worker) {
            return hand_dispute(state, job, at, worker, now, effects);
        }
        if on_probation {
            continue;
        }
        let Some(evaluation) = state.evaluation_mut(job) else {
            continue;
        };
        let round = evaluation.round;
        let of_others = |audit: &Audit| audit.by != name;
        let at = evaluation.audits.iter().position(of_others);
        if let Some(audit) = at.and_then(|at| evaluation.audits.remove(at)) {
            evaluation.audits_out += 1;
            let assignment = Assignment { job, round, indices: audit.indices };
            let purpose = Purpose::Audit { lost: audit.lost };
            dispatch::send(state, worker, assignment, purpose, now, effects);
            return true;
        }
    }
    false
}

/// The first dispute of a job that this worker is to decide: of those that may, nobody can be
/// expected to do better.
fn to_judge(state: &State, job: JobId, worker: WorkerId) -> Option<usize> {
    let Stage::Computing(evaluation) = &state.jobs.get(&job)?.stage else {
        return None;
    };
    let worker = state.workers.get(&worker)?;
    let is_for = |dispute: &Dispute| {
        let standing = |worker: &Worker| suspects::standing(state, worker, &dispute.lost);
        let may = |worker: &&Worker| !worker.draining && !dispute.involves(&worker.name);
        let best = state.workers.values().filter(may).map(standing).min();
        dispute.judges.is_empty() && may(&worker) && best == Some(standing(worker))
    };
    evaluation.disputes.iter().position(is_for)
}

/// Has a worker decide a dispute.
fn hand_dispute(
    state: &mut State,
    job: JobId,
    at: usize,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) -> bool {
    let Some(evaluation) = state.evaluation_mut(job) else {
        return false;
    };
    let (round, indices) = (evaluation.round, evaluation.disputes[at].indices);
    let assignment = Assignment { job, round, indices };
    let batch = dispatch::send(state, worker, assignment, Purpose::TieBreak, now, effects);
    if let Some(evaluation) = state.evaluation_mut(job) {
        evaluation.disputes[at].judges.extend(batch);
    }
    batch.is_some()
}

/// Compares an answer with what is known of its indices.
pub(super) fn compare(
    state: &mut State,
    assignment: &Assignment,
    solved: &[Solved],
    by: &WorkerName,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(evaluation) = state.attempt_mut(assignment) else {
        return;
    };
    let Some((indices, votes)) = evaluation.compare(assignment.indices, solved, by) else {
        return;
    };
    let [earlier, later] = &votes;
    if earlier.by == later.by {
        let dispute = Dispute::new(indices, votes.clone(), now);
        let what = dispute.contradiction().map_or_else(String::new, |it| {
            let [(_, earlier), (_, later)] = it.answers;
            format!("realization {} as {} and as {}", it.index, shown(earlier), shown(later))
        });
        let reason = format!("answered {what}");
        expulsion::expel(state, by, assignment.job, reason, now, effects);
        return;
    }
    let known = |dispute: &Dispute| dispute.involves(&earlier.by) && dispute.involves(&later.by);
    if !evaluation.disputes.iter().any(known) {
        tracing::warn!(job = %assignment.job, one = %earlier.by, other = %later.by,
            first = indices.first, "two workers answer differently; a third decides");
        evaluation.disputes.push(Dispute::new(indices, votes, now));
    }
}

/// Takes the answer of a worker that was to decide.
pub(super) fn judged(
    state: &mut State,
    batch: BatchId,
    assignment: &Assignment,
    solved: Vec<Solved>,
    by: &WorkerName,
    now: Duration,
    effects: &mut Effects,
) {
    let of_batch = |dispute: &Dispute| dispute.judges.contains(&batch);
    let found = |it: &mut Evaluation| it.disputes.iter().position(of_batch);
    let at = state.attempt_mut(assignment).and_then(found);
    state.settle(batch);
    let Some((at, evaluation)) = at.zip(state.attempt_mut(assignment)) else {
        return;
    };
    let dispute = &mut evaluation.disputes[at];
    if let Some(verdict) = dispute.vote(Vote { by: by.clone(), solved }) {
        evaluation.disputes.remove(at);
        execute(state, assignment.job, verdict, now, effects);
    }
}

/// Expels those who were not believed.
fn execute(state: &mut State, job: JobId, verdict: Verdict, now: Duration, effects: &mut Effects) {
    let Verdict { believed: [one, other], liars } = verdict;
    for Contradiction { index, answers: [(_, right), (liar, wrong)] } in liars {
        let reason = format!(
            "answered realization {index} of job {job} with {}, while {one} and {other} agree on \
             {}",
            shown(wrong),
            shown(right)
        );
        expulsion::expel(state, &liar, job, reason, now, effects);
    }
}

/// A worker that had something to check is lost: another does it, up to a point.
pub(super) fn orphaned(state: &mut State, batch: &Batch, loss: &Loss) {
    let blame = u32::from(loss.cause != Cause::Announced);
    let Assignment { indices, .. } = batch.assignment;
    let Purpose::Audit { lost } = batch.purpose else {
        return;
    };
    if !batch.duplicates.is_empty() {
        return;
    }
    if let Some(evaluation) = state.attempt_mut(&batch.assignment)
        && lost + blame < LOST_MAX
        && let Some(by) = evaluation.owner(indices.first)
    {
        evaluation.audits.push_front(Audit { indices, by, lost: lost + blame });
    }
}

/// A worker that was to decide is lost.
pub(super) fn judge_lost(state: &mut State, assignment: &Assignment, batch: BatchId, loss: &Loss) {
    if let Some(evaluation) = state.attempt_mut(assignment)
        && let Some(dispute) = evaluation.disputes.iter_mut().find(|it| it.judges.contains(&batch))
    {
        dispute.lost.add(loss);
    }
}

/// Gives up what nobody is there to check, and what nobody survives to check. Without a check an
/// answer is believed; two different answers without a third are the end of their job.
pub(super) fn give_up(state: &mut State, now: Duration, effects: &mut Effects) {
    if state.draining {
        // The next coordinator checks.
        return;
    }
    let active: Vec<JobId> = state.active.iter().copied().collect();
    for job in active {
        give_up_audits(state, job);
        jobs::store_if_complete(state, job, now, effects);
        if let Some(failure) = undecided(state, job, now) {
            jobs::fail(state, job, &failure, now, effects);
        }
    }
}

fn give_up_audits(state: &mut State, job: JobId) {
    let Some(evaluation) = state.evaluation_mut(job) else {
        return;
    };
    if evaluation.audits.is_empty() {
        return;
    }
    let mut audits = std::mem::take(&mut evaluation.audits);
    audits.retain(|audit| state.answers_batches(|name| *name != audit.by));
    if let Some(evaluation) = state.evaluation_mut(job) {
        evaluation.audits = audits;
    }
}

/// Why a job fails over its disputes, if it does.
fn undecided(state: &State, job: JobId, now: Duration) -> Option<Failure> {
    let Stage::Computing(evaluation) = &state.jobs.get(&job)?.stage else {
        return None;
    };
    let hopeless = |dispute: &&Dispute| {
        let patient = now.saturating_sub(dispute.since) <= state.config.expiry;
        let nobody = !state.answers_batches(|name| !dispute.involves(name));
        let others = |name: &WorkerName| !dispute.involves(name);
        let lethal = suspects::hopeless(state, &dispute.lost, others, now);
        let waited_for = |judge| overdue::is_waited_for(state, judge, now);
        !dispute.judges.iter().copied().any(waited_for) && (lethal || (nobody && !patient))
    };
    let dispute = evaluation.disputes.iter().find(hopeless)?;
    let contradiction = Box::new(dispute.contradiction()?);
    Some(Failure::Contradiction { contradiction, point: evaluation.point })
}
