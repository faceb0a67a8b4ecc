//! Speculative batches for idle slots, and the cases in which these slots stay idle instead.
//!
//! A realization that has begun is not interrupted, so a slot stays idle if it will soon be needed for
//! something better. That is so if the evaluation of the same job is about to be complete, because
//! another point may be likelier afterwards, or if another job is about to need the slot.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_common::parameters::Point;

use super::{batches, eta, sizing};
use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::bounded_duration::bounded_duration;
use crate::core::evaluation::PendingEvaluation;
use crate::core::ids::{JobId, WorkerId};
use crate::core::indices::Indices;
use crate::core::job::{Job, Stage};
use crate::core::policy::{BATCHES_IN_FLIGHT_MAX, IDLE_AT_ONCE, SPECULATIVE_BATCHES_MIN};
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, State};

/// ETA of the last batch of each evaluation that a search waits for.
type Etas = BTreeMap<JobId, Duration>;

/// Sends speculative batches to the workers with idle slots, but no more than the coordinator can serve
/// without delaying the answers that a search waits for.
pub(crate) fn dispatch(turn: &mut Turn) {
    if choose_point(turn.state).is_none() {
        return;
    }
    let speculative = |batch: &&Batch| batch.purpose == Purpose::Speculative;
    let mut out = turn.state.batches.values().filter(speculative).count();
    // A worker that holds a speculative batch gets no other.
    let without_speculative =
        (0..BATCHES_IN_FLIGHT_MAX).flat_map(|held| turn.state.order.holding(held));
    let idle = without_speculative
        .filter_map(|id| Some((id, spare_slots(turn.state, turn.state.workers.get(&id)?))));
    let idle: Vec<(WorkerId, u64)> =
        idle.filter(|(_, slots)| *slots > 0).take(IDLE_AT_ONCE).collect();
    let mut slots: u64 = idle.iter().map(|(_, slots)| slots).sum();
    let etas = eta::etas(turn.state);
    let mut wanted = choose_point(turn.state);
    for (worker, spare) in idle {
        let Some((job, point)) = wanted else {
            return;
        };
        if !must_stay_idle(turn.state, job, &point, worker, slots, &etas, turn.now) {
            let size = batch_size(turn.state, job, &point, worker);
            if out >= batches_out_max(turn.state, job, worker, size) {
                return;
            }
            send(turn, job, point, worker, size);
            out += 1;
            slots -= spare;
            wanted = choose_point(turn.state);
        }
    }
}

/// Returns how many speculative batches of this size may be out at a time: as many as the coordinator
/// serves while one is computed. More would delay the answers that the search waits for.
fn batches_out_max(state: &State, id: JobId, worker: WorkerId, size: u64) -> usize {
    let rate = state.workers.get(&worker).and_then(|it| it.rates.get(&id));
    rate.map_or(SPECULATIVE_BATCHES_MIN, |rate| {
        sizing::batches_served_within(size as f64 / rate).max(SPECULATIVE_BATCHES_MIN)
    })
}

/// Chooses the point to compute speculatively next, and its job. Points that a search will certainly
/// ask for as soon as a record is durable come first, the others by their rank among the candidates of
/// their job. Points of equal rank come in the order in which their jobs are served with other work.
fn choose_point(state: &State) -> Option<(JobId, Point)> {
    let rank_job = |id: &JobId| {
        let job = state.jobs.get(id)?;
        let has_room = || {
            let more = job.record.specification.monte_carlo.realizations;
            state.realizations() + more <= state.config.active_realizations_max
        };
        let place = job.speculation.candidates.iter().position(|at| {
            match job.speculation.evaluation_at(at) {
                Some(begun) => !begun.queue.is_empty() && !begun.has_crashed_worker,
                None => !job.ahead.has(at) && has_room(),
            }
        })?;
        let certain = place == 0 && matches!(job.stage, Stage::StoringEvaluation { .. });
        let had = state.shares.computing_time(&job.record.client);
        Some((!certain, place, had, Reverse(job.record.priority), *id))
    };
    let (_, place, .., id) = state.active.iter().filter_map(rank_job).min()?;
    let point = state.jobs.get(&id)?.speculation.candidates.get(place)?;
    Some((id, *point))
}

/// Returns whether the idle slots of a worker must stay idle, because its job or another will need them
/// before a batch of `point` is computed. `slots` is the number of idle slots of all workers that are
/// looked at.
fn must_stay_idle(
    state: &State,
    id: JobId,
    point: &Point,
    worker: WorkerId,
    slots: u64,
    etas: &Etas,
    now: Duration,
) -> bool {
    let (Some(job), Some(attached)) = (state.jobs.get(&id), state.workers.get(&worker)) else {
        return true;
    };
    let spare = spare_slots(state, attached);
    // So many realizations begin at once, and none of them is interrupted.
    let begun = spare.min(queued_realizations(job, point)) as f64;
    let seconds = attached.rates.get(&id).map_or(0.0, |rate| begun / rate);
    let takes = bounded_duration(seconds);
    let is_soon = |eta: &Duration| now < *eta + takes / 2 && *eta < now + takes / 2;
    etas.get(&id).is_some_and(is_soon)
        || slots < spare + slots_wanted_by_others(state, id, now + takes, etas)
}

