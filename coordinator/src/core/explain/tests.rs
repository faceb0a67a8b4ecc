//! One row for each reason why a job is not faster, by the facts that decide it.

use super::*;
use crate::core::ids::{JobId, WorkerId};
use crate::core::worker_name::WorkerName;

fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// A search that computes as fast as the attached workers can: two slots, and nobody else's jobs.
fn facts() -> JobFacts {
    JobFacts {
        job: JobId(7),
        standing: Standing::Computing,
        is_search: true,
        refusal: None,
        stopping: false,
        unanswered: Duration::ZERO,
        running: 1,
        waiting: 0,
        higher: 0,
        other_clients: 0,
        workers: 2,
        draining: 0,
        on_probation: 0,
        reliable: 2,
        without_workers: s(3),
        slots: 16,
        slots_used: 16.0,
        slots_of_others: 0.0,
        realizations: 1000,
        parts_left: 1,
        filled: 400,
        queued: 500,
        quarantined: 0,
        disputed: None,
        oldest: None,
        rate: 300.0,
    }
}

fn oldest(out: u64, duplicates: u64) -> Option<OldestBatch> {
    let (worker, name) = (WorkerId(3), WorkerName::new("node-7", 4711, 1));
    Some(OldestBatch { worker, name, count: 5, out: s(out), duplicates, overdue: duplicates == 0 })
}

#[track_caller]
fn check(facts: JobFacts, reason: PaceReason, parts: &[&str]) -> ExplainResponse {
    let explained = explanation(&facts);
    assert_eq!(explained.reason(), reason, "{}", explained.text);
    for part in parts {
        assert!(explained.text.contains(part), "{part} in: {}", explained.text);
    }
    explained
}

#[test]
fn what_runs_runs_at_the_speed_of_its_slots() {
    let told = check(
        facts(),
        PaceReason::Computing,
        &["16 of 16 slots", "300 realizations per second", "about 2.0 s more", "More workers"],
    );
    assert_eq!((told.job.as_str(), told.slots, told.slots_used), ("7", 16, 16.0));
    assert_eq!((told.realizations_left, told.expected_s), (600, Some(2.0)));
    assert_eq!((told.waiting_s, told.worker), (None, None));
    let idle = JobFacts { rate: 0.0, ..facts() };
    assert_eq!(check(idle, PaceReason::Computing, &["answered lately"]).expected_s, None);
    let nearly = JobFacts { filled: 990, queued: 0, ..facts() };
    check(nearly, PaceReason::Computing, &["needs less than 0.1 s more"]);
    // A record that has just been handed to the store delays nothing.
    let storing = JobFacts { standing: Standing::Storing, filled: 1000, queued: 0, ..facts() };
    assert_eq!(check(storing, PaceReason::Computing, &["is being stored"]).expected_s, None);
}

#[test]
fn what_has_ended_says_how() {
    let ended = |reason: &str| {
        let standing = Standing::Ended { status: "failed", reason: reason.to_owned() };
        JobFacts { standing, rate: 0.0, ..facts() }
    };
    check(ended(""), PaceReason::Ended, &["It has ended: failed."]);
    let told = check(ended("no feasible point"), PaceReason::Ended, &["failed; no feasible point"]);
    assert_eq!(told.realizations_left, 0);
}

#[test]
fn what_stops_a_job_comes_before_what_slows_it() {
    let slow = || JobFacts { slots_of_others: 20.0, oldest: oldest(30, 0), ..facts() };
    let refusal = Some(("disk full".to_owned(), s(12)));
    let refused = check(
        JobFacts { refusal, stopping: true, ..slow() },
        PaceReason::StoreRefuses,
        &["disk full", "for 12 s"],
    );
    assert_eq!(refused.waiting_s, Some(12.0));
    check(JobFacts { stopping: true, ..slow() }, PaceReason::Stopping, &["next one"]);
    let waiting = JobFacts {
        standing: Standing::Waiting,
        unanswered: s(60),
        running: 64,
        waiting: 1,
        ..slow()
    };
    check(waiting, PaceReason::WaitingForTurn, &["for 60 s", "64 jobs running and 1 waiting"]);
    let reading = JobFacts { standing: Standing::Reading { read: 3, stored: 9 }, ..slow() };
    check(reading, PaceReason::ReadingStore, &["3 of 9"]);
    let storing = JobFacts { standing: Standing::Storing, unanswered: s(4), ..slow() };
    check(storing, PaceReason::StoreSlow, &["for 4 s", "local"]);
}

