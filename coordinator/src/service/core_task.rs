//! The task that owns the state: it turns messages into events and effects into messages.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use osteon_proto::spans::TraceContext;
use osteon_proto::v1;
use tokio::sync::{mpsc, oneshot, watch};

use crate::config::Config;
use crate::core::close_reason::CloseReason;
use crate::core::completion::Completion;
use crate::core::effect::{Answer, Effect, Refusal};
use crate::core::event::{Event, Hello, ReadFailure, Request};
use crate::core::ids::{JobId, ReplyId, WorkerId};
use crate::core::reactor::react;
use crate::core::snapshot;
use crate::core::state::State;
use crate::service::accept::Places;
use crate::service::failure_reporter::{ComponentFailure, FailureReporter};
use crate::service::job_spans::JobSpans;
use crate::service::meter::{CoreReport, Meter};
use crate::service::outbound::{self, EvaluationMessages, NotReading, Outbound};
use crate::store::thread::StoreCommand;

/// A message to the core task.
pub(crate) enum Message {
    Event(Event),
    /// A client sends a request and waits for the answer.
    Ask(Request, oneshot::Sender<Answer>),
    /// A client submits a job, as part of this trace if it has one, and waits for the answer.
    Submit(Request, Option<TraceContext>, oneshot::Sender<Answer>),
    /// A client requests to watch a job.
    Watch(JobId, oneshot::Sender<Result<watch::Receiver<v1::JobSnapshot>, Refusal>>),
    /// A worker's stream began; messages to it go to `outbound`.
    Attach {
        worker: WorkerId,
        hello: Hello,
        outbound: Outbound,
    },
    /// Metrics are to be exported.
    Measure(oneshot::Sender<CoreReport>),
    /// Stop, and report when that is done.
    Shutdown(oneshot::Sender<()>),
}

/// Clock of the time since the Unix epoch: read once at the start, monotonic from there.
pub(crate) struct Clock {
    started: Instant,
    epoch: Duration,
}

impl Clock {
    pub(crate) fn new() -> Self {
        let epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { started: Instant::now(), epoch }
    }

    pub(crate) fn now(&self) -> Duration {
        self.epoch + self.started.elapsed()
    }
}

/// What observes the events of the core for operators.
pub(crate) struct Monitoring {
    /// Present if metrics are exported.
    pub(crate) meter: Option<Meter>,
    /// Present if spans are recorded.
    pub(crate) spans: Option<JobSpans>,
}

/// The task that owns the state.
pub(crate) struct Core {
    state: State,
    clock: Clock,
    commands: mpsc::Sender<StoreCommand>,
    /// Sends events back to this task.
    events: mpsc::Sender<Event>,
    /// Places for the connections of clients and workers.
    places: Places,
    next_reply_id: u64,
    waiting: BTreeMap<ReplyId, oneshot::Sender<Answer>>,
    /// Newest snapshots of the jobs that are being watched.
    watching: BTreeMap<JobId, watch::Sender<v1::JobSnapshot>>,
    outbound: BTreeMap<WorkerId, Outbound>,
    evaluations: EvaluationMessages,
    on_stop: Option<oneshot::Sender<()>>,
    stopped: bool,
    failures: FailureReporter,
    /// Present if metrics are exported.
    meter: Option<Meter>,
    /// Present if spans are recorded.
    spans: Option<JobSpans>,
    config: Config,
}

impl Core {
    pub(crate) fn new(
        state: State,
        clock: Clock,
        commands: mpsc::Sender<StoreCommand>,
        events: mpsc::Sender<Event>,
        places: Places,
        failures: FailureReporter,
        Monitoring { meter, spans }: Monitoring,
    ) -> Self {
        let config = state.config;
        Self {
            state,
            clock,
            commands,
            events,
            places,
            next_reply_id: 0,
            waiting: BTreeMap::new(),
            watching: BTreeMap::new(),
            outbound: BTreeMap::new(),
            evaluations: EvaluationMessages::default(),
            on_stop: None,
            stopped: false,
            failures,
            meter,
            spans,
            config,
        }
    }

    pub(crate) async fn run(
        mut self,
        effects: Vec<Effect>,
        mut inbox: mpsc::Receiver<Message>,
        mut from_store: mpsc::Receiver<Event>,
        tick: Duration,
    ) {
        let mut followups = VecDeque::new();
        if let Some(meter) = &mut self.meter {
            meter.count_start(&self.state, &effects, self.clock.now());
        }
        if let Some(spans) = &mut self.spans {
            spans.observe_reaction(&self.state, &effects, self.clock.now());
        }
        self.apply(effects, &mut followups);
        self.handle(followups);
        let mut ticks = tokio::time::interval(tick);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        while !self.stopped {
            // No branch may starve: `select!` chooses at random among those that are ready.
            tokio::select! {
                Some(message) = inbox.recv() => self.message(message),
                Some(event) = from_store.recv() => self.handle(VecDeque::from([event])),
                _ = ticks.tick() => self.tick(),
            }
        }
    }