/// Returns the number of realizations of a point that nobody computes yet.
fn queued_realizations(job: &Job, point: &Point) -> u64 {
    let realizations = job.record.specification.monte_carlo.realizations;
    job.speculation.evaluation_at(point).map_or(realizations, PendingEvaluation::queued)
}

/// Returns the number of slots that jobs other than `but` will need before `until`, beyond those
/// they have.
fn slots_wanted_by_others(state: &State, but: JobId, until: Duration, etas: &Etas) -> u64 {
    let slots_wanted = |id: &JobId| {
        let job = state.jobs.get(id)?;
        let specification = &job.record.specification;
        let realizations = specification.monte_carlo.realizations;
        match &job.stage {
            Stage::Completing(_) | Stage::StoringEvaluation { .. }
                if specification.kind == JobKind::Propagation =>
            {
                None
            }
            Stage::Computing(evaluation) => {
                let soon = etas.get(id).is_some_and(|eta| *eta < until);
                soon.then_some(evaluation.filled())
            }
            Stage::StoringEvaluation { .. } if next_point_is_sent(job) => None,
            Stage::Completing(_)
            | Stage::StoringEvaluation { .. }
            | Stage::StoringPrepared { .. }
            | Stage::Replaying { .. } => Some(realizations),
            Stage::StoringSubmission | Stage::Waiting | Stage::StoringEnd(_) => None,
        }
    };
    state.active.iter().filter(|id| **id != but).filter_map(slots_wanted).sum()
}

/// Returns whether every batch of the point that a job asks for next, when its record is durable,
/// has been sent.
fn next_point_is_sent(job: &Job) -> bool {
    let next =
        job.speculation.candidates.first().and_then(|next| job.speculation.evaluation_at(next));
    next.is_some_and(|next| next.queue.is_empty())
}

/// Returns the number of realizations of a point that the idle slots of a worker get.
fn batch_size(state: &mut State, id: JobId, point: &Point, worker: WorkerId) -> u64 {
    let fleet = sizing::fleet_rate(state, id);
    let (Some(job), Some(attached)) = (state.jobs.get(&id), state.workers.get(&worker)) else {
        return 0;
    };
    let (queued, spare) = (queued_realizations(job, point), spare_slots(state, attached));
    match batches::realizations_held(state, attached) {
        0 => sizing::batch_size(state, attached, id, fleet, (queued, 0)).max(spare.min(queued)),
        _ => spare,
    }
}

/// Sends a batch of a point to the idle slots of a worker.
fn send(turn: &mut Turn, id: JobId, point: Point, worker: WorkerId, size: u64) {
    let Some((attempt, indices)) = take_indices(turn.state, id, point, size) else {
        return;
    };
    let assignment = Assignment { job: id, attempt, indices };
    batches::send(turn, worker, assignment, Purpose::Speculative);
}

/// Takes indices of a point, beginning its evaluation if necessary; returns them with the number of
/// the attempt.
fn take_indices(state: &mut State, id: JobId, point: Point, size: u64) -> Option<(u64, Indices)> {
    let attempt = state.new_attempt();
    let job = state.jobs.get_mut(&id)?;
    if job.speculation.evaluation_at(&point).is_none() {
        // The lowest number that it may get. The number only decides which batches are audited.
        let number = job.search.evaluations() + 1;
        let realizations = job.record.specification.monte_carlo.realizations;
        job.speculation.evaluations.push(PendingEvaluation::new(
            number,
            attempt,
            point,
            realizations,
        ));
    }
    let evaluation = job.speculation.evaluation_at_mut(&point)?;
    Some((evaluation.attempt, evaluation.take(size)?))
}

/// Returns the number of slots of a worker that no other work needs.
fn spare_slots(state: &State, worker: &AttachedWorker) -> u64 {
    let holds = |purpose| state.held_for(worker, purpose).next().is_some();
    let full = worker.in_flight.len() >= BATCHES_IN_FLIGHT_MAX;
    let failing = state.is_failing(worker.name.host());
    let taken = holds(Purpose::Speculative) || holds(Purpose::Exclusive);
    if !state.is_sound(worker) || full || failing || taken {
        return 0;
    }
    u64::from(worker.hello.slots).saturating_sub(batches::realizations_held(state, worker))
}
