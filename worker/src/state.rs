//! State of a worker, and its reaction to each event.
//!
//! Times are passed in as the time since the worker started; nothing here waits or reads a clock.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::version;
use osteon_proto::announced::Received;
use osteon_proto::batch::{self, Work};
use osteon_proto::malformed::Malformed;
use osteon_proto::v1;
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;

use crate::backend::{Computed, Task};
use crate::error::PanickedCase;

/// Maximum number of batches that a worker holds; a coordinator that sends more is faulty.
pub(crate) const BATCHES_HELD_MAX: usize = 1024;
/// Longest time to finish the held batches while draining, s. After it, the worker leaves and the
/// coordinator reassigns them.
pub(crate) const DRAIN_S_MAX: f64 = 10.0;
/// Longest time that a draining worker which holds nothing waits for the coordinator to close its
/// stream, s.
const DISMISSAL_S_MAX: f64 = 2.0;
/// Limits of the intervals that a coordinator may set, s.
const SPAN_S: (f64, f64) = (0.01, 3600.0);

/// Identity of this worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity {
    /// Number of realizations that it computes at the same time.
    pub(crate) slots: u32,
    /// Host name, for display only.
    pub(crate) host: String,
    /// Process id, for display only.
    pub(crate) process: u32,
    /// Random number that distinguishes this process from one with the same host name and process
    /// id in another container.
    pub(crate) instance: u64,
}

/// All events that a worker reacts to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// The coordinator sent a message.
    Message(Box<Response>),
    Computed(Task, Computed),
    /// The stream of the attachment ended.
    Lost,
    /// The worker must drain: its user asked it to, or its time limit has passed.
    Drain,
    /// Time has passed; sent at regular intervals.
    Tick,
}

/// An action that the event loop must carry out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Effect {
    /// Send this message to the coordinator.
    Send(Request),
    Compute(Task, Work),
    Abandon(Task),
    /// Close the stream and attach again.
    Detach(Detached),
    /// End the worker: nothing is left to do.
    Leave,
    /// End the worker with an error: a message is malformed, or the solver panicked.
    Fail(Failure),
}

/// Reason why the worker closes a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Detached {
    /// The coordinator was silent for too long.
    Silence,
    /// The coordinator sent more than [`BATCHES_HELD_MAX`] batches, or a batch number twice.
    Overrun,
    /// The coordinator sent a message that is not allowed in this state.
    Protocol,
}

/// An error that attaching again would not cure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Failure {
    /// The coordinator sent a batch or an evaluation that cannot be read.
    Malformed(Malformed),
    Panicked {
        /// The realization at which it panicked.
        case: Box<PanickedCase>,
        message: String,
    },
}

/// State of a worker.
#[derive(Debug)]
pub(crate) struct State {
    identity: Identity,
    attachments: u64,
    /// The number most recently assigned by the coordinator.
    number: u64,
    link: Link,
    held: BTreeSet<u64>,
    /// Evaluations of this attachment that batches may refer to.
    evaluations: Received,
    /// Time at which draining began.
    draining_since: Option<Duration>,
    /// Time without batches after which the worker drains.
    idle_timeout: Option<Duration>,
    /// Time since which the worker has held no batch; the present while it holds one.
    idle_since: Duration,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Link {
    Down,
    /// The hello has been sent, the welcome has not arrived.
    Greeting,
    Attached {
        heartbeat: Duration,
        expiry: Duration,
        last_heard: Duration,
        last_sent: Duration,
    },
}

impl State {
    /// Creates a worker without a coordinator, which drains when it has been attached without a batch
    /// for `idle_timeout`.
    pub(crate) fn new(identity: Identity, idle_timeout: Option<Duration>) -> Self {
        Self {
            identity,
            attachments: 0,
            number: 0,
            link: Link::Down,
            held: BTreeSet::new(),
            evaluations: Received::default(),
            draining_since: None,
            idle_timeout,
            idle_since: Duration::ZERO,
        }
    }

