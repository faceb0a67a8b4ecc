//! The complete state of a coordinator as plain data. [`crate::core::reactor`] changes it,
//! [`crate::core::sanity`] checks it; nothing here waits, sends or reads a clock.
//!
//! Times are durations since the Unix epoch, given with each event.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;
use osteon_common::outcome::RealizationResult;
use osteon_common::parameters::Point;
use osteon_proto::batch::Work;
use osteon_proto::evaluation::EvaluationInput;

use crate::config::Config;
use crate::core::answer_delay::AnswerDelay;
use crate::core::attachments::Attachments;
use crate::core::audit::NextAudit;
use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::evaluation::PendingEvaluation;
use crate::core::event::Hello;
use crate::core::fairness::Shares;
use crate::core::ids::{BatchId, JobId, LeaseId, WorkerId};
use crate::core::job::{EndedJob, Job, RequestName};
use crate::core::notice::Departure;
use crate::core::policy::{LOST_IN_A_ROW_MAX, SETTLED_MAX};
use crate::core::probation::Probation;
use crate::core::proofs::{Proofs, SetupKey};
use crate::core::rate::Rate;
use crate::core::service_condition::ServiceCondition;
use crate::core::service_order::ServiceOrder;
use crate::core::worker_name::WorkerName;
use crate::store::{BanRecord, JobRecord};

/// Number of lost workers that are remembered per host.
const LOST_SHOWN_MAX: usize = 99;
/// Number of departed workers that are remembered, to be listed.
pub(crate) const DEPARTED_MAX: usize = 64;

/// State of a coordinator.
#[derive(Debug)]
pub struct State {
    pub(crate) config: Config,
    /// Jobs that have not ended.
    pub(crate) jobs: BTreeMap<JobId, Job>,
    /// Jobs that have ended; their output is in the store.
    pub(crate) ended: BTreeMap<JobId, EndedJob>,
    /// The job that each request submitted.
    pub(crate) requests: BTreeMap<RequestName, JobId>,
    /// Jobs that have not begun, in the order of their acceptance; one whose end was taken back is
    /// last.
    pub(crate) waiting: VecDeque<JobId>,
    /// Jobs that are replayed or computed, or whose evaluation is being stored.
    pub(crate) active: BTreeSet<JobId>,
    /// Computing time that the clients of active jobs have received.
    pub(crate) shares: Shares,
    /// The job whose batch was sent last.
    pub(crate) last_served: Option<JobId>,
    /// Jobs that changed since their last published snapshot.
    pub(crate) changed: BTreeSet<JobId>,
    /// Time of the last tick.
    pub(crate) ticked: Duration,
    /// Time when all active jobs were last published.
    pub(crate) published: Duration,
    /// Start time of this process.
    pub(crate) started: Duration,
    /// Time of the last search for jobs to prune; `None` if there was none.
    pub(crate) pruned: Option<Duration>,
    pub(crate) workers: BTreeMap<WorkerId, AttachedWorker>,
    /// The hosts of the attached workers, with their number.
    pub(crate) hosts: BTreeMap<String, usize>,
    /// How often workers of each host attach.
    pub(crate) attachments: Attachments,
    /// What workers computed to prove themselves.
    pub(crate) proofs: Proofs,
    /// The workers that departed last, newest at the end, at most [`DEPARTED_MAX`].
    pub(crate) departed: VecDeque<Departed>,
    /// Workers that returned wrong answers, in the order of their detection, also those whose bans were
    /// lifted.
    pub(crate) banned: Vec<Banned>,
    /// The workers of each host that were lost in a row while they held batches, without an answer
    /// in between.
    pub(crate) lost_in_a_row: BTreeMap<String, HostLosses>,
    /// Workers that accept batches and do not answer them.
    pub(crate) probation: Probation,
    /// Time since which no worker has been attached; meaningless while there is one.
    pub(crate) no_worker_since: Duration,
    pub(crate) batches: BTreeMap<BatchId, Batch>,
    /// The workers that can accept more.
    pub(crate) order: ServiceOrder,
    /// Number of changes of the workers that share the work: attachments, departures, drains, probations.
    pub(crate) fleet_changes: u64,
    /// Overdue batches that wait for a duplicate on another worker; of several duplicates only the
    /// newest is listed.
    pub(crate) overdue: BTreeSet<BatchId>,
    /// Delay of the answers of all workers.
    pub(crate) delay: AnswerDelay,
    /// What it was told of its surroundings.
    pub(crate) condition: ServiceCondition,
    pub(crate) next_job: u64,
    pub(crate) next_lease: u64,
    pub(crate) next_batch: u64,
    pub(crate) next_attempt: u64,
    pub(crate) draining: bool,
}

