//! The service of workers: bytes of a stream into events, effects into bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use osteon_proto::batch::{self, Work};
use osteon_proto::malformed::Malformed;
use osteon_proto::realizations;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::workers_server::Workers;
use osteon_proto::v1::{
    AttachRequest, AttachResponse, BatchRevoke, Heartbeat, WorkerHello, WorkerWelcome,
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};

use crate::config::Config;
use crate::core_task::Message;
use crate::effect::CloseReason;
use crate::event::{Event, Hello};
use crate::ids::{BatchId, LeaseId, WorkerId};

/// Messages to one worker that may wait: its batches, their revocations, signs of life.
const OUTBOUND_MAX: usize = 64;
/// A new stream must say hello within this time.
const HELLO_TIMEOUT: Duration = Duration::from_secs(10);

/// Where messages to one worker go.
pub(crate) type Outbound = mpsc::Sender<Result<AttachResponse, Status>>;

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
        let (outbound, stream) = mpsc::channel(OUTBOUND_MAX);
        let messages = self.messages.clone();
        tokio::spawn(async move {
            let ended = tokio::select! {
                () = forward(worker, request.into_inner(), &messages, &outbound) => outbound,
                // The coordinator closed the stream, or the worker is gone.
                () = outbound.closed() => outbound.clone(),
            };
            drop(ended);
            // Without its core the coordinator is gone, and the stream means nothing.
            let _ = messages.send(Message::Event(Event::StreamEnded { worker })).await;
        });
        Ok(tonic::Response::new(ReceiverStream::new(stream)))
    }
}

/// Turns what a worker sends into events, until its stream ends.
async fn forward(
    worker: WorkerId,
    mut stream: Streaming<AttachRequest>,
    messages: &mpsc::Sender<Message>,
    outbound: &Outbound,
) {
    let hello = match tokio::time::timeout(HELLO_TIMEOUT, stream.message()).await {
        Ok(Ok(Some(AttachRequest { message: Some(Request::Hello(hello)) }))) => hello,
        Ok(Ok(Some(_))) => {
            let status = Status::invalid_argument("the first message of a worker must be `hello`");
            let _ = outbound.send(Err(status)).await;
            return;
        }
        Ok(Ok(None) | Err(_)) => return,
        Err(_) => {
            let status = Status::deadline_exceeded("no `hello` within 10 s");
            let _ = outbound.send(Err(status)).await;
            return;
        }
    };
    let attach = Message::Attach { worker, hello: introduce(hello), outbound: outbound.clone() };
    if messages.send(attach).await.is_err() {
        return;
    }
    loop {
        let event = match stream.message().await {
            Ok(Some(message)) => event(worker, message),
            Ok(None) => return,
            Err(status) => {
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
    let WorkerHello { version, fingerprint, threads, host, process } = hello;
    Hello { version, fingerprint, threads, host, process }
}

fn event(worker: WorkerId, message: AttachRequest) -> Event {
    match message.message {
        Some(Request::Hello(_)) => Event::Misbehaved { worker, reason: CloseReason::SecondHello },
        Some(Request::Heartbeat(Heartbeat {})) => Event::Heartbeat { worker },
        Some(Request::Drain(_)) => Event::WorkerDrains { worker },
        Some(Request::Result(result)) => {
            match realizations::unpack(&result.codes, &result.velocities) {
                Ok(outcomes) => Event::Answered {
                    worker,
                    batch: BatchId(result.batch),
                    outcomes,
                    elapsed_s: result.elapsed_s,
                },
                Err(malformed) => Event::Misbehaved { worker, reason: malformed.into() },
            }
        }
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
        CloseReason::TooManyWorkers { .. } => Code::ResourceExhausted,
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
