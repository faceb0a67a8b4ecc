//! Ended jobs are deleted on request, or when they are old.

use super::*;
use crate::core::event::Retention;

const MINUTE: Duration = Duration::from_secs(60);

/// Returns a rig with jobs 1, 2 and 3, which ended after one, two and three minutes, and job 4,
/// which waits.
fn rig() -> Rig {
    let mut rig = Rig::new();
    for job in 1..=3 {
        rig.now += MINUTE;
        rig.event(submit(1, &format!("request {job}"), propagation(1)));
        rig.event(stored_event(job, RecordKey::Job));
        rig.event(request(1, Request::Cancel(JobId(job))));
        rig.event(stored_event(job, RecordKey::End));
    }
    rig.accept(propagation(1));
    rig
}

fn prune(keep_for: Option<Duration>, keep_last: Option<u64>) -> Event {
    request(7, Request::Prune(Retention { keep_for, keep_last }))
}

fn pruned_event(jobs: &[u64], outcome: Result<(), String>) -> Event {
    let jobs = jobs.iter().map(|job| JobId(*job)).collect();
    Event::Pruned { reply_id: Some(ReplyId(7)), jobs, outcome }
}

#[test]
fn what_is_not_kept_is_forgotten() {
    let mut rig = rig();
    for (keep_for, keep_last, expected) in [
        (None, None, "prune 1 2 3"),
        (None, Some(2), "prune 1"),
        (None, Some(3), "answer 7: pruned 0"),
        (Some(MINUTE), None, "prune 1"),
        (Some(MINUTE / 2), None, "prune 1 2"),
        (Some(MINUTE / 2), Some(2), "prune 1"),
        (Some(MINUTE * 9), None, "answer 7: pruned 0"),
    ] {
        rig.check(prune(keep_for, keep_last), &[expected]);
    }
}

#[test]
fn a_job_is_there_until_the_store_has_forgotten_it() {
    let mut rig = rig();
    rig.check(prune(None, Some(1)), &["prune 1 2"]);
    rig.check(request(8, Request::Fetch(JobId(1))), &["answer 8: ended 1"]);
    let refusal = "answer 7: the store cannot delete the ended jobs; none was deleted: it is full";
    rig.check(pruned_event(&[1, 2], Err("it is full".to_owned())), &[refusal]);
    rig.check(request(8, Request::Fetch(JobId(1))), &["answer 8: ended 1"]);
    rig.check(pruned_event(&[1, 2], Ok(())), &["answer 7: pruned 2"]);
    let gone = "answer 8: no such job: 1";
    rig.check(request(8, Request::Fetch(JobId(1))), &[gone]);
    // Its request id is free again, those of the others are not.
    rig.check(submit(9, "request 1", propagation(2)), &["store job 5"]);
    rig.check(submit(9, "request 3", propagation(1)), &["answer 9: job 3"]);
}

#[test]
fn old_jobs_are_forgotten_unasked() {
    let mut rig = rig();
    rig.state.config.keep_ended = Some(MINUTE * 3);
    rig.check_after(Duration::from_secs(61), &["prune 1"]);
    rig.check(Event::Pruned { reply_id: None, jobs: vec![JobId(1)], outcome: Ok(()) }, &[]);
    // Old jobs are searched for once a minute.
    rig.check_after(Duration::from_secs(59), &[]);
    rig.check_after(Duration::from_secs(1), &["prune 2"]);
}

#[test]
fn a_clock_that_is_far_ahead_forgets_nothing_at_once() {
    const DAY: Duration = Duration::from_secs(86_400);
    for (keep, grace) in [(90 * DAY, 60 * MINUTE), (5 * MINUTE, 5 * MINUTE)] {
        let mut rig = rig();
        rig.state.config.keep_ended = Some(keep);
        // The next run of the coordinator, on the same jobs.
        rig.now += 3650 * DAY;
        (rig.state.started, rig.state.pruned) = (rig.now, None);
        rig.check_after(Duration::ZERO, &[]);
        rig.check_after(grace - MINUTE, &[]);
        rig.check_after(MINUTE, &["prune 1 2 3"]);
        // A client's request is served all the same.
        rig.check(prune(Some(keep), None), &["prune 1 2 3"]);
    }
}