/// A worker that returned wrong answers. Its host is refused until an operator lifts the ban.
#[derive(Debug)]
pub(crate) struct Banned {
    pub(crate) record: BanRecord,
    /// Time of the next attempt to write its record; `None` once it is durable. Until then no job
    /// reads its stored evaluations: after a crash it would be unknown which of them are wrong.
    pub(crate) store_at: Option<Duration>,
    /// The store refused the record, and it has not been sent again yet.
    pub(crate) refused: bool,
}

/// Lost workers of one host.
#[derive(Debug, Clone, Default)]
pub(crate) struct HostLosses {
    /// Their names, newest last.
    pub(crate) workers: VecDeque<WorkerName>,
    /// Time of the last loss.
    pub(crate) last: Duration,
}

/// A worker that is not attached any more.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Departed {
    pub(crate) worker: WorkerId,
    pub(crate) name: WorkerName,
    /// Time of departure.
    pub(crate) at: Duration,
    /// Number of batches that it held.
    pub(crate) batches: usize,
    pub(crate) why: Departure,
}

/// One stay of a worker, from its attachment to its departure.
#[derive(Debug)]
pub(crate) struct AttachedWorker {
    pub(crate) lease: LeaseId,
    pub(crate) name: WorkerName,
    pub(crate) hello: Hello,
    /// Time of attachment.
    pub(crate) attached: Duration,
    /// Time of its last message.
    pub(crate) last_seen: Duration,
    /// Time of its last answer, or of its attachment.
    pub(crate) answered: Duration,
    /// It has answered at least one batch in this stay.
    pub(crate) has_answered: bool,
    /// Batches that others answered in its place since its last answer to a batch that it held.
    pub(crate) missed: MissedBatches,
    /// Time when the last heartbeat was sent to it.
    pub(crate) heartbeat_sent: Duration,
    /// Batches that it holds, in the order they were sent.
    pub(crate) in_flight: Vec<BatchId>,
    /// Batches by which it proves itself, which come beside the others.
    pub(crate) proofs: Vec<BatchId>,
    /// The setups for which it has proved itself in this stay.
    pub(crate) proven: BTreeSet<SetupKey>,
    /// Answers to batches that it holds, which came before its proof.
    pub(crate) early: Vec<EarlyAnswer>,
    /// When its answers are audited next.
    pub(crate) next_audit: NextAudit,
    /// Batches that it answered or that were revoked, newest last.
    pub(crate) settled: VecDeque<(BatchId, Assignment)>,
    /// Its rate over all jobs.
    pub(crate) rate: Rate,
    /// Its rate in realizations per second, by job.
    pub(crate) rates: BTreeMap<JobId, f64>,
    /// It accepts no more batches.
    pub(crate) draining: bool,
}

/// An answer that waits for the proof of its worker.
#[derive(Debug)]
pub(crate) struct EarlyAnswer {
    pub(crate) batch: BatchId,
    pub(crate) solved: Vec<RealizationResult>,
    pub(crate) elapsed_s: f64,
}

/// Consecutive batches of a worker that others answered, long after it should have.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MissedBatches {
    pub(crate) count: u32,
    /// Time when the worker could begin the first of them; meaningless while there is none.
    pub(crate) since: Duration,
}

