//! The whole truth of a coordinator as plain data. [`crate::reactor`] changes it,
//! [`crate::sanity`] checks it; nothing here waits, sends or reads a clock.
//!
//! Times are durations since the Unix epoch, given with each event.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;
use osteon_proto::batch::Work;

use crate::batch::{Assignment, Batch, Purpose};
use crate::config::Config;
use crate::evaluation::Evaluation;
use crate::event::Hello;
use crate::fairness::Shares;
use crate::ids::{BatchId, JobId, LeaseId, WorkerId};
use crate::job::{EndedJob, Job, RequestName, Stage};
use crate::notice::Departure;
use crate::probation::Probation;
use crate::rate::Rate;
use crate::store::BanRecord;
use crate::worker_name::WorkerName;

/// Batches that a worker holds at a time: it computes one while the next is on its way.
pub const BATCHES_IN_FLIGHT_MAX: usize = 2;
/// So many workers of a host that are lost in a row make it one that is given only what it cannot
/// do much harm to.
const LOST_IN_A_ROW_MAX: usize = 3;
/// So many of them are remembered.
const LOST_SHOWN_MAX: usize = 99;
/// Workers that went which are remembered, to be listed.
pub(crate) const DEPARTED_MAX: usize = 64;
/// Settled batches that are remembered for each worker, to compare late answers with.
pub(crate) const SETTLED_MAX: usize = 16;

/// State of a coordinator.
#[derive(Debug)]
pub struct State {
    pub(crate) config: Config,
    /// Jobs that have not ended.
    pub(crate) jobs: BTreeMap<JobId, Job>,
    /// Jobs that have ended; what they left is in the store.
    pub(crate) ended: BTreeMap<JobId, EndedJob>,
    /// Job of each request.
    pub(crate) requests: BTreeMap<RequestName, JobId>,
    /// Jobs that are not begun, in the order of their acceptance.
    pub(crate) waiting: VecDeque<JobId>,
    /// Jobs that are computed or whose evaluation is being stored.
    pub(crate) active: BTreeSet<JobId>,
    /// What the clients of active jobs have had.
    pub(crate) shares: Shares,
    /// Job that was handed out last.
    pub(crate) last_served: Option<JobId>,
    /// Jobs that changed since they were published.
    pub(crate) changed: BTreeSet<JobId>,
    /// When time was looked at last.
    pub(crate) ticked: Duration,
    /// When all active jobs were published last.
    pub(crate) published: Duration,
    /// When this life began.
    pub(crate) started: Duration,
    /// When old jobs were looked for last; `None` if they were not.
    pub(crate) pruned: Option<Duration>,
    pub(crate) workers: BTreeMap<WorkerId, Worker>,
    /// Workers that went last, the newest at the end, at most [`DEPARTED_MAX`].
    pub(crate) departed: VecDeque<Departed>,
    /// Workers that compute wrongly, in the order in which they were found.
    pub(crate) banned: Vec<Banned>,
    /// How many workers of a host were lost in a row with what they held, none answering anything
    /// in between.
    pub(crate) lost_in_a_row: BTreeMap<String, LostInARow>,
    /// Workers that take batches and do not answer them.
    pub(crate) probation: Probation,
    /// Since when there has been no worker; meaningless while there is one.
    pub(crate) no_worker_since: Duration,
    pub(crate) batches: BTreeMap<BatchId, Batch>,
    /// Batches that are overdue and wait for another worker that computes the same; of duplicates the
    /// newest.
    pub(crate) overdue: BTreeSet<BatchId>,
    pub(crate) next_job: u64,
    pub(crate) next_lease: u64,
    pub(crate) next_batch: u64,
    pub(crate) next_attempt: u64,
    pub(crate) draining: bool,
}

