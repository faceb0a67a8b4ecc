//! Synchronous functions from state, event and time to effects: the coordinator's reaction to each
//! event. They use no socket, clock or task; a run is a function of its events and their times.
//!
//! There are three layers, each of which calls only those below it:
//!
//! - `integrity` decides which answers count: it takes in answers, compares them, settles disputes
//!   and bans workers;
//! - `lifecycle` manages jobs, their records, client requests, and the arrival and departure of
//!   workers;
//! - `dispatch` decides which worker computes what: it sends batches, duplicates, audits and
//!   speculative batches.
//!
//! No two files call each other in a circle (`tests/circles.rs`). A lower layer returns what an
//! upper one must act on: the failure of a job, or an evaluation that may be complete.

use std::time::Duration;

use crate::core::effect::{Effect, RecordKey};
use crate::core::event::Event;
use crate::core::state::State;

use self::integrity::{answers, bans, checks};
use self::lifecycle::{jobs, prune, recheck, records, replay, requests, ticks, workers};
use self::turn::Turn;

mod dispatch;
mod integrity;
mod lifecycle;
mod turn;

pub(crate) use dispatch::batches::realizations_held;
pub use lifecycle::restore::Restored;

#[cfg(test)]
mod tests;

/// Changes `state` by one event at `now`, and returns the effects to be carried out.
pub fn react(state: &mut State, event: Event, now: Duration) -> Vec<Effect> {
    let mut turn = Turn::new(state, now);
    // A heartbeat makes no worker free, and heartbeats are frequent.
    let frees = !matches!(event, Event::Heartbeat { .. } | Event::Connections { .. });
    turn.state.condition.note(&event, turn.now);
    apply(&mut turn, event);
    if frees {
        dispatch::dispatch(&mut turn);
    }
    if turn.state.draining && turn.state.unstored_records() == 0 {
        turn.effects.push(Effect::Stop);
    }
    turn.effects
}

fn apply(turn: &mut Turn, event: Event) {
    match event {
        Event::Tick => tick(turn),
        Event::Requested { reply_id, request } => requests::handle_request(turn, reply_id, request),
        Event::Hello { worker, hello } => workers::on_hello(turn, worker, hello),
        Event::Answered { worker, batch, solved, elapsed_s } => {
            answers::take_answer(turn, worker, batch, solved, elapsed_s);
        }
        Event::Heartbeat { worker } => workers::note_sign_of_life(turn.state, worker, turn.now),
        Event::WorkerDrains { worker } => workers::on_draining(turn, worker),
        Event::Misbehaved { worker, reason } => workers::close(turn, worker, reason),
        Event::StreamEnded { worker } => workers::on_stream_ended(turn, worker),
        Event::Gathered(gathered) => jobs::store_gathered(turn, gathered),
        Event::Completed(completed) => records::on_completed(turn, completed),
        Event::Stored { key: RecordKey::Ban(number), .. } => bans::on_ban_stored(turn, number),
        Event::Stored { job, key } => records::on_record_stored(turn, job, key),
        Event::StoreFailed { key: RecordKey::Ban(number), error, .. } => {
            bans::on_ban_not_stored(turn, number, error);
        }
        Event::StoreFailed { job, key, error } => {
            records::on_record_not_stored(turn, job, key, error)
        }
        Event::Read { job, number, found } => replay::on_read(turn, job, number, found),
        Event::Pruned { reply_id, jobs, outcome } => {
            prune::on_pruned(turn, reply_id, jobs, outcome)
        }
        Event::Doubted { ban, jobs } => {
            recheck::note_doubts(turn, ban, jobs);
        }
        Event::Reopened { reply_id, job, outcome } => {
            recheck::on_reopened(turn, reply_id, job, outcome)
        }
        // Noted for all events.
        Event::Connections { .. } | Event::LogCopied | Event::LogStuck { .. } => {}
        Event::Drain => {
            ticks::save_parts(turn, true);
            workers::drain_all(turn);
        }
    }
}

/// Reacts to the passing of time.
fn tick(turn: &mut Turn) {
    ticks::compensate_gap(turn.state, turn.now);
    ticks::expire(turn);
    ticks::send_heartbeats(turn);
    dispatch::overdue::tick(turn);
    checks::give_up(turn);
    if !turn.state.draining {
        ticks::save_parts(turn, false);
        ticks::store_pieces(turn);
        ticks::fail_poisoned(turn);
        ticks::store_again(turn);
        bans::store_again(turn);
        prune::tick(turn);
    }
    ticks::publish(turn);
    ticks::tell_concerns(turn);
}
