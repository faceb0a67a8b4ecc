//! Quarantined realizations: those that were alone in a batch of a lost worker. This file decides
//! which worker gets them, and when so many workers crashed over one that it is poison.
//!
//! A bad node that has just come back holds nothing, so an idle worker is not for that reason a good one:
//! a quarantined realization goes to a worker with the best reputation, and waits for it. If a worker was
//! lost over the realization, it goes to the one of these that has been attached longest, so that a node
//! that comes and goes does not get it while another worker is there.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_files::case_file;

use super::{batches, schedule};
use crate::core::batch::{Assignment, Purpose};
use crate::core::crashes::Crashes;
use crate::core::failure::RunFailure;
use crate::core::ids::{JobId, WorkerId};
use crate::core::indices::Indices;
use crate::core::policy::CRASH_MEMORY;
use crate::core::reactor::turn::Turn;
use crate::core::state::{AttachedWorker, State};
use crate::core::worker_name::WorkerName;

/// Reputation of a worker for a task, lower is better. In order of weight: whether its host's
/// workers are lost whatever they hold, whether it is on probation (which costs time, but fails no
/// job), whether a worker of its host was lost over the task, whether it has not answered anything
/// yet.
pub(crate) type Reputation = (bool, bool, bool, bool);

/// Sends quarantined realizations, each alone to a worker that holds nothing. Returns the workers
/// that are reserved: they receive no other work, so that they soon hold nothing.
pub(crate) fn dispatch(turn: &mut Turn) -> BTreeSet<WorkerId> {
    let mut kept = BTreeSet::new();
    let active: Vec<JobId> = turn.state.active.iter().copied().collect();
    for job in active {
        while let Some((index, worker)) = choose_quarantined(turn.state, job, turn.now) {
            let holds = |worker: &AttachedWorker| turn.state.batches_held(worker) > 0;
            if turn.state.workers.get(&worker).is_none_or(holds) {
                kept.insert(worker);
                break;
            }
            batches::preempt(turn, worker);
            send(turn, job, index, worker);
        }
    }
    kept
}

/// Chooses the next quarantined realization of a job that may be sent, and its worker.
fn choose_quarantined(state: &State, job: JobId, now: Duration) -> Option<(u64, WorkerId)> {
    let evaluation = state.jobs.get(&job)?.evaluation()?;
    let crashes = |index: &u64| evaluation.crashes.get(index);
    let is_open = |index: &&u64| {
        crashes(index).is_none_or(|crashes| !crash_limit_reached(state, crashes, |_| true))
    };
    let index = evaluation.quarantine.iter().find(is_open)?;
    let nobody = Crashes::default();
    let crashes = crashes(index).unwrap_or(&nobody);
    Some((*index, choose_worker(state, crashes, now)?))
}

/// Chooses the worker of a realization over which `crashes` happened, if there is one. A worker
/// that has not answered anything yet must first answer other work, if there is any.
fn choose_worker(state: &State, crashes: &Crashes, now: Duration) -> Option<WorkerId> {
    let rank = |(id, worker): &(&WorkerId, &AttachedWorker)| {
        let held = if crashes.is_empty() { state.batches_held(worker) } else { 0 };
        (reputation(state, worker, crashes), held, **id)
    };
    let takers = state.workers.iter().filter(|(_, worker)| !worker.draining);
    let (id, worker) = takers.min_by_key(rank)?;
    let recent = crashes.last().is_some_and(|last| now.saturating_sub(last) < state.config.expiry);
    let harmless = worker.has_answered
        || (schedule::next_job(state).is_none()
            && !(recent && state.is_failing(worker.name.host())));
    harmless.then_some(*id)
}

