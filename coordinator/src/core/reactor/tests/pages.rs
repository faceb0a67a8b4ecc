//! Pages of jobs, newest first, and the history of a search that is followed.

use super::*;
use crate::core::event::JobChoice;

fn browse(which: JobChoice, before: Option<u64>, limit: usize) -> Event {
    request(7, Request::Browse { which, before: before.map(JobId), limit })
}

fn follow(job: u64, from: u64, limit: usize) -> Event {
    request(7, Request::Follow { job: JobId(job), from, limit })
}

/// Jobs 1 and 2 have ended, 3 and 4 run, 5 to 7 wait, and the submission of 8 is being stored.
fn rig() -> Rig {
    let mut rig = Rig::new();
    for job in 1..=2 {
        rig.accept(propagation(1));
        rig.event(request(1, Request::Cancel(JobId(job))));
        rig.event(stored_event(job, RecordKey::End));
    }
    for _ in 3..=7 {
        rig.accept(propagation(1));
    }
    rig.event(submit(0, "", propagation(1)));
    rig
}

#[test]
fn pages_are_newest_first_and_of_the_chosen_jobs() {
    let mut rig = rig();
    for (which, before, limit, jobs, more_after) in [
        (JobChoice::All, None, 9, &["7", "6", "5", "4", "3", "2", "1"][..], None),
        (JobChoice::All, None, 3, &["7", "6", "5"], Some(5)),
        (JobChoice::All, Some(5), 3, &["4", "3", "2"], Some(2)),
        (JobChoice::All, Some(2), 3, &["1"], None),
        (JobChoice::All, Some(1), 3, &[], None),
        (JobChoice::Running, None, 9, &["4", "3"], None),
        (JobChoice::Running, Some(4), 9, &["3"], None),
        (JobChoice::Waiting, None, 2, &["7", "6"], Some(6)),
        (JobChoice::Waiting, Some(6), 2, &["5"], None),
        (JobChoice::Ended, None, 1, &["2"], Some(2)),
        (JobChoice::Ended, Some(2), 1, &["1"], None),
    ] {
        let more_after = more_after.map(JobId);
        let expected = format!("answer 7: {jobs:?}, more after {more_after:?}");
        rig.check(browse(which, before, limit), &[&expected]);
    }
}

#[test]
fn a_search_is_followed_row_by_row_until_it_has_ended() {
    let mut rig = Rig::new();
    rig.accept(identification(1));
    rig.event(hello(1, 1));
    rig.check(follow(1, 0, 10), &["answer 7: rows 0"]);
    for number in 0..2 {
        rig.event(answer(1, number + 1, 0, 1));
        rig.event(stored_event(1, RecordKey::Evaluation(number)));
    }
    for (from, limit, count) in [(0, 10, 2), (0, 1, 1), (1, 10, 1), (2, 10, 0), (99, 10, 0)] {
        rig.check(follow(1, from, limit), &[&format!("answer 7: rows {count}")]);
    }
    rig.event(request(1, Request::Cancel(JobId(1))));
    rig.event(stored_event(1, RecordKey::End));
    rig.check(follow(1, 0, 10), &["answer 7: ended 1"]);
    rig.check(follow(2, 0, 10), &["answer 7: no such job: 2"]);
}
