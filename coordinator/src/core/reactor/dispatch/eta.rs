//! Expected completion times (ETAs) of batches, from the rates of their workers.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::core::batch::{Batch, Purpose};
use crate::core::bounded_duration::bounded_duration;
use crate::core::ids::JobId;
use crate::core::state::State;

/// Returns the ETA of the last batch of each evaluation that a search waits for.
pub(crate) fn etas(state: &State) -> BTreeMap<JobId, Duration> {
    let mut etas = BTreeMap::new();
    let asked_for = state.batches.values().filter(|it| it.purpose != Purpose::Speculative);
    for batch in asked_for {
        if let Some(answered) = batch_eta(state, batch) {
            let eta: &mut Duration = etas.entry(batch.assignment.job).or_default();
            *eta = answered.max(*eta);
        }
    }
    etas
}

/// Returns when a batch should be answered; `None` if its worker is gone.
fn batch_eta(state: &State, batch: &Batch) -> Option<Duration> {
    let worker = state.workers.get(&batch.worker)?;
    // Two batches of more than half a worker's slots each are computed one after the other.
    let is_large = |held: &Batch| 2 * held.assignment.indices.count > worker.hello.slots.into();
    if !is_large(batch) {
        return Some(batch.sent + expected_time(state, batch));
    }
    let held = worker.in_flight.iter().filter_map(|id| state.batches.get(id));
    let before = held.filter(|held| held.sent < batch.sent && is_large(held));
    let waits: Duration = before.map(|held| expected_time(state, held)).sum();
    Some(batch.sent.max(worker.answered) + waits + expected_time(state, batch))
}

/// Returns the expected time of a batch, or zero if its rate is unknown.
pub(crate) fn expected_time(state: &State, batch: &Batch) -> Duration {
    let rates = state.workers.get(&batch.worker).map(|worker| &worker.rates);
    let rate = rates.and_then(|rates| rates.get(&batch.assignment.job));
    rate.map_or(Duration::ZERO, |rate| {
        bounded_duration(batch.assignment.indices.count as f64 / rate)
    })
}
