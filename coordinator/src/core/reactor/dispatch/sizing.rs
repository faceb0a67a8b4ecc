//! Batch sizes.
//!
//! A worker gets as many realizations as it computes in the target time at its measured rate, but at
//! most a quarter of its share of the remaining ones, so that all workers finish together. As long as
//! its share allows, a batch has a realization for each of the worker's slots.
//!
//! Each batch also takes time of the coordinator, which serves one after another. If many workers share
//! little work, batches of a quarter of a share would not be worth that time. Then fewer workers get
//! larger batches. How long these take follows from the time R that one worker would take for all that is
//! left, and the time c that a batch costs the coordinator:
//!
//! - Batches of the time b cost c R / b in all. The sum b + c R / b is smallest for b = √(R c).
//! - A batch need not take longer than c times the number of workers: by then the coordinator has
//!   served every other worker.
//! - If there are enough workers for one such batch each, R is the time of the whole evaluation, not
//!   of what is left, so that all batches are equal.

use osteon_common::limits::BATCH_REALIZATIONS_MAX;

use super::ahead;
use crate::core::ids::JobId;
use crate::core::job::{FleetRate, Job};
use crate::core::policy::{
    AUDIT_S, BATCH_COST_S, BATCH_WORTH_S, FIRST_BATCH_PER_SLOT, RATED_WORKERS_MIN, SHARE_DIVISOR,
};
use crate::core::state::{AttachedWorker, State};

/// Returns the number of realizations of `job` that `attached` gets at once. In the evaluation that is
/// served, `queued` realizations are left, in other evaluations of the job `further`.
///
/// The usual size is what the worker computes in the target time, at most a quarter of its share. It
/// differs from that in these cases:
///
/// - A batch has a realization for each slot, even if that takes longer than the target time or is more
///   than a quarter of the share; but not if it is more than the share.
/// - A batch that is only so worth its cost may exceed the share.
/// - A worker of unknown speed gets a small batch, with a realization for each slot whatever its share.
///   If the speeds of enough others are known, it counts as equally fast, and the batch takes just long
///   enough to be worth its cost.
/// - With further evaluations, a batch takes just long enough to be worth its cost: each evaluation is
///   one of a chain and should soon be complete. The batches of one are of about equal size.
pub(crate) fn batch_size(
    state: &State,
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    (queued, further): (u64, u64),
) -> u64 {
    let slots = f64::from(attached.hello.slots);
    let measured = attached.rates.get(&job).copied();
    let rate = worker_rate(attached, job, fleet);
    let weight = rate.unwrap_or(slots * fleet.per_slot);
    // A worker may be faster than the fleet was when it was measured.
    let left = (queued + further) as f64;
    let share = left * (weight / fleet.total.max(weight));
    let all = realizations(state, job);
    let worth_s =
        rate.map_or(BATCH_WORTH_S, |rate| worthwhile_s(left / rate, all / rate, fleet.workers));
    let worth = rate.map_or(0.0, |rate| (worth_s * rate).min(left));
    let target_s = state.config.batch_target.as_secs_f64();
    // As long as nothing is known, one for each slot takes no longer than fewer.
    let filled = if rate.is_some() { slots.min(share) } else { slots };
    let most = (share / SHARE_DIVISOR).max(filled).max(worth).ceil();
    let target = match rate {
        Some(rate) if further > 0 => rate * BATCH_WORTH_S.min(target_s),
        Some(rate) if measured.is_none() => rate * BATCH_WORTH_S.max(worth_s).min(target_s),
        Some(rate) => rate * target_s,
        None => f64::from(FIRST_BATCH_PER_SLOT) * slots,
    };
    // `as` saturates, and converts NaN to 0.
    let size = (target.max(slots).min(most) as u64).clamp(1, BATCH_REALIZATIONS_MAX.into());
    if further == 0 { size } else { queued.div_ceil(queued.div_ceil(size).max(1)) }
}

/// Returns whether all workers together compute a whole evaluation of `job` in the time of one batch of `size`.
/// Then `attached`, which holds a batch, should not get a second one: a worker that is about to be idle would
/// complete it sooner. If there are other jobs, or evaluations of other parts of the search, workers may hold
/// batches of these, and none is waited for.
pub(crate) fn is_one_batch_each(
    state: &State,
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    size: u64,
) -> bool {
    let is_alone = |job: &Job| {
        state.active.len() == 1
            && ahead::remaining_realizations(job) == 0
            && job.ahead.evaluations().next().is_none()
    };
    let suffices = |rate| realizations(state, job) <= size as f64 / rate * fleet.total;
    state.jobs.get(&job).is_some_and(is_alone)
        && worker_rate(attached, job, fleet).is_some_and(suffices)
}

/// Returns how many realizations of an answer are audited together at least: one for each slot, because these
/// take another worker no longer than one; more if they take so little time that the batch would cost more.
pub(crate) fn audit_least(attached: &AttachedWorker, job: JobId) -> u64 {
    let rate = attached.rates.get(&job).copied().unwrap_or_default();
    // `as` saturates, and converts NaN to 0.
    ((rate * AUDIT_S) as u64).max(attached.hello.slots.into())
}

