//! Snapshots of the workers, as clients see them.

use std::time::Duration;

use osteon_proto::timestamp;
use osteon_proto::v1::{DepartedWorker, ListWorkersResponse, WorkerSnapshot, WorkerState};

use crate::core::ids::WorkerId;
use crate::core::state::{AttachedWorker, Departed, State};

/// Returns the attached workers, and those that departed last.
pub(crate) fn all(state: &State, now: Duration) -> ListWorkersResponse {
    ListWorkersResponse {
        workers: state.workers.iter().map(|(id, it)| snapshot(state, *id, it, now)).collect(),
        departed: state.departed.iter().rev().map(departed_worker).collect(),
    }
}

/// Returns the snapshot of a worker; `None` if it is not attached.
pub(crate) fn worker_snapshot(
    state: &State,
    worker: WorkerId,
    now: Duration,
) -> Option<WorkerSnapshot> {
    state.workers.get(&worker).map(|attached| snapshot(state, worker, attached, now))
}

fn snapshot(state: &State, id: WorkerId, worker: &AttachedWorker, now: Duration) -> WorkerSnapshot {
    let held = worker.in_flight.iter().filter_map(|batch| state.batches.get(batch));
    let oldest = held.map(|batch| batch.sent).min();
    WorkerSnapshot {
        worker: id.0,
        host: worker.name.host().to_owned(),
        process: worker.name.process(),
        slots: worker.hello.slots,
        version: worker.hello.version.clone(),
        attach_time: Some(timestamp::to_message(worker.attached)),
        silent_s: now.saturating_sub(worker.last_seen).as_secs_f64(),
        realizations_per_second: worker.rate.per_second(now),
        batches: u32::try_from(worker.in_flight.len()).unwrap_or(u32::MAX),
        oldest_batch_s: oldest.map(|sent| now.saturating_sub(sent).as_secs_f64()),
        state: worker_state(state, worker).into(),
    }
}

/// Returns the state of an attached worker, never unspecified.
pub(crate) fn worker_state(state: &State, worker: &AttachedWorker) -> WorkerState {
    if worker.draining {
        WorkerState::Draining
    } else if state.is_failing(worker.name.host()) {
        WorkerState::Distrusted
    } else if state.probation.has(&worker.name) {
        WorkerState::Probation
    } else {
        WorkerState::Ok
    }
}

fn departed_worker(gone: &Departed) -> DepartedWorker {
    DepartedWorker {
        worker: gone.worker.0,
        host: gone.name.host().to_owned(),
        process: gone.name.process(),
        depart_time: Some(timestamp::to_message(gone.at)),
        reason: gone.why.to_string(),
        batches: u32::try_from(gone.batches).unwrap_or(u32::MAX),
    }
}
