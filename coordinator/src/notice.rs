//! What the log of a coordinator tells of its state: one closed list. The reactor makes notices,
//! the core task writes them.

use std::fmt;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_search::Ending;

use crate::close_reason::CloseReason;
use crate::ids::{JobId, WorkerId};
use crate::worker_name::WorkerName;

/// Something that an operator wants to read in the log.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// A worker is attached.
    WorkerAttached {
        /// Its number.
        worker: WorkerId,
        /// Who it is.
        name: WorkerName,
        /// How many realizations it computes at the same time.
        slots: u32,
        /// Version of its program.
        version: String,
    },
    /// A worker introduced itself and is not taken.
    WorkerRefused {
        /// Its number.
        worker: WorkerId,
        /// Who it is.
        name: WorkerName,
        /// Why it is not taken.
        reason: CloseReason,
    },
    /// A worker is not attached any more.
    WorkerDetached {
        /// Its number.
        worker: WorkerId,
        /// Who it is.
        name: WorkerName,
        /// How many batches it held, which are given to others.
        batches: usize,
        /// Why it is gone.
        why: Departure,
    },
    /// A job is accepted and durable.
    JobAccepted {
        /// The job.
        job: JobId,
        /// Who submitted it.
        client: String,
        /// What people call it; may be empty.
        name: String,
        /// What it does.
        kind: JobKind,
        /// Its rank among the jobs of its client.
        priority: u32,
    },
    /// A job is computed from now on.
    JobStarted {
        /// The job.
        job: JobId,
        /// How many evaluations the store has of it already.
        stored: u64,
    },
    /// The end of a job is durable.
    JobEnded {
        /// The job.
        job: JobId,
        /// Who submitted it.
        client: String,
        /// What it did.
        kind: JobKind,
        /// How it ended.
        ending: Ending,
        /// Complete evaluations.
        evaluations: u64,
        /// Time since it was accepted.
        elapsed: Duration,
    },
}

/// Why a worker is not attached any more.
#[derive(Debug, Clone, PartialEq)]
pub enum Departure {
    /// The coordinator closed its stream.
    Closed(CloseReason),
    /// Its stream ended.
    StreamEnded,
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed(reason) => reason.fmt(f),
            Self::StreamEnded => f.write_str("its connection ended"),
        }
    }
}

impl Departure {
    /// Whether it left, or was sent away, in order: nothing is wrong with it.
    pub fn is_orderly(&self) -> bool {
        matches!(self, Self::Closed(CloseReason::Drained | CloseReason::Draining))
    }
}

impl Notice {
    /// Writes it to the log. What a peer says of itself is quoted, so that it cannot look like
    /// another line.
    pub(crate) fn write(&self) {
        match self {
            Self::WorkerAttached { worker, name, slots, version } => tracing::info!(
                %worker, host = name.host(), process = name.process(), threads = slots,
                version = version.as_str(), "worker attached"
            ),
            Self::WorkerRefused { worker, name, reason } => tracing::warn!(
                %worker, host = name.host(), process = name.process(),
                reason = reason.to_string(), "worker refused"
            ),
            Self::WorkerDetached { worker, name, batches, why } => {
                let (host, process, reason) = (name.host(), name.process(), why.to_string());
                // One that held nothing is no loss, however it went.
                if why.is_orderly() || *batches == 0 {
                    tracing::info!(%worker, host, process, reason, "worker disconnected");
                } else {
                    tracing::warn!(%worker, host, process, batches, reason,
                        "worker lost; others compute what it held");
                }
            }
            Self::JobAccepted { job, client, name, kind, priority } => tracing::info!(
                %job, user = client.as_str(), name = name.as_str(), kind = kind_name(*kind), priority,
                "job accepted"
            ),
            Self::JobStarted { job, stored } => tracing::info!(
                %job, stored_evaluations = stored, "job started"
            ),
            Self::JobEnded { job, client, kind, ending, evaluations, elapsed } => tracing::info!(
                %job, user = client.as_str(), kind = kind_name(*kind), status = ending.status.name(),
                reason = ending.reason.as_deref().unwrap_or_default(), evaluations,
                elapsed_s = elapsed.as_secs_f64(), "job ended"
            ),
        }
    }
}

fn kind_name(kind: JobKind) -> &'static str {
    match kind {
        JobKind::Identification => "identification",
        JobKind::Propagation => "propagation",
    }
}
