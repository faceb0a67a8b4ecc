//! Decides whether the results of an evaluation may count: the majority of the hosts confirms the proofs of all
//! workers that contributed results, and the last answers of these workers are audited.

use std::collections::BTreeSet;
use std::time::Duration;

use super::{overdue, proofs};
use crate::core::evaluation::{Audit, PendingEvaluation};
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::indices::Indices;
use crate::core::proofs::SetupKey;
use crate::core::reactor::turn::Turn;
use crate::core::state::State;
use crate::core::worker_name::WorkerName;

/// Returns the number of hosts whose votes on a setup count: those that have voted, and those whose
/// answers are on their way.
pub(crate) fn proof_voters(state: &State, setup: &SetupKey, now: Duration) -> usize {
    let Some(proofs) = state.proofs.for_setup(setup) else {
        return 0;
    };
    if proofs.out.is_empty() {
        return proofs.ballot.count();
    }
    let awaited = proofs.out.iter().filter(|(_, batch)| !overdue::is_overdue(state, **batch, now));
    let awaited = awaited.filter_map(|(id, _)| Some(state.workers.get(id)?.name.host()));
    awaited.chain(proofs.ballot.hosts()).collect::<BTreeSet<_>>().len()
}

/// Returns the attempts at evaluations of a job whose results come from workers without a proof that the
/// majority confirms. They are not saved: after a restart nobody would know that they do not count yet.
pub(crate) fn unproven_attempts(state: &State, job: JobId, now: Duration) -> BTreeSet<u64> {
    let Some(job) = state.jobs.get(&job) else {
        return BTreeSet::new();
    };
    let Some(proofs) = state.proofs.for_setup(&job.setup) else {
        return BTreeSet::new();
    };
    let voters = proof_voters(state, &job.setup, now);
    let confirms =
        |name: &WorkerName| proofs.is_given_by(name) && proofs.ballot.confirms(name.host(), voters);
    let unproven =
        job.needed_evaluations().filter(|evaluation| !evaluation.workers.iter().all(confirms));
    unproven.map(|evaluation| evaluation.attempt).collect()
}

/// What the results of a worker need before they count.
enum Need {
    Nothing,
    /// Its proof, or votes of other hosts, that are on their way.
    Votes,
    /// Its proof, for which it has not been asked.
    Proof(WorkerId),
    /// It cannot give its proof any more: its last answer is audited instead, which the evaluation waits for.
    Audit,
}

/// Decides whether the results of a complete evaluation may count, and asks for what is missing.
pub(crate) fn clear(turn: &mut Turn, id: JobId, attempt: u64) {
    let found =
        turn.state.jobs.get(&id).and_then(|job| Some((job, job.certain_evaluation(attempt)?)));
    let Some((job, evaluation)) = found else {
        return;
    };
    if evaluation.is_cleared || evaluation.filled() < evaluation.realizations() {
        return;
    }
    let setup = job.setup;
    let state = &*turn.state;
    let voters = proof_voters(state, &setup, turn.now);
    let names = evaluation.workers.iter().enumerate();
    let needs: Vec<(usize, Need)> = names
        .map(|(place, name)| {
            (place, clearance_need(state, (evaluation, place), name, (&setup, voters), turn.now))
        })
        .collect();
    let mut is_cleared = true;
    let mut audited = Vec::new();
    for (place, need) in needs {
        is_cleared &= matches!(need, Need::Nothing | Need::Audit);
        match need {
            Need::Nothing | Need::Votes => {}
            Need::Proof(worker) => proofs::ask(turn, worker, id),
            Need::Audit => audited.push(place),
        }
    }
    let Some(job) = turn.state.jobs.get_mut(&id) else {
        return;
    };
    let Some(evaluation) = job.certain_evaluation_mut(attempt) else {
        return;
    };
    for place in audited {
        audit_last(evaluation, place, u64::MAX);
    }
    if is_cleared {
        evaluation.is_cleared = true;
        audit_last_answers(turn, id, attempt);
    }
}

