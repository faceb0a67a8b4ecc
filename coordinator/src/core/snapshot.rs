//! Snapshots: the state of a job at one moment, as clients see it.

use std::time::Duration;

use osteon_proto::choice::{JOB_FAILURE, JOB_KIND, JOB_STATUS};
use osteon_proto::timestamp;
use osteon_proto::v1::{JobSnapshot, JobState};

use crate::core::batch::Purpose;
use crate::core::ids::JobId;
use crate::core::job::{EndedJob, Job, Stage};
use crate::core::state::{HostLosses, State};

/// Without an answer for this long, a snapshot says what the job waits for.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum number of failing hosts that are named, and of workers that do not answer.
const UNFIT_SHOWN_MAX: usize = 3;

/// Returns the snapshot of `id` at `now`; `None` if no client can know the job yet.
pub(crate) fn job_snapshot(state: &State, id: JobId, now: Duration) -> Option<JobSnapshot> {
    if let Some(job) = state.ended.get(&id) {
        return Some(ended_snapshot(state, job));
    }
    let job = state.jobs.get(&id)?;
    let specification = &job.record.specification;
    let realizations = specification.monte_carlo.realizations;
    let mut snapshot = JobSnapshot {
        job: id.to_string(),
        kind: JOB_KIND.number(specification.kind),
        max_evaluations: specification.evaluations_max(),
        realizations,
        workers: workers(state),
        elapsed_s: now.saturating_sub(job.record.accepted).as_secs_f64(),
        sequence: job.sequence,
        client: job.record.client.clone(),
        name: job.record.name.clone(),
        priority: job.record.priority,
        submit_time: Some(timestamp::to_message(job.record.accepted)),
        ..JobSnapshot::default()
    };
    match &job.stage {
        Stage::StoringSubmission => return None,
        Stage::Waiting => snapshot.set_state(JobState::Waiting),
        Stage::Replaying { .. } => snapshot.set_state(JobState::Running),
        Stage::Computing(evaluation) => {
            snapshot.set_state(JobState::Running);
            snapshot.realizations_done = evaluation.filled();
        }
        Stage::Completing(_)
        | Stage::StoringEvaluation { .. }
        | Stage::StoringPrepared { .. }
        | Stage::StoringEnd(_) => {
            snapshot.set_state(JobState::Running);
            snapshot.realizations_done = realizations;
        }
    }
    under_way(state, job, now, &mut snapshot);
    Some(snapshot)
}

fn ended_snapshot(state: &State, job: &EndedJob) -> JobSnapshot {
    let end = &job.end;
    let mut snapshot = JobSnapshot {
        job: end.job.to_string(),
        kind: JOB_KIND.number(job.kind),
        status: JOB_STATUS.number(end.ending.status),
        failure: end.ending.failure.map_or(0, |failure| JOB_FAILURE.number(failure)),
        reason: end.ending.reason.clone().unwrap_or_default(),
        evaluations: end.evaluations,
        max_evaluations: job.max_evaluations,
        // Only complete evaluations count.
        realizations_done: if end.evaluations > 0 { job.realizations } else { 0 },
        realizations: job.realizations,
        best_cost: end.best_cost,
        best_mean: end.best_moments.map(|moments| moments.mean),
        best_coefficient_of_variation: end
            .best_moments
            .map(|moments| moments.coefficient_of_variation),
        workers: workers(state),
        elapsed_s: end.ended.saturating_sub(job.accepted).as_secs_f64(),
        sequence: job.sequence,
        client: job.client.clone(),
        name: job.name.clone(),
        priority: job.priority,
        submit_time: Some(timestamp::to_message(job.accepted)),
        end_time: Some(timestamp::to_message(end.ended)),
        integrity: job.doubts.statement(|ban| state.host_of_ban(ban)),
        ..JobSnapshot::default()
    };
    snapshot.set_state(JobState::Ended);
    snapshot
}

fn workers(state: &State) -> u32 {
    u32::try_from(state.workers.len()).unwrap_or(u32::MAX)
}

fn under_way(state: &State, job: &Job, now: Duration, snapshot: &mut JobSnapshot) {
    let best = job.search.best();
    let moments = best.and_then(|row| row.moments);
    snapshot.evaluations = job.search.evaluations().max(job.stored);
    snapshot.best_cost = best.and_then(|row| row.cost);
    snapshot.best_mean = moments.map(|moments| moments.mean);
    snapshot.best_coefficient_of_variation =
        moments.map(|moments| moments.coefficient_of_variation);
    snapshot.realizations_per_second = job.rate.per_second(now);
    snapshot.waiting_for = describe_wait(state, job, now);
}

