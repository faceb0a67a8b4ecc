//! Messages over a size limit are refused, those at the limit are accepted, also many at a time.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;
mod slow;

use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::limits::{
    HEADER_BYTES_MAX, SMALL_SUBMISSION_BYTES_MAX, SUBMISSIONS_AT_ONCE_MAX,
    SUBMISSIONS_PER_CALLER_MAX, WORKER_MESSAGE_BYTES_MAX,
};
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::{Config, Coordinator, Listener, start};
use osteon_proto::specification;
use osteon_proto::v1::attach_request::Message;
use osteon_proto::v1::{AttachRequest, ListRequest, SubmitRequest, SubmitResponse, WorkerHello};
use osteon_transport::connection::{connect, jobs_client, workers_client};
use prost::Message as _;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::Channel;
use tonic::{Code, Request};
use tonic_prost::ProstCodec;

use crate::slow::{begin_submission, large};

const TIMEOUT: Duration = Duration::from_secs(30);
/// Less than any wait for a permit.
const PROMPT: Duration = Duration::from_secs(3);

async fn coordinator() -> (Coordinator, Channel) {
    coordinator_with(Config::default()).await
}

async fn coordinator_with(config: Config) -> (Coordinator, Channel) {
    let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
    let store = Box::new(MemoryStore::new());
    let coordinator = start(listener, store, config).await.unwrap();
    let channel = connect(&coordinator.url().parse().unwrap(), TIMEOUT).await.unwrap();
    (coordinator, channel)
}

/// Returns a hello whose message has `bytes` bytes.
fn hello(bytes: usize) -> AttachRequest {
    let with = |length: usize| AttachRequest {
        message: Some(Message::Hello(WorkerHello {
            host: "h".repeat(length),
            ..WorkerHello::default()
        })),
    };
    // The name is preceded by two lengths, whose own size depends on their values.
    let mut length = bytes;
    while with(length).encoded_len() > bytes {
        length -= with(length).encoded_len() - bytes;
    }
    with(length)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_workers_message_is_read_up_to_its_bound() {
    let (coordinator, channel) = coordinator().await;
    for (bytes, code) in [
        // Read, and refused for its contents.
        (WORKER_MESSAGE_BYTES_MAX, Some(Code::InvalidArgument)),
        // Not read: the stream ends.
        (WORKER_MESSAGE_BYTES_MAX + 1, None),
    ] {
        let message = hello(bytes);
        assert_eq!(message.encoded_len(), bytes);
        let outgoing =
            tokio_stream::StreamExt::chain(tokio_stream::once(message), tokio_stream::pending());
        let attached = workers_client(channel.clone()).attach(outgoing).await;
        let first = tokio::time::timeout(TIMEOUT, attached.unwrap().get_mut().message()).await;
        let found = first.unwrap().map(|message| assert!(message.is_none()));
        assert_eq!(found.err().map(|status| status.code()), code, "{bytes} bytes");
    }
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn headers_are_read_up_to_their_bound() {
    let (coordinator, channel) = coordinator().await;
    let mut client = jobs_client(channel);
    // The headers of gRPC itself take some of the space.
    for (bytes, passes) in
        [(HEADER_BYTES_MAX as usize - 1000, true), (HEADER_BYTES_MAX as usize, false)]
    {
        let mut request = Request::new(ListRequest::default());
        request.metadata_mut().insert("x-long", "x".repeat(bytes).parse().unwrap());
        let answer = client.list(request).await;
        assert_eq!(answer.is_ok(), passes, "{bytes} bytes: {answer:?}");
    }
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn more_submissions_than_are_read_at_a_time_wait_their_turn() {
    let (coordinator, _) = coordinator().await;
    let specification = specification::to_message(&large());
    assert!(specification.encoded_len() as u64 > SMALL_SUBMISSION_BYTES_MAX);
    let mut calls = tokio::task::JoinSet::new();
    for _ in 0..10 * SUBMISSIONS_AT_ONCE_MAX / SUBMISSIONS_PER_CALLER_MAX {
        let channel = connect(&coordinator.url().parse().unwrap(), TIMEOUT).await.unwrap();
        for _ in 0..SUBMISSIONS_PER_CALLER_MAX {
            let mut client = jobs_client(channel.clone());
            let specification = Some(specification.clone());
            calls.spawn(async move {
                let request = SubmitRequest { specification, ..Default::default() };
                client.submit(request).await.map(drop)
            });
        }
    }
    while let Some(call) = calls.join_next().await {
        call.unwrap().unwrap();
    }
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_whose_message_never_ends_is_given_up() {
    let call_timeout = Duration::from_millis(200);
    let (coordinator, channel) =
        coordinator_with(Config { call_timeout, ..Config::default() }).await;
    // More than the number of submissions that are read at a time: they must not block each other
    // forever.
    let mut calls = tokio::task::JoinSet::new();
    for _ in 0..2 * SUBMISSIONS_AT_ONCE_MAX {
        let mut grpc = Grpc::new(channel.clone());
        calls.spawn(async move {
            grpc.ready().await.unwrap();
            let path = PathAndQuery::from_static("/osteon.v1.Jobs/Submit");
            let endless = Request::new(tokio_stream::pending::<SubmitRequest>());
            let codec = ProstCodec::<SubmitRequest, SubmitResponse>::default();
            grpc.client_streaming(endless, path, codec).await.map(drop)
        });
    }
    while let Some(call) = tokio::time::timeout(TIMEOUT, calls.join_next()).await.unwrap() {
        let status = call.unwrap().unwrap_err();
        assert!(matches!(status.code(), Code::DeadlineExceeded | Code::Cancelled), "{status}");
    }
    let specification = Some(specification::to_message(&fake::identification(100, 10, 7)));
    let request = SubmitRequest { specification, ..Default::default() };
    jobs_client(channel).submit(request).await.unwrap();
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_submissions_keep_nobody_out() {
    let (coordinator, slow) = coordinator().await;
    let quick = connect(&coordinator.url().parse().unwrap(), TIMEOUT).await.unwrap();
    let begun: Vec<_> = [1000, 1 << 20]
        .into_iter()
        .flat_map(|length| (0..100).map(move |_| length))
        .map(|length| tokio::spawn(begin_submission(slow.clone(), length, None)))
        .collect();
    let small = fake::identification(100, 10, 7);
    let large = large();
    let submit = async |channel: &Channel, specification: &JobSpecification| {
        let specification = Some(specification::to_message(specification));
        let request = SubmitRequest { specification, ..Default::default() };
        jobs_client(channel.clone()).submit(request).await
    };
    // The slow submissions have arrived when one of the same caller gets no permit.
    let full = loop {
        if let Err(full) = submit(&slow, &large).await {
            break full;
        }
    };
    assert_eq!(full.code(), Code::ResourceExhausted, "{full}");
    for specification in [&small, &large] {
        let submitted = tokio::time::timeout(PROMPT, submit(&quick, specification)).await;
        submitted.unwrap().unwrap();
    }
    begun.iter().for_each(tokio::task::JoinHandle::abort);
    coordinator.shutdown().await;
}
