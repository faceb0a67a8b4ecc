//! Batch sizes. A worker gets as many realizations as it computes in the target time by its
//! measured rate, but at most a quarter of its share of the remaining ones, so that all workers
//! finish together. While its share allows, no batch is smaller than the worker's slots.

use osteon_common::limits::BATCH_REALIZATIONS_MAX;

use crate::core::ids::JobId;
use crate::core::state::{AttachedWorker, State};

/// Realizations for each slot in a worker's first batch of a job: enough to measure its rate, few
/// enough to be answered soon.
const FIRST_BATCH_PER_SLOT: u32 = 4;
/// A batch holds at most this fraction (1 over the constant) of a worker's share of the remaining
/// realizations. It may hold more to give each of the worker's slots one realization, but never
/// more than the share.
const SHARE_DIVISOR: f64 = 4.0;

/// Returns the number of realizations of `job`, of which `queued` are left, that `attached` gets at
/// once: as many as it computes in the target time, at most a quarter of its share. Both limits
/// give way to one realization for each slot (a realization may take longer than the target, and a
/// share may hold fewer than four for each slot), but the share itself does not.
pub(crate) fn batch_size(state: &State, attached: &AttachedWorker, job: JobId, queued: u64) -> u64 {
    let per_slot = mean_rate_per_slot(state, job);
    let weight = |worker: &AttachedWorker| {
        worker.rates.get(&job).copied().unwrap_or(f64::from(worker.hello.slots) * per_slot)
    };
    let total: f64 = state.workers.values().filter(|it| state.is_sound(it)).map(weight).sum();
    let share = queued as f64 * weight(attached) / total;
    let slots = f64::from(attached.hello.slots);
    let most = (share / SHARE_DIVISOR).max(slots.min(share)).ceil();
    let target = match attached.rates.get(&job) {
        Some(rate) => rate * state.config.batch_target.as_secs_f64(),
        None => f64::from(FIRST_BATCH_PER_SLOT) * slots,
    };
    // `as` saturates, and converts NaN to 0.
    (target.max(slots).min(most) as u64).clamp(1, BATCH_REALIZATIONS_MAX.into())
}

/// Returns the mean rate of one slot at `job` over the workers with a measured rate; 1 if there is
/// none.
fn mean_rate_per_slot(state: &State, job: JobId) -> f64 {
    let measured = state
        .workers
        .values()
        .filter_map(|worker| Some((*worker.rates.get(&job)?, f64::from(worker.hello.slots))));
    let (rates, slots) = measured.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    if slots > 0.0 { rates / slots } else { 1.0 }
}
