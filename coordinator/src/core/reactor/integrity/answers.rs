//! Answers to batches: each fills an evaluation, is compared with another answer, or decides a
//! dispute.

use std::time::Duration;

use osteon_common::carried_velocity::carried_velocities;
use osteon_common::outcome::RealizationResult;
use osteon_proto::malformed::Malformed;

use super::checks;
use crate::core::batch::{Assignment, Batch, Purpose};
use crate::core::bounded_duration::bounded_duration;
use crate::core::close_reason::CloseReason;
use crate::core::ids::{BatchId, WorkerId};
use crate::core::job::Job;
use crate::core::policy::{ELAPSED_MIN_S, RATE_WEIGHT};
use crate::core::reactor::dispatch::{batches, departures, overdue};
use crate::core::reactor::lifecycle::{jobs, workers};
use crate::core::reactor::turn::Turn;
use crate::core::state::{EarlyAnswer, State};
use crate::core::worker_name::WorkerName;

/// Takes in a worker's answer. If the batch was settled before (a duplicate was faster, or the
/// answer came twice), the answer is only compared with the known results; the answer to an unknown
/// batch is ignored.
pub(crate) fn take_answer(
    turn: &mut Turn,
    worker: WorkerId,
    batch: BatchId,
    solved: Vec<RealizationResult>,
    elapsed_s: f64,
) {
    let Some(attached) = turn.state.workers.get_mut(&worker) else {
        return;
    };
    attached.last_seen = turn.now;
    let answered_before = std::mem::replace(&mut attached.answered, turn.now);
    attached.rate.add(solved.len() as u64, turn.now);
    let name = attached.name.clone();
    let held = turn.state.batches.get(&batch).filter(|held| held.worker == worker);
    let find_settled =
        || attached.settled.iter().find(|(id, _)| *id == batch).map(|(_, about)| *about);
    let Some(assignment) = held.map(|held| held.assignment).or_else(find_settled) else {
        return;
    };
    let (purpose, duplicates) = held.map(|held| (held.purpose, held.duplicates.clone())).unzip();
    let duplicates = duplicates.unwrap_or_default();
    let (found, expected) = (solved.len(), assignment.indices.count);
    if found as u64 != expected {
        let reason = CloseReason::WrongCount { batch, found, expected };
        workers::close(turn, worker, reason);
        return;
    }
    if let Some(reason) = unusable(turn.state, &assignment, &solved) {
        workers::close(turn, worker, reason);
        return;
    }
    turn.state.note_answer(worker);
    if purpose.is_some() && waits_for_proof(turn.state, worker, &assignment) {
        hold_back(turn.state, worker, EarlyAnswer { batch, solved, elapsed_s });
        return;
    }
    if purpose.is_some() {
        overdue::note_answer(turn.state, worker, batch, turn.now);
    }
    match purpose {
        Some(Purpose::Fill | Purpose::Exclusive | Purpose::Speculative) => {
            if let Some(held) = turn.state.settle(batch) {
                measure(turn.state, &held, elapsed_s, (answered_before, turn.now));
            }
            take_back(turn, duplicates);
            fill(turn.state, &assignment, &solved, &name, turn.now);
            checks::audit(turn.state, worker, batch, &assignment);
        }
        Some(Purpose::Audit { .. }) => {
            turn.state.settle(batch);
            take_back(turn, duplicates);
            checks::compare(turn, &assignment, &solved, &name);
        }
        Some(Purpose::TieBreak) => {
            take_back(turn, duplicates);
            checks::take_tie_break(turn, batch, &assignment, solved, &name);
        }
        Some(Purpose::Proof) => {
            learn_realization_time(turn.state, &assignment, worker, elapsed_s);
            checks::take_proof(turn, (worker, batch), &assignment, solved, &name);
            take_early(turn, worker);
        }
        None => checks::compare(turn, &assignment, &solved, &name),
    }
    jobs::settle(turn, assignment.job, assignment.attempt);
    departures::dismiss_if_drained(turn, worker);
}

/// Returns why answers cannot be used, if they cannot.
fn unusable(
    state: &State,
    assignment: &Assignment,
    solved: &[RealizationResult],
) -> Option<CloseReason> {
    if lacks_observables(state, assignment, solved) {
        return Some(CloseReason::Malformed(Malformed::Missing { field: "observables" }));
    }
    implausible(state, assignment, solved)
}

/// Returns whether the job asks for an observable that a velocity lacks: the worker does not know it.
fn lacks_observables(state: &State, assignment: &Assignment, solved: &[RealizationResult]) -> bool {
    let job = state.jobs.get(&assignment.job);
    job.is_some_and(|job| {
        let wanted = job.record.specification.observables();
        solved.iter().any(|one| one.lacks_one(wanted))
    })
}

