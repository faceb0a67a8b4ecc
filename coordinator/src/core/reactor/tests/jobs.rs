//! Jobs: accepted, computed, stored, ended, cancelled, refused.

use osteon_common::limits::{CLIENT_SHARE_DIVISOR, JOBS_MAX};

use super::*;

fn not_stored_event(job: u64, key: RecordKey) -> Event {
    Event::StoreFailed { job: JobId(job), key, error: "the disk is full".to_owned() }
}

#[test]
fn nothing_is_said_before_it_is_durable() {
    let mut rig = Rig::new();
    rig.check(hello(1, 1), &["welcome 1, lease 1"]);
    rig.check(submit(7, "", propagation(2)), &["store job 1"]);
    rig.check(
        stored_event(1, RecordKey::Job),
        &["answer 7: job 1", "send 1: batch 1 = 0+1", "send 1: batch 2 = 1+1"],
    );
    rig.check(answer(1, 2, 1, 1), &[]);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["store job 1 end: converged "]);
    let fetch = || request(8, Request::Fetch(JobId(1)));
    rig.check(fetch(), &["answer 8: job 1 has not ended"]);
    rig.check(stored_event(1, RecordKey::End), &["publish 1"]);
    rig.check(fetch(), &["answer 8: ended 1"]);
    assert!(rig.state.is_idle());
}

#[test]
fn a_search_goes_to_its_next_point_when_the_last_is_durable() {
    let mut rig = Rig::new();
    rig.accept(identification(1));
    rig.check(hello(1, 1), &["welcome 1, lease 1", "send 1: batch 1 = 0+1"]);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["send 1: batch 2 = 0+1"]);
    // A repeated report is ignored.
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &[]);
}

#[test]
fn a_submission_is_idempotent_by_its_request_id() {
    let mut rig = Rig::new();
    rig.check(submit(1, "r", propagation(2)), &["store job 1"]);
    // Before and after the job is durable.
    rig.check(submit(2, "r", propagation(2)), &[]);
    rig.check(stored_event(1, RecordKey::Job), &["answer 1: job 1", "answer 2: job 1"]);
    rig.check(submit(3, "r", propagation(2)), &["answer 3: job 1"]);
    let refusal = "answer 4: request id `r` belongs to job 1, which has another specification; \
                   choose another request id";
    rig.check(submit(4, "r", propagation(3)), &[refusal]);
    // Without an id every submission is a new job.
    rig.check(submit(5, "", propagation(2)), &["store job 2"]);
    rig.check(submit(6, "", propagation(2)), &["store job 3"]);
}

#[test]
fn clients_that_choose_the_same_request_id_have_jobs_of_their_own() {
    let submit_as = |reply_id, client: &str, realizations| {
        let Event::Requested { reply_id, request } =
            submit(reply_id, "r", propagation(realizations))
        else {
            unreachable!()
        };
        let Request::Submit { specification, request_id, priority, .. } = request else {
            unreachable!()
        };
        let client = client.to_owned();
        let request =
            Request::Submit { specification, request_id, client, priority, name: String::new() };
        Event::Requested { reply_id, request }
    };
    let mut rig = Rig::new();
    rig.check(submit_as(1, "ann", 2), &["store job 1"]);
    rig.check(submit_as(2, "bob", 3), &["store job 2"]);
    rig.check(stored_event(1, RecordKey::Job), &["answer 1: job 1"]);
    rig.check(stored_event(2, RecordKey::Job), &["answer 2: job 2"]);
    rig.check(submit_as(3, "ann", 2), &["answer 3: job 1"]);
    rig.check(submit_as(4, "bob", 3), &["answer 4: job 2"]);
    // An id of one client may be used by another.
    rig.check(submit_as(5, "cem", 4), &["store job 3"]);
}

#[test]
fn a_job_that_cannot_be_stored_is_not_accepted() {
    let mut rig = Rig::new();
    rig.check(submit(1, "r", propagation(2)), &["store job 1"]);
    let refusal = "answer 1: the job could not be stored and is not accepted: the disk is full";
    rig.check(not_stored_event(1, RecordKey::Job), &[refusal]);
    rig.check(submit(2, "r", propagation(2)), &["store job 2"]);
}