    fn tick(&mut self) {
        let (open, most) = self.places.usage();
        self.handle(VecDeque::from([Event::Connections { open, most }, Event::Tick]));
    }

    fn message(&mut self, message: Message) {
        match message {
            Message::Event(event) => self.handle(VecDeque::from([event])),
            Message::Ask(request, reply) => {
                let reply_id = self.expect(reply);
                self.handle(VecDeque::from([Event::Requested { reply_id, request }]));
            }
            Message::Submit(request, client, reply) => {
                let reply_id = self.expect(reply);
                if let Some(spans) = &mut self.spans {
                    spans.note_submission(reply_id, client, self.clock.now());
                }
                self.handle(VecDeque::from([Event::Requested { reply_id, request }]));
            }
            Message::Watch(job, reply) => self.watch(job, reply),
            Message::Attach { worker, hello, outbound } => {
                self.outbound.insert(worker, outbound);
                self.handle(VecDeque::from([Event::Hello { worker, hello }]));
            }
            Message::Measure(reply) => self.measure(reply),
            Message::Shutdown(reply) => {
                self.on_stop = Some(reply);
                self.handle(VecDeque::from([Event::Drain]));
            }
        }
    }

    /// Returns a number for a request that is answered to `reply`.
    fn expect(&mut self, reply: oneshot::Sender<Answer>) -> ReplyId {
        let reply_id = ReplyId(self.next_reply_id);
        self.next_reply_id += 1;
        // Requests whose clients have gone are dropped.
        self.waiting.retain(|_, reply| !reply.is_closed());
        self.waiting.insert(reply_id, reply);
        reply_id
    }

    /// Reacts to events, and to the events that the effects cause.
    fn handle(&mut self, mut events: VecDeque<Event>) {
        while let Some(event) = events.pop_front() {
            tracing::trace!(?event);
            if let Event::StreamEnded { worker } = &event {
                self.outbound.remove(worker);
            }
            let now = self.clock.now();
            let reading = self.meter.as_mut().map(|meter| meter.begin(&self.state, &event, now));
            if let Some(spans) = &mut self.spans {
                spans.observe_event(&event, now);
            }
            let effects = react(&mut self.state, event, now);
            if let Some(spans) = &mut self.spans {
                spans.observe_reaction(&self.state, &effects, now);
            }
            if let Some((meter, reading)) = self.meter.as_mut().zip(reading.as_ref()) {
                meter.count_reaction(reading, &self.state, &effects, now);
            }
            self.apply(effects, &mut events);
            if let Some((meter, reading)) = self.meter.as_mut().zip(reading) {
                meter.end(&reading);
            }
        }
    }

    fn apply(&mut self, effects: Vec<Effect>, followups: &mut VecDeque<Event>) {
        for effect in effects {
            tracing::trace!(?effect);
            match effect {
                Effect::Welcome { worker, lease } => {
                    let welcome = outbound::welcome(worker, lease, &self.config);
                    self.send(worker, welcome, followups);
                }
                Effect::Send { worker, batch, work } => {
                    let trace = self.spans.as_ref().and_then(|spans| spans.context(batch));
                    // Apart, because `queue` borrows the rest.
                    let mut evaluations = std::mem::take(&mut self.evaluations);
                    self.queue(worker, followups, |outbound| {
                        outbound.send_batch(batch, &work, trace, &mut evaluations)
                    });
                    self.evaluations = evaluations;
                }
                Effect::Revoke { worker, batch } => {
                    self.send(worker, outbound::revoke(batch), followups);
                }
                Effect::Heartbeat { worker } => {
                    self.send(worker, outbound::heartbeat(), followups);
                }
                Effect::Drain { worker } => {
                    self.send(worker, outbound::drain(), followups);
                }
                Effect::Close { worker, reason } => self.close(worker, &reason),
                Effect::Complete(completion) => self.complete(completion),
                Effect::Store(record) => {
                    let (job, key) = record.key();
                    if let Err(refused) = self.commands.try_send(StoreCommand::Put(record)) {
                        followups.push_back(Event::StoreFailed {
                            job,
                            key,
                            error: refused.to_string(),
                        });
                    }
                }
                Effect::Read { job, number } => {
                    if let Err(refused) = self.commands.try_send(StoreCommand::Read { job, number })
                    {
                        let found = Err(ReadFailure::Refused { error: refused.to_string() });
                        followups.push_back(Event::Read { job, number, found });
                    }
                }
                Effect::Prune { reply_id, jobs } => {
                    let command = StoreCommand::Prune { reply_id, jobs: jobs.clone() };
                    if let Err(refused) = self.commands.try_send(command) {
                        let outcome = Err(refused.to_string());
                        followups.push_back(Event::Pruned { reply_id, jobs, outcome });
                    }
                }
                Effect::Reopen { reply_id, job } => {
                    followups.extend(self.reopen(reply_id, job));
                }
                Effect::Answer { reply_id, answer } => {
                    if let Some(reply) = self.waiting.remove(&reply_id) {
                        // The client may have gone.
                        let _ = reply.send(answer);
                    }
                }
                Effect::Note(notice) => notice.write(),
                Effect::Publish { job, snapshot } => self.publish(job, snapshot),
                Effect::ReportStoreFailure { error, waited } => {
                    self.failures.report(ComponentFailure::StoreRefuses { error, waited });
                }
                Effect::Stop => self.stop(),
            }
        }
    }

