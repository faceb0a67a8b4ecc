//! How many workers a queue of jobs needs, and what has to be done about it.
//!
//! Plain state and a function from an observation to actions; nothing here waits, runs a program or
//! reads a clock.

use std::collections::BTreeSet;
use std::time::Duration;

use super::queue::{QueueStage, QueuedWorker};

/// Wait after the first failed allocation, and longest wait after many, s.
const BACKOFF_S: (u64, u64) = (30, 3600);
/// A worker that has run for this long was no failure.
const SOUND_AFTER: Duration = Duration::from_secs(60);

/// Limits set by the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScalingPolicy {
    /// Number of workers that are kept without work, too.
    pub min: u32,
    /// Largest number of workers, waiting ones included; at least `min`.
    pub max: u32,
    /// Largest number of workers that wait in Slurm's queue.
    pub backlog: u32,
    /// Number of threads of each worker, above 0.
    pub threads_per_worker: u32,
    /// Waiting workers for which there is no work are cancelled after this long.
    pub idle_timeout: Duration,
}

/// What is seen at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct QueueObservation {
    /// Time since the start of the program.
    pub(crate) now: Duration,
    /// Number of threads that the jobs of the coordinator can use.
    pub(crate) wanted_threads: u64,
    /// The workers in Slurm's queue, those that ended lately included.
    pub(crate) queue: Vec<QueuedWorker>,
}

/// Something to be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScalingAction {
    /// Submit workers.
    Submit {
        /// Their number, above 0.
        count: u32,
        /// Whether they stay without work.
        lasting: bool,
    },
    /// Cancel workers that still wait in the queue.
    Cancel {
        /// Their ids.
        ids: Vec<String>,
    },
}

/// What is to be done, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decision {
    /// The actions, in order.
    pub actions: Vec<ScalingAction>,
    /// The state, and the reason why no more is done.
    pub reason: String,
}

/// State between two decisions.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Scaling {
    /// Workers whose end has been taken into account, as long as Slurm lists them.
    settled: BTreeSet<String>,
    /// Workers that this program cancelled, as long as Slurm lists them.
    cancelled: BTreeSet<String>,
    /// Failed allocations since the last sound one, with the last reason.
    failures: u32,
    last_failure: String,
    /// Nothing is submitted before this time.
    blocked_until: Duration,
    /// Time since which more workers have waited than are wanted.
    surplus_since: Option<Duration>,
    /// Whether there was an observation.
    started: bool,
}

/// Returns the number of threads that jobs with these numbers of realizations can use, if each
/// thread is to get at least `per_thread` of an evaluation's realizations.
pub(crate) fn wanted_threads(realizations: impl Iterator<Item = u64>, per_thread: u32) -> u64 {
    let per_thread = u64::from(per_thread.max(1));
    realizations.map(|count| count.div_ceil(per_thread)).fold(0, u64::saturating_add)
}

impl Scaling {
    /// Decides what to do about an observation.
    pub(crate) fn decide(&mut self, policy: &ScalingPolicy, seen: &QueueObservation) -> Decision {
        self.settle(seen);
        let of = |stage: QueueStage, lasting: bool| {
            let matching = seen.queue.iter();
            let matching = matching.filter(move |it| it.stage == stage && it.lasting == lasting);
            u32::try_from(matching.count()).unwrap_or(u32::MAX)
        };
        let waiting = of(QueueStage::Waiting, false) + of(QueueStage::Waiting, true);
        let running = of(QueueStage::Running, false) + of(QueueStage::Running, true);
        let lasting = of(QueueStage::Waiting, true) + of(QueueStage::Running, true);
        let elastic = waiting + running - lasting;

        let useful = seen.wanted_threads.div_ceil(u64::from(policy.threads_per_worker.max(1)));
        let target = u32::try_from(useful).unwrap_or(u32::MAX).clamp(policy.min, policy.max);
        let mut reason = format!(
            "jobs can use {} threads: {target} workers are wanted ({} to {}), {running} run, \
             {waiting} wait in Slurm's queue{}",
            seen.wanted_threads,
            policy.min,
            policy.max,
            waits(&seen.queue)
        );
        let missing_lasting = policy.min.saturating_sub(lasting);
        let missing_elastic = (target - policy.min).saturating_sub(elastic);
        let mut actions = Vec::new();
        if missing_lasting + missing_elastic > 0 {
            let allowed = self.allowed(policy, seen.now, waiting, &mut reason);
            let lasting = missing_lasting.min(allowed);
            let elastic = missing_elastic.min(allowed - lasting);
            let submit = [(lasting, true), (elastic, false)].into_iter();
            actions.extend(
                submit
                    .filter(|(count, _)| *count > 0)
                    .map(|(count, lasting)| ScalingAction::Submit { count, lasting }),
            );
        }
        let surplus = elastic.saturating_sub(target - policy.min);
        actions.extend(self.cancelling(policy, seen, surplus));
        Decision { actions, reason }
    }

