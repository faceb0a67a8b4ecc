//! A worker that returns wrong answers, over real sockets: it is found out and banned, and leaves
//! no trace in the result. Then the job is deleted.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::time::Duration;

use osteon_common::results::Status as JobEnd;
use osteon_coordinator::store::sqlite::SqliteStore;
use osteon_coordinator::{Config, Coordinator, Listener, start};
use osteon_files::report::ResultFile;
use osteon_proto::announced::Received;
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{
    AttachRequest, FetchRequest, GetRequest, JobState, ListBansRequest, PruneRequest,
    SubmitRequest, WatchRequest,
};
use osteon_proto::{batch, specification};
use osteon_transport::connection::{connect, jobs_client, workers_client};
use osteon_transport::endpoint::Endpoint;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::Channel;
use tonic::{Code, Status};

const TIMEOUT: Duration = Duration::from_secs(60);
const LIAR: u32 = 2;

async fn channel(coordinator: &Coordinator) -> Channel {
    let endpoint: Endpoint = coordinator.url().parse().unwrap();
    connect(&endpoint, TIMEOUT).await.unwrap()
}

/// Works in `process` until the stream ends. The faulty worker's answers are off by one bit now and
/// then.
async fn work(channel: Channel, process: u32) -> Result<(), Status> {
    let (outbound, messages) = mpsc::channel(16);
    let hello = fake::wire_hello(process);
    outbound.send(AttachRequest { message: Some(Request::Hello(hello)) }).await.unwrap();
    let attached = workers_client(channel).attach(ReceiverStream::new(messages)).await?;
    let mut stream = attached.into_inner();
    let mut evaluations = Received::default();
    while let Some(message) = stream.message().await? {
        if let Some(Response::Evaluation(message)) = &message.message {
            evaluations.receive(message).unwrap();
        }
        if let Some(Response::Batch(message)) = message.message {
            let mut solved = fake::solved(&batch::from_message(&message, &evaluations).unwrap());
            if process == LIAR
                && message.batch.is_multiple_of(5)
                && let Ok(velocity) = &mut solved[0].outcome
            {
                *velocity = velocity.next_up();
            }
            let result = batch::answer_to_message(message.batch, &solved, 0.001);
            // The stream may have ended meanwhile.
            let _ = outbound.send(AttachRequest { message: Some(Request::Result(result)) }).await;
        }
    }
    Ok(())
}

/// Returns the digest and the status of an ended job.
async fn left(client: &mut JobsClient<Channel>, job: &str) -> Result<(String, JobEnd), Status> {
    let mut stream = client.fetch(FetchRequest { job: job.to_owned() }).await?.into_inner();
    loop {
        if let Some(Part::Result(result)) = stream.message().await?.unwrap().part {
            let status = JOB_STATUS.value(result.status).unwrap();
            let result = ResultFile::from_json(&result.json).unwrap();
            return Ok((result.digest().to_owned(), status));
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_liar_leaves_no_trace_and_stays_out() {
    let directory = tempfile::tempdir().unwrap();
    let store = Box::new(SqliteStore::open(directory.path()).unwrap());
    let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
    let config = Config { audit_fraction: 0.5, ..Config::default() };
    let coordinator = start(listener, store, config).await.unwrap();
    let mut client = jobs_client(channel(&coordinator).await);
    let specification = fake::identification(200, 40, 3);
    let request = SubmitRequest {
        specification: Some(specification::to_message(&specification)),
        ..SubmitRequest::default()
    };
    let job = client.submit(request).await.unwrap().into_inner().job;
    let mut workers = Vec::new();
    for process in 1..=3 {
        workers.push(tokio::spawn(work(channel(&coordinator).await, process)));
    }
    let banned = workers.remove(LIAR as usize - 1);
    let banned = tokio::time::timeout(TIMEOUT, banned).await.unwrap().unwrap().unwrap_err();
    assert_eq!(banned.code(), Code::PermissionDenied, "{banned}");
    let again = work(channel(&coordinator).await, LIAR).await.unwrap_err();
    assert_eq!(again.code(), Code::PermissionDenied, "{again}");

    let mut after = 0;
    loop {
        // A watch is interrupted and resumed.
        let request = WatchRequest { job: job.clone(), after };
        let mut stream = client.watch(request).await.unwrap().into_inner();
        let read = tokio::time::timeout(TIMEOUT, stream.message()).await.unwrap();
        let snapshot = read.unwrap().unwrap().snapshot.unwrap();
        assert!(snapshot.sequence > after, "{snapshot:?} after {after}");
        after = snapshot.sequence;
        if snapshot.state() == JobState::Ended {
            break;
        }
    }
    let expected = fake::plain_run(&specification);
    let found = left(&mut client, &job).await.unwrap();
    assert_eq!(found, (expected.digest, expected.status));
    let listed = client.list_bans(ListBansRequest {}).await.unwrap().into_inner().workers;
    assert_eq!(listed.len(), 1, "{listed:?}");
    assert_eq!(
        (listed[0].host.as_str(), listed[0].process, &listed[0].job),
        ("node-2", LIAR, &job)
    );
    assert!(listed[0].reason.contains(" agree on "), "{listed:?}");

    let bad = PruneRequest { keep_for_s: Some(-1.0), keep_last: None };
    assert_eq!(client.prune(bad).await.unwrap_err().code(), Code::InvalidArgument);
    let kept = PruneRequest { keep_for_s: None, keep_last: Some(1) };
    assert_eq!(client.prune(kept).await.unwrap().into_inner().jobs, [""; 0]);
    let pruned = client.prune(PruneRequest::default()).await.unwrap().into_inner().jobs;
    assert_eq!(pruned, std::slice::from_ref(&job));
    assert_eq!(left(&mut client, &job).await.unwrap_err().code(), Code::NotFound);
    let gone = client.get(GetRequest { job }).await.unwrap_err();
    assert_eq!(gone.code(), Code::NotFound, "{gone}");
    drop(client);
    coordinator.shutdown().await;
}