/// Queues an audit of the last realization of each worker, so that a machine that has broken meanwhile is found
/// before the evaluation counts, even if it broke within its last answer. Of attached workers none is queued if
/// there are so many that these would be more than the fraction of the realizations that is audited: such a machine
/// is found by its next audit, which never comes for a worker that has left.
fn audit_last_answers(turn: &mut Turn, id: JobId, attempt: u64) {
    let fraction = turn.state.config.audit_fraction;
    let state = &*turn.state;
    let Some(evaluation) = state.jobs.get(&id).and_then(|job| job.certain_evaluation(attempt))
    else {
        return;
    };
    if fraction <= 0.0 {
        return;
    }
    let are_few = evaluation.workers.len() as f64 <= fraction * evaluation.realizations() as f64;
    let attached: BTreeSet<&WorkerName> = state.workers.values().map(|one| &one.name).collect();
    let is_due = |(place, name): &(usize, &WorkerName)| {
        !evaluation.vouched.contains(place)
            && (are_few || !attached.contains(name))
            && state.can_check(name.host())
    };
    let due = evaluation.workers.iter().enumerate().filter(is_due);
    let due: Vec<(usize, WorkerName)> = due.map(|(place, name)| (place, name.clone())).collect();
    for (place, name) in due {
        let job = turn.state.jobs.get_mut(&id);
        if let Some(evaluation) = job.and_then(|job| job.certain_evaluation_mut(attempt)) {
            audit_last(evaluation, place, 1);
            turn.state.count_checked(&name, 1);
        }
    }
}

/// Returns what the results of the worker at a place of an evaluation need.
fn clearance_need(
    state: &State,
    (evaluation, place): (&PendingEvaluation, usize),
    name: &WorkerName,
    (setup, voters): (&SetupKey, usize),
    now: Duration,
) -> Need {
    let Some(proofs) = state.proofs.for_setup(setup) else {
        // As long as all workers are of one host, nothing can be compared.
        return Need::Nothing;
    };
    if proofs.is_given_by(name) {
        return match proofs.ballot.confirms(name.host(), voters) {
            true => Need::Nothing,
            false => Need::Votes,
        };
    }
    let attached = state.workers.iter().find(|(_, worker)| worker.name == *name);
    let is_late = |batch: &BatchId| overdue::is_overdue(state, *batch, now);
    match attached.map(|(id, _)| (*id, proofs.out.get(id))) {
        Some((id, None)) => Need::Proof(id),
        Some((_, Some(batch))) if !is_late(batch) => Need::Votes,
        _ if evaluation.vouched.contains(&place) || !state.can_check(name.host()) => Need::Nothing,
        _ => Need::Audit,
    }
}

/// Queues an audit of the last realizations of a worker, at most `most` and of one answer, unless they have been
/// audited.
fn audit_last(evaluation: &mut PendingEvaluation, place: usize, most: u64) {
    if !evaluation.vouched.insert(place) {
        return;
    }
    let (Some(last), Some(by)) =
        (evaluation.last_answers.get(place), evaluation.workers.get(place))
    else {
        return;
    };
    let count = last.count.min(most);
    let indices = Indices { first: last.end() - count, count };
    evaluation.audits.push_back(Audit { indices, by: by.clone(), lost: 0 });
}

/// Puts workers on probation that do not give their proof of a setup, and asks further hosts if no answer has a
/// majority.
pub(crate) fn look_for_majority(turn: &mut Turn, setup: &SetupKey) {
    let Some(proofs) = turn.state.proofs.for_setup(setup) else {
        return;
    };
    let late =
        |(_, batch): &(&WorkerId, &BatchId)| overdue::is_overdue(turn.state, **batch, turn.now);
    let names = proofs.out.iter().filter(late).filter_map(|(worker, batch)| {
        let sent = turn.state.batches.get(batch)?.sent;
        Some((turn.state.workers.get(worker)?.name.clone(), sent))
    });
    let late: Vec<(WorkerName, Duration)> = names.collect();
    // The batch stays with the worker: it may be slow, and its answer ends the probation.
    for (name, sent) in &late {
        overdue::begin_probation(turn.state, name, *sent, turn.now);
    }
    ask_for_majority(turn, setup);
}

/// Asks further hosts if no answer of those asked has a majority, and notes since when that is so.
fn ask_for_majority(turn: &mut Turn, setup: &SetupKey) {
    let Some(proofs) = turn.state.proofs.for_setup(setup) else {
        return;
    };
    let voters = proof_voters(turn.state, setup, turn.now);
    let voted = proofs.ballot.count();
    let lacks = proofs.ballot.lacks(voters);
    let now = turn.now;
    if let Some(proofs) = turn.state.proofs.for_setup_mut(setup) {
        let undecided = voted > 1 && lacks > 0;
        proofs.undecided_since = undecided.then(|| proofs.undecided_since.unwrap_or(now));
    }
    if voted < 2 || voters > voted || lacks == 0 {
        return;
    }
    let job = turn.state.active_jobs_of(setup).next();
    if let Some(job) = job {
        proofs::ask_further(turn, job, voted + lacks);
    }
}
