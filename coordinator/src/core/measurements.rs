//! Measurements: the numbers that describe a state at one moment, for monitoring. They contain no
//! names of users, jobs and hosts.

use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_proto::v1::WorkerState;

use crate::core::job::{Job, Stage};
use crate::core::policy::{BATCH_WORTH_S, REALIZATION_USUAL_S};
use crate::core::reactor::realizations_held;
use crate::core::service_condition::Bounded;
use crate::core::state::{AttachedWorker, State};
use crate::core::worker_list;

/// A state at one moment, in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct StateMeasurements {
    pub(crate) jobs_waiting: u64,
    pub(crate) jobs_running: u64,
    pub(crate) jobs_ended: u64,
    /// Realizations that no worker holds, of evaluations that a search needs (not of speculative ones).
    pub(crate) realizations_waiting: u64,
    pub(crate) slots_busy: u64,
    pub(crate) slots_idle: u64,
    /// Free slots of workers that drain or are on probation.
    pub(crate) slots_unavailable: u64,
    /// Slots that the jobs which have not ended could keep busy together.
    pub(crate) slots_wanted: u64,
    pub(crate) workers_ok: u64,
    pub(crate) workers_draining: u64,
    pub(crate) workers_distrusted: u64,
    pub(crate) workers_on_probation: u64,
    pub(crate) workers_banned: u64,
    pub(crate) batches_in_flight: u64,
    /// Time since the oldest batch that a worker holds was sent.
    pub(crate) oldest_batch: Duration,
    /// Time for which the store has refused a record.
    pub(crate) store_refusing: Duration,
    /// Time for which the store's log could not be copied into the database.
    pub(crate) log_stuck: Duration,
    pub(crate) log_stuck_bytes: u64,
    /// Used part of each bound, 0 to 1.
    pub(crate) bounds_used: Vec<(Bounded, f64)>,
}

impl StateMeasurements {
    pub(crate) fn new(state: &State, now: Duration) -> Self {
        let since =
            |then: Option<Duration>| then.map_or(Duration::ZERO, |it| now.saturating_sub(it));
        let mut measured = Self {
            jobs_ended: state.ended.len() as u64,
            workers_banned: state.banned.iter().filter(|it| it.record.lifted.is_none()).count()
                as u64,
            batches_in_flight: state.batches.len() as u64,
            oldest_batch: since(state.batches.values().map(|batch| batch.sent).min()),
            store_refusing: since(oldest_refusal(state)),
            log_stuck: since(state.condition.stuck_log.map(|stuck| stuck.since)),
            log_stuck_bytes: state.condition.stuck_log.map_or(0, |stuck| stuck.bytes),
            bounds_used: Bounded::ALL.map(|what| (what, used_fraction(what, state))).to_vec(),
            ..Self::default()
        };
        for job in state.jobs.values() {
            measured.add_job(job);
        }
        for worker in state.workers.values() {
            measured.add_worker(state, worker);
        }
        measured
    }

    fn add_job(&mut self, job: &Job) {
        match job.stage {
            // No client knows it yet.
            Stage::StoringSubmission => {}
            Stage::Waiting => self.jobs_waiting += 1,
            _ => self.jobs_running += 1,
        }
        for evaluation in job.needed_evaluations() {
            self.realizations_waiting += evaluation.queued() + evaluation.quarantine.len() as u64;
        }
        self.slots_wanted += slots_wanted(job);
    }

    fn add_worker(&mut self, state: &State, worker: &AttachedWorker) {
        let slots = u64::from(worker.hello.slots);
        let busy = realizations_held(state, worker).min(slots);
        self.slots_busy += busy;
        if state.is_sound(worker) {
            self.slots_idle += slots - busy;
        } else {
            self.slots_unavailable += slots - busy;
        }
        *match worker_list::worker_state(state, worker) {
            WorkerState::Ok | WorkerState::Unspecified => &mut self.workers_ok,
            WorkerState::Draining => &mut self.workers_draining,
            WorkerState::Distrusted => &mut self.workers_distrusted,
            WorkerState::Probation => &mut self.workers_on_probation,
        } += 1;
    }
}

fn used_fraction(what: Bounded, state: &State) -> f64 {
    let (used, most) = what.usage(state);
    used as f64 / most.max(1) as f64
}

/// Returns the number of slots that a job could keep busy. Each group and start of a search that has not
/// ended counts with all realizations of an evaluation, however many of the present one are done: the next
/// evaluation follows at once, and the number would otherwise fall to nothing at the end of each.
fn slots_wanted(job: &Job) -> u64 {
    let specification = &job.record.specification;
    let all = specification.monte_carlo.realizations;
    let realizations = match (&job.stage, specification.kind) {
        (Stage::StoringSubmission | Stage::StoringEnd(_), _) => 0,
        (
            Stage::Completing(_) | Stage::StoringEvaluation { .. } | Stage::StoringPrepared { .. },
            JobKind::Propagation,
        ) => 0,
        (Stage::Computing(evaluation), JobKind::Propagation) => all - evaluation.filled().min(all),
        _ => all.saturating_mul(job.search.parts().saturating_sub(job.search.part())),
    };
    let each = job
        .realization_time
        .expected_time(1, 1)
        .map_or(REALIZATION_USUAL_S, |time| time.as_secs_f64());
    let worth = (realizations as f64 * each / BATCH_WORTH_S).ceil();
    // `as` saturates.
    (worth as u64).clamp(realizations.min(1), realizations)
}

/// Returns since when the store has refused a record; of several, the one refused for longest.
fn oldest_refusal(state: &State) -> Option<Duration> {
    let jobs = state.jobs.values().filter_map(|job| Some(job.store_retry.as_ref()?.since));
    let bans = state.banned.iter().filter(|banned| banned.refused).map(|banned| banned.record.at);
    jobs.chain(bans).min()
}
