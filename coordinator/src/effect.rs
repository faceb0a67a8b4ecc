//! Everything that a coordinator does to the world: one closed list.

use std::sync::Arc;
use std::time::Duration;

use osteon_proto::batch::Work;
use osteon_proto::v1::{JobSnapshot, ListWorkersResponse, WorkerSnapshot};
use osteon_search::Summary;
use thiserror::Error;

use crate::close_reason::CloseReason;
use crate::ids::{BatchId, JobId, LeaseId, Token, WorkerId};
use crate::notice::Notice;
use crate::store::{BanRecord, EndRecord, EvaluationRecord, JobRecord};

/// Something to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Tell a worker that it is attached.
    Welcome {
        /// The worker.
        worker: WorkerId,
        /// Its lease.
        lease: LeaseId,
    },
    /// Send a batch.
    Send {
        /// To this worker.
        worker: WorkerId,
        /// Number of the batch.
        batch: BatchId,
        /// What to compute.
        work: Work,
    },
    /// Tell a worker to forget a batch.
    Revoke {
        /// The worker.
        worker: WorkerId,
        /// The batch.
        batch: BatchId,
    },
    /// Give a worker a sign of life.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
    },
    /// Tell a worker to leave when it has answered what it holds.
    Drain {
        /// The worker.
        worker: WorkerId,
    },
    /// End a worker's stream.
    Close {
        /// The worker.
        worker: WorkerId,
        /// Why.
        reason: CloseReason,
    },
    /// Make a record durable, then report it.
    Store(Record),
    /// Read an evaluation of a job, then report it.
    Read {
        /// The job.
        job: JobId,
        /// Number of the evaluation.
        number: u64,
    },
    /// Forget ended jobs, then report it.
    Prune {
        /// The request, if a client wants it.
        token: Option<Token>,
        /// The jobs.
        jobs: Vec<JobId>,
    },
    /// Answer a request.
    Answer {
        /// Which.
        token: Token,
        /// With this.
        answer: Answer,
    },
    /// Show those who watch a job how it stands.
    Publish {
        /// The job.
        job: JobId,
        /// How it stands.
        snapshot: JobSnapshot,
    },
    /// Tell the operator, in the log.
    Note(Notice),
    /// Say that the store takes nothing any more.
    Despair {
        /// What it said last.
        error: String,
        /// For how long it has refused a record.
        waited: Duration,
    },
    /// Nothing is left to do: everything stored, every stream closed.
    Stop,
}

/// A record to store.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// An accepted job.
    Job(JobRecord),
    /// A complete evaluation.
    Evaluation {
        /// The evaluation.
        record: EvaluationRecord,
        /// Forget those after it: they belong to another path.
        is_last: bool,
    },
    /// The end of a job.
    End {
        /// How it ended.
        end: EndRecord,
        /// What its path came to.
        summary: Arc<Summary>,
    },
    /// A worker is banned.
    Ban(BanRecord),
}

impl Record {
    /// The job and the name of the record.
    pub fn key(&self) -> (JobId, RecordKey) {
        match self {
            Self::Job(record) => (record.job, RecordKey::Job),
            Self::Evaluation { record, .. } => (record.job, RecordKey::Evaluation(record.number)),
            Self::End { end, .. } => (end.job, RecordKey::End),
            Self::Ban(record) => (record.job, RecordKey::Ban(record.number)),
        }
    }
}

/// Names one record of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordKey {
    /// The job itself.
    Job,
    /// The evaluation with this number.
    Evaluation(u64),
    /// Its end.
    End,
    /// The ban with this number, of a worker that was found in it.
    Ban(u64),
}

/// Answer to a request.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// The job is accepted and durable.
    Submitted(JobId),
    /// How a job stands.
    Snapshot(JobSnapshot),
    /// A page of jobs.
    Page {
        /// Oldest first.
        snapshots: Vec<JobSnapshot>,
        /// The last of them, if there are more.
        more_after: Option<JobId>,
    },
    /// The job has ended; what it left is in the store.
    Ended(EndRecord),
    /// These ended jobs are forgotten.
    Pruned(Vec<JobId>),
    /// The banned workers, with the time since then.
    Banned(Vec<(BanRecord, Duration)>),
    /// The attached workers, and those that went last.
    Workers(ListWorkersResponse),
    /// How a worker stands.
    Worker(WorkerSnapshot),
    /// The request is refused.
    Refused(Refusal),
}

/// Why a request is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Refusal {
    /// There is no such job.
    #[error("no such job: {job}")]
    NoJob {
        /// The job asked for.
        job: JobId,
    },
    /// There is no such worker.
    #[error("no worker with number {worker} is attached")]
    NoWorker {
        /// The worker asked for.
        worker: WorkerId,
    },
    /// The request id belongs to a job with another specification.
    #[error(
        "request id `{request_id}` belongs to job {job}, which has another specification; \
         choose another request id"
    )]
    RequestIdTaken {
        /// The request id.
        request_id: String,
        /// The job it belongs to.
        job: JobId,
    },
    /// Too many jobs wait or run.
    #[error(
        "{limit} jobs wait or run already, the most allowed; submit again when some have ended"
    )]
    TooManyJobs {
        /// Most jobs allowed.
        limit: usize,
    },
    /// The jobs that wait or run are too large together.
    #[error(
        "the specifications of {whose} jobs that wait or run take {held} bytes, with this one's \
         {more} more than the {limit} allowed; submit again when some have ended, or with fewer \
         measured velocities"
    )]
    TooMuchQueued {
        /// `this client's` or `all`.
        whose: &'static str,
        /// What they take already.
        held: u64,
        /// What the refused one would take.
        more: u64,
        /// Most allowed.
        limit: u64,
    },
    /// The job has not ended.
    #[error("job {job} has not ended")]
    NotEnded {
        /// The job.
        job: JobId,
    },
    /// The coordinator is stopping.
    #[error("the coordinator is shutting down; try again when it is back")]
    Draining,
    /// The store did not forget.
    #[error("the store does not forget ended jobs, none is removed: {error}")]
    NotPruned {
        /// What the store said.
        error: String,
    },
    /// The store refused the job.
    #[error("the job could not be stored and is not accepted: {error}")]
    Store {
        /// What the store said.
        error: String,
    },
}
