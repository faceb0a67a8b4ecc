//! Ended jobs take little memory: their output is in the store. After ten million realizations there is as much as after the
//! first two million.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;

use std::collections::VecDeque;
use std::time::Duration;

use osteon_common::job::Data;
use osteon_coordinator::config::Config;
use osteon_coordinator::core::effect::Effect;
use osteon_coordinator::core::event::{Event, Request};
use osteon_coordinator::core::ids::ReplyId;
use osteon_coordinator::core::reactor::react;
use osteon_coordinator::core::state::State;
use osteon_coordinator::store::sqlite::SqliteStore;

/// Returns the resident memory of this process, bytes.
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    text.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
}

/// Computes a job to its end.
fn run(state: &mut State, store: &mut SqliteStore, request: Request) {
    let requested = Event::Requested { reply_id: ReplyId(1), request };
    let mut effects = VecDeque::from(react(state, requested, Duration::ZERO));
    while let Some(effect) = effects.pop_front() {
        let events = match effect {
            Effect::Send { worker, batch, work } => {
                let solved = fake::solved(&work);
                vec![Event::Answered { worker, batch, solved, elapsed_s: 0.01 }]
            }
            Effect::Complete(completion) => {
                let mut events = Vec::new();
                let completed = completion.run(|outcomes| events.push(Event::Gathered(outcomes)));
                events.push(Event::Completed(completed));
                events
            }
            Effect::Store(record) => vec![fake::written(store, &record)],
            _ => continue,
        };
        for event in events {
            effects.extend(react(state, event, Duration::ZERO));
        }
    }
}

#[test]
fn ended_jobs_take_little_memory() {
    const REALIZATIONS: u64 = 200_000;
    const JOBS: u64 = 20;
    /// A fortieth of the outcomes of one evaluation.
    const BYTES_MAX: u64 = 80_000;

    let directory = tempfile::tempdir().unwrap();
    let mut store = SqliteStore::open(directory.path()).unwrap();
    let mut state = State::new(Config::default(), Duration::ZERO);
    react(&mut state, fake::attached(1), Duration::ZERO);
    let mut one_more = |seed| {
        let mut specification = fake::identification(REALIZATIONS, 2, seed);
        specification.data = Some(Data::from_velocities([3900.0, 3901.0].repeat(50_000)));
        run(&mut state, &mut store, fake::submission(&specification, ""));
        assert!(state.is_idle());
    };
    // The first jobs allocate memory that later ones reuse.
    (0..5).for_each(&mut one_more);
    let before = resident();
    (0..JOBS).for_each(&mut one_more);
    let each = resident().saturating_sub(before) / JOBS;
    println!("{each} bytes of each ended job are left");
    assert!(each < BYTES_MAX, "{each} bytes of each ended job are left");
}
