//! The event loop of the worker and its only async file: moves bytes between coordinator, state and
//! backend.

use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use osteon_common::limits::{NAME_BYTES_MAX, WORKER_THREADS_MAX};
use osteon_proto::identity;
use osteon_proto::spans::SpanRecorder;
use osteon_proto::status::{is_banned, retry_after};
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::{AttachRequest, AttachResponse};
use osteon_solver::Isa;
use osteon_transport::connection::{self, ConnectError, Connection};
use osteon_transport::credentials::Credentials;
use osteon_transport::endpoint::Endpoint;
use osteon_transport::tls_failure::TlsFailure;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};
use tracing::{info, trace, warn};

use crate::backend::{Backend, Computed, Task};
use crate::backoff::Backoff;
use crate::batch_spans::BatchSpans;
use crate::compute::Cores;
use crate::error::WorkerError;
use crate::self_test::{KNOWN_DIGEST, known_batch_digest};
use crate::state::{BATCHES_HELD_MAX, Detached, Effect, Event, Failure, Identity, State};

/// Longest wait for a connection, and for the answer to the hello, s.
const ATTACH_S_MAX: u64 = 10;
/// Interval of the ticks, ms.
const TICK_MS: u64 = 100;
/// Maximum number of messages waiting to be sent: an answer to every batch, and heartbeats.
const OUTBOX_MAX: usize = 2 * BATCHES_HELD_MAX;

/// Configuration of a worker.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// Address of the coordinator.
    pub endpoint: Endpoint,
    /// Certificates and token for the coordinator, and the authorities that are trusted.
    pub credentials: Credentials,
    /// Name of the machine, by which its answers count as one vote, and by which it is banned; `None`: its host
    /// name.
    pub host: Option<String>,
    /// Number of threads to compute on, 1 to [`WORKER_THREADS_MAX`].
    pub threads: u32,
    /// Instruction set to compute on; results do not depend on it.
    pub isa: Isa,
    /// Time without a coordinator after which the worker gives up; `None` to retry without limit.
    pub give_up_after: Option<Duration>,
    /// Time after which the worker drains and ends, e.g. shortly before a batch system would kill
    /// it.
    pub time_limit: Option<Duration>,
    /// Time without work, or without a coordinator, after which the worker ends; `None` to stay.
    pub idle_timeout: Option<Duration>,
    /// Where the spans of batches go that the coordinator traces.
    pub spans: Option<Arc<dyn SpanRecorder>>,
}

/// Serves a coordinator until `shutdown` completes, the time limit has passed, or there was no work
/// for the idle timeout; then finishes or returns the batches that it holds. Losing the coordinator is not an error: the worker attaches
/// again.
///
/// # Errors
/// If this machine computes a known batch wrongly, the coordinator refuses the worker, is away for longer than
/// allowed or sends a message that cannot be read, or if the solver panics.
pub async fn run(
    config: WorkerConfig,
    shutdown: impl Future<Output = ()>,
) -> Result<(), WorkerError> {
    if config.threads == 0 || config.threads > WORKER_THREADS_MAX {
        return Err(WorkerError::Threads { threads: config.threads, max: WORKER_THREADS_MAX });
    }
    info!(
        endpoint = %config.endpoint,
        threads = config.threads,
        instruction_set = config.isa.name(),
        "starting"
    );
    let backend = Box::new(Cores::new(config.threads, config.isa)?);
    run_on_backend(backend, config, shutdown).await
}

/// As [`run`], on the computing device `backend`.
async fn run_on_backend(
    backend: Box<dyn Backend>,
    config: WorkerConfig,
    shutdown: impl Future<Output = ()>,
) -> Result<(), WorkerError> {
    let (finished_sender, finished) = mpsc::channel(BATCHES_HELD_MAX);
    let identity = Identity {
        slots: backend.slots(),
        host: host_name(config.host.as_deref()),
        process: std::process::id(),
        instance: identity::random_number()?,
    };
    let mut worker = Worker {
        state: State::new(identity, config.idle_timeout),
        backend,
        finished_sender,
        finished,
        started: Instant::now(),
        last_attached: Instant::now(),
        ever_attached: false,
        ever_answered: false,
        endpoint: config.endpoint.clone(),
        credentials: config.credentials.clone(),
        spans: config.spans.clone().map(BatchSpans::new),
        isa: config.isa,
    };
    let leave = async {
        match config.time_limit {
            Some(limit) => drop(timeout(limit, shutdown).await),
            None => shutdown.await,
        }
    };
    let leave = pin!(leave);
    // Without a coordinator there is no work either.
    let give_up_after = config.give_up_after.into_iter().chain(config.idle_timeout).min();
    let served = worker.serve(give_up_after, leave).await;
    info!(endpoint = %config.endpoint, "ended");
    served
}

