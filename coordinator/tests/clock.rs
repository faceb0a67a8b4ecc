//! A wall clock that jumps. Within one life of a coordinator time is monotonic: the wall clock is
//! read once, at the start. Between two lives it may have been set to anything, years back or
//! ahead of what the store has.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::collections::VecDeque;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_coordinator::config::Config;
use osteon_coordinator::effect::{Answer, Effect};
use osteon_coordinator::event::{Event, Request};
use osteon_coordinator::ids::{JobId, Token};
use osteon_coordinator::leftover;
use osteon_coordinator::reactor::{Restored, react};
use osteon_coordinator::state::State;
use osteon_coordinator::store::Store as _;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_proto::v1::{JobSnapshot, JobState};

const YEAR: Duration = Duration::from_secs(365 * 86_400);
const JOB: JobId = JobId(1);

/// One life from `now` on, with one worker, ended after so many writes; how the job stands then.
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
    let submitted = Event::Requested { token: Token(1), request };
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
    let get = Event::Requested { token: Token(2), request: Request::Get(JOB) };
    let answers = react(&mut state, get, now);
    let snapshot = answers.into_iter().find_map(|effect| match effect {
        Effect::Answer { answer: Answer::Snapshot(snapshot), .. } => Some(snapshot),
        _ => None,
    });
    snapshot.unwrap()
}

/// The first life at `clocks[0]`, the others at the others.
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
    let result = leftover::read(&mut store, jobs[0].end.as_ref().unwrap()).unwrap().result;
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
