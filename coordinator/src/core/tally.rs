//! Counts what happens in a coordinator, from its events and effects: the reactions themselves count
//! nothing. The numbers are for monitoring and influence nothing.

use std::collections::BTreeMap;
use std::time::Duration;

use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::results::Status;

use crate::core::batch::{Assignment, Purpose};
use crate::core::distribution::TimeDistribution;
use crate::core::effect::{Effect, RecordKey};
use crate::core::event::Event;
use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::job::Stage;
use crate::core::notice::Notice;
use crate::core::state::State;

/// Counts since the start of the process.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct EventCounts {
    pub(crate) jobs_accepted: u64,
    /// In the order of [`Status::ALL`].
    pub(crate) jobs_ended: [u64; Status::ALL.len()],
    /// Evaluations that are durable.
    pub(crate) evaluations: u64,
    /// Realizations that filled an index of an evaluation: successes, then each kind of failure by
    /// its code.
    pub(crate) realizations: [u64; FailureKind::ALL.len() + 1],
    /// Batches sent, by [`purpose`].
    pub(crate) batches_sent: [u64; PURPOSES.len()],
    /// Batches sent while another worker held the same.
    pub(crate) batches_duplicated: u64,
    /// Batches of workers that departed, which others compute.
    pub(crate) batches_reassigned: u64,
    /// Answers that differ from the answer of another worker.
    pub(crate) mismatches: u64,
    pub(crate) bans: u64,
    pub(crate) workers_attached: u64,
    pub(crate) workers_refused: u64,
    /// Workers that left as announced, or held nothing.
    pub(crate) workers_left: u64,
    pub(crate) workers_lost: u64,
    /// Writes and reads that the store refused.
    pub(crate) store_errors: u64,
    /// Times from one durable evaluation of a job, or from its start, to the next.
    pub(crate) evaluation_times: TimeDistribution,
}

/// Returns the number of evaluations in the record that a job is storing.
fn evaluations_in_record(state: &State, job: JobId) -> u64 {
    match state.jobs.get(&job).map(|job| &job.stage) {
        Some(Stage::StoringPrepared { records, .. }) => records.len() as u64,
        _ => 1,
    }
}

/// Names of the purposes of batches.
pub(crate) const PURPOSES: [&str; 6] =
    ["fill", "exclusive", "speculative", "audit", "tie_break", "proof"];

/// Returns the place of a purpose in [`PURPOSES`].
fn purpose(purpose: Purpose) -> usize {
    match purpose {
        Purpose::Fill => 0,
        Purpose::Exclusive => 1,
        Purpose::Speculative => 2,
        Purpose::Audit { .. } => 3,
        Purpose::TieBreak => 4,
        Purpose::Proof => 5,
    }
}

/// Counts, and what is needed to continue counting.
#[derive(Debug, Default)]
pub(crate) struct EventTally {
    counts: EventCounts,
    /// Time since which each job that has started waits for its next durable evaluation.
    evaluating: BTreeMap<JobId, Duration>,
}

/// What the state was before a reaction.
#[derive(Debug)]
pub(crate) struct Before {
    /// The batch that is answered, with the number of disputes in its evaluation.
    disputes: Option<(Assignment, usize)>,
    bans: usize,
}

impl EventTally {
    pub(crate) fn counts(&self) -> &EventCounts {
        &self.counts
    }

    /// Counts an event before the state reacts to it.
    pub(crate) fn count_event(&mut self, state: &State, event: &Event, now: Duration) -> Before {
        let mut disputes = None;
        match event {
            Event::Answered { worker, batch, solved, .. } => {
                self.fill(state, *worker, *batch, solved);
                disputes = assignment(state, *worker, *batch)
                    .map(|assignment| (assignment, disputes_in(state, &assignment)));
            }
            Event::Stored { job, key: RecordKey::Evaluation(_) } => {
                self.counts.evaluations += evaluations_in_record(state, *job);
                if let Some(since) = self.evaluating.get_mut(job) {
                    self.counts.evaluation_times.add(now.saturating_sub(*since));
                    *since = now;
                }
            }
            Event::StoreFailed { .. }
            | Event::Read { found: Err(_), .. }
            | Event::Pruned { outcome: Err(_), .. } => self.counts.store_errors += 1,
            _ => {}
        }
        Before { disputes, bans: state.banned.len() }
    }

