//! The gRPC service for workers: turns the messages of a stream into events.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures::{Stream, StreamExt as _};
use osteon_proto::batch;
use osteon_proto::malformed::Malformed;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::workers_server::Workers;
use osteon_proto::v1::{AttachRequest, AttachResponse, Heartbeat, WorkerHello};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, Streaming};

use crate::core::close_reason::CloseReason;
use crate::core::event::{Event, Hello};
use crate::core::ids::{BatchId, WorkerId};
use crate::service::core_task::Message;
use crate::service::outbound::{OUTBOUND_MAX, Outbound, Outgoing};

/// A new stream must send its hello message within this time.
const HELLO_TIMEOUT: Duration = Duration::from_secs(10);

/// The gRPC service for workers.
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

/// Serves one worker in a task of its own; returns the messages to the worker.
fn attach(
    worker: WorkerId,
    incoming: impl Stream<Item = Result<AttachRequest, Status>> + Send + Unpin + 'static,
    messages: mpsc::Sender<Message>,
) -> ReceiverStream<Outgoing> {
    let (outgoing, stream) = mpsc::channel(OUTBOUND_MAX);
    tokio::spawn(async move {
        let (outbound, closed) = Outbound::new(outgoing.clone());
        tokio::select! {
            () = forward(worker, incoming, &messages, outbound) => {}
            // The coordinator has dropped the other end, so the stream is closed.
            _ = closed => {}
            // The worker has gone.
            () = outgoing.closed() => {}
        }
        drop(outgoing);
        // Without its core task the coordinator is gone, and the end of the stream is irrelevant.
        let _ = messages.send(Message::Event(Event::StreamEnded { worker })).await;
    });
    ReceiverStream::new(stream)
}

/// Turns the messages of a worker into events, until its stream ends.
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
                tracing::debug!(%worker, %status, "the stream of a worker broke");
                return;
            }
        };
        if messages.send(Message::Event(event)).await.is_err() {
            return;
        }
    }
}

fn introduce(hello: WorkerHello) -> Hello {
    let WorkerHello { version, fingerprint, slots, host, process, instance } = hello;
    Hello { version, fingerprint, slots, host, process, instance }
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

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;
    use crate::service::outbound::{heartbeat, status};

    /// Returns a worker that sends a hello message, then neither sends nor reads.
    async fn silent_worker() -> (Outbound, mpsc::Receiver<Message>, ReceiverStream<Outgoing>) {
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
        let (outbound, messages, stream) = silent_worker().await;
        for _ in 0..OUTBOUND_MAX {
            outbound.send(Ok(heartbeat())).unwrap();
        }
        // The queue is full, so the status is not sent.
        outbound.send(Err(status(&CloseReason::NotReading))).unwrap_err();
        drop(outbound);
        let read = tokio::time::timeout(HELLO_TIMEOUT, stream.count()).await;
        assert_eq!(read.unwrap(), OUTBOUND_MAX);
        check_ended(messages).await;
    }

    #[tokio::test]
    async fn a_worker_that_reads_learns_why_its_stream_ends() {
        let (outbound, messages, mut stream) = silent_worker().await;
        outbound.send(Err(status(&CloseReason::Draining))).unwrap();
        drop(outbound);
        assert_eq!(stream.next().await.unwrap().unwrap_err().code(), Code::Unavailable);
        let after = tokio::time::timeout(HELLO_TIMEOUT, stream.next()).await;
        assert!(after.unwrap().is_none());
        check_ended(messages).await;
    }

    #[tokio::test]
    async fn a_worker_that_goes_is_noticed() {
        let (_outbound, messages, stream) = silent_worker().await;
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
