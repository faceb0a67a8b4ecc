//! The services over real sockets, with workers that compute a cheap substitute for the physics.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;
mod wire;

use std::time::Duration;

use osteon_common::version;
use osteon_coordinator::core::ids::JobId;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::store::sqlite::SqliteStore;
use osteon_coordinator::store::{
    BanRecord, Changes, DoubtRecord, EndRecord, EvaluationRecord, JobRecord, Store, StoreError,
    StoredJob,
};
use osteon_coordinator::{ComponentFailure, Config, Coordinator, Listener, start};
use osteon_files::report::ResultFile;
use osteon_proto::announced::Received;
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{
    AttachRequest, CancelRequest, FetchRequest, GetRequest, JobSnapshot, JobState, JobStatus,
    ListRequest, SubmitRequest, WatchRequest, WorkerHello,
};
use osteon_proto::{batch, realizations, specification, status};
use osteon_search::Summary;
use osteon_transport::connection::{connect, jobs_client, workers_client};
use osteon_transport::endpoint::Endpoint;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::Channel;
use tonic::{Code, Status};
use tonic_types::StatusExt as _;

const TIMEOUT: Duration = Duration::from_secs(30);

async fn coordinator(address: &str, store: Box<dyn Store + Send>) -> Coordinator {
    let listener = Listener::bind(&address.parse().unwrap(), false).await.unwrap();
    let config = Config { tick: Duration::from_millis(10), ..Config::default() };
    start(listener, store, config).await.unwrap()
}

async fn client(coordinator: &Coordinator) -> JobsClient<Channel> {
    jobs_client(channel(coordinator).await)
}

async fn channel(coordinator: &Coordinator) -> Channel {
    let endpoint: Endpoint = coordinator.url().parse().unwrap();
    connect(&endpoint, TIMEOUT).await.unwrap()
}

fn hello(fingerprint: String) -> AttachRequest {
    let hello = WorkerHello { fingerprint, slots: 2, ..fake::wire_hello(1) };
    AttachRequest { message: Some(Request::Hello(hello)) }
}

/// A worker that answers at most `batches_max` batches, then disappears without notice.
async fn work(channel: Channel, batches_max: usize) -> Result<usize, Status> {
    work_with(channel, batches_max, |_| {}).await
}

/// As [`work`], and shows each message of the coordinator to `see`.
async fn work_with(
    channel: Channel,
    batches_max: usize,
    mut see: impl FnMut(&Response),
) -> Result<usize, Status> {
    let (outbound, messages) = mpsc::channel(16);
    outbound.send(hello(version::fingerprint())).await.unwrap();
    let attached = workers_client(channel).attach(ReceiverStream::new(messages)).await?;
    let mut stream = attached.into_inner();
    let mut evaluations = Received::default();
    let mut answered = 0;
    while answered < batches_max
        && let Some(message) = stream.message().await?
    {
        message.message.iter().for_each(&mut see);
        if let Some(Response::Evaluation(message)) = &message.message {
            evaluations.receive(message).unwrap();
        }
        if let Some(Response::Batch(message)) = message.message {
            let work = batch::from_message(&message, &evaluations).unwrap();
            let result = batch::answer_to_message(message.batch, &fake::solved(&work), 0.001);
            let result = AttachRequest { message: Some(Request::Result(result)) };
            outbound.send(result).await.unwrap();
            answered += 1;
        }
    }
    Ok(answered)
}

async fn submit(
    client: &mut JobsClient<Channel>,
    job: &osteon_common::job::JobSpecification,
    request_id: &str,
) -> Result<String, Status> {
    let request = SubmitRequest {
        specification: Some(specification::to_message(job)),
        request_id: request_id.to_owned(),
        ..SubmitRequest::default()
    };
    Ok(client.submit(request).await?.into_inner().job)
}

