//! Starts and stops a coordinator: the store's thread, the task that owns the state, and the
//! services on one port. All asynchronous code is here, in the services and in
//! [`crate::service::core_task`], and only moves bytes.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use osteon_common::limits::{HEADER_BYTES_MAX, MESSAGE_BYTES_MAX, WORKER_MESSAGE_BYTES_MAX};
use osteon_proto::identity::NoRandomness;
use osteon_proto::v1;
use osteon_proto::v1::jobs_server::JobsServer;
use osteon_proto::v1::workers_server::WorkersServer;
use thiserror::Error;
use tokio::sync::{mpsc, oneshot, watch};
use tonic::transport::Server;
use tonic::transport::server::Router;
use tower::layer::util::{Identity, Stack};

use crate::access::Policy;
use crate::access::layer::AccessLayer;
use crate::access::tls::Tls;
use crate::access::tokens::Tokens;
use crate::config::Config;
use crate::core::audit::AuditKey;
use crate::core::reactor::Restored;
use crate::core::state::State;
use crate::metrics::write_times::WriteTimes;
use crate::service::accept::{self, Places};
use crate::service::beside::{BesideKind, BesideTask, SharedParts};
use crate::service::core_task::{Clock, Core, Message, Monitoring};
use crate::service::failure_reporter::{ComponentFailure, FailureReporter, Guard};
use crate::service::job_spans::JobSpans;
use crate::service::jobs::JobsService;
use crate::service::listen::Listener;
use crate::service::meter::Meter;
use crate::service::workers::WorkersService;
use crate::store::thread::{self, StoreCommand};
use crate::store::{Store, StoreError};

/// Maximum number of events that wait for the core task.
const EVENTS_MAX: usize = 1024;
/// Maximum number of streams and calls that one connection may have open.
const STREAMS_PER_CONNECTION_MAX: u32 = 256;
/// A silent connection is probed at this interval, and closed when a probe is not answered within
/// the same time.
const KEEPALIVE: Duration = Duration::from_secs(10);

/// The services behind the access layer.
type GuardedRouter = Router<Stack<AccessLayer, Identity>>;

