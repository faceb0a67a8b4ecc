//! The worker against coordinators that misbehave, over a Unix socket.

use std::future::pending;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use osteon_proto::v1::attach_response::Message as Reply;
use osteon_proto::v1::workers_server::{Workers, WorkersServer};
use osteon_proto::v1::{Batch, WorkerWelcome};
use tokio::net::UnixListener;
use tokio_stream::wrappers::UnixListenerStream;
use tonic::transport::Server;
use tonic::{Request as Call, Response};

use super::*;

/// What a false coordinator does with every worker.
#[derive(Debug, Clone, Copy)]
enum Script {
    /// Does not take it.
    Refuse,
    /// Takes it and closes the stream.
    Leave,
    /// Takes it and sends what cannot be read.
    Garble,
    /// Says nothing.
    Silence,
}

struct FalseCoordinator {
    script: Script,
    attachments: Arc<AtomicU32>,
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
        requests.message().await?;
        let (sender, stream) = mpsc::channel(4);
        let welcome = WorkerWelcome { worker: 1, lease: 1, heartbeat_s: 0.2, expiry_s: 0.5 };
        let mut script = Vec::new();
        match self.script {
            Script::Refuse => return Err(Status::failed_precondition("numerics differ")),
            Script::Leave => script.push(Reply::Welcome(welcome)),
            Script::Garble => {
                script.push(Reply::Welcome(welcome));
                script.push(Reply::Batch(Batch { batch: 1, count: 1, ..Batch::default() }));
            }
            Script::Silence => {
                script.push(Reply::Welcome(welcome));
                // Held open until the worker has gone.
                let open = sender.clone();
                tokio::spawn(async move { open.closed().await });
            }
        }
        for message in script {
            let _gone = sender.try_send(Ok(AttachResponse { message: Some(message) }));
        }
        Ok(Response::new(ReceiverStream::new(stream)))
    }
}

struct Scene {
    endpoint: Endpoint,
    socket: PathBuf,
    attachments: Arc<AtomicU32>,
}

impl Drop for Scene {
    fn drop(&mut self) {
        drop(std::fs::remove_file(&self.socket));
    }
}

/// Starts a false coordinator; it ends with the test's runtime.
fn scene(name: &str, script: Script) -> Scene {
    let name = format!("osteon-worker-test-{}-{name}", std::process::id());
    let socket = std::env::temp_dir().join(name);
    drop(std::fs::remove_file(&socket));
    let listener = UnixListener::bind(&socket).unwrap();
    let attachments = Arc::new(AtomicU32::new(0));
    let service = FalseCoordinator { script, attachments: Arc::clone(&attachments) };
    let router = Server::builder().add_service(WorkersServer::new(service));
    tokio::spawn(router.serve_with_incoming(UnixListenerStream::new(listener)));
    Scene { endpoint: Endpoint::Unix(socket.clone()), socket, attachments }
}

fn config(scene: &Scene) -> WorkerConfig {
    let endpoint = scene.endpoint.clone();
    WorkerConfig {
        endpoint,
        credentials: Credentials::default(),
        threads: 1,
        isa: Isa::fastest(),
        give_up_after: None,
        time_limit: None,
    }
}

async fn reached(attachments: &AtomicU32, count: u32) {
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
async fn a_lost_coordinator_is_found_again() {
    for (name, script) in [("leave", Script::Leave), ("silence", Script::Silence)] {
        let scene = scene(name, script);
        let attachments = Arc::clone(&scene.attachments);
        let shutdown = async move { reached(&attachments, 3).await };
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
            threads,
            isa: Isa::fastest(),
            give_up_after: None,
            time_limit: None,
        };
        let error = run(config, pending()).await.unwrap_err();
        assert!(matches!(error, WorkerError::Threads { .. }), "{error}");
    }
}
