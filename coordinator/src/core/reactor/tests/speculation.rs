//! Speculative evaluations.

use super::*;
use crate::core::batch::Purpose;
use crate::core::job::Stage;

/// Returns a rig with a search over one parameter, whose second point is known from the first on,
/// and workers 1, 2, … of one thread, each on a host of its own.
fn rig(workers: u32) -> Rig {
    let mut rig = Rig::speculating();
    rig.state.config.audit_fraction = 0.0;
    rig.accept(identification(1));
    for worker in 1..=workers {
        rig.event(hello_on(&format!("host {worker}"), worker.into(), worker, 1));
    }
    rig
}

fn evaluation(number: u64) -> Event {
    stored_event(1, RecordKey::Evaluation(number))
}

#[test]
fn an_idle_worker_computes_the_next_point_and_nobody_sees_it_before_its_time() {
    let mut rig = rig(1);
    let idle = hello_on("idle", 2, 2, 1);
    rig.check(idle, &["welcome 2, lease 2", "send 2: batch 2 = 0+1"]);
    rig.check(answer(2, 2, 0, 1), &[]);
    let job = &rig.state.jobs[&JobId(1)];
    assert_eq!(job.evaluation().map(|evaluation| evaluation.filled()), Some(0));
    assert_eq!(job.rate.per_second(rig.now), 0.0);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    // The speculative evaluation is complete, so it is stored at once.
    let expected = ["store job 1 evaluation 1", "send 1: batch 3 = 0+1", "send 2: batch 4 = 0+1"];
    rig.check(evaluation(0), &expected);
}

/// Each speculative batch costs the coordinator time that the answers of the evaluation wait for. No more
/// are out than it serves while one is computed: 50 of 20 realizations, which take 5 ms; 16 of unknown ones.
#[test]
fn many_idle_workers_do_not_delay_the_search() {
    let mut rig = Rig::speculating();
    rig.state.config.audit_fraction = 0.0;
    let job = rig.accept(identification(1000));
    let speculative = |rig: &Rig| {
        let batches = rig.state.batches.values();
        batches.filter(|batch| batch.purpose == Purpose::Speculative).count()
    };
    for worker in 1..=400 {
        rig.event(hello(worker, 16));
        assert!(speculative(&rig) <= 16, "{worker}");
    }
    assert_eq!(speculative(&rig), 16);
    for worker in rig.state.workers.values_mut() {
        worker.rates.insert(job, 4000.0);
    }
    rig.state.reorder_all();
    for worker in 101..=120 {
        rig.heartbeat(worker);
        rig.event(end_of_stream(worker));
    }
    assert_eq!(speculative(&rig), 50);
}

#[test]
fn what_is_under_way_becomes_the_evaluation() {
    let mut rig = rig(2);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    assert_eq!(rig.state.batches[&BatchId(2)].purpose, Purpose::Speculative);
    rig.check(evaluation(0), &[]);
    let batch = &rig.state.batches[&BatchId(2)];
    assert!(batch.purpose == Purpose::Fill && batch.charged > Duration::ZERO);
    assert_eq!(rig.event(answer(2, 2, 0, 1))[0], "store job 1 evaluation 1");
}

#[test]
fn while_a_record_is_stored_its_search_is_ahead() {
    let mut rig = rig(1);
    let expected = ["store job 1 evaluation 0", "send 1: batch 2 = 0+1"];
    rig.check(answer(1, 1, 0, 1), &expected);
    rig.check(evaluation(0), &[]);
    let expected = ["store job 1 evaluation 1", "send 1: batch 3 = 0+1"];
    rig.check(answer(1, 2, 0, 1), &expected);
}

#[test]
fn whoever_does_not_want_it_gets_nothing_ahead() {
    let mut rig = Rig::new();
    rig.accept(identification(1));
    rig.event(hello(1, 1));
    rig.check(hello(2, 1), &["welcome 2, lease 2"]);
}

#[test]
fn other_work_takes_its_place() {
    let mut rig = rig(2);
    rig.event(submit(1, "", propagation(1)));
    let expected = ["answer 1: job 2", "revoke 2: batch 2", "send 2: batch 3 = 0+1"];
    rig.check(stored_event(2, RecordKey::Job), &expected);
    // When that is done, speculation continues.
    rig.check(answer(2, 3, 0, 1), &["store job 2 evaluation 0", "send 2: batch 4 = 0+1"]);
}

#[test]
fn threads_that_a_batch_leaves_idle_are_used() {
    let mut rig = Rig::speculating();
    rig.accept(identification(2));
    let expected = ["welcome 1, lease 1", "send 1: batch 1 = 0+2", "send 1: batch 2 = 0+2"];
    rig.check(hello(1, 4), &expected);
    // The worker may hold no further batch beside the speculative one, which is revoked.
    rig.event(submit(1, "", propagation(1)));
    let expected = ["answer 1: job 2", "revoke 1: batch 2", "send 1: batch 3 = 0+1"];
    rig.check(stored_event(2, RecordKey::Job), &expected);
}

#[test]
fn a_checked_answer_is_checked_when_its_point_is_asked_for() {
    let mut rig = rig(0);
    rig.state.config.audit_fraction = 1.0;
    rig.event(hello_on("host 1", 1, 1, 1));
    rig.event(hello_on("host 2", 2, 2, 1));
    rig.check(answer(2, 2, 0, 1), &[]);
    rig.check(answer(1, 1, 0, 1), &["send 2: batch 3 = 0+1"]);
    rig.check(answer(2, 3, 0, 1), &["store job 1 evaluation 0"]);
    rig.check(evaluation(0), &["send 1: batch 4 = 0+1"]);
    rig.event(answer(1, 4, 0, 1));
    assert!(matches!(rig.state.jobs[&JobId(1)].stage, Stage::StoringEvaluation { .. }));
}

#[test]
fn nobody_else_is_risked_for_a_point_over_which_a_worker_was_lost() {
    let mut rig = rig(2);
    rig.check(end_of_stream(2), &[]);
    rig.check(hello_on("host 3", 3, 3, 1), &["welcome 3, lease 3"]);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    // Now the search asks for it, and it goes alone to the worker with the best reputation.
    rig.check(evaluation(0), &["send 1: batch 3 = 0+1"]);
    assert_eq!(rig.state.batches[&BatchId(3)].purpose, Purpose::Exclusive);
}

#[test]
fn a_worker_that_leaves_does_not_wait_for_it() {
    let mut rig = rig(2);
    let drains = Event::WorkerDrains { worker: WorkerId(2) };
    rig.check(drains, &["revoke 2: batch 2", "close 2: this worker has drained"]);
}

#[test]
fn memory_is_for_what_is_asked_for() {
    let mut rig = Rig::speculating();
    rig.state.config.active_realizations_max = 5;
    rig.accept(identification(2));
    rig.event(hello(1, 4));
    assert_eq!(rig.state.jobs[&JobId(1)].speculation.evaluations.len(), 1);
    // Another job begins, and the limit on realizations in memory leaves no space for both.
    rig.event(submit(1, "", propagation(2)));
    let expected = ["answer 1: job 2", "revoke 1: batch 2", "send 1: batch 3 = 0+2"];
    rig.check(stored_event(2, RecordKey::Job), &expected);
    assert!(rig.state.jobs[&JobId(1)].speculation.evaluations.is_empty());
}

#[test]
fn a_cancelled_search_leaves_nothing_ahead() {
    let mut rig = rig(2);
    let expected = ["store job 1 end: cancelled ", "revoke 1: batch 1", "revoke 2: batch 2"];
    rig.check(request(1, Request::Cancel(JobId(1))), &expected);
}