fn send(turn: &mut Turn, job: JobId, index: u64, worker: WorkerId) {
    let Some(evaluation) = turn.state.evaluation_mut(job) else {
        return;
    };
    evaluation.quarantine.retain(|waiting| *waiting != index);
    let indices = Indices { first: index, count: 1 };
    let assignment = Assignment { job, attempt: evaluation.attempt, indices };
    batches::send(turn, worker, assignment, Purpose::Exclusive);
}

/// Forgets the crashes of a worker that is back: the batches that it held are not to blame for its
/// absence.
pub(crate) fn forget_crashes(state: &mut State, name: &WorkerName) {
    if let Some(lost) = state.lost_in_a_row.get_mut(name.host()) {
        lost.workers.retain(|lost| lost != name);
    }
    for job in state.jobs.values_mut() {
        job.evaluations_mut().for_each(|evaluation| evaluation.forget_crashes(name));
    }
}

/// Forgets the crashes of hosts that have not lost a worker for a long time.
pub(crate) fn forget_old_crashes(state: &mut State, now: Duration) {
    state.lost_in_a_row.retain(|_, lost| now.saturating_sub(lost.last) < CRASH_MEMORY);
}

/// Returns the failure of a job with a poison realization, if it has one.
pub(crate) fn failure(state: &State, job: JobId, now: Duration) -> Option<RunFailure> {
    let evaluation = state.jobs.get(&job)?.evaluation()?;
    let crashes_over = |index: &u64| Some((*index, evaluation.crashes.get(index)?));
    let waiting = evaluation.quarantine.iter().filter_map(crashes_over);
    let is_poison = |(_, crashes): &(u64, &Crashes)| is_poison(state, crashes, |_| true, now);
    let (index, crashes) = waiting.into_iter().find(is_poison)?;
    let hosts = crashes.hosts().into_iter().collect::<Vec<_>>().join(", ");
    let specification = &state.jobs.get(&job)?.record.specification;
    let case = case_file(specification, &evaluation.point, index);
    Some(RunFailure::PoisonRealization { index, workers: crashes.count(), hosts, case })
}

/// Returns a realization as a complete case file, or an empty text if its germs give no elasticity:
/// such a realization is never solved, and crashes no worker.
fn case_file(specification: &JobSpecification, point: &Point, index: u64) -> String {
    let case = || {
        let ensemble = specification.ensemble(point).ok()?;
        let realization = ensemble.realization(index, &specification.setup).ok()?;
        Some(realization.into_case(&specification.setup))
    };
    case().map_or_else(String::new, |case| case_file::to_toml(&case))
}

/// Returns whether a task that the workers in `of` are eligible for is poison: the crash limit is
/// reached, and the lost workers have stayed away for so long that they will not come back.
pub(crate) fn is_poison(
    state: &State,
    crashes: &Crashes,
    of: impl Fn(&WorkerName) -> bool,
    now: Duration,
) -> bool {
    let is_long_ago = |last| now.saturating_sub(last) >= state.config.expiry;
    crashes.last().is_some_and(is_long_ago) && crash_limit_reached(state, crashes, of)
}

/// Returns whether no further worker in `of` shall be risked for a task over which `crashes`
/// happened.
pub(crate) fn crash_limit_reached(
    state: &State,
    crashes: &Crashes,
    of: impl Fn(&WorkerName) -> bool,
) -> bool {
    let is_untried = |worker: &AttachedWorker| {
        let (failing, silent, lost, _) = reputation(state, worker, crashes);
        let stayed = crashes.first().is_some_and(|first| worker.attached < first);
        !worker.draining && !silent && !failing && (stayed || !lost) && of(&worker.name)
    };
    crashes.reach_limit(|| state.workers.values().any(is_untried))
}

/// Returns the reputation of a worker for a task over which `crashes` happened.
pub(crate) fn reputation(state: &State, worker: &AttachedWorker, crashes: &Crashes) -> Reputation {
    let host = worker.name.host();
    let silent = state.probation.has(&worker.name);
    (state.is_failing(host), silent, crashes.include_host(host), !worker.has_answered)
}
