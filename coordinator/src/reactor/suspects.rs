//! Realizations that were alone in a batch of a lost worker: who gets them, and when they fail
//! their job.
//!
//! A bad node that has just come back is the one with nothing to do, so being idle is no
//! recommendation: suspects go to whom most may be expected of, and wait for it. One over which
//! somebody was lost goes to the worker that has been there longest among these, so that a node that
//! comes and goes never has it while another is there.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::case::Case;
use osteon_common::case_file;
use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;

use super::{Effects, ahead, dispatch, jobs};
use crate::evaluation::{Evaluation, Indices};
use crate::failure::Failure;
use crate::ids::{JobId, WorkerId};
use crate::losses::Losses;
use crate::state::{Assignment, Purpose, Stage, State, Worker};
use crate::worker_name::WorkerName;

/// How long the losses of a host are remembered when no more come.
const MEMORY: Duration = Duration::from_secs(600);

/// How little may be expected of a worker, the least last: whether its host's workers are lost over
/// whatever they hold, whether it does not answer what it holds (which costs time, and fails no
/// job), whether one was lost over this, whether it has not answered anything yet.
pub(super) type Standing = (bool, bool, bool, bool);

/// Hands out suspects, each alone to a worker that holds nothing. Returns those who must not be
/// refilled, so that they hold nothing soon.
pub(super) fn hand_out(
    state: &mut State,
    now: Duration,
    effects: &mut Effects,
) -> BTreeSet<WorkerId> {
    let mut kept = BTreeSet::new();
    let active: Vec<JobId> = state.active.iter().copied().collect();
    for job in active {
        while let Some((index, worker)) = next(state, job, now) {
            let holds = |worker: &Worker| dispatch::held(state, worker) > 0;
            if state.workers.get(&worker).is_none_or(holds) {
                kept.insert(worker);
                break;
            }
            ahead::give_back(state, worker, now, effects);
            send(state, job, index, worker, now, effects);
        }
    }
    kept
}

/// The next suspect of a job that may be handed out, and the worker that is to have it.
fn next(state: &State, job: JobId, now: Duration) -> Option<(u64, WorkerId)> {
    let evaluation = computing(state, job)?;
    let losses = |index: &u64| evaluation.suspects.get(index);
    let open = |index: &&u64| losses(index).is_none_or(|losses| !enough(state, losses, |_| true));
    let index = evaluation.quarantine.iter().find(open)?;
    let nobody = Losses::default();
    let losses = losses(index).unwrap_or(&nobody);
    Some((*index, taker(state, losses, now)?))
}

/// The worker that is to have a suspect over which these were lost, if there is one: who has
/// answered nothing yet shows first that it answers something else, if there is something else.
fn taker(state: &State, losses: &Losses, now: Duration) -> Option<WorkerId> {
    let rank = |(id, worker): &(&WorkerId, &Worker)| {
        let held = if losses.is_empty() { dispatch::held(state, worker) } else { 0 };
        (standing(state, worker, losses), held, **id)
    };
    let takers = state.workers.iter().filter(|(_, worker)| !worker.draining);
    let (id, worker) = takers.min_by_key(rank)?;
    let recent = losses.last().is_some_and(|last| now.saturating_sub(last) < state.config.expiry);
    let harmless = worker.proven
        || (dispatch::next_job(state).is_none()
            && !(recent && state.is_failing(worker.name.host())));
    harmless.then_some(*id)
}

fn send(
    state: &mut State,
    job: JobId,
    index: u64,
    worker: WorkerId,
    now: Duration,
    effects: &mut Effects,
) {
    let Some(evaluation) = state.evaluation_mut(job) else {
        return;
    };
    evaluation.quarantine.retain(|waiting| *waiting != index);
    let indices = Indices { first: index, count: 1 };
    let assignment = Assignment { job, round: evaluation.round, indices };
    dispatch::send(state, worker, assignment, Purpose::Exclusive, now, effects);
}

/// A worker is back: nothing that it held is to blame for its absence.
pub(super) fn forgive(state: &mut State, name: &WorkerName) {
    if let Some(lost) = state.lost_in_a_row.get_mut(name.host()) {
        lost.workers.retain(|lost| lost != name);
    }
    for job in state.jobs.values_mut() {
        job.evaluations_mut().for_each(|evaluation| evaluation.forgive(name));
    }
}

/// Fails the jobs of suspects over which enough workers were lost that have stayed away, and
/// forgets hosts of which nobody was lost for long.
pub(super) fn tick(state: &mut State, now: Duration, effects: &mut Effects) {
    state.lost_in_a_row.retain(|_, lost| now.saturating_sub(lost.last) < MEMORY);
    let active: Vec<JobId> = state.active.iter().copied().collect();
    for job in active {
        if let Some(failure) = lethal(state, job, now) {
            jobs::fail(state, job, &failure, now, effects);
        }
    }
}

fn lethal(state: &State, job: JobId, now: Duration) -> Option<Failure> {
    let evaluation = computing(state, job)?;
    let over = |index: &u64| Some((*index, evaluation.suspects.get(index)?));
    let waiting = evaluation.quarantine.iter().filter_map(over);
    let hopeless = |(_, losses): &(u64, &Losses)| hopeless(state, losses, |_| true, now);
    let (index, losses) = waiting.into_iter().find(hopeless)?;
    let hosts = losses.hosts().into_iter().collect::<Vec<_>>().join(", ");
    let specification = &state.jobs.get(&job)?.record.specification;
    let case = case_file(specification, &evaluation.point, index);
    Some(Failure::LethalRealization { index, workers: losses.count(), hosts, case })
}

/// A realization as a complete case file. What is no elasticity is never solved, and kills nobody.
fn case_file(specification: &JobSpecification, point: &Point, index: u64) -> String {
    let ensemble = Ensemble::drawn(point, specification.monte_carlo.germs()).ok();
    let bone = ensemble.and_then(|ensemble| ensemble.bone(index).ok());
    let case = bone.map(|bone| Case { setup: specification.setup, bone });
    case.map_or_else(String::new, |case| case_file::to_toml(&case))
}

/// Whether enough workers were lost over something that those in `of` may have, and have stayed
/// away for so long that they will not come back.
pub(super) fn hopeless(
    state: &State,
    losses: &Losses,
    of: impl Fn(&WorkerName) -> bool,
    now: Duration,
) -> bool {
    let long = |last| now.saturating_sub(last) >= state.config.expiry;
    losses.last().is_some_and(long) && enough(state, losses, of)
}

pub(super) fn enough(state: &State, losses: &Losses, of: impl Fn(&WorkerName) -> bool) -> bool {
    let untried = |worker: &Worker| {
        let (failing, silent, lost, _) = standing(state, worker, losses);
        let stayed = losses.first().is_some_and(|first| worker.attached < first);
        !worker.draining && !silent && !failing && (stayed || !lost) && of(&worker.name)
    };
    losses.are_enough(|| state.workers.values().any(untried))
}

/// How little may be expected of a worker at something over which these were lost.
pub(super) fn standing(state: &State, worker: &Worker, losses: &Losses) -> Standing {
    let host = worker.name.host();
    let silent = state.probation.has(&worker.name);
    (state.is_failing(host), silent, losses.are_of(host), !worker.proven)
}

fn computing(state: &State, job: JobId) -> Option<&Evaluation> {
    match &state.jobs.get(&job)?.stage {
        Stage::Computing(evaluation) => Some(evaluation),
        _ => None,
    }
}
