//! Tests of the worker against coordinators that misbehave, over a Unix socket.

use std::collections::BTreeMap;
use std::future::pending;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use osteon_common::case::Setup;
use osteon_common::germ_source::GermSource;
use osteon_common::outcome::RealizationResult;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::RandomQuantities;
use osteon_proto::batch::{self, Work};
use osteon_proto::evaluation::{self, EvaluationInput};
use osteon_proto::status;
use osteon_proto::v1::attach_response::Message as Reply;
use osteon_proto::v1::workers_server::{Workers, WorkersServer};
use osteon_proto::v1::{Batch, BatchRevoke, WorkerDrain, WorkerWelcome};
use tokio::net::UnixListener;
use tokio_stream::wrappers::UnixListenerStream;
use tonic::transport::Server;
use tonic::{Request as Call, Response};

use super::*;
use crate::backend::Done;

/// Behaviour of a fake coordinator towards every worker.
#[derive(Debug, Clone, Copy)]
enum Script {
    /// Refuses the worker.
    Refuse,
    /// Refuses the worker for now, and states that it may come back in an hour.
    Defer,
    /// Accepts the worker and closes the stream.
    Leave,
    /// Accepts the worker and sends a batch that cannot be read.
    Garble,
    /// Accepts the worker and then stays silent.
    Silence,
    /// Accepts the worker, sends three batches, revokes the second once the first is answered, and
    /// drains the worker when the third is answered.
    Work,
}

struct FalseCoordinator {
    script: Script,
    attachments: Arc<AtomicU32>,
    /// Messages received from workers.
    heard: Arc<Mutex<Vec<Request>>>,
}

#[tonic::async_trait]
impl Workers for FalseCoordinator {
    type AttachStream = ReceiverStream<Result<AttachResponse, Status>>;

    async fn attach(
        &self,
        call: Call<Streaming<AttachRequest>>,
    ) -> Result<Response<Self::AttachStream>, Status> {
        self.attachments.fetch_add(1, Ordering::SeqCst);
        let mut requests = call.into_inner();
        let hello = requests.message().await?.and_then(|request| request.message);
        self.heard.lock().unwrap().extend(hello);
        let (sender, stream) = mpsc::channel(5);
        // Only a silent coordinator should be abandoned soon.
        let expiry_s = if matches!(self.script, Script::Work) { 60.0 } else { 0.5 };
        let welcome = WorkerWelcome { worker: 1, lease: 1, heartbeat_s: 0.2, expiry_s };
        let mut script = Vec::new();
        match self.script {
            Script::Refuse => return Err(Status::failed_precondition("numerics differ")),
            Script::Defer => {
                let hour = Duration::from_secs(3600);
                return Err(status::resource_exhausted("too many workers", hour));
            }
            Script::Leave => script.push(Reply::Welcome(welcome)),
            Script::Garble => {
                script.push(Reply::Welcome(welcome));
                script.push(Reply::Batch(Batch { batch: 1, count: 1, ..Batch::default() }));
            }
            Script::Work => {}
            Script::Silence => {
                script.push(Reply::Welcome(welcome));
                // Keeps the stream open until the worker has gone.
                let open = sender.clone();
                tokio::spawn(async move { open.closed().await });
            }
        }
        if matches!(self.script, Script::Work) {
            script.push(Reply::Welcome(welcome));
            script.push(Reply::Evaluation(evaluation::to_message(&work().evaluation)));
            script.extend((1..=3).map(|number| Reply::Batch(batch::to_message(number, &work()))));
            tokio::spawn(take_answers(requests, sender.clone(), Arc::clone(&self.heard)));
        }
        for message in script {
            let _gone = sender.try_send(Ok(AttachResponse { message: Some(message) }));
        }
        Ok(Response::new(ReceiverStream::new(stream)))
    }
}

