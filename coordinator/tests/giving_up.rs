//! Clients that give up, by a deadline or by a cancellation, hold nothing any more.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::time::Duration;

use osteon_common::limits::{
    BATCH_REALIZATIONS_MAX, FETCHES_AT_ONCE_MAX, READER_PATIENCE_S, SUBMISSIONS_AT_ONCE_MAX,
};
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::{Config, Coordinator, Listener, start};
use osteon_proto::endpoint::{connect, jobs_client, workers_client};
use osteon_proto::v1::attach_request::Message as Sent;
use osteon_proto::v1::attach_response::Message as Received;
use osteon_proto::v1::{
    AttachRequest, FetchRequest, FetchResponse, SubmitRequest, SubmitResponse, WatchRequest,
    WorkerHello,
};
use osteon_proto::{batch, specification};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::Channel;
use tonic::{Code, Request, Status, Streaming};
use tonic_prost::ProstCodec;

/// Shorter than a call may take, and than a reader may pause: what comes within it was not freed by
/// those bounds.
const TIMEOUT: Duration = Duration::from_secs(25);

async fn coordinator() -> (Coordinator, Channel) {
    let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
    let config = Config { tick: Duration::from_millis(10), ..Config::default() };
    assert!(config.call_timeout > TIMEOUT && READER_PATIENCE_S > TIMEOUT.as_secs());
    let coordinator = start(listener, Box::new(MemoryStore::new()), config).await.unwrap();
    let channel = connect(&coordinator.url().parse().unwrap(), TIMEOUT).await.unwrap();
    (coordinator, channel)
}

/// Begins a submission whose message never comes.
async fn endless(channel: Channel, deadline: Option<Duration>) -> Status {
    let mut grpc = Grpc::new(channel);
    grpc.ready().await.unwrap();
    let mut request = Request::new(tokio_stream::pending::<SubmitRequest>());
    if let Some(deadline) = deadline {
        request.set_timeout(deadline);
    }
    let path = PathAndQuery::from_static("/osteon.v1.Jobs/Submit");
    let codec = ProstCodec::<SubmitRequest, SubmitResponse>::default();
    grpc.client_streaming(request, path, codec).await.map(drop).unwrap_err()
}

async fn submit(channel: &Channel, realizations: u64) -> String {
    submit_within(TIMEOUT, channel, realizations).await.unwrap()
}

async fn submit_within(
    deadline: Duration,
    channel: &Channel,
    realizations: u64,
) -> Result<String, Status> {
    let specification = specification::to_message(&fake::propagation(realizations, 7));
    let mut request =
        Request::new(SubmitRequest { specification: Some(specification), ..Default::default() });
    request.set_timeout(deadline);
    Ok(jobs_client(channel.clone()).submit(request).await?.into_inner().job)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deadline_frees_the_place_of_a_submission() {
    let (coordinator, channel) = coordinator().await;
    let mut calls = JoinSet::new();
    for _ in 0..2 * SUBMISSIONS_AT_ONCE_MAX {
        calls.spawn(endless(channel.clone(), Some(Duration::from_millis(300))));
    }
    while let Some(call) = calls.join_next().await {
        let code = call.unwrap().code();
        assert!(matches!(code, Code::DeadlineExceeded | Code::Cancelled), "{code}");
    }
    submit(&channel, 10).await;
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancellation_frees_the_place_of_a_submission() {
    let (coordinator, channel) = coordinator().await;
    let mut calls = JoinSet::new();
    for _ in 0..2 * SUBMISSIONS_AT_ONCE_MAX {
        calls.spawn(endless(channel.clone(), None));
    }
    // Until they hold every place, and nobody else gets one.
    let taken =
        async { while submit_within(Duration::from_millis(300), &channel, 10).await.is_ok() {} };
    tokio::time::timeout(TIMEOUT, taken).await.unwrap();
    calls.shutdown().await;
    submit(&channel, 10).await;
    coordinator.shutdown().await;
}

/// A worker that answers everything.
async fn work(channel: Channel) {
    let (outbound, messages) = mpsc::channel(16);
    let hello = WorkerHello { threads: 2, ..fake::wire_hello(1) };
    outbound.send(AttachRequest { message: Some(Sent::Hello(hello)) }).await.unwrap();
    let attached = workers_client(channel).attach(ReceiverStream::new(messages)).await.unwrap();
    let mut stream = attached.into_inner();
    while let Ok(Some(message)) = stream.message().await {
        if let Some(Received::Batch(message)) = message.message {
            let work = batch::from_message(&message).unwrap();
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
    // More than what is sent before anybody reads.
    let job = submit(&channel, 8 * u64::from(BATCH_REALIZATIONS_MAX)).await;
    let worker = tokio::spawn(work(channel.clone()));
    let request = WatchRequest { job: job.clone(), ..Default::default() };
    let mut stream = jobs_client(channel.clone()).watch(request).await.unwrap().into_inner();
    while tokio::time::timeout(TIMEOUT, stream.message()).await.unwrap().unwrap().is_some() {}

    let mut held = Vec::new();
    for _ in 0..FETCHES_AT_ONCE_MAX {
        held.push(fetch(&channel, &job).await.unwrap());
    }
    // Its deadline is over before one of the others lets it in.
    let refused = fetch(&channel, &job).await.unwrap_err();
    assert!(matches!(refused.code(), Code::DeadlineExceeded | Code::Cancelled), "{refused}");
    drop(held);
    let freed = async { while fetch(&channel, &job).await.is_err() {} };
    tokio::time::timeout(TIMEOUT, freed).await.unwrap();
    worker.abort();
    coordinator.shutdown().await;
}
