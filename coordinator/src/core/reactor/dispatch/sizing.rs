//! Batch sizes. A worker gets as many realizations as it computes in the target time by its
//! measured rate, but at most a quarter of its share of the remaining ones, so that all workers
//! finish together. While its share allows, no batch is smaller than the worker's slots.
//!
//! A batch costs the coordinator, which serves one after another, some time. Where many workers share
//! little work, a share is less than that is worth: then fewer workers get batches that keep them busy
//! for longer. If one worker would take the time R for all that is left and a batch costs c, batches
//! of √(R c) make the sum of both shortest. Longer ones than c for each worker are not needed for that:
//! then the coordinator serves one worker after the other before the first is idle again. If there are
//! enough workers for one such batch each, R is the time of the whole evaluation: all batches are equal.

use std::time::Duration;

use osteon_common::limits::BATCH_REALIZATIONS_MAX;

use super::ahead;
use crate::core::ids::JobId;
use crate::core::job::{FleetRate, Job};
use crate::core::policy::{
    AUDIT_S, BATCH_COST_S, BATCH_WORTH_S, FIRST_BATCH_PER_SLOT, FLEET_RATE_USES_MIN,
    RATED_WORKERS_MIN, SHARE_DIVISOR, UNKNOWN_AT_ONCE, UNKNOWN_TIME,
};
use crate::core::state::{AttachedWorker, State};

