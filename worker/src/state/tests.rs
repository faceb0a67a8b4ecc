use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::germ_source::GermSource;
use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::parameters::Point;
use osteon_common::random_quantities::RandomQuantities;
use osteon_proto::announced::EVALUATIONS_KEPT_MAX;
use osteon_proto::evaluation::{self, EvaluationInput};

use super::*;

/// The evaluation of all batches.
const EVALUATION: u64 = 6;
const POINT: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

/// A worker under test, which checks that every effect is taken before the next event.
struct Recorder {
    state: State,
    now: Duration,
    effects: Vec<Effect>,
}

impl Recorder {
    fn new() -> Self {
        Self::leaving_after(None)
    }

    /// A worker with an idle timeout in seconds.
    fn leaving_after(seconds: Option<u64>) -> Self {
        let idle_timeout = seconds.map(Duration::from_secs);
        let identity = Identity { slots: 2, host: "host".to_owned(), process: 7, instance: 9 };
        Self { state: State::new(identity, idle_timeout), now: Duration::ZERO, effects: Vec::new() }
    }

    fn attached() -> Self {
        let mut recorder = Self::new();
        recorder.attach();
        recorder
    }

    /// Attaches, and receives the evaluation of all batches.
    fn attach(&mut self) {
        self.greet();
        self.evaluation(EVALUATION);
    }

    fn greet(&mut self) {
        self.state.attach();
        self.message(welcome());
        self.nothing_else();
    }

    /// The coordinator closes the stream of a worker that has drained.
    fn dismiss(&mut self) {
        self.event(Event::Lost);
        self.expect(&[Effect::Leave]);
    }

    fn event(&mut self, event: Event) {
        self.nothing_else();
        self.effects = self.state.react(self.now, event);
    }

    fn message(&mut self, message: Response) {
        self.event(Event::Message(Box::new(message)));
    }

    /// Receives an evaluation that can be read.
    fn evaluation(&mut self, id: u64) {
        let sent = EvaluationInput { id, ..EvaluationInput::clone(&work().evaluation) };
        self.message(Response::Evaluation(evaluation::to_message(&sent)));
        self.nothing_else();
    }

    fn batch(&mut self, number: u64) {
        self.message(Response::Batch(batch::to_message(number, &work())));
    }

    fn complete(&mut self, attachment: u64, batch: u64) {
        let computed = Computed::Complete { solved: sample_results(), elapsed_s: 0.5 };
        self.event(Event::Computed(Task { attachment, batch }, computed));
    }

    fn tick_at(&mut self, seconds: f64) {
        self.now = Duration::from_secs_f64(seconds);
        self.event(Event::Tick);
    }

    fn expect(&mut self, expected: &[Effect]) {
        assert_eq!(self.effects, expected);
        self.effects.clear();
    }

    fn nothing_else(&self) {
        assert_eq!(self.effects, []);
    }
}

fn welcome() -> Response {
    Response::Welcome(v1::WorkerWelcome { worker: 1, lease: 1, heartbeat_s: 1.0, expiry_s: 5.0 })
}

fn work() -> Work {
    let (setup, germs) = (Setup::default(), GermSource::streams(1));
    let evaluation = EvaluationInput {
        id: EVALUATION,
        setup,
        point: POINT,
        germs,
        random: RandomQuantities::default(),
        observables: osteon_common::observables::ObservableSet::NONE,
    };
    Work { evaluation: Arc::new(evaluation), first: 10, count: 2 }
}

fn compute(attachment: u64, batch: u64) -> Effect {
    Effect::Compute(Task { attachment, batch }, work())
}

fn abandon(attachment: u64, batch: u64) -> Effect {
    Effect::Abandon(Task { attachment, batch })
}

fn sample_results() -> Vec<RealizationResult> {
    let success = RealizationResult::solved(3900.0, 2e-5);
    vec![success, RealizationResult::failed(FailureKind::NoArrival)]
}