impl State {
    /// Returns a coordinator without jobs, as of `now`.
    pub fn new(config: Config, now: Duration) -> Self {
        Self {
            config,
            jobs: BTreeMap::new(),
            ended: BTreeMap::new(),
            requests: BTreeMap::new(),
            waiting: VecDeque::new(),
            active: BTreeSet::new(),
            shares: Shares::default(),
            last_served: None,
            changed: BTreeSet::new(),
            ticked: now,
            published: now,
            started: now,
            pruned: None,
            workers: BTreeMap::new(),
            hosts: BTreeMap::new(),
            attachments: Attachments::default(),
            proofs: Proofs::default(),
            departed: VecDeque::new(),
            banned: Vec::new(),
            lost_in_a_row: BTreeMap::new(),
            probation: Probation::default(),
            no_worker_since: now,
            batches: BTreeMap::new(),
            order: ServiceOrder::default(),
            fleet_changes: 0,
            overdue: BTreeSet::new(),
            delay: AnswerDelay::default(),
            condition: ServiceCondition::default(),
            next_job: 1,
            next_lease: 1,
            next_batch: 1,
            next_attempt: 1,
            draining: false,
        }
    }

    /// Returns whether nothing is left to do.
    pub fn is_idle(&self) -> bool {
        self.active.is_empty() && self.waiting.is_empty() && self.unstored_records() == 0
    }

    /// Returns the number of jobs that have not ended.
    pub(crate) fn unfinished_jobs(&self) -> usize {
        self.jobs.len()
    }

    /// Returns the number of realizations in the evaluations of all active jobs, with speculative ones
    /// and those ahead of their searches.
    pub(crate) fn realizations(&self) -> u64 {
        let count_realizations = |id: &JobId| {
            let job = self.jobs.get(id)?;
            let each = job.record.specification.monte_carlo.realizations;
            let further = job.speculation.evaluations.len() + job.ahead.count();
            Some(each * (1 + further as u64))
        };
        self.active.iter().filter_map(count_realizations).sum()
    }

    /// Returns the number of records on their way to the store.
    pub(crate) fn unstored_records(&self) -> usize {
        let is_on_its_way = |banned: &&Banned| banned.store_at.is_some() && !banned.refused;
        let banned = self.banned.iter().filter(is_on_its_way).count();
        let jobs =
            self.jobs.values().filter(|job| job.stage.is_storing() && job.store_retry.is_none());
        jobs.count() + banned
    }

    /// Returns the work of an assignment while its evaluation is under way.
    pub(crate) fn work(&self, assignment: &Assignment) -> Option<Work> {
        let shared = match self.evaluation_of(assignment) {
            // Attempts are numbered over all jobs.
            Some(it) => Arc::new(self.input(assignment.job, it.attempt, it.point)?),
            None => self.proofs.input(assignment.attempt)?,
        };
        Some(Work {
            evaluation: shared,
            first: assignment.indices.first,
            count: u32::try_from(assignment.indices.count).ok()?,
        })
    }

    /// Returns what the batches of a point of a job have in common, by this number.
    pub(crate) fn input(&self, job: JobId, id: u64, point: Point) -> Option<EvaluationInput> {
        let specification = &self.jobs.get(&job)?.record.specification;
        Some(EvaluationInput {
            id,
            setup: specification.setup.clone(),
            point,
            germs: specification.monte_carlo.germs(),
            random: specification.random,
            observables: specification.observables(),
        })
    }

    /// Returns the evaluation that the job's search asked for, while it is under way.
    pub(crate) fn evaluation_mut(&mut self, job: JobId) -> Option<&mut PendingEvaluation> {
        self.jobs.get_mut(&job)?.evaluation_mut()
    }

    /// Returns the evaluation of an assignment while this attempt at it is under way.
    pub(crate) fn evaluation_of(&self, assignment: &Assignment) -> Option<&PendingEvaluation> {
        let job = self.jobs.get(&assignment.job)?;
        job.evaluations().find(|found| found.attempt == assignment.attempt)
    }