/// Returns how many of the `audited` realizations of one audit a worker gets at once when nothing else waits
/// to be sent. An evaluation waits for its last audits, and many workers compute them sooner than one.
/// `waiting` is the number of realizations in all audits that wait.
pub(crate) fn audit_size(
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    (audited, waiting): (u64, u64),
) -> u64 {
    let best_size = |rate: f64| (rate * best_s(waiting as f64 / rate)).ceil() as u64;
    let size = worker_rate(attached, job, fleet).map_or(audited, best_size);
    // The worker whose answer is audited computes no part of its audit.
    let others = fleet.workers.saturating_sub(1).max(1) as u64;
    size.max(attached.hello.slots.into()).max(audited.div_ceil(others)).min(audited)
}

/// Returns the number of realizations of an evaluation of a job.
fn realizations(state: &State, id: JobId) -> f64 {
    let job = state.jobs.get(&id);
    job.map_or(0, |job| job.record.specification.monte_carlo.realizations) as f64
}

/// Returns the rate of a worker at a job, realizations per second: as measured, or else the mean rate of
/// the others for as many slots; `None` if too few of them are known.
pub(crate) fn worker_rate(attached: &AttachedWorker, job: JobId, fleet: FleetRate) -> Option<f64> {
    let mean_of_others = || f64::from(attached.hello.slots) * fleet.per_slot;
    let is_known = fleet.rated_workers >= RATED_WORKERS_MIN;
    attached.rates.get(&job).copied().or_else(|| is_known.then(mean_of_others))
}

/// Returns the time, s, that a batch should take at least to be worth its cost. One worker would take `left_s`
/// for all that is left, and `all_s` for the whole evaluation. If there are enough workers for one batch each, all
/// batches are equal. Otherwise they become smaller as less is left, so that all workers finish together.
fn worthwhile_s(left_s: f64, all_s: f64, workers: usize) -> f64 {
    let round_s = workers as f64 * BATCH_COST_S;
    let basis_s = if are_enough_workers(workers, all_s) { all_s.max(left_s) } else { left_s };
    best_s(basis_s).min(round_s.max(BATCH_WORTH_S))
}

/// Returns whether there are enough workers for one batch each of an evaluation for which one of them would take
/// `all_s`.
fn are_enough_workers(workers: usize, all_s: f64) -> bool {
    all_s <= best_s(all_s) * workers as f64
}

/// Returns the time, s, of batches for which the sum of this time and of the cost of all batches is smallest, if
/// one worker would take `left_s` for all that is left.
fn best_s(left_s: f64) -> f64 {
    (left_s * BATCH_COST_S).sqrt()
}

/// Returns the number of batches that the coordinator serves in this time, s.
pub(crate) fn batches_served_within(seconds: f64) -> usize {
    // `as` saturates, and converts NaN to 0.
    (seconds / BATCH_COST_S) as usize
}

/// Returns the rate of all workers at a job. It is measured again after as many batches as there are
/// workers, so that measuring costs each batch the look at one worker; and at once if workers came or
/// went, or if twice as many of them have computed something of the job.
pub(crate) fn fleet_rate(state: &mut State, id: JobId) -> FleetRate {
    let (uses_max, changes) = (state.workers.len() as u64, state.fleet_changes);
    if let Some(Job { fleet: Some(fleet), rated_workers, .. }) = state.jobs.get_mut(&id) {
        let is_current = fleet.changes == changes
            && fleet.uses < uses_max
            && *rated_workers < (2 * fleet.rated_workers).max(1);
        if is_current {
            fleet.uses += 1;
            return *fleet;
        }
    }
    let fleet = measure_fleet(state, id);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.fleet = Some(fleet);
    }
    fleet
}

/// Measures the rate of all workers at a job. Those without a measured rate count with the mean rate
/// of a slot of the others, or with one realization per second and slot if there are none.
pub(crate) fn measure_fleet(state: &State, id: JobId) -> FleetRate {
    let rates = |worker: &AttachedWorker| worker.rates.get(&id).copied();
    let rated = state
        .workers
        .values()
        .filter_map(|worker| Some((rates(worker)?, f64::from(worker.hello.slots))));
    let (all, slots) = rated.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    let per_slot = if slots > 0.0 { all / slots } else { 1.0 };
    let weight =
        |worker: &AttachedWorker| rates(worker).unwrap_or(f64::from(worker.hello.slots) * per_slot);
    let sound_workers = || state.workers.values().filter(|it| state.is_sound(it));
    let (total, workers) = (sound_workers().map(weight).sum(), sound_workers().count());
    let rated_workers = state.jobs.get(&id).map_or(0, |job| job.rated_workers);
    FleetRate { total, workers, per_slot, rated_workers, changes: state.fleet_changes, uses: 1 }
}
