//! How many realizations a worker gets at once.

use osteon_common::limits::BATCH_REALIZATIONS_MAX;

use crate::ids::JobId;
use crate::state::{State, Worker};

/// Realizations for each thread in a worker's first batch of a job: enough to measure its rate,
/// little enough to be soon answered.
const FIRST_BATCH_PER_THREAD: u32 = 4;

/// A batch holds at most one in so many of a worker's share of what remains, and more only to
/// give each of the worker's threads one realization; never more than the share.
const SHARE_DIVISOR: f64 = 4.0;

/// Realizations of `job`, of which `queued` are left, that `attached` should get at once: what it
/// computes in the target time, at most a quarter of its share. Both limits give way to one
/// realization for each thread (a realization may take longer than the target, and a share may
/// hold fewer than four for each thread), the share itself does not.
pub(crate) fn batch_size(state: &State, attached: &Worker, job: JobId, queued: u64) -> u64 {
    let per_thread = mean_rate_per_thread(state, job);
    let weight = |worker: &Worker| {
        worker.rates.get(&job).copied().unwrap_or(f64::from(worker.hello.threads) * per_thread)
    };
    let total: f64 = state.workers.values().filter(|it| state.is_sound(it)).map(weight).sum();
    let share = queued as f64 * weight(attached) / total;
    let threads = f64::from(attached.hello.threads);
    let most = (share / SHARE_DIVISOR).max(threads.min(share)).ceil();
    let target = match attached.rates.get(&job) {
        Some(rate) => rate * state.config.batch_target.as_secs_f64(),
        None => f64::from(FIRST_BATCH_PER_THREAD) * threads,
    };
    // `as` saturates, and takes NaN for 0.
    (target.max(threads).min(most) as u64).clamp(1, BATCH_REALIZATIONS_MAX.into())
}

/// Mean rate of one thread at `job` over the workers that are measured; 1 if none is.
fn mean_rate_per_thread(state: &State, job: JobId) -> f64 {
    let measured = state
        .workers
        .values()
        .filter_map(|worker| Some((*worker.rates.get(&job)?, f64::from(worker.hello.threads))));
    let (rates, threads) = measured.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    if threads > 0.0 { rates / threads } else { 1.0 }
}