/// Returns the number of realizations of `job`, of which `queued` are left in its evaluation and
/// `further` in others, that `attached` gets at once: as many as it computes in the target time, at
/// most a quarter of its share. Both limits give way to one realization for each slot (a realization
/// may take longer than the target, and a share may hold fewer than four for each slot), but the share
/// itself gives way only to a batch that is worth its cost.
///
/// The first batch of a worker is small, because nothing is known of its speed, but has a realization for
/// each slot, whatever its share. If some others are known, it takes as long as it has to for one of their
/// speed to be worth its cost.
///
/// Where there are further evaluations, a batch takes no longer than it has to be worth its cost: then
/// each of them, which is one of a chain, is soon complete. The batches of one are of about equal size.
pub(crate) fn batch_size(
    state: &State,
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    (queued, further): (u64, u64),
) -> u64 {
    let slots = f64::from(attached.hello.slots);
    let measured = attached.rates.get(&job).copied();
    let rate = rate(attached, job, fleet);
    let weight = rate.unwrap_or(slots * fleet.per_slot);
    // A worker may be faster than the fleet was when it was measured.
    let left = (queued + further) as f64;
    let share = left * (weight / fleet.total.max(weight));
    let all = realizations(state, job);
    let worth_s =
        rate.map_or(BATCH_WORTH_S, |rate| worth_s(left / rate, all / rate, fleet.workers));
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
/// Then a second one for `attached`, which holds another, would be complete later than on an idle worker, of
/// which there will be some. With several jobs, or evaluations in several chains, workers hold batches of
/// others and are not waited for.
pub(crate) fn is_one_batch_each(
    state: &State,
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    size: u64,
) -> bool {
    let is_alone = |job: &Job| {
        state.active.len() == 1 && ahead::left(job) == 0 && job.ahead.evaluations().next().is_none()
    };
    let suffices = |rate| realizations(state, job) <= size as f64 / rate * fleet.total;
    state.jobs.get(&job).is_some_and(is_alone) && rate(attached, job, fleet).is_some_and(suffices)
}

/// Returns the number of realizations of an answer that are audited together at least: one for each slot, which
/// take another worker no longer than one, and more if they take so little time that the batch costs more.
pub(crate) fn audit_least(attached: &AttachedWorker, job: JobId) -> u64 {
    let rate = attached.rates.get(&job).copied().unwrap_or_default();
    // `as` saturates, and converts NaN to 0.
    ((rate * AUDIT_S) as u64).max(attached.hello.slots.into())
}

/// Returns the number of realizations of an audit of so many that a worker gets at once, when nothing else
/// waits: an evaluation waits for its last audits, and many workers compute them together sooner than one.
/// `waiting` is the number of realizations in all audits that wait.
pub(crate) fn audit_size(
    attached: &AttachedWorker,
    job: JobId,
    fleet: FleetRate,
    (audited, waiting): (u64, u64),
) -> u64 {
    let of = |rate: f64| (rate * best_s(waiting as f64 / rate)).ceil() as u64;
    let size = rate(attached, job, fleet).map_or(audited, of);
    // The worker whose answer is audited computes no part of its audit.
    let others = fleet.workers.saturating_sub(1).max(1) as u64;
    size.max(attached.hello.slots.into()).max(audited.div_ceil(others)).min(audited)
}

/// Returns the number of realizations of an evaluation of a job.
fn realizations(state: &State, id: JobId) -> f64 {
    let job = state.jobs.get(&id);
    job.map_or(0, |job| job.record.specification.monte_carlo.realizations) as f64
}

/// Returns whether a job must wait until it is known how large its batches should be: so many were sent that
/// there may soon be answers.
pub(crate) fn must_wait(job: &Job) -> bool {
    job.unknown_sent >= UNKNOWN_AT_ONCE && job.rated_workers < RATED_WORKERS_MIN
}

/// Lets jobs send batches of unknown duration again after a while without answers.
pub(crate) fn forget_unknown(state: &mut State, now: Duration) {
    for id in &state.active {
        if let Some(job) = state.jobs.get_mut(id)
            && now.saturating_sub(job.unknown_since) >= UNKNOWN_TIME
        {
            (job.unknown_since, job.unknown_sent) = (now, 0);
        }
    }
}

/// Returns the rate of a worker at a job, as measured, or that of its slots in the mean of the others if
/// enough of them are known.
pub(crate) fn rate(attached: &AttachedWorker, job: JobId, fleet: FleetRate) -> Option<f64> {
    let of_others = || f64::from(attached.hello.slots) * fleet.per_slot;
    let is_known = fleet.rated_workers >= RATED_WORKERS_MIN;
    attached.rates.get(&job).copied().or_else(|| is_known.then(of_others))
}

/// Returns the time that a batch should take at least, s, given the time of all that is left, that of the
/// whole evaluation and the number of workers. If these suffice for one batch each, all batches are equal.
/// Otherwise they become smaller, so that all workers finish together.
fn worth_s(left_s: f64, all_s: f64, workers: usize) -> f64 {
    let round_s = workers as f64 * BATCH_COST_S;
    let basis_s = if suffice(workers, all_s) { all_s.max(left_s) } else { left_s };
    best_s(basis_s).min(round_s.max(BATCH_WORTH_S))
}

/// Returns whether workers suffice for one batch each of an evaluation that takes one of them this time, s.
fn suffice(workers: usize, all_s: f64) -> bool {
    all_s <= best_s(all_s) * workers as f64
}

/// Returns the time of the batches that make the sum of their time and their cost shortest, s, given the
/// time of all that is left.
fn best_s(left_s: f64) -> f64 {
    (left_s * BATCH_COST_S).sqrt()
}

/// Returns the number of batches that the coordinator serves within some time, s.
pub(crate) fn served_within(seconds: f64) -> usize {
    // `as` saturates, and converts NaN to 0.
    (seconds / BATCH_COST_S) as usize
}

/// Returns the rate of all workers at a job. It is measured again after as many batches as there are
/// workers, so that each of them pays for one; at once if workers came or went, or if twice as many of
/// them have computed something of the job.
pub(crate) fn fleet_rate(state: &mut State, id: JobId) -> FleetRate {
    let uses_max = FLEET_RATE_USES_MIN.max(state.workers.len() as u64);
    let changes = state.fleet_changes;
    if let Some(Job { fleet: Some(fleet), rated_workers, .. }) = state.jobs.get_mut(&id) {
        let is_current = fleet.changes == changes
            && fleet.uses < uses_max
            && *rated_workers < (2 * fleet.rated_workers).max(1);
        if is_current {
            fleet.uses += 1;
            return *fleet;
        }
    }
    let fleet = measured(state, id);
    if let Some(job) = state.jobs.get_mut(&id) {
        job.fleet = Some(fleet);
    }
    fleet
}

/// Measures the rate of all workers at a job. Those without a measured rate count with the mean rate
/// of a slot of the others, or with one realization per second and slot if there are none.
pub(crate) fn measured(state: &State, id: JobId) -> FleetRate {
    let rates = |worker: &AttachedWorker| worker.rates.get(&id).copied();
    let rated = state
        .workers
        .values()
        .filter_map(|worker| Some((rates(worker)?, f64::from(worker.hello.slots))));
    let (all, slots) = rated.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    let per_slot = if slots > 0.0 { all / slots } else { 1.0 };
    let weight =
        |worker: &AttachedWorker| rates(worker).unwrap_or(f64::from(worker.hello.slots) * per_slot);
    let sound = || state.workers.values().filter(|it| state.is_sound(it));
    let (total, workers) = (sound().map(weight).sum(), sound().count());
    let rated_workers = state.jobs.get(&id).map_or(0, |job| job.rated_workers);
    FleetRate { total, workers, per_slot, rated_workers, changes: state.fleet_changes, uses: 1 }
}
