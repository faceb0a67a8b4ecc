//! The service of workers: bytes of a stream into events, effects into bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures::{Stream, StreamExt as _};
use osteon_proto::batch::{self, Work};
use osteon_proto::malformed::Malformed;
use osteon_proto::status::resource_exhausted;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::workers_server::Workers;
use osteon_proto::v1::{
    AttachRequest, AttachResponse, BatchRevoke, Heartbeat, WorkerDrain, WorkerHello, WorkerWelcome,
};
use tokio::sync::{mpsc, oneshot};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};

use crate::config::Config;
use crate::core_task::Message;
use crate::effect::CloseReason;
use crate::event::{Event, Hello};
use crate::ids::{BatchId, LeaseId, WorkerId};

/// Messages to one worker that may wait: its batches, their revocations, signs of life.
const OUTBOUND_MAX: usize = 64;
/// When a worker that finds no place may try again.
const RETRY: Duration = Duration::from_secs(30);
/// A new stream must say hello within this time.
const HELLO_TIMEOUT: Duration = Duration::from_secs(10);

/// What goes to a worker.
type Outgoing = Result<AttachResponse, Status>;

/// Where messages to one worker go. Its stream ends when this is dropped, be it ever so full.
#[derive(Debug)]
pub(crate) struct Outbound {
    messages: mpsc::Sender<Outgoing>,
    /// Never sent on: its end is the message.
    _open: oneshot::Sender<()>,
}

impl Outbound {
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

/// The service of workers.
pub(crate) struct WorkersService {
    messages: mpsc::Sender<Message>,
    next_worker: Arc<AtomicU64>,
}

impl WorkersService {
    pub(crate) fn new(messages: mpsc::Sender<Message>) -> Self {
        Self { messages, next_worker: Arc::new(AtomicU64::new(1)) }
    }
}

#[tonic::async_trait]
impl Workers for WorkersService {
    type AttachStream = ReceiverStream<Result<AttachResponse, Status>>;

    async fn attach(
        &self,
        request: tonic::Request<Streaming<AttachRequest>>,
    ) -> Result<tonic::Response<Self::AttachStream>, Status> {
        let worker = WorkerId(self.next_worker.fetch_add(1, Ordering::Relaxed));
        Ok(tonic::Response::new(attach(worker, request.into_inner(), self.messages.clone())))
    }
}

/// Serves one worker in a task of its own; what the worker gets.
fn attach(
    worker: WorkerId,
    incoming: impl Stream<Item = Result<AttachRequest, Status>> + Send + Unpin + 'static,
    messages: mpsc::Sender<Message>,
) -> ReceiverStream<Outgoing> {
    let (outgoing, stream) = mpsc::channel(OUTBOUND_MAX);
    tokio::spawn(async move {
        let (open, closed) = oneshot::channel();
        let outbound = Outbound { messages: outgoing.clone(), _open: open };
        tokio::select! {
            () = forward(worker, incoming, &messages, outbound) => {}
            // The coordinator has dropped the other end: it closed the stream.
            _ = closed => {}
            // The worker is gone.
            () = outgoing.closed() => {}
        }
        drop(outgoing);
        // Without its core the coordinator is gone, and the stream means nothing.
        let _ = messages.send(Message::Event(Event::StreamEnded { worker })).await;
    });
    ReceiverStream::new(stream)
}

/// Turns what a worker sends into events, until its stream ends.
async fn forward(
    worker: WorkerId,
    mut incoming: impl Stream<Item = Result<AttachRequest, Status>> + Unpin,
    messages: &mpsc::Sender<Message>,
    outbound: Outbound,
) {
    let hello = match tokio::time::timeout(HELLO_TIMEOUT, incoming.next()).await {
        Ok(Some(Ok(AttachRequest { message: Some(Request::Hello(hello)) }))) => hello,
        Ok(Some(Ok(_))) => {
            let status = Status::invalid_argument("the first message of a worker must be `hello`");
            // The worker may have gone.
            let _ = outbound.send(Err(status));
            return;
        }
        Ok(None | Some(Err(_))) => return,
        Err(_) => {
            let status = Status::deadline_exceeded("no `hello` within 10 s");
            let _ = outbound.send(Err(status));
            return;
        }
    };
    let attach = Message::Attach { worker, hello: introduce(hello), outbound };
    if messages.send(attach).await.is_err() {
        return;
    }
    loop {
        let event = match incoming.next().await {
            Some(Ok(message)) => event(worker, message),
            None => return,
            Some(Err(status)) => {
                tracing::debug!(%worker, %status, "a worker's stream broke");
                return;
            }
        };
        if messages.send(Message::Event(event)).await.is_err() {
            return;
        }
    }
}

fn introduce(hello: WorkerHello) -> Hello {
    let WorkerHello { version, fingerprint, threads, host, process, instance } = hello;
    Hello { version, fingerprint, threads, host, process, instance }
}

fn event(worker: WorkerId, message: AttachRequest) -> Event {
    match message.message {
        Some(Request::Hello(_)) => Event::Misbehaved { worker, reason: CloseReason::SecondHello },
        Some(Request::Heartbeat(Heartbeat {})) => Event::Heartbeat { worker },
        Some(Request::Drain(_)) => Event::WorkerDrains { worker },
        Some(Request::Result(result)) => match batch::answer_from_message(&result) {
            Ok(solved) => Event::Answered {
                worker,
                batch: BatchId(result.batch),
                solved,
                elapsed_s: result.elapsed_s,
            },
            Err(malformed) => Event::Misbehaved { worker, reason: malformed.into() },
        },
        None => {
            let reason = Malformed::Missing { field: "message" }.into();
            Event::Misbehaved { worker, reason }
        }
    }
}

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
        CloseReason::Threads { .. }
        | CloseReason::NameTooLong { .. }
        | CloseReason::Malformed(_)
        | CloseReason::WrongCount { .. }
        | CloseReason::SecondHello => Code::InvalidArgument,
        CloseReason::Expelled { .. } => Code::PermissionDenied,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A worker that says hello, then neither speaks nor reads.
    async fn attached() -> (Outbound, mpsc::Receiver<Message>, ReceiverStream<Outgoing>) {
        let hello = AttachRequest { message: Some(Request::Hello(WorkerHello::default())) };
        let incoming = futures::stream::iter([Ok(hello)]).chain(futures::stream::pending());
        let (sender, mut messages) = mpsc::channel(4);
        let stream = attach(WorkerId(7), incoming, sender);
        match messages.recv().await {
            Some(Message::Attach { worker: WorkerId(7), outbound, .. }) => {
                (outbound, messages, stream)
            }
            _ => panic!("not attached"),
        }
    }