    /// Counts what a reaction has changed, and its effects.
    pub(crate) fn count_reaction(
        &mut self,
        before: &Before,
        state: &State,
        effects: &[Effect],
        now: Duration,
    ) {
        if let Some((assignment, disputes)) = before.disputes {
            let new = disputes_in(state, &assignment).saturating_sub(disputes);
            self.counts.mismatches += new as u64;
        }
        self.counts.bans += state.banned.len().saturating_sub(before.bans) as u64;
        self.count_effects(state, effects, now);
    }

    /// Counts effects.
    pub(crate) fn count_effects(&mut self, state: &State, effects: &[Effect], now: Duration) {
        for effect in effects {
            match effect {
                Effect::Send { batch, .. } => {
                    if let Some(sent) = state.batches.get(batch) {
                        self.counts.batches_sent[purpose(sent.purpose)] += 1;
                        self.counts.batches_duplicated += u64::from(!sent.duplicates.is_empty());
                    }
                }
                Effect::Note(notice) => self.notice(notice, now),
                _ => {}
            }
        }
    }

    fn notice(&mut self, notice: &Notice, now: Duration) {
        let counts = &mut self.counts;
        match notice {
            Notice::WorkerAttached { .. } => counts.workers_attached += 1,
            Notice::WorkerRefused { .. } => counts.workers_refused += 1,
            Notice::WorkerDetached { batches, why, .. } => {
                counts.batches_reassigned += *batches as u64;
                if why.is_orderly() || *batches == 0 {
                    counts.workers_left += 1;
                } else {
                    counts.workers_lost += 1;
                }
            }
            Notice::JobAccepted { .. } => counts.jobs_accepted += 1,
            Notice::JobStarted { job, .. } => {
                self.evaluating.insert(*job, now);
            }
            Notice::Concern { .. } => {}
            Notice::JobEnded { job, ending, .. } => {
                self.evaluating.remove(job);
                if let Some(place) = Status::ALL.iter().position(|it| *it == ending.status) {
                    counts.jobs_ended[place] += 1;
                }
            }
        }
    }

    /// Counts the realizations of an answer if they fill an evaluation: those of duplicates, audits
    /// and late answers are only compared.
    fn fill(&mut self, state: &State, worker: WorkerId, id: BatchId, solved: &[RealizationResult]) {
        let held = state.batches.get(&id).filter(|batch| batch.worker == worker);
        let fills = held.is_some_and(|batch| {
            batch.purpose.fills()
                && batch.assignment.indices.count == solved.len() as u64
                && state.evaluation_of(&batch.assignment).is_some()
        });
        if fills {
            for result in solved {
                let place = result.outcome.map_or_else(FailureKind::code, |_| 0);
                self.counts.realizations[usize::from(place)] += 1;
            }
        }
    }
}

/// Returns the assignment of a batch that a worker holds or held.
fn assignment(state: &State, worker: WorkerId, id: BatchId) -> Option<Assignment> {
    let held = state.batches.get(&id).filter(|batch| batch.worker == worker);
    held.map(|batch| batch.assignment).or_else(|| {
        let settled = &state.workers.get(&worker)?.settled;
        settled.iter().find(|(settled, _)| *settled == id).map(|(_, assignment)| *assignment)
    })
}

/// Returns the number of disputes in the evaluation of an assignment, while it is under way.
fn disputes_in(state: &State, assignment: &Assignment) -> usize {
    state.evaluation_of(assignment).map_or(0, |evaluation| evaluation.disputes.len())
}