    /// Begins an attachment. Returns the first message to send.
    pub(crate) fn attach(&mut self) -> Request {
        self.attachments += 1;
        self.link = Link::Greeting;
        Request::Hello(v1::WorkerHello {
            version: version::VERSION.to_owned(),
            fingerprint: version::fingerprint(),
            slots: self.identity.slots,
            host: self.identity.host.clone(),
            process: self.identity.process,
            instance: self.identity.instance,
        })
    }

    /// Returns whether the coordinator has accepted this worker.
    pub(crate) fn is_attached(&self) -> bool {
        matches!(self.link, Link::Attached { .. })
    }

    /// Returns the number assigned by the coordinator, which identifies this worker in its log.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Returns whether the worker leaves once all its batches are answered.
    pub(crate) fn is_draining(&self) -> bool {
        self.draining_since.is_some()
    }

    /// Returns whether the worker has been attached without a batch for its idle timeout.
    pub(crate) fn is_idle_too_long(&self, now: Duration) -> bool {
        let limit = self.idle_timeout.filter(|_| self.is_attached() && self.held.is_empty());
        limit.is_some_and(|limit| now.saturating_sub(self.idle_since) >= limit)
    }

    /// Returns the effects of `event`, which happens at `now`.
    pub(crate) fn react(&mut self, now: Duration, event: Event) -> Vec<Effect> {
        let held_before = !self.held.is_empty();
        let mut effects = match event {
            Event::Message(message) => self.on_message(now, *message),
            Event::Computed(task, computed) => self.on_computed(task, computed),
            Event::Lost => self.on_lost(),
            Event::Drain => self.on_drain(now),
            Event::Tick => self.on_tick(now),
        };
        if let Link::Attached { last_sent, .. } = &mut self.link
            && effects.iter().any(|effect| matches!(effect, Effect::Send(_)))
        {
            *last_sent = now;
        }
        if effects.iter().any(|effect| matches!(effect, Effect::Detach(_))) {
            effects.extend(self.on_lost());
        }
        if held_before || !self.held.is_empty() {
            self.idle_since = now;
        }
        self.sanity_check();
        effects
    }

    fn on_message(&mut self, now: Duration, message: Response) -> Vec<Effect> {
        if let Link::Attached { last_heard, .. } = &mut self.link {
            *last_heard = now;
        }
        match (self.link, message) {
            (Link::Greeting, Response::Welcome(welcome)) => self.on_welcome(now, &welcome),
            (Link::Attached { .. }, Response::Evaluation(message)) => self.on_evaluation(&message),
            (Link::Attached { .. }, Response::Batch(message)) => self.on_batch(&message),
            (Link::Attached { .. }, Response::Revoke(revoke)) => {
                let held = self.held.remove(&revoke.batch);
                let mut effects = Vec::new();
                if held {
                    effects.push(Effect::Abandon(self.task(revoke.batch)));
                }
                effects
            }
            (Link::Attached { .. }, Response::Drain(_)) => self.on_drain(now),
            (Link::Attached { .. }, Response::Heartbeat(_)) | (Link::Down, _) => Vec::new(),
            _ => vec![Effect::Detach(Detached::Protocol)],
        }
    }

    fn on_welcome(&mut self, now: Duration, welcome: &v1::WorkerWelcome) -> Vec<Effect> {
        self.number = welcome.worker;
        // The time without a coordinator does not count: work may have waited for this worker.
        self.idle_since = now;
        let span = |seconds: f64| {
            // `max` turns a NaN into the lower limit.
            Duration::from_secs_f64(seconds.max(SPAN_S.0).min(SPAN_S.1))
        };
        self.link = Link::Attached {
            heartbeat: span(welcome.heartbeat_s),
            expiry: span(welcome.expiry_s),
            last_heard: now,
            last_sent: now,
        };
        Vec::new()
    }