    pub(crate) fn evaluation_of_mut(
        &mut self,
        assignment: &Assignment,
    ) -> Option<&mut PendingEvaluation> {
        let job = self.jobs.get_mut(&assignment.job)?;
        job.evaluations_mut().find(|found| found.attempt == assignment.attempt)
    }

    /// Returns the point of an assignment's realizations, while its evaluation is under way, or its proof.
    pub(crate) fn point_of(&self, assignment: &Assignment) -> Option<Point> {
        let proof_point = || Some(self.proofs.with_attempt(assignment.attempt)?.1.point());
        self.evaluation_of(assignment).map(|it| it.point).or_else(proof_point)
    }

    /// Returns a number for the next attempt at an evaluation.
    pub(crate) fn new_attempt(&mut self) -> u64 {
        self.next_attempt += 1;
        self.next_attempt - 1
    }

    /// Returns the ban of a host that has not been lifted.
    pub(crate) fn ban(&self, host: &str) -> Option<&BanRecord> {
        let is_of_host = |banned: &&Banned| banned.record.worker.host() == host;
        let mut records = self.banned.iter().filter(is_of_host).map(|banned| &banned.record);
        records.find(|record| record.lifted.is_none())
    }

    /// Returns the host of the ban with this number.
    pub(crate) fn host_of_ban(&self, number: u64) -> Option<String> {
        let found = self.banned.iter().find(|banned| banned.record.number == number)?;
        Some(found.record.worker.host().to_owned())
    }

    /// Returns whether the answers of a worker in a job may be wrong: its host was found to compute wrongly
    /// after the job had been accepted. That the host has been repaired since changes nothing.
    pub(crate) fn is_doubtful(&self, name: &WorkerName, job: &JobRecord) -> bool {
        let concerns = |record: &BanRecord| {
            record.worker.host() == name.host()
                && (record.lifted.is_none() || record.at >= job.accepted)
        };
        self.banned.iter().any(|banned| concerns(&banned.record))
    }

    /// Returns the running jobs with a setup, in the order of their identifiers.
    pub(crate) fn active_jobs_of(&self, setup: &SetupKey) -> impl Iterator<Item = JobId> {
        let has_setup = |id: &&JobId| self.jobs.get(id).is_some_and(|job| job.setup == *setup);
        self.active.iter().filter(has_setup).copied()
    }

    /// Returns whether any ban is not durable yet.
    pub(crate) fn has_pending_ban(&self) -> bool {
        self.banned.iter().any(|banned| banned.store_at.is_some())
    }

    /// Returns whether the workers of a host are lost whatever they hold.
    pub(crate) fn is_failing(&self, host: &str) -> bool {
        self.lost_in_a_row.get(host).is_some_and(|lost| lost.workers.len() >= LOST_IN_A_ROW_MAX)
    }

