//! Everything that can happen to a coordinator: one closed list.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::Solved;

use crate::close_reason::CloseReason;
use crate::effect::RecordKey;
use crate::ids::{BatchId, JobId, Token, WorkerId};
use crate::store::EvaluationRecord;

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Time went by.
    Tick,
    /// A client wants something; its answer goes to `token`.
    Requested {
        /// Where the answer goes.
        token: Token,
        /// What it wants.
        request: Request,
    },
    /// A worker introduced itself on a new stream.
    Hello {
        /// Number of the stream.
        worker: WorkerId,
        /// Who it is.
        hello: Hello,
    },
    /// A worker answered a batch.
    Answered {
        /// The worker.
        worker: WorkerId,
        /// The batch.
        batch: BatchId,
        /// Its realizations in index order.
        solved: Vec<Solved>,
        /// Computing time, s, as the worker measured it.
        elapsed_s: f64,
    },
    /// A worker is alive.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
    },
    /// A worker wants no more batches.
    WorkerDrains {
        /// The worker.
        worker: WorkerId,
    },
    /// A worker sent what cannot be understood.
    Misbehaved {
        /// The worker.
        worker: WorkerId,
        /// What is wrong with it.
        reason: CloseReason,
    },
    /// A worker's stream ended.
    StreamEnded {
        /// The worker.
        worker: WorkerId,
    },
    /// A record of a job is durable.
    Stored {
        /// The job.
        job: JobId,
        /// Which record.
        key: RecordKey,
    },
    /// A record of a job could not be stored.
    StoreFailed {
        /// The job.
        job: JobId,
        /// Which record.
        key: RecordKey,
        /// Why, for people.
        error: String,
    },
    /// The store was read for a job.
    Read {
        /// The job.
        job: JobId,
        /// Number of the evaluation.
        number: u64,
        /// What the store has, or why it was not read.
        found: Result<Option<EvaluationRecord>, Unread>,
    },
    /// Ended jobs are forgotten, or cannot be.
    Pruned {
        /// The request, if a client wanted it.
        token: Option<Token>,
        /// The jobs.
        jobs: Vec<JobId>,
        /// Why they cannot be forgotten, for people.
        outcome: Result<(), String>,
    },
    /// The coordinator is to stop.
    Drain,
}

/// Why an evaluation was not read from the store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unread {
    /// It may be read another time.
    Refused {
        /// Why, for people.
        error: String,
    },
    /// What is stored of it is damaged, and stays so.
    Damaged,
}

/// What a client wants.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// A job computed. The specification has passed its check.
    Submit {
        /// What to compute.
        specification: Arc<JobSpecification>,
        /// Identifier of the request; empty if it has none.
        request_id: String,
        /// Who wants it, as the client says.
        client: String,
        /// Rank among the client's jobs.
        priority: u32,
        /// What people call it; may be empty.
        name: String,
    },
    /// A snapshot.
    Get(JobId),
    /// Snapshots of jobs after one, oldest first.
    List {
        /// The last job of the page before.
        after: Option<JobId>,
        /// Most jobs to list.
        limit: usize,
    },
    /// A job ended before its time.
    Cancel(JobId),
    /// What an ended job left.
    Fetch(JobId),
    /// Ended jobs forgotten.
    Prune(Retention),
    /// The workers that were found to compute wrongly.
    Banned,
    /// The attached workers, and those that went last.
    Workers,
    /// A worker sent away when it has answered what it holds.
    DrainWorker(WorkerId),
}

/// Which ended jobs are kept: one that meets both conditions is forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Retention {
    /// Those that ended at most so long ago are kept.
    pub keep_for: Option<Duration>,
    /// So many that ended last are kept.
    pub keep_last: Option<u64>,
}

/// How a worker introduces itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hello {
    /// Version of its program.
    pub version: String,
    /// Fingerprint of its numerics.
    pub fingerprint: String,
    /// How many realizations it computes at the same time: threads of a processor, or what another
    /// device has. The field of the wire is called `threads`.
    pub slots: u32,
    /// Host name, for people.
    pub host: String,
    /// Process id, for people.
    pub process: u32,
    /// A number that the process drew at its start, 0 if it told none.
    pub instance: u64,
}