    /// Asks the store to make an ended job an unfinished one again; returns the event of a failure if the
    /// store cannot be asked.
    fn reopen(&self, reply_id: ReplyId, job: JobId) -> Option<Event> {
        let refused = self.commands.try_send(StoreCommand::Reopen { reply_id, job }).err()?;
        Some(Event::Reopened { reply_id, job, outcome: Err(refused.to_string()) })
    }

    /// Completes an evaluation on a thread of its own. A job has at most one at a time.
    fn complete(&self, completion: Completion) {
        let events = self.events.clone();
        tokio::task::spawn_blocking(move || {
            // The receiver is gone when the coordinator has stopped.
            let report = |event| drop(events.blocking_send(event));
            let completed = completion.run(|gathered| report(Event::Gathered(gathered)));
            report(Event::Completed(completed));
        });
    }

    fn send(
        &mut self,
        worker: WorkerId,
        message: v1::AttachResponse,
        followups: &mut VecDeque<Event>,
    ) {
        self.queue(worker, followups, |outbound| outbound.send(Ok(message)));
    }

    fn queue(
        &mut self,
        worker: WorkerId,
        followups: &mut VecDeque<Event>,
        send: impl FnOnce(&mut Outbound) -> Result<(), NotReading>,
    ) {
        if let Some(outbound) = self.outbound.get_mut(&worker)
            && send(outbound).is_err()
        {
            // The messages in flight are bounded, so the queue is full only if the worker does not
            // read or has gone.
            followups.push_back(Event::Misbehaved { worker, reason: CloseReason::NotReading });
        }
    }

    fn close(&mut self, worker: WorkerId, reason: &CloseReason) {
        tracing::debug!(%worker, %reason, "stream of a worker closed");
        if let Some(outbound) = self.outbound.remove(&worker) {
            // If the queue is full, the worker does not read; its stream ends all the same.
            let _ = outbound.send(Err(outbound::status(reason)));
        }
    }

    fn watch(
        &mut self,
        job: JobId,
        reply: oneshot::Sender<Result<watch::Receiver<v1::JobSnapshot>, Refusal>>,
    ) {
        let answer = match snapshot::job_snapshot(&self.state, job, self.clock.now()) {
            None => Err(Refusal::NoJob { job }),
            Some(snapshot) => {
                let sender =
                    self.watching.entry(job).or_insert_with(|| watch::Sender::new(snapshot));
                Ok(sender.subscribe())
            }
        };
        let has_ended = |receiver: &watch::Receiver<v1::JobSnapshot>| {
            receiver.borrow().state() == v1::JobState::Ended
        };
        if answer.as_ref().is_ok_and(has_ended) {
            self.watching.remove(&job);
        }
        // The client may have gone.
        let _ = reply.send(answer);
    }

    fn measure(&self, reply: oneshot::Sender<CoreReport>) {
        if let Some(meter) = &self.meter {
            let queue = self.commands.max_capacity() - self.commands.capacity();
            // Whoever asked may have gone.
            let _ = reply.send(meter.report(&self.state, queue, self.clock.now()));
        }
    }

    fn publish(&mut self, job: JobId, snapshot: v1::JobSnapshot) {
        let ended = snapshot.state() == v1::JobState::Ended;
        if let Some(watching) = self.watching.get(&job) {
            watching.send_replace(snapshot);
            if ended || watching.receiver_count() == 0 {
                self.watching.remove(&job);
            }
        }
    }

    fn stop(&mut self) {
        self.stopped = true;
        self.watching.clear();
        if let Some(reply) = self.on_stop.take() {
            // The caller may no longer wait.
            let _ = reply.send(());
        }
    }
}