#[test]
fn another_record_is_written_again_until_it_is_durable() {
    let mut rig = Rig::with(1, &[1]);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    let (failed, retry) =
        (|| not_stored_event(1, RecordKey::Evaluation(0)), Duration::from_secs(2));
    rig.check(failed(), &[]);
    rig.check_after(retry / 2, &[]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(
        snapshot.waiting_for,
        "the store cannot write a record; retrying: the disk is full (since 1 s)"
    );
    rig.check_after(retry / 2, &["store job 1 evaluation 0"]);
    rig.check_after(Duration::ZERO, &[]);
    for _ in 0..1000 {
        rig.heartbeat(1);
        rig.check(failed(), &[]);
        rig.check_after(retry, &["store job 1 evaluation 0"]);
    }
    rig.check(request(1, Request::Get(JobId(1))), &["answer 1: Running Unspecified"]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["store job 1 end: converged "]);
}

#[test]
fn an_end_that_is_not_durable_is_none() {
    let mut rig = Rig::with(8, &[]);
    rig.check(request(7, Request::Cancel(JobId(1))), &["store job 1 end: cancelled "]);
    for _ in 0..1000 {
        rig.check(not_stored_event(1, RecordKey::End), &[]);
        rig.check_after(Duration::from_secs(2), &["store job 1 end: cancelled "]);
    }
    let refusal = "answer 8: job 1 has not ended";
    rig.check(request(8, Request::Fetch(JobId(1))), &[refusal]);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
}

#[test]
fn a_store_that_refuses_for_too_long_is_despaired_of_and_tried_on() {
    let mut rig = Rig::with(8, &[]);
    rig.state.config.store_give_up_after = Some(Duration::from_secs(4));
    rig.event(request(7, Request::Cancel(JobId(1))));
    for _ in 0..2 {
        rig.check(not_stored_event(1, RecordKey::End), &[]);
        rig.check_after(Duration::from_secs(2), &["store job 1 end: cancelled "]);
    }
    rig.check(not_stored_event(1, RecordKey::End), &["give_up after 4s: the disk is full"]);
    rig.check_after(Duration::from_secs(2), &["store job 1 end: cancelled "]);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
}

#[test]
fn a_cancelled_job_ends_when_its_end_is_durable() {
    let mut rig = Rig::with(8, &[1]);
    let cancel = || request(7, Request::Cancel(JobId(1)));
    rig.check(cancel(), &["store job 1 end: cancelled ", "revoke 1: batch 1", "revoke 1: batch 2"]);
    // The answer to a revoked batch may have been sent already.
    rig.check(answer(1, 1, 0, 2), &[]);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
    rig.check(cancel(), &["answer 7: Ended Cancelled"]);
    let refusal = "answer 7: no such job: 9";
    rig.check(request(7, Request::Cancel(JobId(9))), &[refusal]);
}

#[test]
fn a_job_cancelled_while_an_evaluation_is_stored_keeps_the_evaluation() {
    let mut rig = Rig::new();
    rig.accept(identification(1));
    rig.event(hello(1, 1));
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    rig.check(request(7, Request::Cancel(JobId(1))), &[]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["store job 1 end: cancelled "]);
    rig.check(stored_event(1, RecordKey::End), &["answer 7: Ended Cancelled", "publish 1"]);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(snapshot.evaluations, 1);
}

#[test]
fn jobs_beyond_the_active_ones_wait_their_turn() {
    let mut rig = Rig::new();
    for _ in 0..4 {
        rig.accept(propagation(1));
    }
    let waiting = |rig: &Rig, job| {
        crate::core::snapshot::job_snapshot(&rig.state, JobId(job), rig.now).unwrap().waiting_for
    };
    assert_eq!(waiting(&rig, 1), "no worker is attached (since 0 s)");
    assert_eq!(waiting(&rig, 4), "its turn: 2 jobs run and 2 wait (since 0 s)");
    rig.check(request(1, Request::Get(JobId(3))), &["answer 1: Waiting Unspecified"]);
    rig.check(request(1, Request::Cancel(JobId(3))), &["store job 3 end: cancelled "]);
    assert_eq!(waiting(&rig, 4), "its turn: 2 jobs run and 1 wait (since 0 s)");
    rig.check(request(1, Request::Cancel(JobId(1))), &["store job 1 end: cancelled "]);
    rig.check(request(1, Request::Get(JobId(4))), &["answer 1: Running Unspecified"]);
}

#[test]
fn jobs_are_bounded() {
    let mut rig = Rig::new();
    let share = JOBS_MAX / CLIENT_SHARE_DIVISOR as usize;
    for client in ["a", "b", "c", ""] {
        for _ in 0..share {
            let job = JobId(rig.state.next_job);
            react(&mut rig.state, submit_for(client, 1, "", propagation(1)), rig.now);
            react(&mut rig.state, Event::Stored { job, key: RecordKey::Job }, rig.now);
        }
        if client == "a" {
            // The others still have their shares.
            let refusal = "answer 1: 2500 jobs of the client \"a\" wait or run already, the most that one \
                           client may have of the 10000 of all; submit again when some have ended, or \
                           cancel some";
            rig.check(submit_for("a", 1, "", propagation(1)), &[refusal]);
        }
    }
    let refusal = "answer 1: 10000 jobs of all clients wait or run already, the most allowed; submit again \
                   when some have ended";
    rig.check(submit_for("e", 1, "", propagation(1)), &[refusal]);
    rig.event(request(2, Request::Cancel(JobId(5))));
    rig.event(stored_event(5, RecordKey::End));
    rig.check(submit_for("a", 1, "", propagation(1)), &["store job 10001"]);
}

#[test]
fn jobs_are_listed_page_by_page() {
    let mut rig = Rig::new();
    for _ in 0..3 {
        rig.accept(propagation(1));
    }
    let page = |after| request(1, Request::List { after, limit: 2 });
    rig.check(page(None), &[r#"answer 1: ["1", "2"], more after Some(JobId(2))"#]);
    rig.check(page(Some(JobId(2))), &[r#"answer 1: ["3"], more after None"#]);
    rig.check(page(Some(JobId(3))), &["answer 1: [], more after None"]);
}

#[test]
fn a_change_is_published_with_the_next_tick_and_only_then() {
    let mut rig = Rig::with(100, &[1]);
    rig.check(Event::Tick, &["publish 1"]);
    rig.check(Event::Tick, &[]);
    rig.check(answer(1, 1, 0, 4), &["send 1: batch 3 = 8+8"]);
    rig.check(Event::Tick, &["publish 1"]);
    // If nothing but the time changes, a job is published once a second.
    rig.now += Duration::from_millis(999);
    rig.check(Event::Tick, &[]);
    rig.now += Duration::from_millis(1);
    rig.check(Event::Tick, &["publish 1"]);
}

#[test]
fn a_snapshot_tells_what_is_done() {
    let mut rig = Rig::with(100, &[1, 1]);
    rig.now = Duration::from_secs(2);
    rig.event(answer(1, 1, 0, 4));
    rig.now = Duration::from_secs(4);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!((snapshot.realizations_done, snapshot.realizations), (4, 100));
    assert_eq!((snapshot.evaluations, snapshot.max_evaluations), (0, 1));
    assert_eq!((snapshot.workers, snapshot.elapsed_s), (2, 4.0));
    assert_eq!(snapshot.realizations_per_second, 2.0);
    assert_eq!((snapshot.best_cost, snapshot.waiting_for.as_str()), (None, ""));
    rig.now = Duration::from_secs(8);
    let snapshot = crate::core::snapshot::job_snapshot(&rig.state, JobId(1), rig.now).unwrap();
    assert_eq!(
        snapshot.waiting_for,
        "the answer of node (process 42) to 4 realizations (since 8 s)"
    );
}

#[test]
fn a_drained_coordinator_stops_when_everything_is_stored() {
    let mut rig = Rig::with(1, &[1]);
    rig.check(answer(1, 1, 0, 1), &["store job 1 evaluation 0"]);
    rig.check(submit(3, "", propagation(2)), &["store job 2"]);
    let closed = "close 1: the coordinator is shutting down; attach again when it is back";
    rig.check(Event::Drain, &[closed]);
    let refusal = "answer 4: the coordinator is shutting down; try again when it is back";
    rig.check(submit(4, "", propagation(2)), &[refusal]);
    let closed = "close 2: the coordinator is shutting down; attach again when it is back";
    rig.check(hello(2, 1), &[closed]);
    rig.check(stored_event(2, RecordKey::Job), &["answer 3: job 2"]);
    rig.check(stored_event(1, RecordKey::Evaluation(0)), &["store job 1 end: converged "]);
    rig.check(stored_event(1, RecordKey::End), &["publish 1", "stop"]);
}
