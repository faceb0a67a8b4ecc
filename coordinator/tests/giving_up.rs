//! Clients that give up, by a deadline or by a cancellation, release everything they held.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;
mod slow;

use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::limits::{
    BATCH_REALIZATIONS_MAX, FETCHES_PER_CALLER_MAX, READER_STALL_SECONDS_MAX,
    SUBMISSIONS_AT_ONCE_MAX,
};
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::{Config, Coordinator, Listener, start};
use osteon_proto::v1::attach_request::Message as Sent;
use osteon_proto::v1::attach_response::Message as Received;
use osteon_proto::v1::{
    AttachRequest, FetchRequest, FetchResponse, SubmitRequest, WatchRequest, WorkerHello,
};
use osteon_proto::{announced, batch, specification};
use osteon_transport::connection::{connect, jobs_client, workers_client};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::Channel;
use tonic::{Code, Request, Status, Streaming};

use crate::slow::{begin_submission, large};

/// Shorter than the time limits of a call and of a reader's pause, so those limits cannot be what
/// freed the permits.
const TIMEOUT: Duration = Duration::from_secs(25);
/// Length of a submission that never ends, bytes.
const LONG: u32 = 1 << 20;

async fn coordinator() -> (Coordinator, Channel) {
    let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
    let config = Config { tick: Duration::from_millis(10), ..Config::default() };
    assert!(config.call_timeout > TIMEOUT && READER_STALL_SECONDS_MAX > TIMEOUT.as_secs());
    let coordinator = start(listener, Box::new(MemoryStore::new()), config).await.unwrap();
    let channel = connect(&coordinator.url().parse().unwrap(), TIMEOUT).await.unwrap();
    (coordinator, channel)
}

async fn submit(channel: &Channel, specification: &JobSpecification) -> String {
    submit_within(TIMEOUT, channel, specification).await.unwrap()
}

async fn submit_within(
    deadline: Duration,
    channel: &Channel,
    specification: &JobSpecification,
) -> Result<String, Status> {
    let specification = Some(specification::to_message(specification));
    let mut request = Request::new(SubmitRequest { specification, ..Default::default() });
    request.set_timeout(deadline);
    Ok(jobs_client(channel.clone()).submit(request).await?.into_inner().job)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deadline_frees_the_place_of_a_submission() {
    let (coordinator, channel) = coordinator().await;
    let mut calls = JoinSet::new();
    for _ in 0..2 * SUBMISSIONS_AT_ONCE_MAX {
        let deadline = Some(Duration::from_millis(300));
        calls.spawn(begin_submission(channel.clone(), LONG, deadline));
    }
    while let Some(call) = calls.join_next().await {
        call.unwrap();
    }
    submit(&channel, &large()).await;
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancellation_frees_the_place_of_a_submission() {
    let (coordinator, channel) = coordinator().await;
    let mut calls = JoinSet::new();
    for _ in 0..2 * SUBMISSIONS_AT_ONCE_MAX {
        calls.spawn(begin_submission(channel.clone(), LONG, None));
    }
    // Until they hold every permit of their connection.
    let (large, deadline) = (large(), Duration::from_millis(300));
    let taken = async { while submit_within(deadline, &channel, &large).await.is_ok() {} };
    tokio::time::timeout(TIMEOUT, taken).await.unwrap();
    calls.shutdown().await;
    submit(&channel, &large).await;
    coordinator.shutdown().await;
}

/// A worker that answers every batch.
async fn work(channel: Channel) {
    let (outbound, messages) = mpsc::channel(16);
    let hello = WorkerHello { slots: 2, ..fake::wire_hello(1) };
    outbound.send(AttachRequest { message: Some(Sent::Hello(hello)) }).await.unwrap();
    let attached = workers_client(channel).attach(ReceiverStream::new(messages)).await.unwrap();
    let mut stream = attached.into_inner();
    let mut evaluations = announced::Received::default();
    while let Ok(Some(message)) = stream.message().await {
        if let Some(Received::Evaluation(message)) = &message.message {
            evaluations.receive(message).unwrap();
        }
        if let Some(Received::Batch(message)) = message.message {
            let work = batch::from_message(&message, &evaluations).unwrap();
            let result = batch::answer_to_message(message.batch, &fake::solved(&work), 0.001);
            outbound.send(AttachRequest { message: Some(Sent::Result(result)) }).await.unwrap();
        }
    }
}

async fn fetch(channel: &Channel, job: &str) -> Result<Streaming<FetchResponse>, Status> {
    let mut request = Request::new(FetchRequest { job: job.to_owned() });
    request.set_timeout(Duration::from_secs(1));
    Ok(jobs_client(channel.clone()).fetch(request).await?.into_inner())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reader_that_goes_frees_the_place_of_a_fetch() {
    let (coordinator, channel) = coordinator().await;
    // More than is sent before the client reads.
    let specification = fake::propagation(8 * u64::from(BATCH_REALIZATIONS_MAX), 7);
    let job = submit(&channel, &specification).await;
    let worker = tokio::spawn(work(channel.clone()));
    let request = WatchRequest { job: job.clone(), ..Default::default() };
    let mut stream = jobs_client(channel.clone()).watch(request).await.unwrap().into_inner();
    while tokio::time::timeout(TIMEOUT, stream.message()).await.unwrap().unwrap().is_some() {}

    let mut held = Vec::new();
    for _ in 0..FETCHES_PER_CALLER_MAX {
        held.push(fetch(&channel, &job).await.unwrap());
    }
    // Its deadline passes before another fetch releases its permit.
    let refused = fetch(&channel, &job).await.unwrap_err();
    assert!(matches!(refused.code(), Code::DeadlineExceeded | Code::Cancelled), "{refused}");
    drop(held);
    let freed = async { while fetch(&channel, &job).await.is_err() {} };
    tokio::time::timeout(TIMEOUT, freed).await.unwrap();
    worker.abort();
    coordinator.shutdown().await;
}
