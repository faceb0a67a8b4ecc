//! Workers: admitted, refused, silent, draining.

use super::*;
use crate::core::close_reason::CloseReason;

#[test]
fn every_attachment_has_a_new_lease() {
    let mut rig = Rig::new();
    rig.check(hello(5, 1), &["welcome 5, lease 1"]);
    rig.check(end_of_stream(5), &[]);
    rig.check(hello(6, 4096), &["welcome 6, lease 2"]);
}

#[test]
fn a_worker_that_cannot_be_used_is_refused_with_the_reason() {
    let with = |change: fn(&mut Hello)| {
        let Event::Hello { worker, mut hello } = hello(1, 1) else { panic!("no hello") };
        change(&mut hello);
        Event::Hello { worker, hello }
    };
    let fingerprint = format!(
        "close 1: this worker's numerics are `other`, the coordinator's are `{}`; results would \
         not be reproducible: run the same version of osteon on both",
        version::fingerprint()
    );
    for (event, expected) in [
        (with(|hello| hello.fingerprint = "other".to_owned()), fingerprint.as_str()),
        (
            with(|hello| hello.slots = 0),
            "close 1: this worker announces 0 slots; 1 to 4096 are allowed",
        ),
        (
            with(|hello| hello.slots = 4097),
            "close 1: this worker announces 4097 slots; 1 to 4096 are allowed",
        ),
        (
            with(|hello| hello.host = "x".repeat(257)),
            "close 1: a name in this worker's hello has 257 bytes; at most 256 are allowed",
        ),
    ] {
        let mut rig = Rig::with(100, &[]);
        rig.check(event, &[expected]);
        // Later messages of a refused worker are ignored.
        rig.check(Event::Heartbeat { worker: WorkerId(1) }, &[]);
        rig.check(answer(1, 1, 0, 1), &[]);
        rig.check(end_of_stream(1), &[]);
    }
}

#[test]
fn a_second_hello_ends_the_stream() {
    let mut rig = Rig::new();
    rig.check(hello(1, 1), &["welcome 1, lease 1"]);
    rig.check(hello(1, 1), &["close 1: this worker sent a second hello on one stream"]);
    rig.check(hello(2, 1), &["welcome 2, lease 2"]);
}

#[test]
fn a_silent_worker_loses_its_lease() {
    let mut rig = Rig::with(8, &[1]);
    rig.check_after(Duration::from_secs(9), &[]);
    rig.heartbeat(1);
    rig.check_after(Duration::from_secs(10), &[]);
    let expired = "close 1: no message came from this worker for 10.001s; its lease has ended, \
                   attach again";
    rig.check_after(Duration::from_millis(1), &[expired]);
    // Its later messages are ignored, and its batches go to the next worker.
    rig.check(answer(1, 1, 0, 4), &[]);
    rig.check(
        hello(2, 1),
        &["welcome 2, lease 2", "send 2: batch 3 = 2+1", "send 2: batch 4 = 3+1"],
    );
}

#[test]
fn while_the_coordinator_stands_still_nobody_is_silent() {
    let mut rig = Rig::with(8, &[1]);
    rig.check_after(Duration::from_secs(9), &[]);
    for _ in 0..3 {
        rig.now += Duration::from_secs(3600);
        let effects = rig.event(Event::Tick);
        assert!(!effects.iter().any(|effect| effect.starts_with("close")), "{effects:?}");
    }
    // It was silent for nine seconds before, and still is.
    rig.check_after(Duration::from_secs(1), &[]);
    let expired = "close 1: no message came from this worker for 10.001s; its lease has ended, \
                   attach again";
    rig.check_after(Duration::from_millis(1), &[expired]);
}

#[test]
fn signs_of_life_are_given_in_time() {
    let mut rig = Rig::new();
    rig.event(hello(1, 1));
    rig.now = Duration::from_millis(1999);
    rig.check(Event::Tick, &[]);
    rig.now = Duration::from_secs(2);
    rig.check(Event::Tick, &["beat 1"]);
    rig.check(Event::Tick, &[]);
}

#[test]
fn a_worker_that_lives_but_never_answers_loses_its_lease() {
    let mut rig = Rig::with(8, &[1]);
    for _ in 0..100 {
        rig.heartbeat(1);
        rig.check_after(Duration::from_secs(6), &[]);
    }
    rig.heartbeat(1);
    let closed = "close 1: this worker has not answered any of its batches for 600.1s; its lease \
                  has ended, attach again";
    rig.check_after(Duration::from_millis(100), &[closed]);
}

