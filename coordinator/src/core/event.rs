//! All events of a coordinator, as one closed list.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::RealizationResult;

use crate::core::close_reason::CloseReason;
use crate::core::completion::{Completed, Gathered};
use crate::core::effect::RecordKey;
use crate::core::ids::{BatchId, JobId, ReplyId, WorkerId};
use crate::store::EvaluationRecord;
use crate::store::StoredJob;

/// An event.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Time has passed.
    Tick,
    /// A client sent a request; its reply carries `reply_id`.
    Requested {
        /// Destination of the answer.
        reply_id: ReplyId,
        /// The request.
        request: Request,
    },
    /// A worker introduced itself on a new stream.
    Hello {
        /// Number of the stream.
        worker: WorkerId,
        /// Its introduction.
        hello: Hello,
    },
    /// A worker answered a batch.
    Answered {
        /// The worker.
        worker: WorkerId,
        /// The batch.
        batch: BatchId,
        /// Its realizations in index order.
        solved: Vec<RealizationResult>,
        /// Computing time, s, as the worker measured it.
        elapsed_s: f64,
    },
    /// A worker sent a heartbeat.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
    },
    /// A worker accepts no more batches.
    WorkerDrains {
        /// The worker.
        worker: WorkerId,
    },
    /// A worker sent an invalid message.
    Misbehaved {
        /// The worker.
        worker: WorkerId,
        /// The reason for closing its stream.
        reason: CloseReason,
    },
    /// A worker's stream ended.
    StreamEnded {
        /// The worker.
        worker: WorkerId,
    },
    /// The outcomes of an evaluation are gathered.
    Gathered(Gathered),
    /// The search has taken in an evaluation that was gathered.
    Completed(Completed),
    /// A record of a job is durable.
    Stored {
        /// The job.
        job: JobId,
        /// The record.
        key: RecordKey,
    },
    /// A record of a job could not be stored.
    StoreFailed {
        /// The job.
        job: JobId,
        /// The record.
        key: RecordKey,
        /// Error text for people.
        error: String,
    },
    /// The store has finished a read for a job.
    Read {
        /// The job.
        job: JobId,
        /// Number of the evaluation.
        number: u64,
        /// The stored evaluation, if there is one, or why it was not read.
        found: Result<Option<EvaluationRecord>, ReadFailure>,
    },
    /// Ended jobs were deleted, or could not be.
    Pruned {
        /// The request, if a client sent one.
        reply_id: Option<ReplyId>,
        /// The jobs.
        jobs: Vec<JobId>,
        /// Error text for people, if they could not be deleted.
        outcome: Result<(), String>,
    },
    /// A ban has made ended jobs doubtful.
    Doubted {
        /// Number of the ban.
        ban: u64,
        /// The jobs.
        jobs: Vec<JobId>,
    },
    /// An ended job is an unfinished one again in the store, or could not be made one.
    Reopened {
        /// The request.
        reply_id: ReplyId,
        /// The job.
        job: JobId,
        /// What is stored of it; `None` if there is no such job. Or error text for people.
        outcome: Result<Option<StoredJob>, String>,
    },
    /// The number of connections of clients and workers has changed.
    Connections {
        /// Open connections.
        open: u64,
        /// Their maximum number.
        most: u64,
    },
    /// The store's log is copied into the database.
    LogCopied,
    /// The store's log could not be copied into the database, or not all of it.
    LogStuck {
        /// Its length, bytes.
        bytes: u64,
    },
    /// The coordinator shall stop.
    Drain,
}

/// Why an evaluation was not read from the store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReadFailure {
    /// It may be readable at another time.
    Refused {
        /// Error text for people.
        error: String,
    },
    /// The stored record is permanently damaged.
    Damaged,
}

/// A client's request.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Submit a job. The specification has passed its checks.
    Submit {
        /// The specification.
        specification: Arc<JobSpecification>,
        /// Identifier of the request; empty if it has none.
        request_id: String,
        /// Name of the client, as it gave it.
        client: String,
        /// Priority among the client's jobs.
        priority: u32,
        /// Display name; may be empty.
        name: String,
    },
    /// Get a snapshot of a job.
    Get(JobId),
    /// List the present warnings for the operator, as sentences.
    Concerns,
    /// Explain what decides how fast a job is.
    Explain(JobId),
    /// List snapshots of the jobs after a given one, oldest first.
    List {
        /// Last job of the previous page.
        after: Option<JobId>,
        /// Maximum number of jobs to list.
        limit: usize,
    },
    /// List snapshots of jobs, newest first.
    Browse {
        /// Which jobs.
        which: JobChoice,
        /// Last job of the page before.
        before: Option<JobId>,
        /// Maximum number of jobs to list.
        limit: usize,
    },
    /// Follow the search of a job.
    Follow {
        /// The job.
        job: JobId,
        /// Number of the first row of its history that is wanted.
        from: u64,
        /// Maximum number of rows.
        limit: usize,
    },
    /// Cancel a job.
    Cancel(JobId),
    /// Fetch the output of an ended job.
    Fetch(JobId),
    /// Delete ended jobs.
    Prune(Retention),
    /// List the workers that were banned for wrong answers.
    Banned,
    /// List the attached workers, and those that departed last.
    Workers,
    /// Drain a worker: it leaves when it has answered the batches that it holds.
    DrainWorker(WorkerId),
    /// Lift the ban of a host.
    Unban(String),
    /// Compute an ended job again that a banned host contributed to.
    Recheck(JobId),
}

/// Which jobs are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum JobChoice {
    /// All.
    #[default]
    All,
    /// Those that run.
    Running,
    /// Those that have not begun.
    Waiting,
    /// Those that have ended.
    Ended,
}

/// Rules for keeping ended jobs: a job is deleted only if neither rule keeps it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Retention {
    /// Jobs that ended at most this long ago are kept.
    pub keep_for: Option<Duration>,
    /// This many of the jobs that ended last are kept.
    pub keep_last: Option<u64>,
}

/// Introduction of a worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hello {
    /// Version of its program.
    pub version: String,
    /// Fingerprint of its numerics.
    pub fingerprint: String,
    /// Number of realizations that it computes at the same time: threads of a processor, or the
    /// equivalent of another device.
    pub slots: u32,
    /// Host name, for people.
    pub host: String,
    /// Process id, for people.
    pub process: u32,
    /// Random number that the process drew at its start, 0 if it sent none.
    pub instance: u64,
}