    /// Records that a worker has answered.
    pub(crate) fn note_answer(&mut self, worker: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&worker) {
            worker.has_answered = true;
            self.lost_in_a_row.remove(worker.name.host());
        }
    }

    /// Records that a worker was lost while it held batches.
    pub(crate) fn count_loss(&mut self, name: &WorkerName, now: Duration) {
        let host = name.host();
        if self.lost_in_a_row.len() >= WORKERS_MAX && !self.lost_in_a_row.contains_key(host) {
            self.lost_in_a_row.pop_first();
        }
        let lost = self.lost_in_a_row.entry(host.to_owned()).or_default();
        lost.last = now;
        lost.workers.push_back(name.clone());
        if lost.workers.len() > LOST_SHOWN_MAX {
            lost.workers.pop_front();
        }
        if lost.workers.len() == LOST_IN_A_ROW_MAX {
            tracing::warn!(%host, "workers on this host keep disappearing with the batches they hold");
        }
    }

    /// Returns whether a worker accepts batches and is expected to answer them.
    pub(crate) fn is_sound(&self, worker: &AttachedWorker) -> bool {
        !worker.draining && !self.probation.has(&worker.name)
    }

    /// Returns whether a worker may be one that accepts batches and never answers: it has not answered
    /// anything in this stay, others answered in its place, or it is on probation.
    pub(crate) fn may_be_silent(&self, worker: &AttachedWorker) -> bool {
        !worker.has_answered || worker.missed.count > 0 || !self.is_sound(worker)
    }

    /// Returns whether a worker that satisfies `of` accepts batches and is expected to answer them.
    pub(crate) fn answers_batches(&self, of: impl Fn(&WorkerName) -> bool) -> bool {
        let answers = |worker: &AttachedWorker| of(&worker.name) && self.is_sound(worker);
        !self.draining && self.workers.values().any(answers)
    }

    /// Counts realizations of a worker that are checked beside the audits that are due: these come later by as
    /// much, so that all checks together keep the fraction.
    pub(crate) fn count_checked(&mut self, name: &WorkerName, count: u64) {
        let fraction = self.config.audit_fraction;
        let stays = self.workers.values_mut().filter(|worker| worker.name == *name);
        stays.for_each(|worker| worker.next_audit.left += count as f64 / fraction);
    }

    /// Returns whether an attached worker of another host answers batches, so that it can check answers.
    pub(crate) fn can_check(&self, host: &str) -> bool {
        let other = |worker: &AttachedWorker| worker.name.host() != host && self.is_checker(worker);
        self.has_several_hosts() && !self.draining && self.workers.values().any(other)
    }

    /// Returns whether a worker may check the answers of others: it answers batches. With proofs, that is
    /// known only once it has answered one.
    pub(crate) fn is_checker(&self, worker: &AttachedWorker) -> bool {
        self.is_sound(worker) && (worker.has_answered || !self.config.proofs)
    }

    /// Returns whether the attached workers are of several hosts.
    pub(crate) fn has_several_hosts(&self) -> bool {
        self.hosts.len() > 1
    }

    /// Returns the batches that a worker holds for one purpose.
    pub(crate) fn held_for<'a>(
        &'a self,
        worker: &'a AttachedWorker,
        purpose: Purpose,
    ) -> impl Iterator<Item = BatchId> + 'a {
        let is_for =
            move |id: &BatchId| self.batches.get(id).is_some_and(|it| it.purpose == purpose);
        worker.in_flight.iter().copied().filter(is_for)
    }

    /// Removes a batch, and remembers its assignment with its worker.
    pub(crate) fn settle(&mut self, batch: BatchId) -> Option<Batch> {
        let settled = self.batches.remove(&batch)?;
        self.overdue.remove(&batch);
        if settled.purpose == Purpose::Proof {
            self.proofs.settle(settled.assignment.attempt, settled.worker);
            if let Some(worker) = self.workers.get_mut(&settled.worker) {
                worker.proofs.retain(|held| *held != batch);
            }
            return Some(settled);
        }
        if let Some(evaluation) = self.evaluation_of_mut(&settled.assignment) {
            match settled.purpose {
                Purpose::Fill | Purpose::Exclusive | Purpose::Speculative | Purpose::Proof => {}
                Purpose::Audit { .. } => evaluation.audits_out -= 1,
                Purpose::TieBreak => {
                    for dispute in &mut evaluation.disputes {
                        dispute.tie_breakers.retain(|tie_breaker| *tie_breaker != batch);
                    }
                }
            }
        }
        if let Some(worker) = self.workers.get_mut(&settled.worker) {
            worker.in_flight.retain(|held| *held != batch);
            worker.early.retain(|early| early.batch != batch);
            worker.settled.push_back((batch, settled.assignment));
            if worker.settled.len() > SETTLED_MAX {
                worker.settled.pop_front();
            }
        }
        self.reorder(settled.worker);
        for duplicate in &settled.duplicates {
            if let Some(duplicate) = self.batches.get_mut(duplicate) {
                duplicate.duplicates.retain(|other| *other != batch);
            }
        }
        Some(settled)
    }
}