fn answer(batch: u64) -> Effect {
    Effect::Send(Request::Result(v1::BatchResult {
        batch,
        codes: vec![0, 1],
        velocities: vec![3900.0, 0.0],
        elapsed_s: 0.5,
        estimated_errors: vec![2e-5, 0.0],
        observables: Vec::new(),
    }))
}

const HEARTBEAT: Effect = Effect::Send(Request::Heartbeat(v1::Heartbeat {}));
const DRAIN: Effect = Effect::Send(Request::Drain(v1::WorkerDrain {}));

#[test]
fn hello_says_who_it_is() {
    let Request::Hello(hello) = Recorder::new().state.attach() else { panic!("no hello") };
    assert_eq!((hello.slots, hello.host.as_str(), hello.process), (2, "host", 7));
    assert_eq!(hello.instance, 9);
    assert_eq!(hello.fingerprint, version::fingerprint());
}

#[test]
fn a_batch_is_computed_and_answered() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.complete(1, 4);
    worker.nothing_else();
}

#[test]
fn a_revoked_batch_is_abandoned_and_never_answered() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.message(Response::Revoke(v1::BatchRevoke { batch: 4 }));
    worker.expect(&[abandon(1, 4)]);
    worker.complete(1, 4);
    worker.nothing_else();
    worker.message(Response::Revoke(v1::BatchRevoke { batch: 99 }));
    worker.nothing_else();
}

#[test]
fn an_answer_of_an_earlier_lease_is_told_from_a_current_one() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.event(Event::Lost);
    worker.expect(&[abandon(1, 4)]);
    worker.attach();
    worker.batch(4);
    worker.expect(&[compute(2, 4)]);
    worker.complete(1, 4);
    worker.nothing_else();
    worker.complete(2, 4);
    worker.expect(&[answer(4)]);
}

#[test]
fn heartbeats_fill_silence() {
    let mut worker = Recorder::attached();
    worker.tick_at(0.4);
    worker.nothing_else();
    worker.tick_at(0.5);
    worker.expect(&[HEARTBEAT]);
    worker.tick_at(0.9);
    worker.nothing_else();
    worker.tick_at(1.0);
    worker.expect(&[HEARTBEAT]);
}

#[test]
fn a_silent_coordinator_is_left_with_all_batches() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.tick_at(4.9);
    worker.expect(&[HEARTBEAT]);
    worker.tick_at(5.0);
    worker.expect(&[Effect::Detach(Detached::Silence), abandon(1, 4)]);
    worker.tick_at(9.0);
    worker.nothing_else();
}

#[test]
fn any_message_is_a_sign_of_life() {
    let mut worker = Recorder::attached();
    worker.now = Duration::from_secs(4);
    worker.message(Response::Heartbeat(v1::Heartbeat {}));
    worker.nothing_else();
    worker.tick_at(8.9);
    worker.expect(&[HEARTBEAT]);
    worker.tick_at(9.0);
    worker.expect(&[Effect::Detach(Detached::Silence)]);
}

#[test]
fn a_drained_worker_finishes_what_it_holds() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.batch(5);
    worker.expect(&[compute(1, 5)]);
    worker.event(Event::Drain);
    worker.expect(&[DRAIN]);
    worker.event(Event::Drain);
    worker.nothing_else();
    worker.complete(1, 5);
    worker.expect(&[answer(5)]);
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.dismiss();
}

/// The coordinator sends a batch before it has heard that the worker drains.
#[test]
fn a_batch_on_its_way_to_a_worker_that_drains_is_answered() {
    let mut worker = Recorder::attached();
    worker.event(Event::Drain);
    worker.expect(&[DRAIN]);
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    // It was idle for a long time before, and may still need some time.
    worker.tick_at(4.9);
    worker.expect(&[HEARTBEAT]);
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.dismiss();
}

