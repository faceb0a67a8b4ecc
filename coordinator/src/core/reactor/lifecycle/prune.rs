//! Deletes ended jobs: on a client's request, and when they are old.

use std::time::Duration;

use crate::core::effect::{Answer, Effect, Refusal};
use crate::core::event::Retention;
use crate::core::ids::{JobId, ReplyId};
use crate::core::reactor::turn::Turn;
use crate::core::state::State;

/// Interval of the search for old jobs.
const LOOK_EVERY: Duration = Duration::from_secs(60);
/// Time after the start during which a coordinator deletes no job on its own, unless jobs are kept
/// for less: its clock may be far ahead of that of earlier runs, and the operator needs time to
/// notice.
const GRACE: Duration = Duration::from_secs(3600);

/// Deletes the jobs that `retention` does not keep; the client is answered when that is durable.
pub(crate) fn prune_on_request(turn: &mut Turn, reply_id: ReplyId, retention: Retention) {
    let jobs = choose_jobs(turn.state, retention, turn.now);
    if jobs.is_empty() {
        turn.effects.push(Effect::Answer { reply_id, answer: Answer::Pruned(jobs) });
    } else {
        turn.effects.push(Effect::Prune { reply_id: Some(reply_id), jobs });
    }
}

/// Deletes the jobs that ended longer ago than the operator keeps them.
pub(crate) fn tick(turn: &mut Turn) {
    let Some(keep_for) = turn.state.config.keep_ended else {
        return;
    };
    let is_first = turn.state.pruned.is_none();
    if turn.state.pruned.is_some_and(|last| turn.now.saturating_sub(last) < LOOK_EVERY) {
        return;
    }
    turn.state.pruned = Some(turn.now);
    let retention = Retention { keep_for: Some(keep_for), keep_last: None };
    let jobs = choose_jobs(turn.state, retention, turn.now);
    let grace = GRACE.min(keep_for).saturating_sub(turn.now.saturating_sub(turn.state.started));
    // Until then, no job that ended in this run can be older than that.
    if grace > Duration::ZERO {
        if is_first && !jobs.is_empty() {
            tracing::warn!(
                jobs = jobs.len(),
                in_s = grace.as_secs(),
                "these ended jobs are older than --keep-ended by this machine's clock and will be \
                 forgotten; stop the coordinator if the clock is wrong"
            );
        }
        return;
    }
    if !jobs.is_empty() {
        turn.effects.push(Effect::Prune { reply_id: None, jobs });
    }
}

/// Removes jobs that the store has deleted, or reports that it could not delete them.
pub(crate) fn on_pruned(
    turn: &mut Turn,
    reply_id: Option<ReplyId>,
    jobs: Vec<JobId>,
    outcome: Result<(), String>,
) {
    let answer = match outcome {
        Ok(()) => {
            for job in &jobs {
                if let Some(request) = turn.state.ended.remove(job).and_then(|ended| ended.request)
                    && turn.state.requests.get(&request) == Some(job)
                {
                    turn.state.requests.remove(&request);
                }
            }
            Answer::Pruned(jobs)
        }
        Err(error) => Answer::Refused(Refusal::NotPruned { error }),
    };
    if let Some(reply_id) = reply_id {
        turn.effects.push(Effect::Answer { reply_id, answer });
    }
}

/// Returns the ended jobs that are not kept, in the order of their identifiers.
fn choose_jobs(state: &State, retention: Retention, now: Duration) -> Vec<JobId> {
    let Retention { keep_for, keep_last } = retention;
    let mut ended: Vec<(Duration, JobId)> =
        state.ended.iter().map(|(id, job)| (job.end.ended, *id)).collect();
    ended.sort_unstable();
    let keep_last = usize::try_from(keep_last.unwrap_or(0)).unwrap_or(usize::MAX);
    ended.truncate(ended.len().saturating_sub(keep_last));
    let is_young = |at: Duration| keep_for.is_some_and(|age| now.saturating_sub(at) <= age);
    ended.retain(|(at, _)| !is_young(*at));
    let mut jobs: Vec<JobId> = ended.into_iter().map(|(_, id)| id).collect();
    jobs.sort_unstable();
    jobs
}
