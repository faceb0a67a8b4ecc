//! What a coordinator does about an event: synchronous functions from state, event and time to
//! effects. No socket, no clock, no task; a run is a function of its events and their times.

use std::time::Duration;

use crate::effect::Effect;
use crate::event::Event;
use crate::state::State;

mod ahead;
mod batches;
mod checks;
mod copies;
mod dispatch;
mod due;
mod expulsion;
mod jobs;
mod overdue;
mod prune;
mod requests;
mod reread;
mod restore;
mod suspects;
mod ticks;
mod workers;

pub(crate) use ahead::LIKELY_MAX;
pub(crate) use overdue::COPIES_MAX;
pub use restore::Restored;

#[cfg(test)]
mod tests;

/// Effects in the order in which they are to be done.
type Effects = Vec<Effect>;

/// Changes `state` by one event at `now`, and returns what is to be done.
pub fn react(state: &mut State, event: Event, now: Duration) -> Vec<Effect> {
    let mut effects = Vec::new();
    // A sign of life frees nobody, and there are many of them.
    let frees = !matches!(event, Event::Heartbeat { .. });
    match event {
        Event::Tick => ticks::tick(state, now, &mut effects),
        Event::Requested { token, request } => {
            requests::requested(state, token, request, now, &mut effects);
        }
        Event::Hello { worker, hello } => {
            workers::hello(state, worker, hello, now, &mut effects);
        }
        Event::Answered { worker, batch, solved, elapsed_s } => {
            batches::answered(state, worker, batch, solved, elapsed_s, now, &mut effects);
        }
        Event::Heartbeat { worker } => workers::heard(state, worker, now),
        Event::WorkerDrains { worker } => workers::drains(state, worker, now, &mut effects),
        Event::Misbehaved { worker, reason } => {
            workers::close(state, worker, reason, now, &mut effects);
        }
        Event::StreamEnded { worker } => workers::stream_ended(state, worker, now, &mut effects),
        Event::Stored { job, key } => jobs::stored(state, job, key, now, &mut effects),
        Event::StoreFailed { job, key, error } => {
            jobs::store_failed(state, job, key, error, now, &mut effects);
        }
        Event::Read { job, number, found } => {
            reread::read(state, job, number, found, now, &mut effects);
        }
        Event::Pruned { token, jobs, outcome } => {
            prune::pruned(state, token, jobs, outcome, &mut effects);
        }
        Event::Drain => workers::drain_all(state, now, &mut effects),
    }
    if frees {
        dispatch::hand_out(state, now, &mut effects);
    }
    if state.draining && state.unstored() == 0 {
        effects.push(Effect::Stop);
    }
    effects
}