#[test]
fn a_worker_that_drains_before_its_welcome_tells_so_and_answers_what_is_on_its_way() {
    let mut worker = Recorder::new();
    worker.state.attach();
    worker.event(Event::Drain);
    worker.expect(&[DRAIN]);
    worker.message(welcome());
    worker.evaluation(EVALUATION);
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.dismiss();
}

#[test]
fn a_worker_that_drains_waits_for_its_dismissal_only_so_long() {
    let mut idle = Recorder::attached();
    idle.now = Duration::from_secs(3);
    idle.event(Event::Drain);
    idle.expect(&[DRAIN]);
    idle.tick_at(4.9);
    idle.expect(&[HEARTBEAT]);
    idle.tick_at(5.0);
    idle.expect(&[Effect::Leave]);
    // The time begins with the last answer.
    let mut busy = Recorder::attached();
    busy.batch(4);
    busy.expect(&[compute(1, 4)]);
    busy.event(Event::Drain);
    busy.expect(&[DRAIN]);
    busy.now = Duration::from_secs(4);
    busy.complete(1, 4);
    busy.expect(&[answer(4)]);
    busy.message(Response::Heartbeat(v1::Heartbeat {}));
    busy.tick_at(5.9);
    busy.expect(&[HEARTBEAT]);
    busy.tick_at(6.0);
    busy.expect(&[Effect::Leave]);
}

#[test]
fn a_worker_that_the_coordinator_sends_away_answers_what_it_holds_and_leaves() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    let leave = || Response::Drain(v1::WorkerDrain {});
    worker.message(leave());
    worker.expect(&[DRAIN]);
    worker.message(leave());
    worker.nothing_else();
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.dismiss();
    let mut idle = Recorder::attached();
    idle.message(leave());
    idle.expect(&[DRAIN]);
    idle.dismiss();
}

#[test]
fn a_worker_without_a_coordinator_leaves_at_once() {
    let mut alone = Recorder::new();
    alone.event(Event::Drain);
    alone.expect(&[Effect::Leave]);
}

#[test]
fn a_worker_without_work_leaves_after_its_idle_timeout() {
    let mut worker = Recorder::leaving_after(Some(3));
    // Without a coordinator nothing happens here, and that time does not count afterwards.
    worker.tick_at(10.0);
    worker.nothing_else();
    worker.attach();
    worker.tick_at(12.9);
    worker.expect(&[HEARTBEAT]);
    // A batch begins the time again, from its end on.
    worker.batch(1);
    worker.expect(&[compute(1, 1)]);
    worker.tick_at(14.0);
    worker.expect(&[HEARTBEAT]);
    assert!(!worker.state.is_idle_too_long(Duration::from_secs(100)));
    worker.now = Duration::from_secs(20);
    worker.message(Response::Heartbeat(v1::Heartbeat {}));
    worker.nothing_else();
    worker.complete(1, 1);
    worker.expect(&[answer(1)]);
    worker.now = Duration::from_secs(22);
    worker.message(Response::Heartbeat(v1::Heartbeat {}));
    worker.tick_at(22.0);
    worker.expect(&[HEARTBEAT]);
    worker.tick_at(23.0);
    worker.expect(&[DRAIN]);
    worker.dismiss();
}

#[test]
fn a_worker_without_an_idle_timeout_stays() {
    let mut worker = Recorder::attached();
    worker.now = Duration::from_secs(1_000_000);
    worker.message(Response::Heartbeat(v1::Heartbeat {}));
    worker.tick_at(1_000_000.0);
    worker.expect(&[HEARTBEAT]);
}

#[test]
fn a_drain_has_an_end() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.event(Event::Drain);
    worker.expect(&[DRAIN]);
    worker.now = Duration::from_secs(6);
    worker.message(Response::Heartbeat(v1::Heartbeat {}));
    worker.tick_at(9.9);
    worker.expect(&[HEARTBEAT]);
    worker.tick_at(10.0);
    worker.expect(&[Effect::Leave]);
}