/// Describes what a job that has not ended waits for; empty if it does not wait.
fn describe_wait(state: &State, job: &Job, now: Duration) -> String {
    let since = |then: Duration| format!("(since {} s)", now.saturating_sub(then).as_secs());
    if let Some(store_retry) = &job.store_retry {
        let does = match job.stage {
            Stage::Replaying { .. } => "read",
            _ => "write",
        };
        return format!(
            "the store cannot {does} a record; retrying: {} {}",
            store_retry.error,
            since(store_retry.since)
        );
    }
    if state.draining {
        return "the coordinator is shutting down".to_owned();
    }
    let unfit = unfit(state);
    match &job.stage {
        Stage::Computing(evaluation) if !evaluation.quarantine.is_empty() && !unfit.is_empty() => {
            let count = evaluation.quarantine.len();
            format!(
                "a reliable worker for {count} realizations over which others were lost; {unfit}"
            )
        }
        Stage::Waiting => format!(
            "its turn: {} jobs run and {} wait {}",
            state.active.len(),
            state.waiting.len(),
            since(job.last_progress)
        ),
        Stage::Replaying { .. } => format!(
            "its stored evaluations, {} of {} are read again",
            job.search.evaluations(),
            job.stored
        ),
        Stage::Computing(_) if state.workers.is_empty() => {
            format!("no worker is attached {}", since(state.no_worker_since))
        }
        Stage::Computing(evaluation) if !evaluation.disputes.is_empty() => {
            let begun = evaluation.disputes.iter().map(|dispute| dispute.since).min();
            let what = "a third worker, which decides between two whose answers differ";
            let tie_breakers = evaluation.disputes.iter().flat_map(|dispute| &dispute.tie_breakers);
            let asked = tie_breakers
                .filter_map(|tie_breaker| {
                    state.workers.get(&state.batches.get(tie_breaker)?.worker)
                })
                .next();
            let asked = asked.map_or_else(String::new, |it| format!("; {} is asked", it.name));
            format!("{what} {}{asked}", since(begun.unwrap_or(now)))
        }
        Stage::Computing(_) if now.saturating_sub(job.last_progress) >= PATIENCE => {
            oldest_answer(state, job, since).unwrap_or_else(|| {
                format!("a worker that takes batches {}", since(job.last_progress))
            })
        }
        Stage::Computing(_) if !unfit.is_empty() => format!("nothing; {unfit}"),
        Stage::StoringSubmission
        | Stage::Computing(_)
        | Stage::Completing(_)
        | Stage::StoringEvaluation { .. }
        | Stage::StoringPrepared { .. }
        | Stage::StoringEnd(_) => String::new(),
    }
}

/// Describes the answer that a job has been waiting for longest.
fn oldest_answer(state: &State, job: &Job, since: impl Fn(Duration) -> String) -> Option<String> {
    let of_job = state.batches.iter().filter(|(_, batch)| {
        batch.assignment.job == job.record.job && batch.purpose != Purpose::Speculative
    });
    let (id, batch) = of_job.min_by_key(|(_, batch)| batch.sent)?;
    let others = batch.duplicates.len();
    let instead = match others {
        0 if !state.overdue.contains(id) => String::new(),
        0 if job.realization_time.is_known() => {
            "; it is overdue, and no other worker has taken it over".to_owned()
        }
        // The first answer may just take this long.
        0 => "; nothing of this job is answered yet".to_owned(),
        1 => "; another worker computes the same".to_owned(),
        _ => format!("; {others} others compute the same"),
    };
    let (name, count) = (&state.workers.get(&batch.worker)?.name, batch.assignment.indices.count);
    Some(format!("the answer of {name} to {count} realizations {}{instead}", since(batch.sent)))
}

/// Describes the hosts whose workers are lost whatever they hold, and the workers that do not
/// answer; empty if there are none.
fn unfit(state: &State) -> String {
    let failing = state.lost_in_a_row.iter().filter(|(host, _)| state.is_failing(host));
    let describe = |(host, lost): (&String, &HostLosses)| {
        format!("the last {} workers of {host} were lost with their batches", lost.workers.len())
    };
    // A worker that holds nothing or has departed is not waited for.
    let holding = state.workers.values().filter(|worker| !worker.in_flight.is_empty());
    let silent = holding.filter(|worker| state.probation.is_silent(&worker.name));
    let silent = silent.map(|worker| format!("{} does not answer its batches", worker.name));
    let all = failing.map(describe).take(UNFIT_SHOWN_MAX).chain(silent.take(UNFIT_SHOWN_MAX));
    all.collect::<Vec<_>>().join(", ")
}