/// Records the worker's messages, and performs the rest of [`Script::Work`].
async fn take_answers(
    mut requests: Streaming<AttachRequest>,
    sender: mpsc::Sender<Result<AttachResponse, Status>>,
    heard: Arc<Mutex<Vec<Request>>>,
) {
    while let Ok(Some(AttachRequest { message: Some(message) })) = requests.message().await {
        let answered = match &message {
            Request::Result(result) => result.batch,
            // It holds nothing any more.
            Request::Drain(_) => return,
            _ => 0,
        };
        heard.lock().unwrap().push(message);
        let reply = match answered {
            1 => Reply::Revoke(BatchRevoke { batch: 2 }),
            3 => Reply::Drain(WorkerDrain {}),
            _ => continue,
        };
        let _gone = sender.send(Ok(AttachResponse { message: Some(reply) })).await;
    }
}

fn work() -> Work {
    let (setup, germs) = (Setup::default(), GermSource::streams(5));
    let evaluation = EvaluationInput {
        id: 1,
        setup,
        point: Point::of_bone([1.0; 7]),
        germs,
        random: RandomQuantities::default(),
        observables: osteon_common::observables::ObservableSet::NONE,
    };
    Work { evaluation: Arc::new(evaluation), first: 7, count: 2 }
}

/// A device that computes nothing. It completes a batch when the next one is started or another one
/// is released.
#[derive(Debug, Default)]
struct FakeBackend {
    open: BTreeMap<Task, Held>,
    seen: Arc<Mutex<Vec<String>>>,
}

struct Held(Work, Done);

impl std::fmt::Debug for Held {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

impl FakeBackend {
    /// Ends a batch on a thread of its own, as a real device does.
    fn end(held: Held, computed: Computed) {
        std::thread::spawn(move || (held.1)(computed));
    }
}

impl Backend for FakeBackend {
    fn slots(&self) -> u32 {
        4096
    }

    fn start(&mut self, task: Task, work: Work, done: Done) {
        self.seen.lock().unwrap().push(format!("start {}", task.batch));
        self.open.insert(task, Held(work, done));
        if task.batch == 3
            && let Some(first) = self.open.remove(&Task { batch: 1, ..task })
        {
            let solved = outcomes(&first.0);
            Self::end(first, Computed::Complete { solved, elapsed_s: 0.5 });
        }
    }

