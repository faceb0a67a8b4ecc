//! Attachment, heartbeats, draining and loss of workers.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use osteon_common::limits::{NAME_BYTES_MAX, WORKER_THREADS_MAX, WORKERS_MAX};
use osteon_common::version;

use crate::core::audit::NextAudit;
use crate::core::close_reason::CloseReason;
use crate::core::crashes::{Cause, LostWorker};
use crate::core::effect::{Effect, Refusal};
use crate::core::event::Hello;
use crate::core::ids::{LeaseId, WorkerId};
use crate::core::notice::{Departure, Notice};
use crate::core::rate::Rate;
use crate::core::reactor::dispatch::{batches, departures, overdue, poison};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, MissedBatches, State};
use crate::core::worker_name::WorkerName;

pub(crate) fn on_hello(turn: &mut Turn, worker: WorkerId, hello: Hello) {
    if turn.state.workers.contains_key(&worker) {
        close(turn, worker, CloseReason::SecondHello);
        return;
    }
    if let Err(reason) = admit(turn.state, &hello, turn.now) {
        // A name that is too long is shortened before it is shown.
        let host: String = hello.host.chars().take(NAME_BYTES_MAX).collect();
        let name = WorkerName::new(&host, hello.process, hello.instance);
        let refused = Notice::WorkerRefused { worker, name, reason: reason.clone() };
        turn.effects.extend([Effect::Close { worker, reason }, Effect::Note(refused)]);
        return;
    }
    let lease = LeaseId(turn.state.next_lease);
    turn.state.next_lease += 1;
    let audits = (&turn.state.config.audit_key, turn.state.config.audit_fraction);
    let next_audit = NextAudit::first(audits, lease, hello.slots);
    let name = name(&hello);
    poison::forget_crashes(turn.state, &name);
    if turn.state.probation.attach(&name, turn.now) {
        // An earlier stay of the same worker may not have ended yet.
        overdue::follow_probation(turn.state);
    }
    turn.effects.push(Effect::Welcome { worker, lease });
    turn.effects.push(Effect::Note(Notice::WorkerAttached {
        worker,
        name: name.clone(),
        slots: hello.slots,
        version: hello.version.clone(),
    }));
    *turn.state.hosts.entry(name.host().to_owned()).or_default() += 1;
    turn.state.workers.insert(
        worker,
        AttachedWorker {
            lease,
            name,
            hello,
            attached: turn.now,
            last_seen: turn.now,
            answered: turn.now,
            has_answered: false,
            missed: MissedBatches::default(),
            heartbeat_sent: turn.now,
            in_flight: Vec::new(),
            proofs: Vec::new(),
            proven: BTreeSet::new(),
            early: Vec::new(),
            next_audit,
            settled: VecDeque::new(),
            rate: Rate::default(),
            rates: BTreeMap::new(),
            draining: false,
        },
    );
    turn.state.follow_fleet_change(worker);
}

pub(crate) fn note_sign_of_life(state: &mut State, worker: WorkerId, now: Duration) {
    if let Some(worker) = state.workers.get_mut(&worker) {
        worker.last_seen = now;
    }
}

pub(crate) fn on_draining(turn: &mut Turn, worker: WorkerId) {
    note_sign_of_life(turn.state, worker, turn.now);
    begin_draining(turn.state, worker);
    batches::preempt(turn, worker);
    departures::dismiss_if_drained(turn, worker);
}

/// Drains a worker: it receives no new work, and leaves when it has answered the batches that it
/// holds.
///
/// # Errors
/// When no such worker is attached.
pub(crate) fn drain_worker(turn: &mut Turn, worker: WorkerId) -> Result<(), Refusal> {
    let attached = turn.state.workers.get(&worker).ok_or(Refusal::NoWorker { worker })?;
    if !attached.draining {
        begin_draining(turn.state, worker);
        turn.effects.push(Effect::Drain { worker });
        batches::preempt(turn, worker);
    }
    Ok(())
}

/// Lets a worker accept no more batches.
pub(crate) fn begin_draining(state: &mut State, worker: WorkerId) {
    if let Some(attached) = state.workers.get_mut(&worker) {
        attached.draining = true;
        state.reorder(worker);
        state.fleet_changes += 1;
    }
}

/// Closes a worker's stream; the batches that it held are reassigned.
pub(crate) fn close(turn: &mut Turn, worker: WorkerId, reason: CloseReason) {
    if matches!(reason, CloseReason::Unanswering { .. })
        && let Some(name) = turn.state.workers.get(&worker).map(|worker| worker.name.clone())
    {
        overdue::begin_probation(turn.state, &name, turn.now, turn.now);
    }
    turn.effects.push(Effect::Close { worker, reason: reason.clone() });
    remove_lost(turn, worker, Departure::Closed(reason));
}

