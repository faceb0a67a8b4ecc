//! A fleet of simulated workers, each a task with a connection of its own.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context as _, Error, Result, bail};
use osteon_proto::announced::Received;
use osteon_proto::batch;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::{AttachRequest, AttachResponse, Heartbeat, WorkerHello};
use osteon_transport::connection::{connect, workers_client};
use osteon_transport::endpoint::Endpoint;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, sleep_until, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;

use crate::fake;
use crate::slots::Slots;

/// Longest wait for a connection, and for the welcome.
const ATTACH_LIMIT: Duration = Duration::from_secs(10);
/// Shortest and longest wait before a worker attaches again.
const RETRY: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(5));
/// Messages of a worker that wait to be sent.
const OUTBOX_MAX: usize = 64;

/// How a worker behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Behaviour {
    /// As it should.
    Work,
    /// Its connection breaks, and it does not come back.
    Vanish,
    /// It sends heartbeats only.
    Silent,
    /// It sends and reads nothing; its connection stays.
    Mute,
}

/// How far the fleet is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Progress {
    /// Welcomes, with those of workers that came back.
    pub(crate) welcomes: u64,
    /// Answered batches.
    pub(crate) batches: u64,
    /// Answered realizations, with all repetitions.
    pub(crate) realizations: u64,
}

/// A fleet, which ends with its owner.
pub(crate) struct Fleet {
    workers: u32,
    shared: Arc<Shared>,
    _tasks: JoinSet<()>,
}

/// Settings, orders and counts that all workers of a fleet share.
struct Shared {
    endpoint: Endpoint,
    slots: u32,
    each: Duration,
    progress: watch::Sender<Progress>,
    /// Workers with numbers up to the first behave like the second.
    orders: watch::Sender<(u32, Behaviour)>,
    /// Why a worker lost its stream last.
    last_loss: Mutex<String>,
}

impl Fleet {
    /// Starts a fleet whose realizations take `each`.
    pub(crate) fn start(endpoint: Endpoint, workers: u32, slots: u32, each: Duration) -> Self {
        let shared = Arc::new(Shared {
            endpoint,
            slots,
            each,
            progress: watch::Sender::default(),
            orders: watch::Sender::new((0, Behaviour::Work)),
            last_loss: Mutex::default(),
        });
        let mut tasks = JoinSet::new();
        for number in 1..=workers {
            tasks.spawn(stay(number, Arc::clone(&shared)));
        }
        Self { workers, shared, _tasks: tasks }
    }

    /// Returns when all workers have been attached.
    pub(crate) async fn wait_for_attachments(&self) {
        self.wait_for(|progress| progress.welcomes >= self.workers.into()).await;
    }

    /// Returns when so many realizations have been answered.
    pub(crate) async fn wait_for_answers(&self, realizations: u64) {
        self.wait_for(|progress| progress.realizations >= realizations).await;
    }

    async fn wait_for(&self, reached: impl FnMut(&Progress) -> bool) {
        // It cannot fail: the sender lives as long as the fleet.
        let _ = self.shared.progress.subscribe().wait_for(reached).await;
    }

    /// Returns how far it is.
    pub(crate) fn progress(&self) -> Progress {
        *self.shared.progress.borrow()
    }

