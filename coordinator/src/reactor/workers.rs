//! Workers come, give signs of life, leave, and are lost.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use osteon_common::limits::{NAME_BYTES_MAX, WORKER_THREADS_MAX, WORKERS_MAX};
use osteon_common::version;

use super::{Effects, ahead, batches, overdue, suspects};
use crate::effect::{CloseReason, Effect, Refusal};
use crate::event::Hello;
use crate::ids::{LeaseId, WorkerId};
use crate::losses::{Cause, Loss};
use crate::notice::{Departure, Notice};
use crate::rate::Rate;
use crate::state::{DEPARTED_MAX, Departed, Missed, State, Worker};
use crate::worker_name::WorkerName;

pub(super) fn hello(
    state: &mut State,
    worker: WorkerId,
    hello: Hello,
    now: Duration,
    effects: &mut Effects,
) {
    if state.workers.contains_key(&worker) {
        close(state, worker, CloseReason::SecondHello, now, effects);
        return;
    }
    if let Err(reason) = admit(state, &hello) {
        // A name that is too long is not repeated as a whole.
        let host: String = hello.host.chars().take(NAME_BYTES_MAX).collect();
        let name = WorkerName::new(&host, hello.process, hello.instance);
        let refused = Notice::WorkerRefused { worker, name, reason: reason.clone() };
        effects.extend([Effect::Close { worker, reason }, Effect::Note(refused)]);
        return;
    }
    let lease = LeaseId(state.next_lease);
    state.next_lease += 1;
    let name = name(&hello);
    suspects::forgive(state, &name);
    state.probation.attach(&name, now);
    effects.push(Effect::Welcome { worker, lease });
    effects.push(Effect::Note(Notice::WorkerAttached {
        worker,
        name: name.clone(),
        threads: hello.threads,
        version: hello.version.clone(),
    }));
    state.workers.insert(
        worker,
        Worker {
            lease,
            name,
            hello,
            attached: now,
            heard: now,
            answered: now,
            proven: false,
            missed: Missed::default(),
            beat: now,
            in_flight: Vec::new(),
            settled: VecDeque::new(),
            rate: Rate::default(),
            rates: BTreeMap::new(),
            draining: false,
        },
    );
}

pub(super) fn heard(state: &mut State, worker: WorkerId, now: Duration) {
    if let Some(worker) = state.workers.get_mut(&worker) {
        worker.heard = now;
    }
}

pub(super) fn drains(state: &mut State, worker: WorkerId, now: Duration, effects: &mut Effects) {
    heard(state, worker, now);
    if let Some(attached) = state.workers.get_mut(&worker) {
        attached.draining = true;
    }
    ahead::give_back(state, worker, now, effects);
    dismiss_if_drained(state, worker, now, effects);
}

/// Sends a worker away: it gets nothing new, and leaves when it has answered what it holds.
///
/// # Errors
/// When no such worker is attached.
pub(super) fn send_away(
    state: &mut State,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) -> Result<(), Refusal> {
    let attached = state.workers.get_mut(&worker).ok_or(Refusal::NoWorker { worker })?;
    if !attached.draining {
        attached.draining = true;
        effects.push(Effect::Drain { worker });
        ahead::give_back(state, worker, now, effects);
    }
    Ok(())
}

/// Closes the stream of a worker that wanted to leave and holds nothing any more.
pub(super) fn dismiss_if_drained(
    state: &mut State,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) {
    let drained = |worker: &Worker| worker.draining && worker.in_flight.is_empty();
    if state.workers.get(&worker).is_some_and(drained) {
        close(state, worker, CloseReason::Drained, now, effects);
    }
}

/// Closes a worker's stream; what it held goes to others.
pub(super) fn close(
    state: &mut State,
    worker: WorkerId,
    reason: CloseReason,
    now: Duration,
    effects: &mut Effects,
) {
    if matches!(reason, CloseReason::Unanswering { .. })
        && let Some(name) = state.workers.get(&worker).map(|worker| worker.name.clone())
    {
        overdue::begin_probation(state, &name, now, now);
    }
    effects.push(Effect::Close { worker, reason: reason.clone() });
    lost(state, worker, Departure::Closed(reason), now, effects);
}