/// A worker that computes wrongly: refused for the life of the coordinator.
#[derive(Debug)]
pub(crate) struct Banned {
    pub(crate) record: BanRecord,
    /// When its record is written again; `None` once it is durable. Until then no job reads its
    /// stored evaluations: after a crash nobody would know which of them are wrong.
    pub(crate) store_at: Option<Duration>,
    /// The store refused it, and it is not on its way again.
    pub(crate) refused: bool,
}

/// Workers of one host.
#[derive(Debug, Clone, Default)]
pub(crate) struct LostInARow {
    /// Which, the newest.
    pub(crate) workers: VecDeque<WorkerName>,
    /// When the last was lost.
    pub(crate) last: Duration,
}

/// A worker that is not attached any more.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Departed {
    pub(crate) worker: WorkerId,
    pub(crate) name: WorkerName,
    /// When it went.
    pub(crate) at: Duration,
    /// How many batches it held.
    pub(crate) batches: usize,
    pub(crate) why: Departure,
}

/// A stay of a worker.
#[derive(Debug)]
pub(crate) struct Worker {
    pub(crate) lease: LeaseId,
    pub(crate) name: WorkerName,
    pub(crate) hello: Hello,
    /// Since when it is there.
    pub(crate) attached: Duration,
    /// When its last message came.
    pub(crate) last_seen: Duration,
    /// When its last answer came, or it attached.
    pub(crate) answered: Duration,
    /// It has answered something in this stay.
    pub(crate) has_answered: bool,
    /// Batches that others answered in its place, since its last answer to one that it held.
    pub(crate) missed: Missed,
    /// When the last sign of life was given to it.
    pub(crate) heartbeat_sent: Duration,
    /// Batches it holds, in the order they were sent.
    pub(crate) in_flight: Vec<BatchId>,
    /// Batches it answered or was told to forget, newest last.
    pub(crate) settled: VecDeque<(BatchId, Assignment)>,
    /// What it answers, over all jobs.
    pub(crate) rate: Rate,
    /// Realizations per second, by job.
    pub(crate) rates: BTreeMap<JobId, f64>,
    /// It wants no more batches.
    pub(crate) draining: bool,
}

/// Batches in a row that others answered, long after their worker should have.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Missed {
    /// How many.
    pub(crate) count: u32,
    /// When the worker could begin the first of them; means nothing while there is none.
    pub(crate) since: Duration,
}