    async fn check_ended(mut messages: mpsc::Receiver<Message>) {
        let last = tokio::time::timeout(HELLO_TIMEOUT, messages.recv()).await.unwrap();
        let ended = Event::StreamEnded { worker: WorkerId(7) };
        assert!(matches!(last, Some(Message::Event(event)) if event == ended));
    }

    #[tokio::test]
    async fn the_stream_of_a_worker_that_does_not_read_ends_when_it_is_closed() {
        let (outbound, messages, stream) = attached().await;
        for _ in 0..OUTBOUND_MAX {
            outbound.send(Ok(heartbeat())).unwrap();
        }
        // The status finds no place.
        outbound.send(Err(status(&CloseReason::NotReading))).unwrap_err();
        drop(outbound);
        let read = tokio::time::timeout(HELLO_TIMEOUT, stream.count()).await;
        assert_eq!(read.unwrap(), OUTBOUND_MAX);
        check_ended(messages).await;
    }

    #[tokio::test]
    async fn a_worker_that_reads_learns_why_its_stream_ends() {
        let (outbound, messages, mut stream) = attached().await;
        outbound.send(Err(status(&CloseReason::Draining))).unwrap();
        drop(outbound);
        assert_eq!(stream.next().await.unwrap().unwrap_err().code(), Code::Unavailable);
        let after = tokio::time::timeout(HELLO_TIMEOUT, stream.next()).await;
        assert!(after.unwrap().is_none());
        check_ended(messages).await;
    }

    #[tokio::test]
    async fn a_worker_that_goes_is_noticed() {
        let (_outbound, messages, stream) = attached().await;
        drop(stream);
        check_ended(messages).await;
    }

    #[test]
    fn nothing_that_a_worker_says_of_itself_writes_lines_of_its_own() {
        let worker = "y\n\x1b[31mFAKE LOG\u{202e}".to_owned();
        let reason = CloseReason::FingerprintDiffers { worker, coordinator: "x".to_owned() };
        let told = status(&reason).message().to_owned();
        assert!(told.contains(r"`y\n\u{1b}[31mFAKE LOG\u{202e}`"), "{told}");
        assert!(!told.chars().any(char::is_control), "{told:?}");
    }
}