struct Worker {
    state: State,
    backend: Box<dyn Backend>,
    finished_sender: mpsc::Sender<(Task, Computed)>,
    finished: mpsc::Receiver<(Task, Computed)>,
    started: Instant,
    /// Time at which the worker last had a lease, or its start.
    last_attached: Instant,
    ever_attached: bool,
    /// Whether any call was ever answered, even by a refusal.
    ever_answered: bool,
    endpoint: Endpoint,
    credentials: Credentials,
    /// Present if spans are recorded.
    spans: Option<BatchSpans>,
    /// The instruction set on which the known batch is computed.
    isa: Isa,
}

/// Outcome of an attachment.
enum End {
    /// The worker has left as intended.
    Left,
    /// The connection was lost, for this reason: retry.
    Lost(String),
    /// The coordinator closed the stream for this reason, and states when to retry.
    Deferred(String, Duration),
}

impl Worker {
    async fn serve(
        &mut self,
        give_up_after: Option<Duration>,
        mut leave: Pin<&mut impl Future<Output = ()>>,
    ) -> Result<(), WorkerError> {
        let mut backoff = Backoff::default();
        loop {
            self.check_machine().await?;
            let (last, stated) = match self.attachment(leave.as_mut(), &mut backoff).await? {
                End::Left => return Ok(()),
                End::Lost(reason) => (reason, None),
                End::Deferred(reason, delay) => (reason, Some(delay)),
            };
            // Noted here, too: the stream may have ended while this process stood still.
            if self.state.is_attached() {
                self.last_attached = Instant::now();
            }
            if let Some(End::Left) = self.apply(Event::Lost, None)? {
                return Ok(());
            }
            let away = self.last_attached.elapsed();
            let left = give_up_after.map(|limit| limit.saturating_sub(away));
            if left == Some(Duration::ZERO) {
                let (endpoint, seconds) = (self.endpoint.clone(), away.as_secs_f64().round());
                return Err(WorkerError::GaveUp { endpoint, seconds, last });
            }
            let wait = stated.map_or_else(|| backoff.next_wait(), Backoff::wait_after_refusal);
            let wait = wait.min(left.unwrap_or(Duration::MAX));
            let wait_ms = wait.as_millis() as u64;
            warn!(endpoint = %self.endpoint, wait_ms, reason = last, "reconnecting");
            if timeout(wait, leave.as_mut()).await.is_ok() {
                return Ok(());
            }
        }
    }

    /// Computes a known batch before each attachment: a machine that computes wrongly must not attach.
    async fn check_machine(&self) -> Result<(), WorkerError> {
        let isa = self.isa;
        let computed = tokio::task::spawn_blocking(move || known_batch_digest(isa)).await;
        // A solver that panics here would at every batch.
        let found = computed.ok().flatten().unwrap_or_else(|| "none".to_owned());
        if found == KNOWN_DIGEST {
            return Ok(());
        }
        Err(WorkerError::ComputesWrongly { isa: isa.name(), found })
    }