impl State {
    /// A coordinator that knows no job, as of `now`.
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
            departed: VecDeque::new(),
            banned: Vec::new(),
            lost_in_a_row: BTreeMap::new(),
            probation: Probation::default(),
            no_worker_since: now,
            batches: BTreeMap::new(),
            overdue: BTreeSet::new(),
            next_job: 1,
            next_lease: 1,
            next_batch: 1,
            next_attempt: 1,
            draining: false,
        }
    }

    /// Whether nothing is left to do.
    pub fn is_idle(&self) -> bool {
        self.active.is_empty() && self.waiting.is_empty() && self.unstored() == 0
    }

    /// How many jobs have not ended.
    pub(crate) fn unfinished(&self) -> usize {
        self.jobs.len()
    }

    /// Records on their way to the store.
    pub(crate) fn unstored(&self) -> usize {
        let on_its_way = |banned: &&Banned| banned.store_at.is_some() && !banned.refused;
        let banned = self.banned.iter().filter(on_its_way).count();
        let jobs = self.jobs.values().filter(|job| job.stage.is_storing() && job.trouble.is_none());
        jobs.count() + banned
    }

    /// The work of an assignment, while its evaluation is under way.
    pub(crate) fn work(&self, assignment: &Assignment) -> Option<Work> {
        let evaluation = self.evaluation_of(assignment)?;
        let specification = &self.jobs.get(&assignment.job)?.record.specification;
        Some(Work {
            setup: specification.setup,
            point: evaluation.point,
            germs: specification.monte_carlo.germs(),
            first: assignment.indices.first,
            count: u32::try_from(assignment.indices.count).ok()?,
        })
    }

    /// The evaluation of a job, while it is under way.
    pub(crate) fn evaluation_mut(&mut self, job: JobId) -> Option<&mut Evaluation> {
        match &mut self.jobs.get_mut(&job)?.stage {
            Stage::Computing(evaluation) => Some(evaluation),
            _ => None,
        }
    }

    /// The evaluation that a batch is about, while this attempt at it is under way.
    pub(crate) fn evaluation_of(&self, assignment: &Assignment) -> Option<&Evaluation> {
        let job = self.jobs.get(&assignment.job)?;
        job.evaluations().find(|found| found.attempt == assignment.attempt)
    }

    /// As [`State::evaluation_of`].
    pub(crate) fn evaluation_of_mut(&mut self, assignment: &Assignment) -> Option<&mut Evaluation> {
        let job = self.jobs.get_mut(&assignment.job)?;
        job.evaluations_mut().find(|found| found.attempt == assignment.attempt)
    }

    /// A number for the next attempt at an evaluation.
    pub(crate) fn new_attempt(&mut self) -> u64 {
        self.next_attempt += 1;
        self.next_attempt - 1
    }

    /// The ban of a worker, if it was banned.
    pub(crate) fn ban(&self, name: &WorkerName) -> Option<&BanRecord> {
        let found = self.banned.iter().find(|banned| banned.record.worker == *name);
        found.map(|banned| &banned.record)
    }

    /// Whether the ban of a worker is not durable yet.
    pub(crate) fn ban_pending(&self) -> bool {
        self.banned.iter().any(|banned| banned.store_at.is_some())
    }

    /// Whether the workers of a host are lost over whatever they hold.
    pub(crate) fn is_failing(&self, host: &str) -> bool {
        self.lost_in_a_row.get(host).is_some_and(|lost| lost.workers.len() >= LOST_IN_A_ROW_MAX)
    }

    /// A worker of a host has answered.
    pub(crate) fn note_answer(&mut self, worker: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&worker) {
            worker.has_answered = true;
            self.lost_in_a_row.remove(worker.name.host());
        }
    }

    /// A worker of a host was lost with what it held.
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
            tracing::warn!(%host, "the workers of this host vanish with whatever they hold");
        }
    }

    /// Whether a worker takes batches, and is expected to answer them.
    pub(crate) fn is_sound(&self, worker: &Worker) -> bool {
        !worker.draining && !self.probation.has(&worker.name)
    }

    /// Whether somebody that meets `of` takes batches, and is expected to answer them.
    pub(crate) fn answers_batches(&self, of: impl Fn(&WorkerName) -> bool) -> bool {
        let answers = |worker: &Worker| of(&worker.name) && self.is_sound(worker);
        !self.draining && self.workers.values().any(answers)
    }

    /// The batches that a worker holds for one purpose.
    pub(crate) fn held_for<'a>(
        &'a self,
        worker: &'a Worker,
        purpose: Purpose,
    ) -> impl Iterator<Item = BatchId> + 'a {
        let is_for =
            move |id: &BatchId| self.batches.get(id).is_some_and(|it| it.purpose == purpose);
        worker.in_flight.iter().copied().filter(is_for)
    }

    /// Forgets a batch, and remembers with its worker what it was about.
    pub(crate) fn settle(&mut self, batch: BatchId) -> Option<Batch> {
        let settled = self.batches.remove(&batch)?;
        self.overdue.remove(&batch);
        if let Some(evaluation) = self.evaluation_of_mut(&settled.assignment) {
            match settled.purpose {
                Purpose::Fill | Purpose::Exclusive | Purpose::Speculative => {}
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
            worker.settled.push_back((batch, settled.assignment));
            if worker.settled.len() > SETTLED_MAX {
                worker.settled.pop_front();
            }
        }
        for duplicate in &settled.duplicates {
            if let Some(duplicate) = self.batches.get_mut(duplicate) {
                duplicate.duplicates.retain(|other| *other != batch);
            }
        }
        Some(settled)
    }
}