/// Error when a coordinator cannot start.
#[derive(Debug, Error)]
pub enum StartError {
    /// The store cannot be read.
    #[error(transparent)]
    Restore(#[from] StoreError),
    /// The operating system cannot create a thread.
    #[error("cannot start the store's thread: {source}")]
    Thread {
        /// The cause.
        source: std::io::Error,
    },
    /// The thread that reads the store ended unexpectedly.
    #[error("the store could not be read: its thread ended unexpectedly")]
    Interrupted {
        /// The cause.
        source: tokio::task::JoinError,
    },
    /// The operating system provides no random numbers for secrets.
    #[error(transparent)]
    NoRandomness(#[from] NoRandomness),
    /// The description of the services cannot be read.
    #[error("the services' description for gRPC reflection cannot be read")]
    Reflection {
        /// The cause.
        source: tonic_reflection::server::Error,
    },
}

/// A running coordinator.
#[derive(Debug)]
pub struct Coordinator {
    url: String,
    failures: FailureReporter,
    messages: mpsc::Sender<Message>,
    policy: watch::Sender<Arc<Policy>>,
    tls: Option<watch::Sender<Tls>>,
    stop_serving: oneshot::Sender<()>,
    server: tokio::task::JoinHandle<()>,
    core: tokio::task::JoinHandle<()>,
    store: JoinHandle<()>,
    beside: Vec<BesideTask>,
    shutdown_timeout: Duration,
    drained: bool,
}

/// Starts a coordinator on a bound address, and continues the jobs of its store.
///
/// # Errors
/// When the store cannot be read, or another part cannot be started.
pub async fn start(
    mut listener: Listener,
    mut store: Box<dyn Store + Send>,
    config: Config,
) -> Result<Coordinator, StartError> {
    let load = move || Restored::load(store.as_mut()).map(|restored| (store, restored));
    let loaded = tokio::task::spawn_blocking(load).await;
    let (store, restored) = loaded.map_err(|source| StartError::Interrupted { source })??;
    let audit_key = AuditKey::random()?;
    let config = Config { audit_key, ..config };
    let clock = Clock::new();
    tracing::info!(
        unfinished_jobs = restored.unfinished_jobs(),
        ended_jobs = restored.ended_jobs(),
        banned_workers = restored.banned_workers(),
        "jobs recovered from the store"
    );
    let (state, effects) = State::restore(config, restored, clock.now());

    let failures = FailureReporter::new();
    let (messages, inbox) = mpsc::channel(EVENTS_MAX);
    let (events, from_store) = mpsc::channel(EVENTS_MAX);
    let write_times = WriteTimes::default();
    let (commands, store) = thread::start(
        store,
        events.clone(),
        write_times.clone(),
        failures.guard(ComponentFailure::Store),
    )
    .map_err(|source| StartError::Thread { source })?;
    let listener_spans = listener.spans.take();
    let (policy, decided) = watch::channel(Arc::new(listener.policy.clone()));
    let (tls, shown) = listener.tls.clone().map(watch::channel).unzip();
    let parts = SharedParts {
        messages: &messages,
        store: &commands,
        write_times: &write_times,
        policy: &decided,
        tls: shown.as_ref(),
    };
    let beside = std::mem::take(&mut listener.beside).into_iter();
    let beside: Vec<BesideTask> = beside.map(|listener| listener.start(parts)).collect();
    let router = services(&messages, &commands, decided, config).await?;
    let url = listener.url().to_owned();
    let (stop_serving, stopped) = oneshot::channel();
    let places = Places::for_coordinator();
    let server = serve(router, listener, shown, places.clone(), stopped);
    let server = tokio::spawn(run_guarded(failures.guard(ComponentFailure::Server), server));
    let guard = failures.guard(ComponentFailure::Core);
    let meter = (!beside.is_empty()).then(Meter::default);
    let monitoring = Monitoring { meter, spans: listener_spans.map(JobSpans::new) };
    let core = Core::new(state, clock, commands, events, places, failures.clone(), monitoring);
    let core = core.run(effects, inbox, from_store, config.tick);
    let core = tokio::spawn(run_guarded(guard, core));
    tracing::info!(%url, "listening");
    Ok(Coordinator {
        url,
        failures,
        messages,
        policy,
        tls,
        stop_serving,
        server,
        core,
        store,
        beside,
        shutdown_timeout: config.shutdown_timeout,
        drained: false,
    })
}

impl Coordinator {
    /// Returns the URL that clients and workers use: `https://HOST:PORT`, `http://127.0.0.1:PORT`
    /// or `unix:PATH`.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns the URL of the metrics, if they are exported.
    pub fn metrics_url(&self) -> Option<&str> {
        self.url_beside(BesideKind::Metrics)
    }

    /// Returns the URL of the live page, if it is served.
    pub fn page_url(&self) -> Option<&str> {
        self.url_beside(BesideKind::Page)
    }

    fn url_beside(&self, kind: BesideKind) -> Option<&str> {
        self.beside.iter().find(|task| task.kind == kind).map(|task| task.url.as_str())
    }

    /// Replaces the accepted tokens, for every call that begins from now on. A coordinator that
    /// requires no tokens continues to require none.
    pub fn replace_tokens(&self, tokens: Tokens) {
        self.policy.send_modify(|policy| match **policy {
            Policy::Everybody => {}
            Policy::Tokens(_) => *policy = Arc::new(Policy::Tokens(tokens)),
            Policy::Tls(_) => *policy = Arc::new(Policy::Tls(tokens)),
        });
    }

    /// Replaces the certificates, for every connection that begins from now on. A coordinator
    /// without TLS continues without.
    pub fn replace_tls(&self, with: Tls) {
        if let Some(tls) = &self.tls {
            tls.send_replace(with);
        }
    }

    /// Waits until a part of the coordinator has ended unexpectedly, or the store has refused a
    /// record for [`Config::store_give_up_after`]; otherwise the future never completes. The coordinator
    /// cannot continue then: shut it down and report the reason.
    pub fn failed(&self) -> impl Future<Output = ComponentFailure> + Send + use<> {
        self.failures.first()
    }

    /// Sends no new batch, closes every stream and stores everything complete. Waits for that at most
    /// [`Config::shutdown_timeout`]. Workers that end afterwards are not lost. All that is left to do
    /// is [`Self::shutdown`].
    pub async fn drain(&mut self) {
        if std::mem::replace(&mut self.drained, true) {
            return;
        }
        self.failures.disarm();
        let stop = async {
            let (reply, stopped) = oneshot::channel();
            if self.messages.send(Message::Shutdown(reply)).await.is_ok() {
                // The task may have ended already; then there is nothing to wait for.
                let _ = stopped.await;
            }
        };
        if tokio::time::timeout(self.shutdown_timeout, stop).await.is_err() {
            tracing::warn!("shutting down before everything is stored");
        }
    }

    /// Drains and stops; evaluations that are not stored by then are computed again by the next
    /// coordinator on the same store.
    pub async fn shutdown(mut self) {
        self.drain().await;
        self.core.abort();
        let _ = self.core.await;
        drop(self.beside);
        let _ = self.stop_serving.send(());
        let mut server = self.server;
        if tokio::time::timeout(self.shutdown_timeout, &mut server).await.is_err() {
            server.abort();
            let _ = server.await;
        }
        // The services, which held the last senders of commands, are gone: the thread finishes its
        // current write, closes the store and ends.
        let store = self.store;
        let joined = tokio::task::spawn_blocking(move || store.join());
        let _ = tokio::time::timeout(self.shutdown_timeout, joined).await;
    }
}

async fn run_guarded(guard: Guard, part: impl Future<Output = ()>) {
    part.await;
    drop(guard);
}

/// Builds the services of one port.
async fn services(
    messages: &mpsc::Sender<Message>,
    commands: &mpsc::Sender<StoreCommand>,
    policy: watch::Receiver<Arc<Policy>>,
    config: Config,
) -> Result<GuardedRouter, StartError> {
    let jobs = JobsService::new(messages.clone(), commands.clone());
    let workers = WorkersService::new(messages.clone());
    let (health, health_service) = tonic_health::server::health_reporter();
    health.set_serving::<JobsServer<JobsService>>().await;
    health.set_serving::<WorkersServer<WorkersService>>().await;
    let describe = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(v1::FILE_DESCRIPTOR_SET)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let unreadable = |source| StartError::Reflection { source };
    let reflection = describe().build_v1().map_err(unreadable)?;
    // The official clients of some languages support only this version.
    let reflection_v1alpha = describe().build_v1alpha().map_err(unreadable)?;
    Ok(Server::builder()
        .http2_keepalive_interval(Some(KEEPALIVE))
        .http2_keepalive_timeout(Some(KEEPALIVE))
        .max_concurrent_streams(Some(STREAMS_PER_CONNECTION_MAX))
        .http2_max_header_list_size(HEADER_BYTES_MAX)
        .timeout(config.call_timeout)
        .layer(AccessLayer::new(policy))
        .add_service(health_service)
        .add_service(reflection)
        .add_service(reflection_v1alpha)
        .add_service(
            JobsServer::new(jobs)
                .max_decoding_message_size(MESSAGE_BYTES_MAX)
                .max_encoding_message_size(MESSAGE_BYTES_MAX),
        )
        .add_service(
            WorkersServer::new(workers)
                .max_decoding_message_size(WORKER_MESSAGE_BYTES_MAX)
                .max_encoding_message_size(MESSAGE_BYTES_MAX),
        ))
}

async fn serve(
    router: GuardedRouter,
    listener: Listener,
    tls: Option<watch::Receiver<Tls>>,
    places: Places,
    stopped: oneshot::Receiver<()>,
) {
    let signal = async {
        // A message and a dropped sender both mean stop.
        let _ = stopped.await;
    };
    let Listener { bound, file: _file, .. } = listener;
    let connections = accept::connections(bound, tls, places);
    if let Err(error) = router.serve_with_incoming_shutdown(connections, signal).await {
        tracing::error!(%error, "the server ended");
    }
}