    /// Runs one attachment, from the connection to its end.
    async fn attachment(
        &mut self,
        mut leave: Pin<&mut impl Future<Output = ()>>,
        backoff: &mut Backoff,
    ) -> Result<End, WorkerError> {
        let (outbox, requests) = mpsc::channel(OUTBOX_MAX);
        let (endpoint, credentials) = (self.endpoint.clone(), self.credentials.clone());
        let connected = tokio::select! {
            () = leave.as_mut() => return Ok(End::Left),
            connected = connect(&endpoint, &credentials) => connected,
        };
        // From the hello on, the coordinator may send batches: whoever leaves must drain.
        let hello = self.state.attach();
        let mut responses = match open(connected, hello, &outbox, requests).await {
            Ok(responses) => {
                self.ever_answered = true;
                responses
            }
            Err(OpenError::Unreachable(reason)) => return Ok(End::Lost(reason)),
            Err(OpenError::Distrust(failure)) => return self.on_tls_failure(failure),
            Err(OpenError::Status(status)) => return self.interpret_end(&status),
        };
        let mut ticks = interval(Duration::from_millis(TICK_MS));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let hello_deadline = Instant::now() + Duration::from_secs(ATTACH_S_MAX);
        let mut draining = false;
        loop {
            let was_attached = self.state.is_attached();
            let was_draining = self.state.is_draining();
            let event = tokio::select! {
                // The order matters: finished batches are sent before anything else is handled.
                biased;
                Some((task, computed)) = self.finished.recv() => Event::Computed(task, computed),
                message = responses.message() => match message {
                    Ok(Some(AttachResponse { message: Some(message) })) => Event::Message(Box::new(message)),
                    Ok(Some(AttachResponse { message: None })) => continue,
                    Ok(None) => return Ok(End::Lost("the coordinator closed the stream".to_owned())),
                    Err(status) => return self.interpret_end(&status),
                },
                () = leave.as_mut(), if !draining => {
                    draining = true;
                    Event::Drain
                }
                _ = ticks.tick() => Event::Tick,
            };
            // After the wait: time in which this process stood still does not count as time without a lease.
            if was_attached {
                self.last_attached = Instant::now();
            }
            let ended = self.apply(event, Some(&outbox))?;
            if !was_draining && self.state.is_draining() {
                let by = self.drain_reason(draining);
                info!(by, "draining: answering the batches in hand, then leaving");
            }
            if let Some(end) = ended {
                if matches!(end, End::Left) {
                    close(outbox, &mut responses).await;
                }
                return Ok(end);
            }
            if !was_attached && self.state.is_attached() {
                backoff.reset();
                self.ever_attached = true;
                info!(endpoint = %self.endpoint, worker = %self.state.number(), "attached");
            }
            if !self.state.is_attached() && Instant::now() > hello_deadline {
                return Ok(End::Lost("the coordinator does not answer".to_owned()));
            }
        }
    }

    /// Returns who makes this worker drain; `asked` if its user or its time limit does.
    fn drain_reason(&self, asked: bool) -> &'static str {
        match asked {
            true => "this machine",
            false if self.state.is_idle_too_long(self.started.elapsed()) => "the idle timeout",
            false => "the coordinator",
        }
    }

    /// Passes `event` to the state and carries out its effects.
    fn apply(
        &mut self,
        event: Event,
        outbox: Option<&mpsc::Sender<AttachRequest>>,
    ) -> Result<Option<End>, WorkerError> {
        if let Event::Computed(task, _) = &event {
            self.backend.forget(*task);
        }
        trace!(?event, "event");
        if let Some(spans) = &mut self.spans {
            spans.observe(&event, SystemTime::now());
        }
        let mut end = None;
        for effect in self.state.react(self.started.elapsed(), event) {
            match effect {
                Effect::Send(message) => {
                    let request = AttachRequest { message: Some(message) };
                    if outbox.is_some_and(|outbox| outbox.try_send(request).is_err()) {
                        end = Some(End::Lost("the coordinator does not read messages".to_owned()));
                    }
                }
                Effect::Compute(task, work) => {
                    if let Some(spans) = &mut self.spans {
                        spans.begin(task, &work);
                    }
                    let sender = self.finished_sender.clone();
                    let done = move |computed| {
                        // Fails only if the worker has ended; the result is then not needed.
                        drop(sender.blocking_send((task, computed)));
                    };
                    self.backend.start(task, work, Box::new(done));
                }
                Effect::Abandon(task) => {
                    if let Some(spans) = &mut self.spans {
                        spans.abandon(task);
                    }
                    self.backend.forget(task);
                }
                Effect::Detach(why) => end = Some(End::Lost(detachment_text(why).to_owned())),
                Effect::Leave => return Ok(Some(End::Left)),
                Effect::Fail(failure) => return Err(self.failure_error(failure)),
            }
        }
        Ok(end)
    }

    /// Interprets a status: some codes are a final refusal, all others a lost connection.
    fn interpret_end(&mut self, status: &Status) -> Result<End, WorkerError> {
        // Only errors of the transport have a source, so one without was sent by a coordinator.
        self.ever_answered |= std::error::Error::source(status).is_none();
        if let Some(failure) = TlsFailure::find_cause(status) {
            return self.on_tls_failure(failure);
        }
        let reason = self.endpoint.explained(status, self.ever_answered);
        if is_banned(status) {
            return Err(WorkerError::Banned { endpoint: self.endpoint.clone(), reason });
        }
        match status.code() {
            Code::FailedPrecondition
            | Code::InvalidArgument
            | Code::PermissionDenied
            | Code::Unauthenticated
            | Code::Unimplemented => {
                let (endpoint, code) = (self.endpoint.clone(), status.code());
                Err(WorkerError::Refused { endpoint, code, reason })
            }
            code => {
                let reason = format!("{code}: {reason}");
                Ok(match retry_after(status) {
                    Some(delay) => End::Deferred(reason, delay),
                    None => End::Lost(reason),
                })
            }
        }
    }

    /// Handles a TLS failure. A worker that was attached before waits until the certificates are
    /// repaired; one that never was has the wrong ones and ends.
    fn on_tls_failure(&self, failure: TlsFailure) -> Result<End, WorkerError> {
        let endpoint = self.endpoint.clone();
        if self.ever_attached {
            return Ok(End::Lost(ConnectError::Tls { endpoint, failure }.to_string()));
        }
        Err(WorkerError::Distrust { endpoint, failure })
    }

    fn failure_error(&self, failure: Failure) -> WorkerError {
        match failure {
            Failure::Malformed(source) => {
                WorkerError::Malformed { endpoint: self.endpoint.clone(), source }
            }
            Failure::Panicked { case, message } => WorkerError::Panicked { case, message },
        }
    }
}