#[test]
fn losing_the_coordinator_while_draining_is_leave_to_go() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.event(Event::Drain);
    worker.expect(&[DRAIN]);
    worker.event(Event::Lost);
    worker.expect(&[abandon(1, 4), Effect::Leave]);
}

#[test]
fn more_batches_than_it_can_hold_end_the_lease() {
    let mut worker = Recorder::attached();
    for number in 0..BATCHES_HELD_MAX as u64 {
        worker.batch(number);
        worker.expect(&[compute(1, number)]);
    }
    worker.batch(BATCHES_HELD_MAX as u64);
    assert_eq!(worker.effects[0], Effect::Detach(Detached::Overrun));
    assert_eq!(worker.effects.len(), 1 + BATCHES_HELD_MAX);
}

#[test]
fn one_number_twice_ends_the_lease() {
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    worker.batch(4);
    worker.expect(&[Effect::Detach(Detached::Overrun), abandon(1, 4)]);
}

#[test]
fn what_cannot_be_read_or_computed_ends_the_worker() {
    let mut worker = Recorder::attached();
    worker.message(Response::Evaluation(v1::Evaluation::default()));
    worker.expect(&[malformed(Malformed::IncompleteSetup)]);

    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    let case = Box::new(PanickedCase { index: 11, germs: GermSource::streams(1), point: POINT });
    let (panicked, failed) = (case.clone(), case);
    let message = || "index out of bounds".to_owned();
    worker.event(Event::Computed(
        Task { attachment: 1, batch: 4 },
        Computed::Panicked { case: panicked, message: message() },
    ));
    worker.expect(&[Effect::Fail(Failure::Panicked { case: failed, message: message() })]);
}

fn malformed(defect: Malformed) -> Effect {
    Effect::Fail(Failure::Malformed(defect))
}

#[test]
fn a_batch_of_an_unknown_evaluation_ends_the_worker() {
    let batch_of = |evaluation| {
        Response::Batch(v1::Batch { batch: 1, evaluation, count: 1, ..v1::Batch::default() })
    };
    let unknown_evaluation = |evaluation| [malformed(Malformed::UnknownEvaluation { evaluation })];
    let mut worker = Recorder::attached();
    worker.message(batch_of(7));
    worker.expect(&unknown_evaluation(7));

    // Each stream has its own evaluations.
    let mut worker = Recorder::attached();
    worker.event(Event::Lost);
    worker.greet();
    worker.message(batch_of(EVALUATION));
    worker.expect(&unknown_evaluation(EVALUATION));

    // The oldest is forgotten, but not what a worker computes of it.
    let mut worker = Recorder::attached();
    worker.batch(4);
    worker.expect(&[compute(1, 4)]);
    (100..100 + EVALUATIONS_KEPT_MAX as u64).for_each(|id| worker.evaluation(id));
    worker.complete(1, 4);
    worker.expect(&[answer(4)]);
    worker.message(batch_of(EVALUATION));
    worker.expect(&unknown_evaluation(EVALUATION));
}

#[test]
fn messages_out_of_turn_end_the_lease() {
    let mut worker = Recorder::new();
    worker.state.attach();
    worker.batch(1);
    worker.expect(&[Effect::Detach(Detached::Protocol)]);
    let mut worker = Recorder::attached();
    worker.message(Response::Welcome(v1::WorkerWelcome::default()));
    worker.expect(&[Effect::Detach(Detached::Protocol)]);
}

#[test]
fn spans_beyond_reason_are_bounded() {
    for (heartbeat_s, expiry_s) in [(f64::NAN, f64::INFINITY), (-1.0, 1e300)] {
        let mut worker = Recorder::new();
        worker.state.attach();
        let welcome = v1::WorkerWelcome { worker: 1, lease: 1, heartbeat_s, expiry_s };
        worker.message(Response::Welcome(welcome));
        worker.nothing_else();
        worker.tick_at(0.1);
        worker.expect(&[HEARTBEAT]);
    }
}