#[test]
fn a_malformed_answer_ends_the_stream_and_its_batches_return() {
    let mut rig = Rig::with(8, &[1]);
    let closed = "close 1: the answer to batch 1 has 3 realizations, expected 2";
    rig.check(answer(1, 1, 0, 3), &[closed]);
    let mut rig = Rig::with(8, &[1]);
    let reason = CloseReason::SecondHello;
    let closed = "close 1: this worker sent a second hello on one stream";
    rig.check(Event::Misbehaved { worker: WorkerId(1), reason }, &[closed]);
    rig.check(
        hello(2, 1),
        &["welcome 2, lease 2", "send 2: batch 3 = 2+1", "send 2: batch 4 = 3+1"],
    );
}

#[test]
fn a_leaving_worker_gets_no_more_and_is_dismissed_when_it_has_answered() {
    let mut rig = Rig::with(100, &[1]);
    rig.check(Event::WorkerDrains { worker: WorkerId(1) }, &[]);
    rig.check(answer(1, 1, 0, 4), &[]);
    rig.check(answer(1, 2, 4, 4), &["close 1: this worker has drained"]);
    rig.check(
        hello(2, 1),
        &["welcome 2, lease 2", "send 2: batch 3 = 8+4", "send 2: batch 4 = 12+4"],
    );
}

#[test]
fn answers_to_unknown_batches_mean_nothing() {
    let mut rig = Rig::with(100, &[1, 1]);
    // An unknown batch, and one that another worker holds.
    rig.check(answer(1, 99, 0, 4), &[]);
    rig.check(answer(1, 3, 8, 4), &[]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(snapshot.realizations_done, 0);
}

#[test]
fn the_list_of_workers_says_who_is_there_what_they_hold_and_who_went() {
    let mut rig = Rig::with(1000, &[1, 2]);
    rig.now += Duration::from_secs(3);
    rig.heartbeat(2);
    let list = crate::core::worker_list::all(&rig.state, rig.now + Duration::from_secs(1));
    let shown: Vec<_> = list
        .workers
        .iter()
        .map(|it| (it.worker, it.slots, it.silent_s, it.batches, it.oldest_batch_s, it.state()))
        .collect();
    let ok = osteon_proto::v1::WorkerState::Ok;
    assert_eq!(shown, [(1, 1, 4.0, 2, Some(4.0), ok), (2, 2, 1.0, 2, Some(4.0), ok)]);
    assert_eq!(list.workers[0].realizations_per_second, 0.0);
    assert_eq!(list.departed, []);
    rig.event(answer(1, 1, 0, 4));
    rig.event(end_of_stream(1));
    let list = crate::core::worker_list::all(&rig.state, rig.now);
    assert_eq!(list.workers.len(), 1);
    let [gone] = &list.departed[..] else { panic!("{list:?}") };
    assert_eq!((gone.worker, gone.host.as_str(), gone.process), (1, "node", 42));
    assert_eq!((gone.batches, gone.reason.as_str()), (2, "its connection ended"));
    assert_eq!(gone.depart_time.map(|time| time.seconds), Some(3));
    // However many come and go, the number of departed workers is limited.
    for worker in 3..200 {
        rig.event(hello(worker, 1));
        rig.event(end_of_stream(worker));
    }
    let list = crate::core::worker_list::all(&rig.state, rig.now);
    assert_eq!(list.departed.len(), 64);
    assert_eq!(list.departed[0].worker, 199);
}

#[test]
fn a_worker_that_is_sent_away_gets_nothing_more_and_leaves_when_it_has_answered() {
    let mut rig = Rig::with(1000, &[1]);
    let drain = |worker| request(7, Request::DrainWorker(WorkerId(worker)));
    rig.check(drain(1), &["drain 1", "answer 7: worker 1 Draining"]);
    // A second request changes nothing.
    rig.check(drain(1), &["answer 7: worker 1 Draining"]);
    let unknown = "answer 7: no worker with number 5 is attached";
    rig.check(drain(5), &[unknown]);
    rig.check(answer(1, 1, 0, 4), &[]);
    rig.check(answer(1, 2, 4, 4), &["close 1: this worker has drained"]);
}

#[test]
fn a_worker_that_holds_nothing_is_told_before_its_stream_is_closed() {
    let mut rig = Rig::new();
    rig.event(hello(1, 1));
    let drain = request(7, Request::DrainWorker(WorkerId(1)));
    rig.check(drain, &["drain 1", "answer 7: worker 1 Draining"]);
    let drains = Event::WorkerDrains { worker: WorkerId(1) };
    rig.check(drains, &["close 1: this worker has drained"]);
}
