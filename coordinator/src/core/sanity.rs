//! Checks every cross reference of a state, for tests and simulations.

use std::collections::{BTreeMap, BTreeSet};

use osteon_search::same_point;
use thiserror::Error;

use crate::core::ahead::{Ahead, FollowedBranch};
use crate::core::batch::{Batch, Purpose};
use crate::core::dispute::Dispute;
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::job::{Job, RequestName, Speculation, Stage};
use crate::core::policy::{BATCHES_IN_FLIGHT_MAX, CANDIDATES_MAX, COPIES_MAX, SETTLED_MAX};
use crate::core::state::{Banned, State};
use crate::core::worker_name::WorkerName;

/// An inconsistency of a state.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Inconsistency {
    /// A list of jobs does not hold exactly the jobs in the stage that it is for.
    #[error("job {0} is in a list for another stage, or missing in the list of its stage")]
    JobList(JobId),
    /// A worker and a batch disagree about which worker holds the batch.
    #[error("worker {0} and batch {1} disagree about who holds it")]
    Holding(WorkerId, BatchId),
    /// A worker holds more batches than allowed, more than one speculative batch, or another batch
    /// beside an exclusive one, or too many of its settled batches are remembered.
    #[error("worker {0} holds more than it may")]
    TooMuch(WorkerId),
    /// The duplicates of a batch do not name each other, or differ in their purpose.
    #[error("batch {0} and its duplicates do not match")]
    Duplicates(BatchId),
    /// A batch that is listed as overdue does not exist, is speculative, or is not the newest of
    /// its duplicates.
    #[error("batch {0} cannot be overdue")]
    Overdue(BatchId),
    /// A batch belongs to an evaluation that is not under way.
    #[error("batch {0} belongs to no evaluation under way")]
    Stray(BatchId),
    /// An index is not in exactly one place: filled, queued, in quarantine, or held by a worker.
    #[error("index {index} of job {job} is in {places} places")]
    Index {
        /// The job.
        job: JobId,
        /// The index.
        index: usize,
        /// Number of places.
        places: u32,
    },
    /// The count of filled results is wrong.
    #[error("job {0} miscounts its filled results")]
    Filled(JobId),
    /// A request id does not lead to its job.
    #[error("the request id of job {0} leads elsewhere")]
    RequestId(JobId),
    /// A search has received more evaluations than the store has.
    #[error("the search of job {0} has more evaluations than the store")]
    Stored(JobId),
    /// The audits and disputes of an evaluation do not match the batches for them.
    #[error("job {0} has a wrong count of the audits in progress")]
    Checks(JobId),
    /// A banned worker is attached, or one of its answers counts.
    #[error("worker {0} is banned, but its answers are still used")]
    Banned(WorkerName),
    /// A speculative evaluation is not of one of the candidate points.
    #[error("job {0} has a speculative evaluation that is not a candidate of its search")]
    Speculation(JobId),
    /// An evaluation ahead of a search is of a part that it has passed, or of a wrong point.
    #[error("job {0} has an evaluation ahead of its search that the search will not ask for")]
    Ahead(JobId),
    /// A worker does not have the place that it should have in the order of service.
    #[error("worker {0} has a wrong place in the order of service")]
    Order(WorkerId),
    /// The next identifier is not above all that are in use.
    #[error("an identifier would be assigned twice")]
    Numbers,
}

/// Checks the whole state.
///
/// # Errors
/// The first inconsistency.
pub fn sanity_check(state: &State) -> Result<(), Inconsistency> {
    check_jobs(state)?;
    check_workers(state)?;
    check_batches(state)?;
    if let Some(worker) = state.find_misplaced() {
        return Err(Inconsistency::Order(worker));
    }
    for (&id, job) in &state.jobs {
        for evaluation in job.evaluations() {
            check_evaluation(state, id, evaluation)?;
            check_checks(state, id, evaluation)?;
        }
        check_speculation(job)?;
        check_ahead(state, job)?;
    }
    let jobs = state.jobs.last_key_value().is_some_and(|(last, _)| last.0 >= state.next_job);
    let batches = state.batches.last_key_value();
    let batches = batches.is_some_and(|(last, _)| last.0 >= state.next_batch);
    let leases = state.workers.values().any(|worker| worker.lease.0 >= state.next_lease);
    if jobs || batches || leases { Err(Inconsistency::Numbers) } else { Ok(()) }
}

