//! Pages of jobs, and of the history of one.

use std::ops::Bound;
use std::time::Duration;

use crate::core::effect::{Answer, Refusal, SearchRows};
use crate::core::event::JobChoice;
use crate::core::ids::JobId;
use crate::core::job::Stage;
use crate::core::snapshot;
use crate::core::state::State;

/// Returns a page of the jobs after a given one, oldest first.
pub(crate) fn oldest_first(
    state: &State,
    after: Option<JobId>,
    limit: usize,
    now: Duration,
) -> Answer {
    let from = after.map_or(Bound::Unbounded, Bound::Excluded);
    let range = (from, Bound::Unbounded);
    let mut ids: Vec<JobId> = state.ended.range(range).map(|(id, _)| *id).take(limit + 1).collect();
    ids.extend(state.jobs.range(range).map(|(id, _)| *id));
    ids.sort_unstable();
    let mut listed =
        ids.into_iter().filter_map(|id| Some((id, snapshot::job_snapshot(state, id, now)?)));
    let page: Vec<_> = listed.by_ref().take(limit).collect();
    let more_after = listed.next().and_then(|_| page.last().map(|(id, _)| *id));
    Answer::Page { snapshots: page.into_iter().map(|(_, snapshot)| snapshot).collect(), more_after }
}

/// Returns a page of the jobs before a given one, newest first, in a time that depends on the length of
/// the page only.
pub(crate) fn newest_first(
    state: &State,
    which: JobChoice,
    before: Option<JobId>,
    limit: usize,
    now: Duration,
) -> Answer {
    let to = before.map_or(Bound::Unbounded, Bound::Excluded);
    let range = (Bound::Unbounded, to);
    // One more shows whether there is a next page.
    let most = limit.saturating_add(1);
    let mut ids: Vec<JobId> = Vec::new();
    match which {
        JobChoice::Running => ids.extend(state.active.range(range).rev().take(most)),
        JobChoice::Waiting | JobChoice::All => {
            let known = state.jobs.range(range).rev();
            // Few jobs are in another stage: those that run, and those whose submission is stored.
            let wanted = known.filter(|(_, job)| match job.stage {
                Stage::StoringSubmission => false,
                Stage::Waiting => true,
                _ => which == JobChoice::All,
            });
            ids.extend(wanted.map(|(id, _)| *id).take(most));
        }
        JobChoice::Ended => {}
    }
    if matches!(which, JobChoice::Ended | JobChoice::All) {
        ids.extend(state.ended.range(range).rev().map(|(id, _)| *id).take(most));
    }
    ids.sort_unstable_by(|a, b| b.cmp(a));
    let is_last = ids.len() <= limit;
    ids.truncate(limit);
    let more_after = ids.last().copied().filter(|_| !is_last);
    let snapshots = ids.into_iter().filter_map(|id| snapshot::job_snapshot(state, id, now));
    Answer::Page { snapshots: snapshots.collect(), more_after }
}

/// Returns rows of the history of a job that has not ended.
pub(crate) fn search_rows(state: &State, id: JobId, from: u64, limit: usize) -> Answer {
    match state.jobs.get(&id) {
        Some(job) if !matches!(job.stage, Stage::StoringSubmission) => {
            let from = usize::try_from(from).unwrap_or(usize::MAX);
            let rows = job.search.history().get(from..).unwrap_or_default();
            let rows = rows.iter().take(limit).copied().collect();
            Answer::Followed(SearchRows { specification: job.record.specification.clone(), rows })
        }
        _ => end(state, id),
    }
}

pub(crate) fn end(state: &State, id: JobId) -> Answer {
    if let Some(ended) = state.ended.get(&id) {
        let integrity = ended.doubts.integrity(|ban| state.host_of_ban(ban));
        return Answer::Ended { end: ended.end.clone(), integrity };
    }
    match state.jobs.get(&id).map(|job| &job.stage) {
        None | Some(Stage::StoringSubmission) => Answer::Refused(Refusal::NoJob { job: id }),
        Some(_) => Answer::Refused(Refusal::NotEnded { job: id }),
    }
}