/// The stream of a worker ended; what it held goes to others.
pub(super) fn stream_ended(
    state: &mut State,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) {
    lost(state, worker, Departure::StreamEnded, now, effects);
}

/// Forgets a worker; what it held goes to others. Later events of it mean nothing.
fn lost(state: &mut State, worker: WorkerId, why: Departure, now: Duration, effects: &mut Effects) {
    let Some(gone) = state.workers.remove(&worker) else {
        return;
    };
    if state.workers.is_empty() {
        state.no_worker_since = now;
    }
    let batches = gone.in_flight.len();
    let cause = if gone.draining { Cause::Announced } else { cause(&why) };
    let name = gone.name.clone();
    let departed = Departed { worker, name: name.clone(), at: now, batches, why: why.clone() };
    state.departed.push_back(departed);
    if state.departed.len() > DEPARTED_MAX {
        state.departed.pop_front();
    }
    effects.push(Effect::Note(Notice::WorkerDetached { worker, name, batches, why }));
    if cause != Cause::Announced && !gone.in_flight.is_empty() {
        state.count_loss(&gone.name, now);
    }
    let alone = gone.in_flight.len() == 1;
    let loss = Loss { worker: gone.name, cause, at: now, alone, proven: gone.proven };
    for batch in gone.in_flight {
        batches::orphaned(state, batch, &loss);
    }
}

/// What the way in which a worker went says about it.
fn cause(why: &Departure) -> Cause {
    let Departure::Closed(reason) = why else {
        return Cause::StreamBroke;
    };
    match reason {
        CloseReason::Drained | CloseReason::Draining | CloseReason::Expelled { .. } => {
            Cause::Announced
        }
        CloseReason::Expired { .. } => Cause::Silence,
        CloseReason::Unanswering { .. }
        | CloseReason::NotReading
        | CloseReason::Malformed(_)
        | CloseReason::WrongCount { .. }
        | CloseReason::SecondHello
        | CloseReason::FingerprintDiffers { .. }
        | CloseReason::Threads { .. }
        | CloseReason::NameTooLong { .. }
        | CloseReason::TooManyWorkers { .. } => Cause::Misbehaviour,
    }
}

/// Begins the end: no new batch, every stream closed; records on their way are waited for.
pub(super) fn drain_all(state: &mut State, now: Duration, effects: &mut Effects) {
    state.draining = true;
    let workers: Vec<WorkerId> = state.workers.keys().copied().collect();
    for worker in workers {
        // A worker that is sent away is not to blame for what it held.
        if let Some(attached) = state.workers.get_mut(&worker) {
            attached.draining = true;
        }
        close(state, worker, CloseReason::Draining, now, effects);
    }
}

fn admit(state: &State, hello: &Hello) -> Result<(), CloseReason> {
    let coordinator = version::fingerprint();
    let longest =
        [&hello.version, &hello.fingerprint, &hello.host].into_iter().map(String::len).max();
    let bytes = longest.unwrap_or(0);
    let expulsion = state.expulsion(&name(hello));
    if state.draining {
        Err(CloseReason::Draining)
    } else if bytes > NAME_BYTES_MAX {
        Err(CloseReason::NameTooLong { bytes, max: NAME_BYTES_MAX })
    } else if hello.fingerprint != coordinator {
        let worker = hello.fingerprint.clone();
        Err(CloseReason::FingerprintDiffers { worker, coordinator })
    } else if let Some(expulsion) = expulsion {
        Err(CloseReason::Expelled { reason: expulsion.reason.clone() })
    } else if hello.threads == 0 || hello.threads > WORKER_THREADS_MAX {
        Err(CloseReason::Threads { threads: hello.threads, max: WORKER_THREADS_MAX })
    } else if state.workers.len() >= WORKERS_MAX {
        Err(CloseReason::TooManyWorkers { limit: WORKERS_MAX })
    } else {
        Ok(())
    }
}

fn name(hello: &Hello) -> WorkerName {
    WorkerName::new(&hello.host, hello.process, hello.instance)
}