/// Reason why no stream was opened.
enum OpenError {
    Unreachable(String),
    Distrust(TlsFailure),
    Status(Status),
}

async fn connect(endpoint: &Endpoint, credentials: &Credentials) -> Result<Connection, OpenError> {
    let limit = Duration::from_secs(ATTACH_S_MAX);
    let connected = connection::connect_with(endpoint, credentials, limit).await;
    connected.map_err(|error| match error {
        ConnectError::Tls { failure, .. } => OpenError::Distrust(failure),
        other => OpenError::Unreachable(other.to_string()),
    })
}

/// Sends the hello on a new connection, if there is one.
async fn open(
    connected: Result<Connection, OpenError>,
    hello: Request,
    outbox: &mpsc::Sender<AttachRequest>,
    requests: mpsc::Receiver<AttachRequest>,
) -> Result<Streaming<AttachResponse>, OpenError> {
    let limit = Duration::from_secs(ATTACH_S_MAX);
    let unanswered = || OpenError::Unreachable("the coordinator does not answer".to_owned());
    // The outbox is empty, so the hello always fits.
    outbox.try_send(AttachRequest { message: Some(hello) }).map_err(|_| unanswered())?;
    let mut client = connection::workers_client(connected?);
    match timeout(limit, client.attach(ReceiverStream::new(requests))).await {
        Ok(Ok(response)) => Ok(response.into_inner()),
        Ok(Err(status)) => Err(OpenError::Status(status)),
        Err(_) => Err(unanswered()),
    }
}

/// Ends the stream after all sent messages have gone out: the coordinator closes its side in
/// response.
async fn close(outbox: mpsc::Sender<AttachRequest>, responses: &mut Streaming<AttachResponse>) {
    drop(outbox);
    let drained = async { while let Ok(Some(_)) = responses.message().await {} };
    drop(timeout(Duration::from_secs(1), drained).await);
}

fn detachment_text(why: Detached) -> &'static str {
    match why {
        Detached::Silence => "the coordinator was silent for too long",
        Detached::Overrun => "the coordinator sent too many batches, or one twice",
        Detached::Protocol => "the coordinator sent a message out of turn",
    }
}

/// Returns the name of this machine: as given, or its host name.
fn host_name(given: Option<&str>) -> String {
    let known = given.map(str::to_owned).or_else(identity::host_name);
    let name = known.unwrap_or_else(|| "unknown".to_owned());
    name.chars().take(NAME_BYTES_MAX / 4).collect()
}

#[cfg(test)]
mod tests;