fn check_jobs(state: &State) -> Result<(), Inconsistency> {
    for (&id, job) in &state.jobs {
        let waiting = state.waiting.iter().filter(|waiting| **waiting == id).count();
        let active = state.active.contains(&id);
        let fits = match &job.stage {
            Stage::Waiting => waiting == 1 && !active,
            Stage::Replaying { .. }
            | Stage::Computing(_)
            | Stage::Completing(_)
            | Stage::StoringEvaluation { .. }
            | Stage::StoringPrepared { .. } => waiting == 0 && active,
            Stage::StoringSubmission | Stage::StoringEnd(_) => waiting == 0 && !active,
        };
        if !fits || state.ended.contains_key(&id) {
            return Err(Inconsistency::JobList(id));
        }
        if job.search.evaluations() > job.stored {
            return Err(Inconsistency::Stored(id));
        }
        let request = RequestName::from_record(&job.record);
        if request.is_some_and(|request| state.requests.get(&request) != Some(&id)) {
            return Err(Inconsistency::RequestId(id));
        }
    }
    for (id, job) in state.active.iter().filter_map(|id| Some((id, state.jobs.get(id)?))) {
        let client = &job.record.client;
        let of_client =
            |id: &&JobId| state.jobs.get(id).is_some_and(|job| job.record.client == *client);
        if state.active.iter().filter(of_client).count() != state.shares.jobs(client) {
            return Err(Inconsistency::JobList(*id));
        }
    }
    let is_lost = |id: &&JobId| !state.jobs.contains_key(id);
    if let Some(id) = state.active.iter().chain(&state.waiting).find(is_lost) {
        return Err(Inconsistency::JobList(*id));
    }
    match state.requests.values().find(|id| is_lost(id) && !state.ended.contains_key(id)) {
        Some(id) => Err(Inconsistency::JobList(*id)),
        None => Ok(()),
    }
}

/// Checks that speculative evaluations are of candidates, at most one of each, while an evaluation
/// is under way.
fn check_speculation(job: &Job) -> Result<(), Inconsistency> {
    let Speculation { candidates, evaluations } = &job.speculation;
    let under_way = is_under_way(job);
    let points: BTreeSet<_> = job.evaluations().map(|it| it.point.bits()).collect();
    let is_candidate =
        |of: &PendingEvaluation| candidates.iter().any(|at| same_point(at, &of.point));
    let fits = evaluations.iter().all(is_candidate)
        && points.len() == job.evaluations().count()
        && candidates.len() <= CANDIDATES_MAX
        && (under_way || candidates.is_empty())
        && evaluations.iter().all(|it| it.audits_out == 0);
    if fits { Ok(()) } else { Err(Inconsistency::Speculation(job.record.job)) }
}

/// Checks that what is computed ahead of a search belongs to parts that it has not passed, is
/// evaluated once, and that something of it waits to be sent if there is room for more.
fn check_ahead(state: &State, job: &Job) -> Result<(), Inconsistency> {
    let Ahead { branches, .. } = &job.ahead;
    let part = job.search.part();
    let mut parts = branches.iter().map(|it| it.part);
    let is_at_its_point = |it: &FollowedBranch| {
        let point = it.branch.point();
        it.evaluation.as_ref().is_none_or(|evaluation| {
            point.is_some_and(|point| same_point(&point, &evaluation.point))
        })
    };
    let banned = state.banned.iter().filter(|banned| banned.record.lifted.is_none());
    let banned = banned.map(|banned| banned.record.worker.host());
    let mut prepared = job.ahead.prepared_evaluations();
    let fits = parts.clone().is_sorted()
        && parts.all(|of| of >= part && of < job.ahead.next_part)
        && branches.iter().all(is_at_its_point)
        && (is_under_way(job) || job.ahead.evaluations().next().is_none())
        && prepared.all(|it| banned.clone().all(|host| !WorkerName::any_of(&it.workers, host)));
    if fits { Ok(()) } else { Err(Inconsistency::Ahead(job.record.job)) }
}

/// Returns whether the evaluations of a job are computed or stored.
fn is_under_way(job: &Job) -> bool {
    matches!(
        job.stage,
        Stage::Computing(_)
            | Stage::Completing(_)
            | Stage::StoringEvaluation { .. }
            | Stage::StoringPrepared { .. }
    )
}

/// Returns whether a batch belongs to this evaluation.
fn is_of(batch: &Batch, job: JobId, evaluation: &PendingEvaluation) -> bool {
    batch.assignment.job == job && batch.assignment.attempt == evaluation.attempt
}

/// Checks that audits and tie-breakers are held by workers, and that no answer of a banned worker
/// counts.
fn check_checks(
    state: &State,
    job: JobId,
    evaluation: &PendingEvaluation,
) -> Result<(), Inconsistency> {
    let count_batches = |purpose: fn(&Purpose) -> bool| {
        let is_counted = |batch: &&Batch| is_of(batch, job, evaluation) && purpose(&batch.purpose);
        state.batches.values().filter(is_counted).count()
    };
    let judged = |dispute: &Dispute| {
        let tie_breakers =
            dispute.tie_breakers.iter().filter_map(|tie_breaker| state.batches.get(tie_breaker));
        let fits = |batch: &&Batch| {
            batch.purpose == Purpose::TieBreak && batch.assignment.indices == dispute.indices()
        };
        tie_breakers.filter(fits).count() == dispute.tie_breakers.len()
    };
    let disputes = &evaluation.disputes;
    let tie_breakers: usize = disputes.iter().map(|dispute| dispute.tie_breakers.len()).sum();
    if count_batches(|purpose| matches!(purpose, Purpose::Audit { .. })) != evaluation.audits_out
        || count_batches(|purpose| *purpose == Purpose::TieBreak) != tie_breakers
        || !disputes.iter().all(judged)
    {
        return Err(Inconsistency::Checks(job));
    }
    for Banned { record, .. } in state.banned.iter().filter(|it| it.record.lifted.is_none()) {
        let host = record.worker.host();
        let attached = WorkerName::any_of(state.workers.values().map(|worker| &worker.name), host);
        let disputes = disputes.iter().any(|dispute| dispute.has_vote_of(host));
        let includes_host = |job: &Job| WorkerName::any_of(&job.workers, host);
        let told = state.jobs.get(&job).is_some_and(includes_host);
        if attached || disputes || told || WorkerName::any_of(&evaluation.workers, host) {
            return Err(Inconsistency::Banned(record.worker.clone()));
        }
    }
    Ok(())
}

