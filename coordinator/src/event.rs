//! Everything that can happen to a coordinator: one closed list.

use std::sync::Arc;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::Solved;

use crate::effect::CloseReason;
use crate::ids::{BatchId, JobId, Token, WorkerId};

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
    /// The coordinator is to stop.
    Drain,
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
}

/// How a worker introduces itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hello {
    /// Version of its program.
    pub version: String,
    /// Fingerprint of its numerics.
    pub fingerprint: String,
    /// Threads it computes on.
    pub threads: u32,
    /// Host name, for people.
    pub host: String,
    /// Process id, for people.
    pub process: u32,
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
}
