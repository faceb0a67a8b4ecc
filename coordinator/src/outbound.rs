//! Messages to a worker: made from effects, and queued.

use std::time::Duration;

use osteon_proto::batch::{self, Work};
use osteon_proto::status::resource_exhausted;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::{AttachResponse, BatchRevoke, Heartbeat, WorkerDrain, WorkerWelcome};
use tokio::sync::{mpsc, oneshot};
use tonic::{Code, Status};

use crate::close_reason::CloseReason;
use crate::config::Config;
use crate::ids::{BatchId, LeaseId, WorkerId};

/// Maximum number of queued messages to one worker: its batches, their revocations and heartbeats.
pub(crate) const OUTBOUND_MAX: usize = 64;

/// Time after which a worker that was refused for lack of room may try again.
const RETRY: Duration = Duration::from_secs(30);

/// A message to a worker, or the status that ends its stream.
pub(crate) type Outgoing = Result<AttachResponse, Status>;

/// Queue of messages to one worker. The worker's stream ends when this is dropped, even if the
/// queue is full.
#[derive(Debug)]
pub(crate) struct Outbound {
    messages: mpsc::Sender<Outgoing>,
    /// Nothing is sent on it; dropping it is the signal.
    _open: oneshot::Sender<()>,
}

impl Outbound {
    /// Returns a queue for a worker whose stream receives `messages`, and a receiver that completes
    /// when the queue is dropped.
    pub(crate) fn new(messages: mpsc::Sender<Outgoing>) -> (Self, oneshot::Receiver<()>) {
        let (open, closed) = oneshot::channel();
        (Self { messages, _open: open }, closed)
    }

    /// Queues a message.
    ///
    /// # Errors
    /// When the queue is full or the worker has gone.
    pub(crate) fn send(&self, message: Outgoing) -> Result<(), NotReading> {
        self.messages.try_send(message).map_err(|_| NotReading)
    }
}

/// Error when a worker accepts no message.
#[derive(Debug)]
pub(crate) struct NotReading;

/// Returns the first message to an attached worker.
pub(crate) fn welcome(worker: WorkerId, lease: LeaseId, config: &Config) -> AttachResponse {
    respond(Response::Welcome(WorkerWelcome {
        worker: worker.0,
        lease: lease.0,
        heartbeat_s: config.heartbeat.as_secs_f64(),
        expiry_s: config.expiry.as_secs_f64(),
    }))
}

/// Returns the message that sends a batch.
pub(crate) fn batch(id: BatchId, work: &Work) -> AttachResponse {
    respond(Response::Batch(batch::to_message(id.0, work)))
}

/// Returns the message that revokes a batch.
pub(crate) fn revoke(batch: BatchId) -> AttachResponse {
    respond(Response::Revoke(BatchRevoke { batch: batch.0 }))
}

/// Returns the message that drains a worker: it leaves when it has answered the batches that it
/// holds.
pub(crate) fn drain() -> AttachResponse {
    respond(Response::Drain(WorkerDrain {}))
}

/// Returns a heartbeat.
pub(crate) fn heartbeat() -> AttachResponse {
    respond(Response::Heartbeat(Heartbeat {}))
}

/// Returns the status that ends a worker's stream.
pub(crate) fn status(reason: &CloseReason) -> Status {
    let code = match reason {
        CloseReason::FingerprintDiffers { .. } => Code::FailedPrecondition,
        CloseReason::Slots { .. }
        | CloseReason::NameTooLong { .. }
        | CloseReason::Malformed(_)
        | CloseReason::WrongCount { .. }
        | CloseReason::SecondHello => Code::InvalidArgument,
        CloseReason::Banned { .. } => Code::PermissionDenied,
        CloseReason::TooManyWorkers { .. } => {
            return resource_exhausted(reason.to_string(), RETRY);
        }
        CloseReason::Expired { .. } | CloseReason::Unanswering { .. } | CloseReason::NotReading => {
            Code::Aborted
        }
        CloseReason::Drained => Code::Ok,
        CloseReason::Draining => Code::Unavailable,
    };
    Status::new(code, reason.to_string())
}

fn respond(message: Response) -> AttachResponse {
    AttachResponse { message: Some(message) }
}