fn check_workers(state: &State) -> Result<(), Inconsistency> {
    for (&id, worker) in &state.workers {
        let held = worker.in_flight.len();
        let count = |purpose| state.held_for(worker, purpose).count();
        let alone = count(Purpose::Exclusive) == 0 || held == 1;
        let speculative = count(Purpose::Speculative);
        let remembered = worker.settled.len();
        if held > BATCHES_IN_FLIGHT_MAX || !alone || speculative > 1 || remembered > SETTLED_MAX {
            return Err(Inconsistency::TooMuch(id));
        }
        for batch in worker.in_flight.iter().chain(&worker.proofs) {
            if state.batches.get(batch).map(|batch| batch.worker) != Some(id) {
                return Err(Inconsistency::Holding(id, *batch));
            }
        }
    }
    Ok(())
}

fn check_batches(state: &State) -> Result<(), Inconsistency> {
    let overdue = |id: &&BatchId| {
        let batch = state.batches.get(id);
        batch.is_some_and(|batch| {
            batch.purpose != Purpose::Speculative && batch.duplicates.iter().all(|it| it < id)
        })
    };
    if let Some(id) = state.overdue.iter().find(|id| !overdue(id)) {
        return Err(Inconsistency::Overdue(*id));
    }
    for (&id, batch) in &state.batches {
        let worker = state.workers.get(&batch.worker);
        let all = worker.into_iter().flat_map(|it| it.in_flight.iter().chain(&it.proofs));
        let held = all.filter(|held| **held == id).count();
        if held != 1 {
            return Err(Inconsistency::Holding(batch.worker, id));
        }
        let matches = |other: &BatchId| {
            state.batches.get(other).is_some_and(|other| {
                other.duplicates.iter().filter(|of| **of == id).count() == 1
                    && other.duplicates.len() == batch.duplicates.len()
                    && (other.assignment, other.purpose) == (batch.assignment, batch.purpose)
                    && other.worker != batch.worker
            })
        };
        if !batch.duplicates.iter().all(matches) || batch.duplicates.len() >= COPIES_MAX {
            return Err(Inconsistency::Duplicates(id));
        }
        let attempt = batch.assignment.attempt;
        if batch.purpose == Purpose::Proof {
            let proofs = state.proofs.with_attempt(attempt);
            if proofs.is_none_or(|(_, proofs)| proofs.out.get(&batch.worker) != Some(&id)) {
                return Err(Inconsistency::Stray(id));
            }
            continue;
        }
        let job = state.jobs.get(&batch.assignment.job);
        let asked_for = job.is_some_and(|job| job.certain_evaluation(attempt).is_some());
        let speculative = job
            .is_some_and(|job| job.speculation.evaluations.iter().any(|it| it.attempt == attempt));
        if asked_for == speculative || (batch.purpose == Purpose::Speculative) != speculative {
            return Err(Inconsistency::Stray(id));
        }
    }
    Ok(())
}

/// Checks that every index is in exactly one place.
fn check_evaluation(
    state: &State,
    job: JobId,
    evaluation: &PendingEvaluation,
) -> Result<(), Inconsistency> {
    let realizations = usize::try_from(evaluation.realizations()).unwrap_or(usize::MAX);
    let mut places: Vec<u32> =
        (0..realizations).map(|index| u32::from(evaluation.results.get(index).is_some())).collect();
    if places.iter().map(|place| u64::from(*place)).sum::<u64>() != evaluation.filled() {
        return Err(Inconsistency::Filled(job));
    }
    let queued = evaluation.queue.iter().map(|indices| (indices.first, indices.count));
    let quarantine = evaluation.quarantine.iter().map(|index| (*index, 1));
    // A batch and its duplicates count as one place.
    let out: BTreeMap<u64, u64> = state
        .batches
        .values()
        .filter(|batch| is_of(batch, job, evaluation) && batch.purpose.fills())
        .map(|batch| (batch.assignment.indices.first, batch.assignment.indices.count))
        .collect();
    for (first, count) in queued.chain(quarantine).chain(out) {
        for index in first..first + count {
            if let Some(place) = usize::try_from(index).ok().and_then(|i| places.get_mut(i)) {
                *place += 1;
            }
        }
    }
    match places.iter().position(|places| *places != 1) {
        Some(index) => Err(Inconsistency::Index { job, index, places: places[index] }),
        None => Ok(()),
    }
}
