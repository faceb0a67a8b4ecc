//! The whole truth of a coordinator as plain data. [`crate::reactor`] changes it,
//! [`crate::sanity`] checks it; nothing here waits, sends or reads a clock.
//!
//! Times are durations since the Unix epoch, given with each event.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use osteon_proto::batch::Work;

use crate::config::Config;
use crate::evaluation::{Evaluation, Indices};
use crate::event::Hello;
use crate::ids::{BatchId, JobId, LeaseId, Token, WorkerId};
use crate::rate::Rate;
use crate::search::Search;
use crate::store::{EndRecord, EvaluationRecord, JobRecord};

/// Batches that a worker holds at a time: it computes one while the next is on its way.
pub const BATCHES_IN_FLIGHT_MAX: usize = 2;
/// Settled batches that are remembered for each worker, to compare late answers with.
pub(crate) const SETTLED_MAX: usize = 16;

/// State of a coordinator.
#[derive(Debug)]
pub struct State {
    pub(crate) config: Config,
    pub(crate) jobs: BTreeMap<JobId, Job>,
    /// How many jobs have ended.
    pub(crate) ended: usize,
    /// Job of each request id.
    pub(crate) requests: BTreeMap<String, JobId>,
    /// Jobs that are not begun, oldest first.
    pub(crate) waiting: VecDeque<JobId>,
    /// Jobs that are computed or whose evaluation is being stored.
    pub(crate) active: BTreeSet<JobId>,
    /// Job that was handed out last.
    pub(crate) last_served: Option<JobId>,
    /// Jobs that changed since they were published.
    pub(crate) changed: BTreeSet<JobId>,
    /// When all active jobs were published last.
    pub(crate) published: Duration,
    pub(crate) workers: BTreeMap<WorkerId, Worker>,
    /// Since when there has been no worker; meaningless while there is one.
    pub(crate) no_worker_since: Duration,
    pub(crate) batches: BTreeMap<BatchId, Batch>,
    pub(crate) next_job: u64,
    pub(crate) next_lease: u64,
    pub(crate) next_batch: u64,
    pub(crate) draining: bool,
}

/// A job.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) record: JobRecord,
    pub(crate) stage: Stage,
    /// The search; `None` once the job has ended.
    pub(crate) search: Option<Search>,
    /// A client wants it ended as soon as what is being stored is stored.
    pub(crate) cancelled: bool,
    pub(crate) rate: Rate,
    /// When it last got an answer, or began.
    pub(crate) progressed: Duration,
    /// Requests that are answered when the present record is durable: submissions at first,
    /// cancellations at the end.
    pub(crate) tokens: Vec<Token>,
    /// The store's refusal of the present record.
    pub(crate) trouble: Option<Trouble>,
}

/// How far a job is.
#[derive(Debug)]
pub(crate) enum Stage {
    /// Its record is being stored; no client has heard of it.
    Accepting,
    /// It waits for its turn.
    Waiting,
    /// Its evaluation is handed out.
    Computing(Evaluation),
    /// A complete evaluation is being stored.
    Storing(EvaluationRecord),
    /// Its end is being stored.
    Finishing(EndRecord),
    /// Its end is durable.
    Ended(EndRecord),
}

/// A refusal of the store.
#[derive(Debug)]
pub(crate) struct Trouble {
    pub(crate) since: Duration,
    pub(crate) retry_at: Duration,
    pub(crate) error: String,
}

/// A stay of a worker.
#[derive(Debug)]
pub(crate) struct Worker {
    pub(crate) lease: LeaseId,
    pub(crate) hello: Hello,
    /// When its last message came.
    pub(crate) heard: Duration,
    /// When its last answer came, or it attached.
    pub(crate) answered: Duration,
    /// When the last sign of life was given to it.
    pub(crate) beat: Duration,
    /// Batches it holds, in the order they were sent.
    pub(crate) in_flight: Vec<BatchId>,
    /// Batches it answered or was told to forget, newest last.
    pub(crate) settled: VecDeque<(BatchId, Assignment)>,
    /// Realizations per second, by job.
    pub(crate) rates: BTreeMap<JobId, f64>,
    /// It wants no more batches.
    pub(crate) draining: bool,
}