#[test]
fn what_workers_lack_is_told() {
    let none = JobFacts { workers: 0, reliable: 0, slots: 0, ..facts() };
    let told = check(none, PaceReason::NoWorkers, &["for 3 s", "Start workers"]);
    assert_eq!(told.waiting_s, Some(3.0));
    let disputed = JobFacts { disputed: Some(s(8)), ..facts() };
    check(disputed, PaceReason::Dispute, &["8 s ago", "third"]);
    let unfit = JobFacts { quarantined: 2, reliable: 0, ..facts() };
    check(unfit, PaceReason::UnreliableWorkers, &["2 realizations", "another host"]);
    // A reliable worker gets it in a moment.
    check(JobFacts { quarantined: 2, ..facts() }, PaceReason::Computing, &[]);
    let away = JobFacts { slots: 0, draining: 1, on_probation: 2, workers: 3, ..facts() };
    let parts = ["of 3, 1 drains and 2 are on probation"];
    check(away, PaceReason::WorkersUnavailable, &parts);
}

#[test]
fn the_last_realizations_name_the_worker_that_computes_them() {
    let last = |out, duplicates| JobFacts {
        queued: 0,
        filled: 995,
        oldest: oldest(out, duplicates),
        ..facts()
    };
    let told = check(
        last(12, 0),
        PaceReason::LastRealizations,
        &["5 of 1000", "node-7", "4711", "12 s", "No other worker is free"],
    );
    assert_eq!((told.worker, told.waiting_s), (Some(3), Some(12.0)));
    check(last(12, 1), PaceReason::LastRealizations, &["Another worker computes the same"]);
    check(last(12, 2), PaceReason::LastRealizations, &["Others compute the same"]);
    // Young batches are answered in a moment, and while others wait, more workers would help.
    check(last(0, 0), PaceReason::Computing, &[]);
    check(JobFacts { queued: 1, ..last(12, 0) }, PaceReason::Computing, &[]);
}

#[test]
fn other_jobs_come_first_for_a_reason() {
    let shared = || JobFacts { slots_used: 4.0, slots_of_others: 12.0, ..facts() };
    let parts = ["4 of 16 slots", "Other jobs use 12 slots"];
    check(
        JobFacts { higher: 1, ..shared() },
        PaceReason::OtherJobs,
        &["1 job of the same user has"],
    );
    check(
        JobFacts { higher: 2, ..shared() },
        PaceReason::OtherJobs,
        &["2 jobs", "higher priority"],
    );
    check(
        JobFacts { other_clients: 3, ..shared() },
        PaceReason::OtherJobs,
        &["3 other users have"],
    );
    check(JobFacts { other_clients: 1, ..shared() }, PaceReason::OtherJobs, &["1 other user has"]);
    check(shared(), PaceReason::OtherJobs, &["take turns"]);
    check(shared(), PaceReason::OtherJobs, &parts);
    // Others that use less are not what limits it.
    let few = JobFacts { slots_used: 12.0, slots_of_others: 4.0, ..facts() };
    check(few, PaceReason::Computing, &[]);
}

#[test]
fn a_sequential_search_cannot_use_more_slots_than_realizations() {
    let few = || JobFacts { realizations: 10, filled: 4, queued: 0, slots: 64, ..facts() };
    let parts = ["one point after another", "10 realizations each", "do not make it faster"];
    check(few(), PaceReason::FewRealizations, &parts);
    let propagation = check(
        JobFacts { is_search: false, ..few() },
        PaceReason::FewRealizations,
        &["It has 10 realizations"],
    );
    assert!(!propagation.text.contains("search"), "{}", propagation.text);
    // Its groups and starts are computed at the same time.
    check(JobFacts { parts_left: 7, ..few() }, PaceReason::Computing, &[]);
}
