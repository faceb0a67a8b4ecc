//! The facts that decide how fast a job is.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::job::JobKind;

use crate::core::batch::{Batch, Purpose};
use crate::core::ids::{JobId, WorkerId};
use crate::core::job::{Job, Stage};
use crate::core::state::{AttachedWorker, State};
use crate::core::worker_name::WorkerName;

/// What is known about a job and its coordinator.
#[derive(Debug, Clone)]
pub(crate) struct JobFacts {
    pub(crate) job: JobId,
    pub(crate) standing: Standing,
    pub(crate) is_search: bool,
    /// Error of the store that refuses a record of the job, and for how long it has done so.
    pub(crate) refusal: Option<(String, Duration)>,
    /// The coordinator is shutting down.
    pub(crate) stopping: bool,
    /// Time since its last answer, its beginning or its acceptance.
    pub(crate) unanswered: Duration,
    /// Jobs that run, and jobs that wait.
    pub(crate) running: u64,
    pub(crate) waiting: u64,
    /// Running jobs of the same client with a higher priority.
    pub(crate) higher: u64,
    /// Other clients with running jobs.
    pub(crate) other_clients: u64,
    /// Attached workers, and of these those that drain, are on probation, or are not suspected of
    /// anything.
    pub(crate) workers: u64,
    pub(crate) draining: u64,
    pub(crate) on_probation: u64,
    pub(crate) reliable: u64,
    /// Time since the last worker departed; meaningless while there is one.
    pub(crate) without_workers: Duration,
    /// Slots of the workers that take batches.
    pub(crate) slots: u64,
    /// Slots that compute realizations which the job has asked for.
    pub(crate) slots_used: f64,
    pub(crate) slots_of_others: f64,
    /// Realizations of each evaluation, and of the one under way those that have an outcome, and
    /// those that no worker holds.
    pub(crate) realizations: u64,
    /// Number of groups and starts that are left, which are computed at the same time.
    pub(crate) parts_left: u64,
    pub(crate) filled: u64,
    pub(crate) queued: u64,
    /// Realizations over which workers were lost, which wait for a reliable worker.
    pub(crate) quarantined: u64,
    /// Time since two workers answered differently.
    pub(crate) disputed: Option<Duration>,
    /// The batch of the job that has been out longest.
    pub(crate) oldest: Option<OldestBatch>,
    /// Realizations per second over the last seconds.
    pub(crate) rate: f64,
}

/// Where a job stands.
#[derive(Debug, Clone)]
pub(crate) enum Standing {
    Ended { status: &'static str, reason: String },
    Waiting,
    Reading { read: u64, stored: u64 },
    Storing,
    Computing,
}

/// A batch that has not been answered.
#[derive(Debug, Clone)]
pub(crate) struct OldestBatch {
    pub(crate) worker: WorkerId,
    pub(crate) name: WorkerName,
    /// Number of its realizations.
    pub(crate) count: u64,
    /// Time since it was sent.
    pub(crate) out: Duration,
    /// Number of other workers that compute the same.
    pub(crate) duplicates: u64,
    pub(crate) overdue: bool,
}

impl JobFacts {
    /// Collects the facts about a job at `now`; `None` if no client can know the job yet.
    pub(crate) fn new(state: &State, id: JobId, now: Duration) -> Option<Self> {
        let mut facts = Self::from_coordinator(state, id, now);
        if let Some(ended) = state.ended.get(&id) {
            let ending = &ended.end.ending;
            let reason = ending.reason.clone().unwrap_or_default();
            facts.standing = Standing::Ended { status: ending.status.name(), reason };
            facts.is_search = ended.kind == JobKind::Identification;
            facts.realizations = ended.realizations;
            return Some(facts);
        }
        let job = state.jobs.get(&id)?;
        let since = |then: Duration| now.saturating_sub(then);
        facts.standing = match &job.stage {
            Stage::StoringSubmission => return None,
            Stage::Waiting => Standing::Waiting,
            Stage::Replaying { .. } => {
                Standing::Reading { read: job.search.evaluations(), stored: job.stored }
            }
            Stage::Computing(_) => Standing::Computing,
            Stage::Completing(_)
            | Stage::StoringEvaluation { .. }
            | Stage::StoringPrepared { .. }
            | Stage::StoringEnd(_) => Standing::Storing,
        };
        let specification = &job.record.specification;
        facts.is_search = specification.kind == JobKind::Identification;
        facts.realizations = specification.monte_carlo.realizations;
        facts.parts_left = job.search.parts().saturating_sub(job.search.part()).max(1);
        facts.refusal = job.store_retry.as_ref().map(|it| (it.error.clone(), since(it.since)));
        facts.unanswered = since(job.last_progress);
        facts.rate = job.rate.per_second(now);
        facts.oldest = oldest(state, id, now);
        if let Some(evaluation) = job.evaluation() {
            facts.filled = evaluation.filled();
            facts.queued = evaluation.queued();
            facts.quarantined = evaluation.quarantine.len() as u64;
            let disputes = evaluation.disputes.iter().map(|dispute| since(dispute.since));
            let proofs =
                state.proofs.for_setup(&job.setup).and_then(|proofs| proofs.undecided_since);
            facts.disputed = disputes.chain(proofs.map(since)).max();
        }
        facts.compare(state, job);
        Some(facts)
    }