/// What a batch is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Assignment {
    pub(crate) job: JobId,
    /// Number of the evaluation.
    pub(crate) evaluation: u64,
    pub(crate) indices: Indices,
}

/// A batch that a worker holds.
#[derive(Debug)]
pub(crate) struct Batch {
    pub(crate) assignment: Assignment,
    pub(crate) worker: WorkerId,
    pub(crate) sent: Duration,
    /// The other batch with the same indices, when there is a copy.
    pub(crate) twin: Option<BatchId>,
    /// A suspect: its worker holds nothing else, and it is never copied.
    pub(crate) exclusive: bool,
}

impl State {
    /// A coordinator that knows no job, as of `now`.
    pub fn new(config: Config, now: Duration) -> Self {
        Self {
            config,
            jobs: BTreeMap::new(),
            ended: 0,
            requests: BTreeMap::new(),
            waiting: VecDeque::new(),
            active: BTreeSet::new(),
            last_served: None,
            changed: BTreeSet::new(),
            published: now,
            workers: BTreeMap::new(),
            no_worker_since: now,
            batches: BTreeMap::new(),
            next_job: 1,
            next_lease: 1,
            next_batch: 1,
            draining: false,
        }
    }

    /// Whether nothing is left to do.
    pub fn is_idle(&self) -> bool {
        self.active.is_empty() && self.waiting.is_empty() && self.unstored() == 0
    }

    /// How many jobs have not ended.
    pub(crate) fn unfinished(&self) -> usize {
        self.jobs.len() - self.ended
    }

    /// Jobs with a record on its way to the store.
    pub(crate) fn unstored(&self) -> usize {
        self.jobs.values().filter(|job| job.stage.is_storing() && job.trouble.is_none()).count()
    }

    /// The work of an assignment, while its evaluation is under way.
    pub(crate) fn work(&self, assignment: &Assignment) -> Option<Work> {
        let job = self.jobs.get(&assignment.job)?;
        let Stage::Computing(evaluation) = &job.stage else {
            return None;
        };
        let specification = &job.record.specification;
        Some(Work {
            setup: specification.setup,
            point: evaluation.point,
            seed: specification.monte_carlo.seed,
            sampling: specification.monte_carlo.sampling,
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

    /// Forgets a batch, and remembers with its worker what it was about.
    pub(crate) fn settle(&mut self, batch: BatchId) -> Option<Batch> {
        let settled = self.batches.remove(&batch)?;
        if let Some(worker) = self.workers.get_mut(&settled.worker) {
            worker.in_flight.retain(|held| *held != batch);
            worker.settled.push_back((batch, settled.assignment));
            if worker.settled.len() > SETTLED_MAX {
                worker.settled.pop_front();
            }
        }
        if let Some(twin) = settled.twin.and_then(|twin| self.batches.get_mut(&twin)) {
            twin.twin = None;
        }
        Some(settled)
    }
}

impl Job {
    /// A job of which nothing is computed here yet.
    pub(crate) fn new(
        record: JobRecord,
        stage: Stage,
        search: Option<Search>,
        now: Duration,
    ) -> Self {
        Self {
            record,
            stage,
            search,
            cancelled: false,
            rate: Rate::default(),
            progressed: now,
            tokens: Vec::new(),
            trouble: None,
        }
    }
}

impl Stage {
    /// Whether a record of the job is not durable yet.
    pub(crate) fn is_storing(&self) -> bool {
        matches!(self, Self::Accepting | Self::Storing(_) | Self::Finishing(_))
    }
}

impl Worker {
    /// Who it is, for people.
    pub(crate) fn name(&self) -> String {
        format!("{} (process {})", self.hello.host, self.hello.process)
    }
}