    /// Takes into account that a submission was refused.
    pub(crate) fn refused(&mut self, now: Duration, reason: &str) {
        self.fail(now, reason);
    }

    /// Counts what has ended since the last observation.
    fn settle(&mut self, seen: &QueueObservation) {
        let listed: BTreeSet<&String> = seen.queue.iter().map(|worker| &worker.id).collect();
        self.settled.retain(|id| listed.contains(id));
        self.cancelled.retain(|id| listed.contains(id));
        let mut sound = false;
        let mut failed: Option<&QueuedWorker> = None;
        for worker in &seen.queue {
            let ended = !matches!(worker.stage, QueueStage::Waiting | QueueStage::Running);
            sound |= worker.stage == QueueStage::Running && worker.running_for >= SOUND_AFTER;
            // What ended before this program began says nothing about the present.
            if !ended || !self.settled.insert(worker.id.clone()) || !self.started {
                continue;
            }
            match worker.stage {
                QueueStage::Failed => failed = Some(worker),
                // By somebody who does not want these workers.
                QueueStage::Cancelled if !self.cancelled.contains(&worker.id) => {
                    failed = Some(worker);
                }
                _ => sound = true,
            }
        }
        self.started = true;
        match failed {
            // Several that fail together are one failure: they have one cause.
            Some(worker) => self.fail(seen.now, &format!("job {}: {}", worker.id, worker.why)),
            None if sound => {
                self.failures = 0;
                self.blocked_until = Duration::ZERO;
            }
            None => {}
        }
    }

    fn fail(&mut self, now: Duration, reason: &str) {
        self.failures = self.failures.saturating_add(1);
        reason.clone_into(&mut self.last_failure);
        let doubled = BACKOFF_S.0.saturating_mul(1 << (self.failures - 1).min(20));
        self.blocked_until = now + Duration::from_secs(doubled.min(BACKOFF_S.1));
    }

    /// Returns how many workers may be submitted now; adds to `reason` why it is no more.
    fn allowed(
        &self,
        policy: &ScalingPolicy,
        now: Duration,
        waiting: u32,
        reason: &mut String,
    ) -> u32 {
        let room = policy.backlog.saturating_sub(waiting);
        if now < self.blocked_until {
            let left = (self.blocked_until - now).as_secs();
            let (failures, last) = (self.failures, &self.last_failure);
            reason.push_str(&format!(
                "; {failures} allocations failed, the last one ({last}): trying again in {left} s"
            ));
            return 0;
        }
        if room == 0 {
            reason.push_str("; no more may wait (--backlog)");
        }
        // After a failure, one shows whether the cause is gone.
        if self.failures > 0 { room.min(1) } else { room }
    }

    /// Returns the cancellation of waiting workers without work, once that has lasted.
    fn cancelling(
        &mut self,
        policy: &ScalingPolicy,
        seen: &QueueObservation,
        surplus: u32,
    ) -> Option<ScalingAction> {
        let waiting = seen.queue.iter();
        let waiting =
            waiting.filter(|worker| worker.stage == QueueStage::Waiting && !worker.lasting);
        // The last ones first: they would begin last.
        let mut ids: Vec<String> = waiting.map(|worker| worker.id.clone()).collect();
        let kept = ids.len().saturating_sub(surplus as usize);
        ids.drain(..kept);
        if ids.is_empty() {
            self.surplus_since = None;
            return None;
        }
        let since = *self.surplus_since.get_or_insert(seen.now);
        if seen.now.saturating_sub(since) < policy.idle_timeout {
            return None;
        }
        self.surplus_since = None;
        self.cancelled.extend(ids.iter().cloned());
        Some(ScalingAction::Cancel { ids })
    }
}

/// Returns why Slurm lets workers wait: each reason once.
fn waits(queue: &[QueuedWorker]) -> String {
    let waiting = queue.iter().filter(|worker| worker.stage == QueueStage::Waiting);
    let reasons: BTreeSet<&str> = waiting.map(|worker| worker.why.as_str()).collect();
    if reasons.is_empty() {
        return String::new();
    }
    format!(" ({})", reasons.into_iter().collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests;