    fn on_evaluation(&mut self, message: &v1::Evaluation) -> Vec<Effect> {
        match self.evaluations.receive(message) {
            Ok(()) => Vec::new(),
            Err(malformed) => vec![Effect::Fail(Failure::Malformed(malformed))],
        }
    }

    fn on_batch(&mut self, message: &v1::Batch) -> Vec<Effect> {
        let work = match batch::from_message(message, &self.evaluations) {
            Ok(work) => work,
            Err(malformed) => return vec![Effect::Fail(Failure::Malformed(malformed))],
        };
        if self.held.len() >= BATCHES_HELD_MAX || !self.held.insert(message.batch) {
            return vec![Effect::Detach(Detached::Overrun)];
        }
        vec![Effect::Compute(self.task(message.batch), work)]
    }

    fn on_computed(&mut self, task: Task, computed: Computed) -> Vec<Effect> {
        if let Computed::Panicked { case, message } = computed {
            return vec![Effect::Fail(Failure::Panicked { case, message })];
        }
        if task.attachment != self.attachments || !self.held.contains(&task.batch) {
            // The batch was revoked, or its lease has ended: the result is not needed.
            return Vec::new();
        }
        let Computed::Complete { solved, elapsed_s } = computed else { return Vec::new() };
        self.held.remove(&task.batch);
        let result = batch::answer_to_message(task.batch, &solved, elapsed_s);
        vec![Effect::Send(Request::Result(result))]
    }

    fn on_lost(&mut self) -> Vec<Effect> {
        self.link = Link::Down;
        self.evaluations = Received::default();
        let held = std::mem::take(&mut self.held);
        let mut effects: Vec<_> =
            held.into_iter().map(|batch| Effect::Abandon(self.task(batch))).collect();
        if self.is_draining() {
            effects.push(Effect::Leave);
        }
        effects
    }

    fn on_drain(&mut self, now: Duration) -> Vec<Effect> {
        if self.draining_since.is_some() {
            return Vec::new();
        }
        self.draining_since = Some(now);
        match self.link {
            Link::Down => vec![Effect::Leave],
            // Batches may be on their way even to a worker that holds none: the coordinator closes the
            // stream when it has heard this and nothing is open any more.
            Link::Greeting | Link::Attached { .. } => {
                vec![Effect::Send(Request::Drain(v1::WorkerDrain {}))]
            }
        }
    }

    fn on_tick(&mut self, now: Duration) -> Vec<Effect> {
        if self.draining_since.is_some_and(|since| self.has_drained(now, since)) {
            return vec![Effect::Leave];
        }
        if self.draining_since.is_none() && self.is_idle_too_long(now) {
            return self.on_drain(now);
        }
        match self.link {
            Link::Attached { expiry, last_heard, .. }
                if now.saturating_sub(last_heard) >= expiry =>
            {
                vec![Effect::Detach(Detached::Silence)]
            }
            // Half the requested interval leaves room for a late tick.
            Link::Attached { heartbeat, last_sent, .. }
                if now.saturating_sub(last_sent) >= heartbeat / 2 =>
            {
                vec![Effect::Send(Request::Heartbeat(v1::Heartbeat {}))]
            }
            _ => Vec::new(),
        }
    }

    /// Returns whether a worker that has been draining `since` leaves without being dismissed.
    fn has_drained(&self, now: Duration, since: Duration) -> bool {
        let idle_since = if self.held.is_empty() { self.idle_since.max(since) } else { now };
        let idle = now.saturating_sub(idle_since);
        now.saturating_sub(since) >= Duration::from_secs_f64(DRAIN_S_MAX)
            || idle >= Duration::from_secs_f64(DISMISSAL_S_MAX)
    }

    fn task(&self, batch: u64) -> Task {
        Task { attachment: self.attachments, batch }
    }

    fn sanity_check(&self) {
        debug_assert!(self.held.is_empty() || self.is_attached(), "batches without a lease");
        debug_assert!(self.held.len() <= BATCHES_HELD_MAX, "more batches than allowed");
    }
}

#[cfg(test)]
mod tests;