/// Returns whether a worker has not given its proof of the setup of a batch that it answers.
fn waits_for_proof(state: &State, worker: WorkerId, assignment: &Assignment) -> bool {
    let Some(attached) = state.workers.get(&worker) else {
        return false;
    };
    let setup = state.jobs.get(&assignment.job).map(|job| job.setup);
    let mut proofs = attached.proofs.iter().filter_map(|id| state.batches.get(id));
    proofs.any(|proof| {
        let of = state.proofs.with_attempt(proof.assignment.attempt);
        proof.assignment.attempt != assignment.attempt && of.map(|(of, _)| of) == setup
    })
}

/// Keeps an answer until its worker has given its proof. The batch counts as not answered meanwhile.
fn hold_back(state: &mut State, worker: WorkerId, answer: EarlyAnswer) {
    if let Some(attached) = state.workers.get_mut(&worker)
        && attached.early.iter().all(|early| early.batch != answer.batch)
    {
        attached.early.push(answer);
    }
}

/// Takes in the answers that waited for the proof of their worker.
fn take_early(turn: &mut Turn, worker: WorkerId) {
    let attached = turn.state.workers.get_mut(&worker);
    let early = attached.map(|attached| std::mem::take(&mut attached.early));
    for EarlyAnswer { batch, solved, elapsed_s } in early.unwrap_or_default() {
        take_answer(turn, worker, batch, solved, elapsed_s);
    }
}

/// Returns why answers cannot be right: a velocity is beyond what the layers of the job can carry.
fn implausible(
    state: &State,
    assignment: &Assignment,
    solved: &[RealizationResult],
) -> Option<CloseReason> {
    let layers = &state.jobs.get(&assignment.job)?.record.specification.setup.layers;
    let carried = carried_velocities(layers, &state.point_of(assignment)?)?;
    let mut velocities = solved.iter().filter_map(|one| one.outcome.ok());
    let velocity = velocities.find(|velocity| !carried.contains(velocity))?;
    Some(CloseReason::ImpossibleVelocity { velocity })
}

/// Learns from a proof how long realizations of its job take.
fn learn_realization_time(
    state: &mut State,
    assignment: &Assignment,
    worker: WorkerId,
    elapsed_s: f64,
) {
    let slots = state.workers.get(&worker).map(|attached| attached.hello.slots);
    if let Some((job, slots)) = state.jobs.get_mut(&assignment.job).zip(slots)
        && elapsed_s.is_finite()
        && elapsed_s >= ELAPSED_MIN_S
    {
        job.realization_time.learn(assignment.indices.count, slots, elapsed_s);
    }
}

/// Revokes the duplicates of a batch that was answered.
fn take_back(turn: &mut Turn, duplicates: Vec<BatchId>) {
    for duplicate in duplicates {
        overdue::count_missed(turn.state, duplicate, turn.now);
        batches::revoke(turn, duplicate);
    }
}

fn fill(
    state: &mut State,
    assignment: &Assignment,
    solved: &[RealizationResult],
    by: &WorkerName,
    now: Duration,
) {
    let Some(evaluation) = state.evaluation_of_mut(assignment) else {
        return;
    };
    let before = evaluation.filled();
    evaluation.fill(assignment.indices, solved, by);
    let news = evaluation.filled() - before;
    let asked_for =
        |job: &&mut Job| job.needed_evaluations().any(|it| it.attempt == assignment.attempt);
    if let Some(job) = state.jobs.get_mut(&assignment.job).filter(asked_for) {
        job.rate.add(news, now);
        job.last_progress = now;
    }
    state.changed.insert(assignment.job);
}

/// Updates the rate of a worker, the time of a realization of its job and the delay of answers with an answer
/// that arrives `now`; `before` is the time of the worker's answer before it.
fn measure(state: &mut State, batch: &Batch, elapsed_s: f64, (before, now): (Duration, Duration)) {
    let plausible = elapsed_s.is_finite() && elapsed_s >= ELAPSED_MIN_S;
    let waited_s = now.saturating_sub(batch.sent).as_secs_f64().max(ELAPSED_MIN_S);
    let rate = batch.assignment.indices.count as f64 / if plausible { elapsed_s } else { waited_s };
    // A batch that was sent before that answer waited behind the answered one.
    if plausible && batch.sent >= before {
        state.delay.learn(waited_s, elapsed_s);
    }
    let Some(worker) = state.workers.get_mut(&batch.worker) else {
        return;
    };
    let is_first = !worker.rates.contains_key(&batch.assignment.job);
    let known = worker.rates.entry(batch.assignment.job).or_insert(rate);
    *known += RATE_WEIGHT * (rate - *known);
    let count = batch.assignment.indices.count;
    let seconds = count as f64 / rate;
    let slots = worker.hello.slots;
    let took = bounded_duration(seconds * f64::from(slots));
    if let Some(job) = state.jobs.get_mut(&batch.assignment.job) {
        job.rated_workers += u64::from(is_first);
        // A worker cannot have computed for longer than the time since the batch was sent.
        job.realization_time.learn(count, slots, seconds.min(waited_s));
    }
    if let Some(job) =
        state.jobs.get(&batch.assignment.job).filter(|_| batch.purpose != Purpose::Speculative)
    {
        state.shares.correct(&job.record.client, batch.charged, took);
    }
    if is_first {
        state.reorder(batch.worker);
    }
}
