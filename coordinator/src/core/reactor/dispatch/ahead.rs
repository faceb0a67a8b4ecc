//! Parts of a search that are computed before the search comes to them.
//!
//! The search of a job asks for one point after another, and a single evaluation keeps a large fleet
//! busy only for moments. Other groups and other starts do not depend on that point, so theirs are
//! evaluated at the same time. These evaluations are work like any other: their batches are charged to
//! the client and audited. Only disputes and quarantined realizations wait until the search asks for
//! the point, because they may end the job.
//!
//! [`refresh`] makes sure that a job with further parts always has something to send, and that a part
//! begins only when nothing of the others waits to be sent.

use osteon_common::parameters::Point;
use osteon_search::same_point;

use super::{batches, clearance};
use crate::core::ahead::{FollowedBranch, PreparedEvaluation};
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::JobId;
use crate::core::job::{Job, Stage};
use crate::core::reactor::turn::Turn;
use crate::store::EvaluationRecord;

/// Begins evaluations of further parts of a job's search until one waits to be sent.
pub(crate) fn refresh(turn: &mut Turn, id: JobId) {
    while let Some(job) = turn.state.jobs.get_mut(&id) {
        if !turn.state.config.ahead || !computes(job) || job.ahead.has_queue() {
            return;
        }
        job.ahead.next_part = job.ahead.next_part.max(job.search.part() + 1);
        let idle = job.ahead.branches.iter().filter(|it| it.evaluation.is_none());
        let idle: Vec<u64> = idle.map(|it| it.part).collect();
        if idle.into_iter().any(|part| begin(turn, id, part)) {
            return;
        }
        let Some(job) = turn.state.jobs.get_mut(&id) else {
            return;
        };
        // A branch that waits for a point, or for room, shows that the next would wait, too.
        if job.ahead.branches.iter().any(|it| it.evaluation.is_none()) {
            return;
        }
        let part = job.ahead.next_part;
        let Some(branch) = job.search.branch(part) else {
            return;
        };
        job.ahead.next_part += 1;
        job.ahead.branches.push(FollowedBranch { part, branch, evaluation: None });
    }
}

/// Keeps the outcomes of a point that a job's search has asked for, if a branch waits for them: the
/// searches for all groups begin at the same points.
pub(crate) fn keep_if_awaited(job: &mut Job, record: &EvaluationRecord) {
    let waits = |it: &FollowedBranch| {
        it.evaluation.is_none()
            && it.branch.point().is_some_and(|at| same_point(&at, &record.point))
    };
    if job.ahead.branches.iter().any(waits) {
        let prepared = PreparedEvaluation {
            part: None,
            outcomes: record.outcomes.clone(),
            estimated_error: record.estimated_error,
            workers: record.workers.clone(),
            assessment: None,
            // The record is on its way to the store.
            unsaved: None,
        };
        job.ahead.prepare(&record.point, prepared);
    }
}

/// Passes the evaluation of a branch to the branch if `attempt` is one and complete, and begins the next.
pub(crate) fn settle(turn: &mut Turn, id: JobId, attempt: u64) {
    clearance::clear(turn, id, attempt);
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let has_attempt = |it: &&mut FollowedBranch| {
        it.evaluation.as_ref().is_some_and(|evaluation| evaluation.attempt == attempt)
    };
    let Some(part) = job.ahead.branches.iter_mut().find(has_attempt).map(|it| it.part) else {
        return;
    };
    if job.ahead.pass_to_branch(part, turn.now) {
        begin(turn, id, part);
        refresh(turn, id);
    }
}

/// Gives a job's search the evaluation of the point that it asks for, if one is under way.
pub(crate) fn adopt(job: &mut Job, point: &Point) -> Option<PendingEvaluation> {
    let is_at = |it: &&mut FollowedBranch| {
        it.evaluation.as_ref().is_some_and(|evaluation| same_point(&evaluation.point, point))
    };
    job.ahead.branches.iter_mut().find(is_at)?.evaluation.take()
}