/// Handles the end of a worker's stream; the batches that it held are reassigned.
pub(crate) fn on_stream_ended(turn: &mut Turn, worker: WorkerId) {
    remove_lost(turn, worker, Departure::StreamEnded);
}

/// Removes a worker; the batches that it held are reassigned. Its later events are ignored.
fn remove_lost(turn: &mut Turn, worker: WorkerId, why: Departure) {
    let draining = turn.state.workers.get(&worker).is_some_and(|worker| worker.draining);
    let why = match why {
        // Its last batches were on their way when it began to drain, or took too long for it.
        Departure::StreamEnded | Departure::Closed(CloseReason::NotReading) if draining => {
            Departure::Left
        }
        why => why,
    };
    let cause = cause(&why);
    let Some(gone) = departures::depart(turn, worker, why) else {
        return;
    };
    let cause = if draining { Cause::Announced } else { cause };
    if cause != Cause::Announced && !gone.in_flight.is_empty() {
        turn.state.count_loss(&gone.name, turn.now);
    }
    let alone = gone.in_flight.len() == 1;
    let loss = LostWorker {
        worker: gone.name,
        cause,
        at: turn.now,
        alone,
        owed_proof: !gone.proofs.is_empty(),
        has_answered: gone.has_answered,
    };
    for batch in gone.in_flight {
        batches::give_back_orphan(turn.state, batch, &loss);
    }
}

/// Returns the cause of a loss, given the reason for the departure.
fn cause(why: &Departure) -> Cause {
    let reason = match why {
        Departure::StreamEnded => return Cause::StreamBroke,
        Departure::Left => return Cause::Announced,
        Departure::Closed(reason) => reason,
    };
    match reason {
        CloseReason::Drained | CloseReason::Draining | CloseReason::Banned { .. } => {
            Cause::Announced
        }
        CloseReason::Expired { .. } => Cause::LeaseExpired,
        CloseReason::Unanswering { .. }
        | CloseReason::NotReading
        | CloseReason::Malformed(_)
        | CloseReason::WrongCount { .. }
        | CloseReason::SecondHello
        | CloseReason::FingerprintDiffers { .. }
        | CloseReason::VersionDiffers { .. }
        | CloseReason::AttachesTooOften { .. }
        | CloseReason::ImpossibleVelocity { .. }
        | CloseReason::Slots { .. }
        | CloseReason::NameTooLong { .. }
        | CloseReason::TooManyWorkers { .. } => Cause::Misbehaviour,
    }
}

/// Begins the shutdown: no new batch is sent and every stream is closed, but records on their way
/// are awaited.
pub(crate) fn drain_all(turn: &mut Turn) {
    turn.state.draining = true;
    let workers: Vec<WorkerId> = turn.state.workers.keys().copied().collect();
    for worker in workers {
        // A drained worker is not held responsible for its batches.
        begin_draining(turn.state, worker);
        close(turn, worker, CloseReason::Draining);
    }
}

fn admit(state: &mut State, hello: &Hello, now: Duration) -> Result<(), CloseReason> {
    let coordinator = version::fingerprint();
    let longest =
        [&hello.version, &hello.fingerprint, &hello.host].into_iter().map(String::len).max();
    let bytes = longest.unwrap_or(0);
    let ban = state.ban(name(hello).host()).map(|ban| ban.reason.clone());
    if state.draining {
        Err(CloseReason::Draining)
    } else if bytes > NAME_BYTES_MAX {
        Err(CloseReason::NameTooLong { bytes, max: NAME_BYTES_MAX })
    } else if hello.fingerprint != coordinator {
        let worker = hello.fingerprint.clone();
        Err(CloseReason::FingerprintDiffers { worker, coordinator })
    } else if hello.version != version::VERSION {
        let (worker, coordinator) = (hello.version.clone(), version::VERSION);
        Err(CloseReason::VersionDiffers { worker, coordinator })
    } else if let Some(reason) = ban {
        Err(CloseReason::Banned { host: hello.host.clone(), reason })
    } else if hello.slots == 0 || hello.slots > WORKER_THREADS_MAX {
        Err(CloseReason::Slots { slots: hello.slots, max: WORKER_THREADS_MAX })
    } else if state.workers.len() >= WORKERS_MAX {
        Err(CloseReason::TooManyWorkers { limit: WORKERS_MAX })
    } else if state.attachments.exceed(&hello.host, now) {
        Err(CloseReason::AttachesTooOften { host: hello.host.clone() })
    } else {
        Ok(())
    }
}

fn name(hello: &Hello) -> WorkerName {
    WorkerName::new(&hello.host, hello.process, hello.instance)
}
