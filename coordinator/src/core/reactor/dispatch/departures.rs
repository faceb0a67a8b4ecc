//! Removes workers that depart.

use crate::core::close_reason::CloseReason;
use crate::core::effect::Effect;
use crate::core::ids::WorkerId;
use crate::core::notice::{Departure, Notice};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, DEPARTED_MAX, Departed};

/// Closes the stream of a draining worker that holds no batch any more.
pub(crate) fn dismiss_if_drained(turn: &mut Turn, worker: WorkerId) {
    let drained = |worker: &AttachedWorker| worker.draining && worker.in_flight.is_empty();
    if turn.state.workers.get(&worker).is_some_and(drained) {
        let reason = CloseReason::Drained;
        turn.effects.push(Effect::Close { worker, reason: reason.clone() });
        depart(turn, worker, Departure::Closed(reason));
    }
}

/// Removes a worker from the state and returns it: its later events are ignored. The caller returns
/// the batches that it held to the queue.
pub(crate) fn depart(turn: &mut Turn, worker: WorkerId, why: Departure) -> Option<AttachedWorker> {
    let gone = turn.state.workers.remove(&worker)?;
    for proof in &gone.proofs {
        turn.state.settle(*proof);
    }
    if let Some(count) = turn.state.hosts.get_mut(gone.name.host()) {
        *count -= 1;
        if *count == 0 {
            turn.state.hosts.remove(gone.name.host());
        }
    }
    turn.state.follow_fleet_change(worker);
    if turn.state.workers.is_empty() {
        turn.state.no_worker_since = turn.now;
    }
    let (name, batches) = (gone.name.clone(), gone.in_flight.len());
    let departed = Departed { worker, name: name.clone(), at: turn.now, batches, why: why.clone() };
    turn.state.departed.push_back(departed);
    if turn.state.departed.len() > DEPARTED_MAX {
        turn.state.departed.pop_front();
    }
    turn.effects.push(Effect::Note(Notice::WorkerDetached { worker, name, batches, why }));
    Some(gone)
}