/// Drops what only parts before `part` need: the search has come to this part.
pub(crate) fn drop_before(turn: &mut Turn, id: JobId, part: u64) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    job.ahead.drop_before(part);
    let passed = job.ahead.branches.extract_if(.., |it| it.part < part);
    let gone: Vec<u64> = passed.filter_map(|it| Some(it.evaluation?.attempt)).collect();
    batches::revoke_attempts(turn, id, &gone);
}

/// Drops the evaluation of the last branch of the job that has most of them; returns whether there is
/// one. The branch begins again when there is room.
pub(crate) fn drop_last(turn: &mut Turn) -> bool {
    let count = |id: &JobId| {
        let evaluations = turn.state.jobs.get(id)?.ahead.evaluations().count();
        (evaluations > 0).then_some((evaluations, *id))
    };
    let Some((_, id)) = turn.state.active.iter().filter_map(count).max() else {
        return false;
    };
    let branches = turn.state.jobs.get_mut(&id).map(|job| &mut job.ahead.branches);
    let last = branches.into_iter().flatten().rev().find_map(|it| it.evaluation.take());
    batches::revoke_attempts(turn, id, &Vec::from_iter(last.map(|evaluation| evaluation.attempt)));
    true
}

/// Drops everything that may contain answers of a banned host.
pub(crate) fn forget(turn: &mut Turn, id: JobId, host: &str) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let gone: Vec<u64> = job.ahead.evaluations().map(|it| it.attempt).collect();
    job.ahead.forget(host);
    batches::revoke_attempts(turn, id, &gone);
}

pub(crate) fn drop_all(turn: &mut Turn, id: JobId) {
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let ahead = std::mem::take(&mut job.ahead);
    let gone: Vec<u64> = ahead.evaluations().map(|it| it.attempt).collect();
    batches::revoke_attempts(turn, id, &gone);
}

/// Returns the number of realizations that the known parts of a search will need at least, beyond
/// those of the evaluation it asked for: those that wait, and one evaluation for each further part.
pub(crate) fn remaining_realizations(job: &Job) -> u64 {
    let waiting: u64 = job.ahead.evaluations().map(PendingEvaluation::queued).sum();
    let further = job.search.parts().saturating_sub(job.ahead.next_part);
    waiting + further * job.record.specification.monte_carlo.realizations
}

/// Returns whether parts of a job's search may be computed now.
fn computes(job: &Job) -> bool {
    let under_way = match job.stage {
        Stage::Computing(_)
        | Stage::Completing(_)
        | Stage::StoringEvaluation { .. }
        | Stage::StoringPrepared { .. } => true,
        Stage::StoringSubmission
        | Stage::Waiting
        | Stage::Replaying { .. }
        | Stage::StoringEnd(_) => false,
    };
    // Stored evaluations that the search has not received tell more than branches.
    let is_replayed = job.search.evaluations() >= job.stored;
    under_way && is_replayed && !job.cancelled && !job.restart_pending
}

/// Begins the evaluation of the pending point of a branch. Points that are known already are passed
/// to it first; a branch that has ended is removed. Returns whether realizations wait to be sent.
fn begin(turn: &mut Turn, id: JobId, part: u64) -> bool {
    loop {
        let attempt = turn.state.new_attempt();
        let realizations_max = turn.state.config.active_realizations_max;
        let in_memory = turn.state.realizations();
        let Some(job) = turn.state.jobs.get_mut(&id) else {
            return false;
        };
        let Some(at) = job.ahead.branches.iter().position(|it| it.part == part) else {
            return false;
        };
        let Some(point) = job.ahead.branches[at].branch.point() else {
            job.ahead.branches.remove(at);
            return false;
        };
        if job.ahead.tell_prepared(at, &point) {
            continue;
        }
        let realizations = job.record.specification.monte_carlo.realizations;
        let is_under_way = job.evaluations().any(|it| same_point(&it.point, &point));
        if is_under_way || in_memory + realizations > realizations_max {
            return false;
        }
        // The lowest number that it may get. The number only decides which batches are audited.
        let number = job.search.evaluations() + 1;
        let evaluation = job.new_evaluation(number, attempt, point, &turn.state.config);
        let waits = !evaluation.queue.is_empty();
        job.ahead.branches[at].evaluation = Some(evaluation);
        // All of it may have been saved.
        if !job.ahead.pass_to_branch(part, turn.now) {
            return waits;
        }
    }
}
