//! Which worker, and which job, is served next.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use super::votes;
use crate::core::ids::{JobId, WorkerId};
use crate::core::job::Job;
use crate::core::state::State;
use crate::store::JobRecord;

/// Returns whether anything besides quarantined realizations waits to be sent.
pub(crate) fn work_waits(state: &State) -> bool {
    next_job(state).is_some() || checks_wait(state)
}

/// Returns the workers that can accept more, except `reserved` ones, in the order of service.
pub(crate) fn free_workers<'a>(
    state: &'a State,
    reserved: &'a BTreeSet<WorkerId>,
) -> impl Iterator<Item = WorkerId> + 'a {
    state.order.iter().map(|place| place.worker).filter(|worker| !reserved.contains(worker))
}

/// Chooses the job that is served next, among the active jobs with work. The client with the least
/// computing time comes first; of its jobs those with the highest priority are served in turn,
/// starting after the job that was served last.
pub(crate) fn next_job(state: &State) -> Option<JobId> {
    let with_work = state.active.iter().filter_map(|id| {
        let job = state.jobs.get(id)?;
        let waits = job.evaluation().is_some_and(|it| !it.queue.is_empty());
        (waits || job.ahead.has_queue()).then_some((*id, job))
    });
    let rank = |(id, job): (JobId, &Job)| {
        let JobRecord { client, priority, .. } = &job.record;
        let had = state.shares.computing_time(client);
        let served = state.last_served.is_some_and(|last| id <= last);
        (had, client.clone(), Reverse(*priority), served, id)
    };
    with_work.map(rank).min().map(|(.., id)| id)
}

/// Returns whether any audit or dispute waits for a worker.
pub(crate) fn checks_wait(state: &State) -> bool {
    let mut jobs = state.active.iter().filter_map(|id| state.jobs.get(id));
    jobs.any(|job| {
        let mut disputes = job.evaluation().into_iter().flat_map(|asked_for| &asked_for.disputes);
        job.needed_evaluations().any(|evaluation| !evaluation.audits.is_empty())
            || disputes.any(|dispute| votes::are_lacking(state, dispute))
    })
}
