//! Counts and measurements of what happens, as they are exported for monitoring.

use osteon_common::outcome::FailureKind;

use super::*;
use crate::core::measurements::StateMeasurements;
use crate::core::tally::{EventCounts, EventTally};

/// A rig whose events are counted.
struct Counted {
    rig: Rig,
    tally: EventTally,
}

impl Counted {
    fn new(rig: Rig) -> Self {
        Self { rig, tally: EventTally::default() }
    }

    fn event(&mut self, event: Event) {
        let now = self.rig.now;
        let before = self.tally.count_event(&self.rig.state, &event, now);
        let effects = react(&mut self.rig.state, event, now);
        self.tally.count_reaction(&before, &self.rig.state, &effects, now);
    }

    fn accept(&mut self, specification: JobSpecification) {
        let job = self.rig.state.next_job;
        self.event(submit(0, "", specification));
        self.event(stored_event(job, RecordKey::Job));
    }

    fn counts(&self) -> &EventCounts {
        self.tally.counts()
    }

    fn measure(&self) -> StateMeasurements {
        StateMeasurements::new(&self.rig.state, self.rig.now)
    }
}

#[test]
fn a_job_is_counted_from_its_acceptance_to_its_end() {
    let mut counted = Counted::new(Rig::new());
    counted.accept(propagation(2));
    assert_eq!(counted.measure().realizations_waiting, 2);
    counted.event(hello(1, 2));
    assert_eq!((counted.measure().slots_busy, counted.measure().batches_in_flight), (2, 1));
    counted.rig.now += Duration::from_secs(2);
    assert_eq!(counted.measure().oldest_batch, Duration::from_secs(2));
    let failed = RealizationResult::failed(FailureKind::NoArrival);
    let solved = RealizationResult::solved(velocity(0).unwrap(), 0.0);
    let answer = |worker| Event::Answered {
        worker: WorkerId(worker),
        batch: BatchId(1),
        solved: vec![solved, failed],
        elapsed_s: 0.1,
    };
    // Whoever does not hold the batch fills nothing.
    counted.event(answer(9));
    assert_eq!(counted.counts().realizations, [0; 6]);
    counted.event(answer(1));
    // The same again is only compared.
    counted.event(answer(1));
    assert_eq!(counted.counts().realizations, [1, 1, 0, 0, 0, 0]);
    counted.event(stored_event(1, RecordKey::Evaluation(0)));
    counted.event(stored_event(1, RecordKey::End));
    let counts = counted.counts();
    assert_eq!((counts.jobs_accepted, counts.evaluations), (1, 1));
    assert_eq!((counts.evaluation_times.count(), counts.evaluation_times.sum_s()), (1, 2.0));
    assert_eq!(counts.jobs_ended.iter().sum::<u64>(), 1);
    assert_eq!(counts.batches_sent, [1, 0, 0, 0, 0, 0]);
    let measured = counted.measure();
    let expected =
        StateMeasurements { jobs_ended: 1, slots_idle: 2, workers_ok: 1, ..measured.clone() };
    assert_eq!(measured, expected);
    assert_eq!((measured.jobs_running, measured.slots_busy, measured.slots_wanted), (0, 0, 0));
}

#[test]
fn workers_are_counted_when_they_come_leave_and_are_lost() {
    let mut counted = Counted::new(Rig::new());
    counted.event(hello_of(1, 1, 4));
    counted.event(end_of_stream(1));
    // A worker without batches is no loss.
    assert_eq!((counted.counts().workers_left, counted.counts().workers_lost), (1, 0));
    counted.accept(propagation(1000));
    counted.event(hello_of(2, 2, 4));
    let sent: u64 = counted.counts().batches_sent.iter().sum();
    counted.event(end_of_stream(2));
    let counts = counted.counts();
    assert_eq!((counts.workers_attached, counts.workers_left, counts.workers_lost), (2, 1, 1));
    assert_eq!((sent, counts.batches_reassigned), (2, 2));
    counted.event(hello_of(3, 3, 4));
    counted.event(Event::WorkerDrains { worker: WorkerId(3) });
    let measured = counted.measure();
    assert_eq!((measured.workers_draining, measured.workers_ok), (1, 0));
    assert_eq!((measured.slots_idle, measured.slots_unavailable), (0, 4 - measured.slots_busy));
}

#[test]
fn duplicates_are_counted() {
    let mut rig = Rig::with(2, &[]);
    rig.event(hello_of(1, 1, 2));
    rig.event(hello_of(2, 2, 2));
    let mut counted = Counted::new(rig);
    counted.rig.now += Duration::from_millis(150);
    counted.event(Event::Tick);
    assert_eq!(counted.counts().batches_duplicated, 1);
    assert_eq!(counted.counts().batches_sent, [1, 0, 0, 0, 0, 0]);
}

#[test]
fn answers_that_differ_and_bans_are_counted() {
    let mut rig = Rig::new();
    rig.state.config.audit_fraction = 1.0;
    rig.accept(propagation(1));
    for worker in 1..=3 {
        rig.event(hello_of(worker.into(), worker, 1));
    }
    let mut counted = Counted::new(rig);
    counted.event(answer(1, 1, 0, 1));
    counted.event(checks::wrong_answer(2, 2, 0, checks::ONE_BIT));
    assert_eq!((counted.counts().mismatches, counted.counts().bans), (1, 0));
    counted.event(answer(3, 3, 0, 1));
    assert_eq!((counted.counts().mismatches, counted.counts().bans), (1, 1));
    assert_eq!(counted.measure().workers_banned, 1);
    assert_eq!(counted.counts().batches_sent, [0, 0, 0, 1, 1, 0]);
}

#[test]
fn errors_of_the_store_are_counted_and_how_long_it_refuses() {
    let mut counted = Counted::new(Rig::with(1, &[1]));
    counted.event(answer(1, 1, 0, 1));
    let error = "full".to_owned();
    let key = RecordKey::Evaluation(0);
    counted.event(Event::StoreFailed { job: JobId(1), key, error });
    counted.rig.now += Duration::from_secs(3);
    assert_eq!(counted.counts().store_errors, 1);
    assert_eq!(counted.measure().store_refusing, Duration::from_secs(3));
}

/// Slots that one job wants: (realizations, s of one realization or `None` before the first answer,
/// expected).
#[test]
fn wanted_slots_are_those_that_are_worth_their_batches() {
    for (realizations, each_s, expected) in [
        (1, None, 1),
        (2747, None, 138),
        (2747, Some(0.0003), 42),
        (2747, Some(1.0), 2747),
        (10, Some(1e-6), 1),
    ] {
        let mut rig = Rig::with(0, &[]);
        let job = rig.accept(identification(realizations));
        if let Some(each_s) = each_s {
            rig.state.jobs.get_mut(&job).unwrap().realization_time.learn(1, 1, each_s);
        }
        let measured = StateMeasurements::new(&rig.state, rig.now);
        assert_eq!(measured.slots_wanted, expected, "{realizations} of {each_s:?}");
    }
}
