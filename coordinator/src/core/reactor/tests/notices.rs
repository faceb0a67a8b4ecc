//! Notices: one log entry for each thing that operators ask about.

use super::*;
use crate::core::close_reason::CloseReason;
use crate::core::notice::{Departure, Notice};

impl Rig {
    /// Returns the notices that an event causes.
    fn notices(&mut self, event: Event) -> Vec<Notice> {
        let effects = react(&mut self.state, event, self.now);
        let notices = effects.into_iter().filter_map(|effect| match effect {
            Effect::Note(notice) => Some(notice),
            _ => None,
        });
        notices.collect()
    }
}

fn detached(notices: &[Notice]) -> (u64, usize, &Departure) {
    match notices {
        [Notice::WorkerDetached { worker, batches, why, .. }] => (worker.0, *batches, why),
        _ => panic!("{notices:?}"),
    }
}

#[test]
fn a_job_is_told_when_it_is_accepted_starts_and_ends() {
    let mut rig = Rig::new();
    let Event::Requested { reply_id, request } = submit(0, "", propagation(1)) else {
        panic!("no request");
    };
    let Request::Submit { specification, request_id, .. } = request else {
        panic!("no submission");
    };
    let request = Request::Submit {
        specification,
        request_id,
        client: "ann@lab".to_owned(),
        priority: 3,
        name: "left tibia".to_owned(),
    };
    assert_eq!(rig.notices(Event::Requested { reply_id, request }), []);
    let job = JobId(1);
    let accepted = Notice::JobAccepted {
        job,
        client: "ann@lab".to_owned(),
        name: "left tibia".to_owned(),
        kind: JobKind::Propagation,
        priority: 3,
    };
    let started = Notice::JobStarted { job, stored: 0 };
    assert_eq!(rig.notices(stored_event(1, RecordKey::Job)), [accepted, started]);
    rig.notices(hello(1, 1));
    assert_eq!(rig.notices(answer(1, 1, 0, 1)), []);
    assert_eq!(rig.notices(stored_event(1, RecordKey::Evaluation(0))), []);
    rig.now += Duration::from_secs(7);
    let told = rig.notices(stored_event(1, RecordKey::End));
    let [Notice::JobEnded { client, kind, ending, evaluations, elapsed, .. }] = &told[..] else {
        panic!("{told:?}");
    };
    assert_eq!((client.as_str(), *kind, *evaluations), ("ann@lab", JobKind::Propagation, 1));
    assert_eq!(ending.status.name(), "converged");
    // It ended when its last evaluation was durable.
    assert_eq!(*elapsed, Duration::ZERO);
}

#[test]
fn a_worker_is_told_when_it_comes_and_when_it_goes_and_why() {
    let mut rig = Rig::with(1000, &[]);
    let told = rig.notices(hello(1, 4));
    let [Notice::WorkerAttached { worker: WorkerId(1), name, slots: 4, version }] = &told[..]
    else {
        panic!("{told:?}");
    };
    assert_eq!((name.host(), name.process(), version.as_str()), ("node", 42, version::VERSION));
    let told = rig.notices(end_of_stream(1));
    assert_eq!(detached(&told), (1, 2, &Departure::StreamEnded));
    assert!(!detached(&told).2.is_orderly());
    // A refused worker was never attached, so its departure is not logged.
    let Event::Hello { worker, hello: mut foreign } = hello(2, 1) else { panic!("no hello") };
    foreign.fingerprint = "another".to_owned();
    foreign.host = "h".repeat(1000);
    let told = rig.notices(Event::Hello { worker, hello: foreign });
    let [Notice::WorkerRefused { name, .. }] = &told[..] else { panic!("{told:?}") };
    assert_eq!(name.host().len(), 256);
    assert_eq!(rig.notices(end_of_stream(2)), []);
}

#[test]
fn an_ordinary_drain_is_told_as_one() {
    let mut rig = Rig::with(1, &[1]);
    assert_eq!(rig.notices(Event::WorkerDrains { worker: WorkerId(1) }), []);
    let told = rig.notices(answer(1, 1, 0, 1));
    assert_eq!(detached(&told), (1, 0, &Departure::Closed(CloseReason::Drained)));
    assert!(detached(&told).2.is_orderly());
    let mut idle = Rig::with(1, &[]);
    idle.notices(hello(1, 1));
    idle.notices(hello(2, 1));
    let told = idle.notices(Event::WorkerDrains { worker: WorkerId(2) });
    assert_eq!(detached(&told), (2, 0, &Departure::Closed(CloseReason::Drained)));
}

/// A batch crosses the message of a worker that drains: it leaves, or is killed, without an answer.
#[test]
fn a_worker_that_drained_and_left_is_not_lost_with_a_batch_that_was_on_its_way() {
    let ends = [
        end_of_stream(1),
        // A batch for which the queue of a worker that has left has no place.
        Event::Misbehaved { worker: WorkerId(1), reason: CloseReason::NotReading },
    ];
    for end in ends {
        let mut rig = Rig::with(8, &[1]);
        assert_eq!(rig.notices(Event::WorkerDrains { worker: WorkerId(1) }), []);
        let told = rig.notices(end);
        assert_eq!(detached(&told), (1, 2, &Departure::Left));
        assert!(detached(&told).2.is_orderly());
        // Its batches are not suspected, and go out at once as they were.
        let sent = ["welcome 2, lease 2", "send 2: batch 3 = 2+1", "send 2: batch 4 = 3+1"];
        rig.check(hello(2, 1), &sent);
    }
}