    /// Returns why a worker lost its stream last.
    pub(crate) fn last_loss(&self) -> String {
        self.shared.last_loss.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Makes this number of workers behave like this from now on.
    pub(crate) fn order(&self, count: u32, behaviour: Behaviour) {
        self.shared.orders.send_replace((count, behaviour));
    }
}

/// One worker: it attaches, and again whenever it loses its stream, until it vanishes.
async fn stay(number: u32, shared: Arc<Shared>) {
    let orders = shared.orders.subscribe();
    let mut failures = 0;
    loop {
        let mut attachment = match Attachment::open(number, &shared, orders.clone()).await {
            Ok(attachment) => attachment,
            Err(error) => {
                shared.note(&error);
                failures += 1;
                sleep(backoff(number, failures)).await;
                continue;
            }
        };
        failures = 1;
        match attachment.serve().await {
            Ok(()) => return,
            Err(error) => shared.note(&error),
        }
        sleep(backoff(number, failures)).await;
    }
}

/// Returns the wait after so many failures, which is that of real workers.
fn backoff(number: u32, failures: u32) -> Duration {
    let full = RETRY.0.saturating_mul(1 << (failures - 1).min(10)).min(RETRY.1);
    let random = fake::mix((u64::from(number) << 32) + u64::from(failures)) % 1000;
    full.mul_f64(0.5 + random as f64 / 2000.0)
}

impl Shared {
    fn note(&self, error: &Error) {
        *self.last_loss.lock().unwrap_or_else(PoisonError::into_inner) = format!("{error:#}");
    }
}

/// One attachment of a worker.
struct Attachment {
    shared: Arc<Shared>,
    orders: watch::Receiver<(u32, Behaviour)>,
    number: u32,
    outbox: mpsc::Sender<AttachRequest>,
    stream: Streaming<AttachResponse>,
    evaluations: Received,
    slots: Slots,
    /// Longest time between two messages.
    heartbeat: Duration,
    last_sent: Instant,
}

impl Attachment {
    /// Connects, and is welcomed.
    async fn open(
        number: u32,
        shared: &Arc<Shared>,
        orders: watch::Receiver<(u32, Behaviour)>,
    ) -> Result<Self> {
        let channel = connect(&shared.endpoint, ATTACH_LIMIT).await?;
        let (outbox, messages) = mpsc::channel(OUTBOX_MAX);
        let hello =
            WorkerHello { slots: shared.slots, host: host(number), ..fake::wire_hello(number) };
        outbox.try_send(AttachRequest { message: Some(Request::Hello(hello)) })?;
        let mut client = workers_client(channel);
        let opened = client.attach(ReceiverStream::new(messages));
        let mut stream = timeout(ATTACH_LIMIT, opened).await??.into_inner();
        let welcome = timeout(ATTACH_LIMIT, stream.message()).await??;
        let Some(Response::Welcome(welcome)) = welcome.and_then(|welcome| welcome.message) else {
            bail!("no welcome");
        };
        shared.progress.send_modify(|progress| progress.welcomes += 1);
        Ok(Self {
            shared: Arc::clone(shared),
            orders,
            number,
            outbox,
            stream,
            evaluations: Received::default(),
            slots: Slots::new(shared.slots, shared.each),
            heartbeat: Duration::try_from_secs_f64(welcome.heartbeat_s)? / 2,
            last_sent: Instant::now(),
        })
    }

    /// Computes until the stream ends, which is an error, or the worker vanishes.
    async fn serve(&mut self) -> Result<()> {
        loop {
            let (concerned, behaviour) = *self.orders.borrow_and_update();
            let behaviour = if self.number <= concerned { behaviour } else { Behaviour::Work };
            match behaviour {
                Behaviour::Vanish => return Ok(()),
                Behaviour::Mute => {
                    self.orders.changed().await?;
                    continue;
                }
                Behaviour::Work | Behaviour::Silent => {}
            }
            let works = behaviour == Behaviour::Work;
            let next = self.slots.next_end().filter(|_| works);
            tokio::select! {
                biased;
                changed = self.orders.changed() => changed?,
                () = sleep_until_time(next) => self.answer().await?,
                message = self.stream.message() => {
                    let message = message?.context("the coordinator closed the stream")?;
                    self.on_message(message, works)?;
                }
                () = sleep_until(self.last_sent + self.heartbeat) => {
                    self.send(Request::Heartbeat(Heartbeat {})).await?;
                }
            }
        }
    }

    fn on_message(&mut self, message: AttachResponse, works: bool) -> Result<()> {
        match message.message.context("an empty message")? {
            Response::Evaluation(message) => self.evaluations.receive(&message)?,
            Response::Batch(message) if works => {
                let arrived = Instant::now();
                let work = batch::from_message(&message, &self.evaluations)?;
                // While its time passes, so that the answer is ready when it is due.
                let solved = fake::solved(&work);
                self.slots.take(arrived, message.batch, solved);
            }
            Response::Revoke(message) => self.slots.revoke(Instant::now(), message.batch),
            Response::Batch(_) | Response::Heartbeat(_) => {}
            Response::Drain(_) => bail!("the coordinator drains this worker"),
            Response::Welcome(_) => bail!("a second welcome"),
        }
        Ok(())
    }

    /// Answers the batch that has ended.
    async fn answer(&mut self) -> Result<()> {
        let Some(held) = self.slots.take_ended(Instant::now()) else { return Ok(()) };
        let answer = batch::answer_to_message(held.batch, &held.solved, held.elapsed_s());
        self.send(Request::Result(answer)).await?;
        self.shared.progress.send_modify(|progress| {
            progress.batches += 1;
            progress.realizations += held.solved.len() as u64;
        });
        Ok(())
    }

    async fn send(&mut self, message: Request) -> Result<()> {
        self.outbox.send(AttachRequest { message: Some(message) }).await?;
        self.last_sent = Instant::now();
        Ok(())
    }
}

/// Completes at this time; never, if there is none.
async fn sleep_until_time(time: Option<Instant>) {
    match time {
        Some(time) => sleep_until(time).await,
        None => std::future::pending().await,
    }
}

/// Returns the name of a worker's host: each has one of its own.
fn host(number: u32) -> String {
    format!("node-{number}")
}
