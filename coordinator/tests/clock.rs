//! A wall clock that jumps. Within one run of a coordinator time is monotonic: the wall clock is
//! read once, at the start. BetweenPieces two runs it may have been set to anything, years before or
//! after the times in the store.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::collections::VecDeque;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_coordinator::config::Config;
use osteon_coordinator::core::effect::{Answer, Effect};
use osteon_coordinator::core::event::{Event, Request};
use osteon_coordinator::core::ids::{JobId, ReplyId};
use osteon_coordinator::core::reactor::{Restored, react};
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::Store as _;
use osteon_coordinator::store::job_output;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_proto::v1::{JobSnapshot, JobState};

const YEAR: Duration = Duration::from_secs(365 * 86_400);
const JOB: JobId = JobId(1);

/// Runs a coordinator from `now` on, with one worker, until it has made so many writes; returns the
/// last snapshot of the job.
fn live(
    store: &mut MemoryStore,
    specification: &JobSpecification,
    now: Duration,
    writes: usize,
) -> JobSnapshot {
    let restored = Restored::load(store).unwrap();
    let (mut state, effects) = State::restore(Config::default(), restored, now);
    let mut effects = VecDeque::from(effects);
    let request = fake::submission(specification, "the one");
    let submitted = Event::Requested { reply_id: ReplyId(1), request };
    for event in [submitted, fake::attached(1)] {
        effects.extend(react(&mut state, event, now));
    }
    let mut left = writes;
    while let Some(effect) = effects.pop_front() {
        let event = match effect {
            Effect::Send { worker, batch, work } => {
                Event::Answered { worker, batch, solved: fake::solved(&work), elapsed_s: 0.1 }
            }
            Effect::Store(record) => {
                left -= 1;
                fake::written(store, &record)
            }
            Effect::Read { job, number } => fake::read(store, job, number),
            _ => continue,
        };
        effects.extend(react(&mut state, event, now));
        if left == 0 {
            break;
        }
    }
    let get = Event::Requested { reply_id: ReplyId(2), request: Request::Get(JOB) };
    let answers = react(&mut state, get, now);
    let snapshot = answers.into_iter().find_map(|effect| match effect {
        Effect::Answer { answer: Answer::Snapshot(snapshot), .. } => Some(snapshot),
        _ => None,
    });
    snapshot.unwrap()
}

/// Runs three coordinators one after the other, starting at these clocks.
fn check(clocks: [Duration; 3]) {
    let specification = fake::identification(20, 8, 5);
    let mut store = MemoryStore::new();
    let mut evaluations = 0;
    // The job and three evaluations, three more, two more and the end.
    for (now, writes) in clocks.into_iter().zip([4, 3, 3]) {
        let seen = live(&mut store, &specification, now, writes);
        assert!(seen.evaluations > evaluations, "{clocks:?}: {seen:?}");
        evaluations = seen.evaluations;
        let most = clocks.iter().max().unwrap().as_secs_f64();
        assert!((0.0..=most).contains(&seen.elapsed_s), "{clocks:?}: {seen:?}");
        assert_eq!(seen.state() == JobState::Ended, now == clocks[2], "{clocks:?}: {seen:?}");
    }
    let jobs = store.jobs().unwrap();
    let result = job_output::read(&mut store, jobs[0].end.as_ref().unwrap()).unwrap().result;
    assert_eq!(result, fake::plain_run(&specification), "{clocks:?}");
}

#[test]
fn a_clock_that_was_set_between_two_lives_changes_no_result() {
    let now = 56 * YEAR;
    for clocks in [
        [now, now - YEAR, now - 2 * YEAR],
        [now, now + 10 * YEAR, now + 11 * YEAR],
        [now, now + 10 * YEAR, now + YEAR],
        [now, Duration::ZERO, now - YEAR],
    ] {
        check(clocks);
    }
}
