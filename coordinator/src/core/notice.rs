//! Notices: the log entries about a coordinator's state, as one closed list. The reactor makes
//! them, the core task writes them.

use std::fmt;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_search::Ending;

use crate::core::close_reason::CloseReason;
use crate::core::ids::{JobId, WorkerId};
use crate::core::worker_name::WorkerName;

/// A notice for the operator's log.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// A worker is attached.
    WorkerAttached {
        /// Its number.
        worker: WorkerId,
        /// Its name.
        name: WorkerName,
        /// Number of realizations that it computes at the same time.
        slots: u32,
        /// Version of its program.
        version: String,
    },
    /// A worker introduced itself and was refused.
    WorkerRefused {
        /// Its number.
        worker: WorkerId,
        /// Its name.
        name: WorkerName,
        /// Reason for the refusal.
        reason: CloseReason,
    },
    /// A worker has departed.
    WorkerDetached {
        /// Its number.
        worker: WorkerId,
        /// Its name.
        name: WorkerName,
        /// Number of batches that it held, which are reassigned.
        batches: usize,
        /// Reason for the departure.
        why: Departure,
    },
    /// A job is accepted and durable.
    JobAccepted {
        /// The job.
        job: JobId,
        /// The client that submitted it.
        client: String,
        /// Display name; may be empty.
        name: String,
        /// Kind of the job.
        kind: JobKind,
        /// Priority among the jobs of its client.
        priority: u32,
    },
    /// The computation of a job begins.
    JobStarted {
        /// The job.
        job: JobId,
        /// Number of its evaluations in the store already.
        stored: u64,
    },
    /// The end of a job is durable.
    JobEnded {
        /// The job.
        job: JobId,
        /// The client that submitted it.
        client: String,
        /// Kind of the job.
        kind: JobKind,
        /// Status and reason of the end.
        ending: Ending,
        /// Number of complete evaluations.
        evaluations: u64,
        /// Time since its acceptance.
        elapsed: Duration,
    },
    /// A warning of `core/concerns.rs` has become due.
    Concern {
        /// A sentence.
        text: String,
    },
}

/// Reason why a worker departed.
#[derive(Debug, Clone, PartialEq)]
pub enum Departure {
    /// The coordinator closed its stream.
    Closed(CloseReason),
    /// Its stream ended.
    StreamEnded,
    /// It was draining, and its stream ended, or was closed because it no longer read.
    Left,
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed(reason) => reason.fmt(f),
            Self::StreamEnded => f.write_str("its connection ended"),
            Self::Left => f.write_str("this worker has left while it drained"),
        }
    }
}

impl Departure {
    /// Returns whether the worker left or was drained: nothing is wrong with it.
    pub fn is_orderly(&self) -> bool {
        matches!(self, Self::Left | Self::Closed(CloseReason::Drained | CloseReason::Draining))
    }
}

impl Notice {
    /// Writes the notice to the log. A text that a peer sent is recorded as a string, never with
    /// `%`: the subscriber quotes strings, so that none can look like another line.
    pub(crate) fn write(&self) {
        match self {
            Self::WorkerAttached { worker, name, slots, version } => tracing::info!(
                %worker, host = name.host(), process = name.process(), slots,
                version = version.as_str(), "worker attached"
            ),
            Self::WorkerRefused { worker, name, reason } => tracing::warn!(
                %worker, host = name.host(), process = name.process(),
                reason = reason.to_string(), "worker refused"
            ),
            Self::WorkerDetached { worker, name, batches, why } => {
                let (host, process, reason) = (name.host(), name.process(), why.to_string());
                // A worker that held nothing is not a loss, whatever the reason.
                if *batches == 0 {
                    tracing::info!(%worker, host, process, reason, "worker disconnected");
                } else if why.is_orderly() {
                    tracing::info!(%worker, host, process, batches, reason,
                        "worker disconnected; others compute the batches it returns");
                } else {
                    tracing::warn!(%worker, host, process, batches, reason,
                        "worker lost; others compute what it held");
                }
            }
            Self::JobAccepted { job, client, name, kind, priority } => tracing::info!(
                %job, user = client.as_str(), name = name.as_str(), kind = kind.name(), priority,
                "job accepted"
            ),
            Self::JobStarted { job, stored } => tracing::info!(
                %job, stored_evaluations = stored, "job started"
            ),
            Self::Concern { text } => tracing::warn!("{text}"),
            Self::JobEnded { job, client, kind, ending, evaluations, elapsed } => tracing::info!(
                %job, user = client.as_str(), kind = kind.name(), status = ending.status.name(),
                reason = ending.reason.as_deref().unwrap_or_default(), evaluations,
                elapsed_s = elapsed.as_secs_f64(), "job ended"
            ),
        }
    }
}