    /// Returns the number of realizations that the evaluation under way lacks.
    pub(crate) fn lacking_realizations(&self) -> u64 {
        self.realizations.saturating_sub(self.filled)
    }

    /// Collects what is the same for all jobs, and who uses the slots.
    fn from_coordinator(state: &State, job: JobId, now: Duration) -> Self {
        let mut facts = Self {
            job,
            standing: Standing::Waiting,
            is_search: true,
            refusal: None,
            stopping: state.draining,
            unanswered: Duration::ZERO,
            running: state.active.len() as u64,
            waiting: state.waiting.len() as u64,
            higher: 0,
            other_clients: 0,
            workers: state.workers.len() as u64,
            draining: 0,
            on_probation: 0,
            reliable: 0,
            without_workers: now.saturating_sub(state.no_worker_since),
            slots: 0,
            slots_used: 0.0,
            slots_of_others: 0.0,
            realizations: 0,
            parts_left: 1,
            filled: 0,
            queued: 0,
            quarantined: 0,
            disputed: None,
            oldest: None,
            rate: 0.0,
        };
        for worker in state.workers.values() {
            facts.add(state, worker);
        }
        facts
    }

    fn add(&mut self, state: &State, worker: &AttachedWorker) {
        let on_probation = state.probation.has(&worker.name);
        self.draining += u64::from(worker.draining);
        self.on_probation += u64::from(on_probation && !worker.draining);
        let sound = state.is_sound(worker);
        self.reliable += u64::from(sound && !state.is_failing(worker.name.host()));
        if sound {
            self.slots += u64::from(worker.hello.slots);
        }
        let held = worker.in_flight.iter().filter_map(|batch| state.batches.get(batch));
        let held = held.filter(|batch| batch.purpose != Purpose::Speculative);
        let (mut own, mut others) = (0, 0);
        for Batch { assignment, .. } in held {
            *(if assignment.job == self.job { &mut own } else { &mut others }) +=
                assignment.indices.count;
        }
        // Jobs that share a worker have its slots in proportion to what it holds of them.
        let busy = (own + others).min(worker.hello.slots.into()) as f64;
        if own + others > 0 {
            self.slots_used += busy * own as f64 / (own + others) as f64;
            self.slots_of_others += busy * others as f64 / (own + others) as f64;
        }
    }

    /// Compares a job with the others that run.
    fn compare(&mut self, state: &State, job: &Job) {
        let client = &job.record.client;
        let active = state.active.iter().filter(|id| **id != self.job);
        let active = active.filter_map(|id| Some(&state.jobs.get(id)?.record));
        let mut clients = BTreeSet::new();
        for record in active {
            if record.client != *client {
                clients.insert(&record.client);
            } else if record.priority > job.record.priority {
                self.higher += 1;
            }
        }
        self.other_clients = clients.len() as u64;
    }
}

fn oldest(state: &State, job: JobId, now: Duration) -> Option<OldestBatch> {
    let of_job = state
        .batches
        .iter()
        .filter(|(_, batch)| batch.assignment.job == job && batch.purpose != Purpose::Speculative);
    let (id, batch) = of_job.min_by_key(|(_, batch)| batch.sent)?;
    Some(OldestBatch {
        worker: batch.worker,
        name: state.workers.get(&batch.worker)?.name.clone(),
        count: batch.assignment.indices.count,
        out: now.saturating_sub(batch.sent),
        duplicates: batch.duplicates.len() as u64,
        overdue: state.overdue.contains(id),
    })
}
