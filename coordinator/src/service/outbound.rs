//! Messages to a worker: made from effects, and queued.

use std::time::Duration;

use osteon_proto::announced::Announced;
use osteon_proto::batch::{self, Work};
use osteon_proto::evaluation::{self, EvaluationInput};
use osteon_proto::spans::TraceContext;
use osteon_proto::status::{banned, resource_exhausted, unavailable};
use osteon_proto::v1;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::{AttachResponse, BatchRevoke, Heartbeat, WorkerDrain, WorkerWelcome};
use tokio::sync::{mpsc, oneshot};
use tonic::{Code, Status};

use crate::config::Config;
use crate::core::close_reason::CloseReason;
use crate::core::ids::{BatchId, LeaseId, WorkerId};

/// Maximum number of queued messages to one worker: its batches, each with a revocation and perhaps
/// an evaluation before it, and heartbeats.
pub(crate) const OUTBOUND_MAX: usize = 96;

/// Time after which a worker that was refused for lack of room may try again.
const RETRY: Duration = Duration::from_secs(30);
/// Time after which the workers of a coordinator that stops may look for the next one: none can be
/// there sooner, and thousands of workers need not ask before.
const RETRY_STOPPED: Duration = Duration::from_secs(1);

/// A message to a worker, or the status that ends its stream.
pub(crate) type Outgoing = Result<AttachResponse, Status>;

/// Queue of messages to one worker. The worker's stream ends when this is dropped, even if the
/// queue is full.
#[derive(Debug)]
pub(crate) struct Outbound {
    messages: mpsc::Sender<Outgoing>,
    /// The evaluations that the worker keeps.
    announced: Announced<()>,
    /// Nothing is sent on it; dropping it is the signal.
    _open: oneshot::Sender<()>,
}

impl Outbound {
    /// Returns a queue for a worker whose stream receives `messages`, and a receiver that completes
    /// when the queue is dropped.
    pub(crate) fn new(messages: mpsc::Sender<Outgoing>) -> (Self, oneshot::Receiver<()>) {
        let (open, closed) = oneshot::channel();
        (Self { messages, announced: Announced::default(), _open: open }, closed)
    }

    /// Queues a message.
    ///
    /// # Errors
    /// When the queue is full or the worker has gone.
    pub(crate) fn send(&self, message: Outgoing) -> Result<(), NotReading> {
        self.messages.try_send(message).map_err(|_| NotReading)
    }

    /// Queues a batch, with its position in a trace if it has one, after its evaluation if the worker
    /// does not have it.
    ///
    /// # Errors
    /// As [`Outbound::send`].
    pub(crate) fn send_batch(
        &mut self,
        id: BatchId,
        work: &Work,
        trace: Option<TraceContext>,
        evaluations: &mut EvaluationMessages,
    ) -> Result<(), NotReading> {
        if self.announced.get(work.evaluation.id).is_none() {
            self.send(Ok(evaluations.announcement(&work.evaluation)))?;
            self.announced.announce(work.evaluation.id, ());
        }
        self.send(Ok(batch(id, work, trace)))
    }
}

/// Messages of the last evaluations: each goes to many workers, and takes much longer to make than to
/// copy.
#[derive(Debug, Default)]
pub(crate) struct EvaluationMessages(Announced<AttachResponse>);

impl EvaluationMessages {
    /// Returns the message that announces an evaluation.
    fn announcement(&mut self, input: &EvaluationInput) -> AttachResponse {
        if let Some(made) = self.0.get(input.id) {
            return made.clone();
        }
        let made = evaluation(input);
        self.0.announce(input.id, made.clone());
        made
    }
}

/// Error when a worker accepts no message.
#[derive(Debug)]
pub(crate) struct NotReading;

/// Returns the first message to an attached worker.
pub(crate) fn welcome(worker: WorkerId, lease: LeaseId, config: &Config) -> AttachResponse {
    respond(Response::Welcome(WorkerWelcome {
        worker: worker.0,
        lease: lease.0,
        heartbeat_s: config.heartbeat.as_secs_f64(),
        expiry_s: config.expiry.as_secs_f64(),
    }))
}

/// Returns the message that announces an evaluation.
fn evaluation(evaluation: &EvaluationInput) -> AttachResponse {
    respond(Response::Evaluation(evaluation::to_message(evaluation)))
}

/// Returns the message that sends a batch.
fn batch(id: BatchId, work: &Work, trace: Option<TraceContext>) -> AttachResponse {
    let trace = trace.map(TraceContext::to_message);
    respond(Response::Batch(v1::Batch { trace, ..batch::to_message(id.0, work) }))
}

/// Returns the message that revokes a batch.
pub(crate) fn revoke(batch: BatchId) -> AttachResponse {
    respond(Response::Revoke(BatchRevoke { batch: batch.0 }))
}

/// Returns the message that drains a worker: it leaves when it has answered the batches that it
/// holds.
pub(crate) fn drain() -> AttachResponse {
    respond(Response::Drain(WorkerDrain {}))
}

pub(crate) fn heartbeat() -> AttachResponse {
    respond(Response::Heartbeat(Heartbeat {}))
}