/// Watches a job to its end; returns the last snapshot.
async fn watch(client: &mut JobsClient<Channel>, job: &str) -> JobSnapshot {
    let request = WatchRequest { job: job.to_owned(), ..WatchRequest::default() };
    let mut stream = client.watch(request).await.unwrap().into_inner();
    let mut last = None;
    let follow = async {
        while let Some(response) = stream.message().await.unwrap() {
            last = response.snapshot;
        }
    };
    tokio::time::timeout(TIMEOUT, follow).await.unwrap();
    last.unwrap()
}

async fn fetch(client: &mut JobsClient<Channel>, job: &str) -> Result<Vec<Part>, Status> {
    let request = FetchRequest { job: job.to_owned() };
    let mut stream = client.fetch(request).await?.into_inner();
    let mut parts = Vec::new();
    while let Some(response) = stream.message().await? {
        let part = response.part.unwrap();
        // A heartbeat of a coordinator on a busy machine.
        let is_sign = matches!(&part, Part::History(block) if block.rows.is_empty());
        if !is_sign {
            parts.push(part);
        }
    }
    Ok(parts)
}

/// Asserts that the output of `job` is the result of the plain run.
async fn check_leftover(
    client: &mut JobsClient<Channel>,
    job: &str,
    expected: &osteon_common::job::JobSpecification,
) {
    let parts = fetch(client, job).await.unwrap();
    let (mut result, mut rows, mut outcomes) = (None, 0, Vec::new());
    assert_eq!(parts[0], Part::Specification(specification::to_message(expected)));
    for part in &parts[1..] {
        match part {
            Part::Specification(_) => panic!("a second specification"),
            Part::Result(message) => result = Some(message),
            Part::History(block) => rows += block.rows.len() as u64,
            Part::Group(_) => panic!("the result of a group"),
            Part::Draws(_) => panic!("draws from a posterior that nobody asked for"),
            Part::Realizations(block) => {
                let (first, block) = realizations::from_message(block).unwrap();
                assert_eq!(first, outcomes.len() as u64);
                outcomes.extend(block);
            }
        }
    }
    let plain = fake::plain_run(expected);
    let message = result.unwrap();
    assert_eq!((message.status, &message.reason), (JOB_STATUS.number(plain.status), &plain.reason));
    assert_eq!(message.json, ResultFile::from_job(expected.kind, &plain).to_json());
    assert_eq!(rows, plain.evaluations);
    assert_eq!(outcomes, plain.best.unwrap().outcomes);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_goes_from_submission_to_result() {
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut client = client(&coordinator).await;
    let specification = fake::identification(500, 60, 7);
    let job = submit(&mut client, &specification, "one").await.unwrap();
    assert_eq!(submit(&mut client, &specification, "one").await.unwrap(), job);
    let unfinished = fetch(&mut client, &job).await.unwrap_err();
    assert_eq!(unfinished.code(), Code::FailedPrecondition, "{unfinished}");

    let mut workers = Vec::new();
    for _ in 0..2 {
        workers.push(tokio::spawn(work(channel(&coordinator).await, usize::MAX)));
    }
    let last = watch(&mut client, &job).await;
    assert_eq!((last.state(), last.status()), (JobState::Ended, JobStatus::MaxEvaluations));
    assert_eq!((last.evaluations, last.realizations, last.workers), (60, 500, 2));
    check_leftover(&mut client, &job, &specification).await;

    coordinator.shutdown().await;
    for worker in workers {
        assert_eq!(worker.await.unwrap().unwrap_err().code(), Code::Unavailable);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_evaluation_comes_once_on_each_stream() {
    const BATCHES: usize = 4;
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut client = client(&coordinator).await;
    submit(&mut client, &fake::propagation(100_000, 7), "").await.unwrap();
    let mut streams = Vec::new();
    // A worker attaches, disappears, and attaches again.
    for _ in 0..2 {
        let (mut evaluations, mut batches) = (Vec::new(), Vec::new());
        let worker = work_with(channel(&coordinator).await, BATCHES, |message| match message {
            Response::Evaluation(message) => {
                assert!(batches.is_empty(), "an evaluation came after its first batch");
                evaluations.push(message.clone());
            }
            Response::Batch(message) => batches.push(message.evaluation),
            _ => {}
        });
        let worked = tokio::time::timeout(TIMEOUT, worker).await.unwrap();
        assert_eq!(worked.unwrap(), BATCHES);
        assert_eq!(evaluations.len(), 1, "{evaluations:?}");
        assert_eq!(batches, [evaluations[0].evaluation; BATCHES]);
        streams.push(evaluations.remove(0));
    }
    assert_eq!(streams[0], streams[1]);
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_restarted_coordinator_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let socket = format!("unix:{}", directory.path().join("o.sock").display());
    let store = || Box::new(SqliteStore::open(directory.path()).unwrap());
    let specification = fake::identification(300, 40, 3);

    let first = coordinator(&socket, store()).await;
    let mut jobs = client(&first).await;
    let job = submit(&mut jobs, &specification, "").await.unwrap();
    assert_eq!(work(channel(&first).await, 25).await.unwrap(), 25);
    let request = GetRequest { job: job.clone() };
    let before = jobs.get(request).await.unwrap().into_inner().snapshot.unwrap();
    assert_eq!(before.state(), JobState::Running);
    drop(jobs);
    first.shutdown().await;

    let second = coordinator(&socket, store()).await;
    let mut jobs = client(&second).await;
    let worker = tokio::spawn(work(channel(&second).await, usize::MAX));
    let last = watch(&mut jobs, &job).await;
    assert!(last.evaluations >= before.evaluations);
    check_leftover(&mut jobs, &job, &specification).await;
    drop(jobs);
    second.shutdown().await;
    assert_eq!(worker.await.unwrap().unwrap_err().code(), Code::Unavailable);

    // Ended jobs are still there after another restart.
    let third = coordinator(&socket, store()).await;
    let mut jobs = client(&third).await;
    check_leftover(&mut jobs, &job, &specification).await;
    let listed = jobs.list(ListRequest::default()).await.unwrap().into_inner();
    assert_eq!(listed.jobs.len(), 1);
    let sequence = listed.jobs[0].sequence;
    assert!(sequence > last.sequence, "{sequence} after {}", last.sequence);
    assert_eq!(listed.jobs[0], JobSnapshot { workers: 0, sequence, ..last });
    drop(jobs);
    third.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_waiting_job_says_what_it_waits_for_and_can_be_cancelled() {
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut client = client(&coordinator).await;
    let job = submit(&mut client, &fake::propagation(100, 1), "").await.unwrap();
    let request = GetRequest { job: job.clone() };
    let snapshot = client.get(request).await.unwrap().into_inner().snapshot.unwrap();
    assert_eq!(snapshot.state(), JobState::Running);
    assert!(snapshot.waiting_for.starts_with("no worker is attached (since "), "{snapshot:?}");
    for _ in 0..2 {
        let request = CancelRequest { job: job.clone() };
        let snapshot = client.cancel(request).await.unwrap().into_inner().snapshot.unwrap();
        assert_eq!(snapshot.status(), JobStatus::Cancelled);
    }
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn bad_requests_are_refused_with_reasons() {
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut client = client(&coordinator).await;

    let mut wrong = fake::identification(0, 10, 1);
    wrong.setup.layers.coupling.density = -1.0;
    let refused = submit(&mut client, &wrong, "").await.unwrap_err();
    let violations = status::violations(&refused).unwrap();
    let fields: Vec<&str> = violations.iter().map(|violation| violation.field.as_str()).collect();
    assert_eq!(fields, ["layers.coupling.density", "monte_carlo.realizations"]);

    submit(&mut client, &fake::propagation(10, 1), "taken").await.unwrap();
    let refused = submit(&mut client, &fake::propagation(10, 2), "taken").await.unwrap_err();
    assert_eq!(refused.code(), Code::AlreadyExists, "{refused}");
    let refused = submit(&mut client, &fake::propagation(10, 1), &"x".repeat(257)).await;
    assert_eq!(refused.unwrap_err().code(), Code::InvalidArgument);
    for job in ["99", "none", ""] {
        let refused = client.get(GetRequest { job: job.to_owned() }).await.unwrap_err();
        assert_eq!(refused.code(), Code::NotFound, "{refused}");
        let resource = refused.get_details_resource_info().unwrap();
        assert_eq!(
            (resource.resource_type.as_str(), resource.resource_name.as_str()),
            ("job", job)
        );
    }
    let request = ListRequest { page_token: "nonsense".to_owned(), ..ListRequest::default() };
    assert_eq!(client.list(request).await.unwrap_err().code(), Code::InvalidArgument);
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_with_other_numerics_is_refused() {
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let (outbound, messages) = mpsc::channel(16);
    outbound.send(hello("osteon 0.0.0 numerics 0".to_owned())).await.unwrap();
    let mut workers = workers_client(channel(&coordinator).await);
    let mut stream = workers.attach(ReceiverStream::new(messages)).await.unwrap().into_inner();
    let refused = stream.message().await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(refused.message().contains("osteon 0.0.0 numerics 0"), "{refused}");
    coordinator.shutdown().await;
}

/// A store that accepts jobs, and then refuses every evaluation, or panics at it.
#[derive(Clone)]
struct BrokenStore {
    sound: MemoryStore,
    dies: bool,
}

impl Store for BrokenStore {
    fn together(&mut self, changes: &mut Changes<'_>) -> Result<(), StoreError> {
        changes(self)
    }

    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError> {
        self.sound.visit_jobs(visit)
    }

    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError> {
        self.sound.job(job)
    }

    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError> {
        self.sound.evaluation(job, number)
    }

    fn reset_job(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        self.sound.reset_job(job, fingerprint)
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        self.sound.put_job(record)
    }

    fn put_evaluation(&mut self, _: &EvaluationRecord, _: bool) -> Result<(), StoreError> {
        assert!(!self.dies, "a store that this test breaks");
        let error = std::io::Error::other("the disk is full");
        Err(StoreError::Directory { path: "store".into(), error })
    }

    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        self.sound.finish_job(end, summary)
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        self.sound.summary(job)
    }

    fn delete_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError> {
        self.sound.delete_jobs(jobs)
    }

    fn last_deleted_job(&mut self) -> Result<Option<JobId>, StoreError> {
        self.sound.last_deleted_job()
    }

    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError> {
        self.sound.put_ban(record)
    }

    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError> {
        self.sound.bans()
    }

    fn doubts(&mut self) -> Result<Vec<DoubtRecord>, StoreError> {
        self.sound.doubts()
    }

    fn reopen_job(&mut self, job: JobId) -> Result<Option<StoredJob>, StoreError> {
        self.sound.reopen_job(job)
    }
}

/// Returns a coordinator whose store accepts no evaluation, and its job, once the coordinator has
/// reported the failure.
async fn failed(dies: bool) -> (Coordinator, MemoryStore, String, ComponentFailure) {
    let sound = MemoryStore::new();
    let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
    let config = Config {
        tick: Duration::from_millis(10),
        store_retry: Duration::from_millis(10),
        store_give_up_after: Some(Duration::from_millis(50)),
        shutdown_timeout: Duration::from_millis(200),
        ..Config::default()
    };
    let store = BrokenStore { sound: sound.clone(), dies };
    let coordinator = start(listener, Box::new(store), config).await.unwrap();
    let specification = fake::identification(10, 3, 1);
    let job = submit(&mut client(&coordinator).await, &specification, "").await.unwrap();
    let worker = tokio::spawn(work(channel(&coordinator).await, usize::MAX));
    let failed = tokio::time::timeout(TIMEOUT, coordinator.failed()).await.unwrap();
    worker.abort();
    (coordinator, sound, job, failed)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_that_refuses_is_told_and_leaves_the_job_unfinished() {
    let (coordinator, mut sound, job, failed) = failed(false).await;
    assert!(failed.to_string().contains("the disk is full"), "{failed}");
    let mut client = client(&coordinator).await;
    let unfinished = fetch(&mut client, &job).await.unwrap_err();
    assert_eq!(unfinished.code(), Code::FailedPrecondition, "{unfinished}");
    let snapshot = client.get(GetRequest { job }).await.unwrap().into_inner().snapshot.unwrap();
    assert!(snapshot.waiting_for.contains("the disk is full"), "{snapshot:?}");
    drop(client);
    coordinator.shutdown().await;
    assert_eq!(sound.jobs().unwrap()[0].end, None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_whose_thread_dies_is_told() {
    let (coordinator, _, _, failed) = failed(true).await;
    assert_eq!(failed, ComponentFailure::Store);
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn health_and_reflection_are_on_the_same_port() {
    use tonic_health::pb::health_check_response::ServingStatus;
    use tonic_health::pb::health_client::HealthClient;
    use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
    use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
    use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;

    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut health = HealthClient::new(channel(&coordinator).await);
    for service in ["", "osteon.v1.Jobs", "osteon.v1.Workers"] {
        let request = tonic_health::pb::HealthCheckRequest { service: service.to_owned() };
        let status = health.check(request).await.unwrap().into_inner().status();
        assert_eq!(status, ServingStatus::Serving, "{service}");
    }
    let request = tonic_reflection::pb::v1::ServerReflectionRequest {
        host: String::new(),
        message_request: Some(MessageRequest::ListServices(String::new())),
    };
    let mut reflection = ServerReflectionClient::new(channel(&coordinator).await);
    let requests = tokio_stream::once(request);
    let mut answers = reflection.server_reflection_info(requests).await.unwrap().into_inner();
    let answer = answers.message().await.unwrap().unwrap().message_response.unwrap();
    let MessageResponse::ListServicesResponse(listed) = answer else { panic!("{answer:?}") };
    let names: Vec<&str> = listed.service.iter().map(|service| service.name.as_str()).collect();
    for expected in ["osteon.v1.Jobs", "osteon.v1.Workers", "grpc.health.v1.Health"] {
        assert!(names.contains(&expected), "{names:?}");
    }
    assert!(names.iter().all(|name| name.starts_with("grpc.") || name.starts_with("osteon.v1.")));
    drop((health, reflection, answers));
    coordinator.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_cancels_a_job_whose_end_the_store_refuses_is_told_so() {
    let directory = tempfile::tempdir().unwrap();
    drop(SqliteStore::open(directory.path()).unwrap());
    let file = rusqlite::Connection::open(directory.path().join("osteon.sqlite")).unwrap();
    let trigger = "CREATE TRIGGER full BEFORE INSERT ON ending
                   BEGIN SELECT RAISE(ABORT, 'the disk is full'); END";
    file.execute_batch(trigger).unwrap();
    drop(file);
    let store = Box::new(SqliteStore::open(directory.path()).unwrap());
    let coordinator = coordinator("127.0.0.1:0", store).await;
    let mut client = client(&coordinator).await;
    let job = submit(&mut client, &fake::propagation(10, 7), "").await.unwrap();
    let cancel = client.cancel(CancelRequest { job: job.clone() });
    let told = tokio::time::timeout(TIMEOUT, cancel).await.unwrap().unwrap_err();
    assert_eq!(told.code(), Code::Unavailable, "{told}");
    let expected = format!("job {job} is cancelled, and has not ended yet: the store cannot write");
    assert!(told.message().starts_with(&expected), "{told}");
    assert!(told.message().contains("the disk is full"), "{told}");
    coordinator.shutdown().await;
}