    fn forget(&mut self, task: Task) {
        self.seen.lock().unwrap().push(format!("forget {}", task.batch));
        let Some(held) = self.open.remove(&task) else { return };
        Self::end(held, Computed::Abandoned);
        if let Some(third) = self.open.remove(&Task { batch: 3, ..task }) {
            let solved = outcomes(&third.0);
            Self::end(third, Computed::Complete { solved, elapsed_s: 0.5 });
        }
    }
}

fn outcomes(work: &Work) -> Vec<RealizationResult> {
    let indices = work.first..work.first + u64::from(work.count);
    indices.map(|index| RealizationResult::solved(index as f64, 0.0)).collect()
}

#[tokio::test]
async fn a_device_is_told_what_to_compute_and_what_to_forget() {
    let scene = scene("device", Script::Work);
    let backend = FakeBackend::default();
    let seen = Arc::clone(&backend.seen);
    let ended = run_on_backend(Box::new(backend), config(&scene), pending());
    timeout(Duration::from_secs(60), ended).await.unwrap().unwrap();
    let heard = scene.heard.lock().unwrap().clone();
    let Some(Request::Hello(hello)) = heard.first() else { panic!("{heard:?}") };
    assert_eq!(hello.slots, 4096);
    let results = heard.iter().filter_map(|message| match message {
        Request::Result(result) => {
            Some((result.batch, batch::answer_from_message(result).unwrap()))
        }
        _ => None,
    });
    let expected = [(1, outcomes(&work())), (3, outcomes(&work()))];
    assert_eq!(results.collect::<Vec<_>>(), expected);
    let mut seen = seen.lock().unwrap().clone();
    // The end of a released batch may be reported at any later time.
    let last = seen.iter().position(|it| it == "forget 3").unwrap();
    seen.truncate(last);
    seen.dedup();
    assert_eq!(seen, ["start 1", "start 2", "start 3", "forget 1", "forget 2"]);
}

struct Scene {
    endpoint: Endpoint,
    socket: PathBuf,
    attachments: Arc<AtomicU32>,
    heard: Arc<Mutex<Vec<Request>>>,
}

impl Drop for Scene {
    fn drop(&mut self) {
        drop(std::fs::remove_file(&self.socket));
    }
}

/// Starts a fake coordinator, which ends with the test's runtime.
fn scene(name: &str, script: Script) -> Scene {
    let name = format!("osteon-worker-test-{}-{name}", std::process::id());
    let socket = std::env::temp_dir().join(name);
    drop(std::fs::remove_file(&socket));
    let listener = UnixListener::bind(&socket).unwrap();
    let attachments = Arc::new(AtomicU32::new(0));
    let heard = Arc::default();
    let service = FalseCoordinator {
        script,
        attachments: Arc::clone(&attachments),
        heard: Arc::clone(&heard),
    };
    let router = Server::builder().add_service(WorkersServer::new(service));
    tokio::spawn(router.serve_with_incoming(UnixListenerStream::new(listener)));
    Scene { endpoint: Endpoint::Unix(socket.clone()), socket, attachments, heard }
}

fn config(scene: &Scene) -> WorkerConfig {
    let endpoint = scene.endpoint.clone();
    WorkerConfig {
        endpoint,
        credentials: Credentials::default(),
        host: None,
        threads: 1,
        isa: Isa::fastest(),
        give_up_after: None,
        time_limit: None,
        idle_timeout: None,
        spans: None,
    }
}

async fn wait_for_attachments(attachments: &AtomicU32, count: u32) {
    while attachments.load(Ordering::SeqCst) < count {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn a_refusal_is_final() {
    let scene = scene("refuse", Script::Refuse);
    let error = run(config(&scene), pending()).await.unwrap_err();
    assert!(matches!(&error, WorkerError::Refused { reason, .. } if reason == "numerics differ"));
    assert!(error.to_string().contains(&scene.endpoint.to_string()), "{error}");
    assert_eq!(scene.attachments.load(Ordering::SeqCst), 1);
}

#[tokio::test]
async fn a_worker_that_is_refused_for_now_honours_the_delay() {
    let scene = scene("defer", Script::Defer);
    // Long enough for several waits of its own choice.
    let config = WorkerConfig { give_up_after: Some(Duration::from_secs(1)), ..config(&scene) };
    let error = run(config, pending()).await.unwrap_err();
    assert!(matches!(error, WorkerError::GaveUp { .. }), "{error}");
    assert!(error.to_string().contains("too many workers"), "{error}");
    // It waits for the whole time that it has, and asks once more at its end.
    assert_eq!(scene.attachments.load(Ordering::SeqCst), 2);
}

#[tokio::test]
async fn a_lost_coordinator_is_found_again() {
    for (name, script) in [("leave", Script::Leave), ("silence", Script::Silence)] {
        let scene = scene(name, script);
        let attachments = Arc::clone(&scene.attachments);
        let shutdown = async move { wait_for_attachments(&attachments, 3).await };
        let limit = Duration::from_secs(60);
        timeout(limit, run(config(&scene), shutdown)).await.unwrap().unwrap();
        assert!(scene.attachments.load(Ordering::SeqCst) >= 3, "{name}");
    }
}

#[tokio::test]
async fn a_batch_that_cannot_be_read_ends_the_worker() {
    let scene = scene("garble", Script::Garble);
    let error = run(config(&scene), pending()).await.unwrap_err();
    assert!(matches!(error, WorkerError::Malformed { .. }), "{error}");
}

#[tokio::test]
async fn threads_have_bounds() {
    let endpoint: Endpoint = "unix:/nonexistent".parse().unwrap();
    for threads in [0, WORKER_THREADS_MAX + 1] {
        let endpoint = endpoint.clone();
        let config = WorkerConfig {
            endpoint,
            credentials: Credentials::default(),
            host: None,
            threads,
            isa: Isa::fastest(),
            give_up_after: None,
            time_limit: None,
            idle_timeout: None,
            spans: None,
        };
        let error = run(config, pending()).await.unwrap_err();
        assert!(matches!(error, WorkerError::Threads { .. }), "{error}");
    }
}