/// Returns the status that ends a worker's stream.
pub(crate) fn status(reason: &CloseReason) -> Status {
    let code = match reason {
        CloseReason::FingerprintDiffers { .. } | CloseReason::VersionDiffers { .. } => {
            Code::FailedPrecondition
        }
        CloseReason::Slots { .. }
        | CloseReason::NameTooLong { .. }
        | CloseReason::Malformed(_)
        | CloseReason::WrongCount { .. }
        | CloseReason::ImpossibleVelocity { .. }
        | CloseReason::SecondHello => Code::InvalidArgument,
        CloseReason::Banned { .. } => return banned(reason.to_string()),
        CloseReason::TooManyWorkers { .. } | CloseReason::AttachesTooOften { .. } => {
            return resource_exhausted(reason.to_string(), RETRY);
        }
        CloseReason::Expired { .. } | CloseReason::Unanswering { .. } | CloseReason::NotReading => {
            Code::Aborted
        }
        CloseReason::Drained => Code::Ok,
        CloseReason::Draining => return unavailable(reason.to_string(), RETRY_STOPPED),
    };
    Status::new(code, reason.to_string())
}

fn respond(message: Response) -> AttachResponse {
    AttachResponse { message: Some(message) }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use osteon_common::case::Setup;
    use osteon_common::germ_source::GermSource;
    use osteon_common::parameters::Point;
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_proto::announced::{EVALUATIONS_KEPT_MAX, Received};
    use osteon_proto::evaluation::EvaluationInput;

    use super::*;

    fn work(id: u64) -> Work {
        let germs = GermSource::streams(id);
        let evaluation = EvaluationInput {
            id,
            setup: Setup::default(),
            point: Point::of_bone([1.0; 7]),
            germs,
            random: RandomQuantities::default(),
            observables: osteon_common::observables::ObservableSet::NONE,
        };
        Work { evaluation: Arc::new(evaluation), first: 0, count: 1 }
    }

    /// Sends batches of these evaluations on a new stream to a worker that reads each at once;
    /// returns the evaluations that came, in their order.
    fn announce_batches(ids: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let (sender, mut stream) = mpsc::channel(2);
        let (mut outbound, _closed) = Outbound::new(sender);
        let (mut received, mut announced) = (Received::default(), Vec::new());
        let mut evaluations = EvaluationMessages::default();
        for id in ids {
            outbound.send_batch(BatchId(9), &work(id), None, &mut evaluations).unwrap();
            while let Ok(message) = stream.try_recv() {
                match message.unwrap().message {
                    Some(Response::Evaluation(message)) => {
                        received.receive(&message).unwrap();
                        announced.push(message.evaluation);
                    }
                    Some(Response::Batch(message)) => {
                        assert_eq!(batch::from_message(&message, &received), Ok(work(id)));
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
        announced
    }

    #[test]
    fn a_worker_is_told_when_to_attach_again() {
        let after = |reason: CloseReason| osteon_proto::status::retry_after(&status(&reason));
        let full = CloseReason::TooManyWorkers { limit: 4096 };
        assert_eq!(after(full), Some(Duration::from_secs(30)));
        assert_eq!(after(CloseReason::Draining), Some(Duration::from_secs(1)));
        // Nothing keeps a worker that was given up for lost from coming back at once.
        assert_eq!(after(CloseReason::Expired { silent: Duration::from_secs(10) }), None);
    }

    #[test]
    fn an_evaluation_is_sent_before_its_first_batch_and_again_when_the_worker_has_lost_it() {
        for _stream in 0..2 {
            assert_eq!(announce_batches([5, 5, 6, 5, 6]), [5, 6]);
        }
        let most = EVALUATIONS_KEPT_MAX as u64;
        let all = || 0..most;
        assert_eq!(announce_batches(all().chain(all())), all().collect::<Vec<_>>());
        let one_more = || all().chain([most]);
        let twice: Vec<u64> = one_more().chain([0, 1]).collect();
        assert_eq!(announce_batches(one_more().chain([most, 0, 1, most])), twice);
    }

    #[test]
    fn a_batch_has_further_bytes_only_if_it_is_traced() {
        use prost::Message as _;
        let trace = TraceContext { trace: 1 << 64 | 7, span: 8, sampled: true };
        let sizes =
            [None, Some(trace)].map(|trace| batch(BatchId(9), &work(5), trace).encoded_len());
        // Without a trace: the batch with its numbers 9, 5, 0 (left out) and 1, in its envelope.
        assert_eq!(sizes, [2 + 6, 2 + 6 + 2 + 27]);
        let sent = batch(BatchId(9), &work(5), Some(trace));
        let Some(Response::Batch(message)) = sent.message else { panic!("{sent:?}") };
        assert_eq!(TraceContext::of_batch(&message), Some(trace));
    }

    #[test]
    fn an_evaluation_for_which_the_queue_has_no_room_is_not_taken_as_sent() {
        let (sender, mut stream) = mpsc::channel(2);
        let (mut outbound, _closed) = Outbound::new(sender);
        outbound.send(Ok(heartbeat())).unwrap();
        outbound.send(Ok(heartbeat())).unwrap();
        let mut evaluations = EvaluationMessages::default();
        assert!(outbound.send_batch(BatchId(1), &work(5), None, &mut evaluations).is_err());
        while stream.try_recv().is_ok() {}
        outbound.send_batch(BatchId(2), &work(5), None, &mut evaluations).unwrap();
        let first = stream.try_recv().unwrap().unwrap();
        assert_eq!(first, evaluation(&work(5).evaluation));
    }
}
