//! Batches of lost workers.

use super::*;

#[test]
fn the_batches_of_a_lost_worker_are_retried_in_halves() {
    let mut rig = Rig::with(64, &[2]);
    rig.check(end_of_stream(1), &[]);
    // It held 0+8 and 8+8; every half is a batch of its own, whoever takes it.
    rig.check(
        hello(2, 2),
        &["welcome 2, lease 2", "send 2: batch 3 = 8+4", "send 2: batch 4 = 12+4"],
    );
    rig.check(answer(2, 3, 8, 4), &["send 2: batch 5 = 0+4"]);
    rig.check(answer(2, 4, 12, 4), &["send 2: batch 6 = 4+4"]);
    rig.check(answer(2, 5, 0, 4), &["send 2: batch 7 = 16+8"]);
}

#[test]
fn a_realization_that_was_alone_on_three_lost_workers_fails_its_job() {
    let mut rig = Rig::with(2, &[1]);
    // Held together with another: both are suspects, neither is blamed.
    rig.check(end_of_stream(1), &[]);
    for worker in 2..4 {
        // A suspect is alone on its worker.
        let batch = worker + 1;
        let (welcome, send) = (
            format!("welcome {worker}, lease {worker}"),
            format!("send {worker}: batch {batch} = {}+1", worker % 2),
        );
        rig.check(hello(worker, 8), &[&welcome, &send]);
        rig.check(end_of_stream(worker), &[]);
    }
    // Index 0 and index 1 have each been alone on one lost worker; 0 answers, 1 goes on killing.
    rig.check(hello(4, 8), &["welcome 4, lease 4", "send 4: batch 5 = 0+1"]);
    rig.check(answer(4, 5, 0, 1), &["send 4: batch 6 = 1+1"]);
    rig.check(end_of_stream(4), &[]);
    rig.check(hello(5, 8), &["welcome 5, lease 5", "send 5: batch 7 = 1+1"]);
    let effects = rig.event(end_of_stream(5));
    assert_eq!(effects.len(), 1, "{effects:?}");
    let reason = &effects[0];
    assert!(reason.starts_with("store job 1 end: failed realization 1 was alone on three"));
    assert!(reason.contains("osteon draw JOB.toml --index 1"), "{reason}");
    assert!(reason.contains("1598.8, 17717000000.0, 0.3816"), "{reason}");
}

#[test]
fn a_worker_that_announced_its_end_is_no_sign_against_its_realizations() {
    let mut rig = Rig::with(1, &[]);
    for worker in 1..10 {
        rig.event(hello(worker, 1));
        rig.check(Event::WorkerDrains { worker: WorkerId(worker) }, &[]);
        rig.check(end_of_stream(worker), &[]);
    }
    rig.event(hello(10, 1));
    rig.check(answer(10, 10, 0, 1), &["store job 1 evaluation 0"]);
}

#[test]
fn a_suspect_is_not_starved_by_the_queue_of_another_job() {
    let mut rig = Rig::new();
    rig.accept(propagation(1));
    rig.accept(propagation(1000));
    for worker in 1..4 {
        rig.event(hello(worker, 1));
    }
    // Worker 1 is lost, and with it realization 0 of job 1 and the first four of job 2. Worker 2
    // is not refilled, worker 3 is.
    rig.check(end_of_stream(1), &[]);
    rig.check(answer(2, 3, 4, 4), &[]);
    rig.check(answer(3, 5, 12, 4), &["send 3: batch 7 = 0+2"]);
    rig.check(answer(2, 4, 8, 4), &["send 2: batch 8 = 0+1"]);
    rig.check(
        answer(2, 8, 0, 1),
        &["store job 1 evaluation 0", "send 2: batch 9 = 2+2", "send 2: batch 10 = 20+8"],
    );
}

#[test]
fn a_suspect_is_never_copied() {
    let mut rig = Rig::with(1, &[1]);
    rig.event(end_of_stream(1));
    rig.check(hello(2, 1), &["welcome 2, lease 2", "send 2: batch 2 = 0+1"]);
    rig.check(hello(3, 1), &["welcome 3, lease 3"]);
    rig.check_after(Duration::from_secs(1), &[]);
}
