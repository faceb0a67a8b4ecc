//! What goes to a worker: effects into messages, and the queue that they wait in.

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

/// Messages to one worker that may wait: its batches, their revocations, signs of life.
pub(crate) const OUTBOUND_MAX: usize = 64;

/// When a worker that finds no place may try again.
const RETRY: Duration = Duration::from_secs(30);

/// What goes to a worker.
pub(crate) type Outgoing = Result<AttachResponse, Status>;

/// Where messages to one worker go. Its stream ends when this is dropped, be it ever so full.
#[derive(Debug)]
pub(crate) struct Outbound {
    messages: mpsc::Sender<Outgoing>,
    /// Never sent on: its end is the message.
    _open: oneshot::Sender<()>,
}

impl Outbound {
    /// Makes the queue to a worker whose stream takes `messages`, and a receiver that ends when the
    /// queue is dropped.
    pub(crate) fn new(messages: mpsc::Sender<Outgoing>) -> (Self, oneshot::Receiver<()>) {
        let (open, closed) = oneshot::channel();
        (Self { messages, _open: open }, closed)
    }

    /// Queues a message.
    ///
    /// # Errors
    /// When the queue is full or the worker is gone.
    pub(crate) fn send(&self, message: Outgoing) -> Result<(), NotReading> {
        self.messages.try_send(message).map_err(|_| NotReading)
    }
}

/// A worker takes no message.
#[derive(Debug)]
pub(crate) struct NotReading;

/// The first message to an attached worker.
pub(crate) fn welcome(worker: WorkerId, lease: LeaseId, config: &Config) -> AttachResponse {
    respond(Response::Welcome(WorkerWelcome {
        worker: worker.0,
        lease: lease.0,
        heartbeat_s: config.heartbeat.as_secs_f64(),
        expiry_s: config.expiry.as_secs_f64(),
    }))
}

/// A batch for a worker.
pub(crate) fn batch(id: BatchId, work: &Work) -> AttachResponse {
    respond(Response::Batch(batch::to_message(id.0, work)))
}

/// A batch that a worker is to forget.
pub(crate) fn revoke(batch: BatchId) -> AttachResponse {
    respond(Response::Revoke(BatchRevoke { batch: batch.0 }))
}

/// The wish that a worker leaves when it has answered what it holds.
pub(crate) fn drain() -> AttachResponse {
    respond(Response::Drain(WorkerDrain {}))
}

/// A sign of life.
pub(crate) fn heartbeat() -> AttachResponse {
    respond(Response::Heartbeat(Heartbeat {}))
}

/// The status that ends a worker's stream.
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
