//! An evaluation under way: a result for each index, and the indices that nobody computes yet.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use osteon_common::observables::ObservableSet;
use osteon_common::outcome::{Outcome, RealizationResult, encode};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::results::EstimatedError;

use self::results::Results;
use self::sent_pieces::SentPieces;
use crate::core::ballot::{self, Vote};
use crate::core::crashes::{Crashes, LostWorker};
use crate::core::dispute::Dispute;
use crate::core::indices::Indices;
use crate::core::worker_name::WorkerName;
use crate::store::PartPiece;

mod results;
mod sent_pieces;

/// A batch that is to be computed a second time by another worker.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Audit {
    /// Its indices, all filled.
    pub(crate) indices: Indices,
    /// The worker that computed them first.
    pub(crate) by: WorkerName,
    /// Number of workers that were lost over the audit.
    pub(crate) lost: u32,
}

/// Contents of the store for an evaluation that is being computed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) enum StoredRecord {
    /// No record.
    #[default]
    Missing,
    /// A record that cannot be read.
    Damaged,
    /// Outcomes, some of them from a worker that was banned.
    Outcomes(Outcomes),
}

/// The realizations of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct PendingEvaluation {
    /// Number of the evaluation, from 0.
    pub number: u64,
    /// Number of this attempt: batches of earlier attempts do not count in this one.
    pub(crate) attempt: u64,
    /// The point.
    pub point: Point,
    /// Contents of the store for it.
    pub(crate) stored: StoredRecord,
    /// Number of realizations.
    realizations: u64,
    /// The results so far. Their owners are positions in `workers`.
    pub(crate) results: Results,
    /// Indices to be sent, from the front.
    pub(crate) queue: VecDeque<Indices>,
    /// Indices that were alone in a batch of a lost worker, with the workers that were lost while
    /// they held nothing else. Those that wait for another attempt are in `quarantine`.
    pub(crate) crashes: BTreeMap<u64, Crashes>,
    /// Quarantined indices that wait to be sent, each alone to a worker that holds nothing else.
    pub(crate) quarantine: VecDeque<u64>,
    /// All workers whose answers are among the results.
    pub(crate) workers: Vec<WorkerName>,
    /// The last answer of each of these, as far as it is among the results.
    pub(crate) last_answers: Vec<Indices>,
    /// Places in `workers` of those whose last realizations are audited.
    pub(crate) vouched: BTreeSet<usize>,
    /// All results are there, and their workers are proven, or nobody can check them.
    pub(crate) is_cleared: bool,
    /// Audits that have not been sent yet.
    pub(crate) audits: VecDeque<Audit>,
    /// Number of audits that are being computed.
    pub(crate) audits_out: usize,
    /// Undecided disputes.
    pub(crate) disputes: Vec<Dispute>,
    /// Indices that were filled since its results were last saved.
    pub(crate) unsaved: Vec<Indices>,
    /// Its pieces that were sent to the store.
    pub(crate) pieces: SentPieces,
    /// Time from which on its results are saved; `None` until the next tick.
    pub(crate) save_at: Option<Duration>,
    /// A worker was lost over it. While it is speculative, no further worker is risked for it until
    /// the search asks for it.
    pub(crate) has_crashed_worker: bool,
}

impl PendingEvaluation {
    /// Returns attempt `attempt` at an evaluation without any results.
    pub fn new(number: u64, attempt: u64, point: Point, realizations: u64) -> Self {
        let length = usize::try_from(realizations).unwrap_or(usize::MAX);
        Self {
            number,
            attempt,
            point,
            stored: StoredRecord::Missing,
            realizations,
            results: Results::with_room_for(length),
            queue: VecDeque::from([Indices { first: 0, count: realizations }]),
            crashes: BTreeMap::new(),
            quarantine: VecDeque::new(),
            workers: Vec::new(),
            last_answers: Vec::new(),
            vouched: BTreeSet::new(),
            is_cleared: false,
            audits: VecDeque::new(),
            audits_out: 0,
            disputes: Vec::new(),
            unsaved: Vec::new(),
            pieces: SentPieces::default(),
            save_at: None,
            has_crashed_worker: false,
        }
    }

    /// Queues exactly the indices that are not filled: nothing of it has been sent yet.
    pub(crate) fn queue_unfilled(&mut self) {
        self.queue = self.results.runs(false).into();
        let first = self.results.len() as u64;
        if first < self.realizations {
            self.queue.push_back(Indices { first, count: self.realizations - first });
        }
    }

    /// Counts all results as not saved.
    pub(crate) fn save_again(&mut self) {
        self.unsaved = self.results.runs(true);
    }

    /// Returns the number of realizations.
    pub fn realizations(&self) -> u64 {
        self.realizations
    }

    /// Returns the number of realizations that have an outcome.
    pub fn filled(&self) -> u64 {
        self.results.filled()
    }

    /// Returns the number of realizations that wait to be sent, without the quarantined ones.
    pub fn queued(&self) -> u64 {
        self.queue.iter().map(|indices| indices.count).sum()
    }

    /// Takes at most `most` indices from the front of the queue.
    pub fn take(&mut self, most: u64) -> Option<Indices> {
        let front = self.queue.front_mut()?;
        let taken = front.take(most);
        if front.count == 0 {
            self.queue.pop_front();
        }
        Some(taken)
    }

    /// Puts the indices of a revoked batch back at the front of the queue.
    pub fn put_back(&mut self, indices: Indices) {
        match self.queue.front_mut() {
            Some(front) if front.first == indices.end() => {
                front.first = indices.first;
                front.count += indices.count;
            }
            Some(front) if front.end() == indices.first => front.count += indices.count,
            _ => self.queue.push_front(indices),
        }
        self.join_front();
    }

    /// Joins the first indices of the queue with those after them while they are consecutive.
    fn join_front(&mut self) {
        while let Some((front, next)) = self.queue.front().copied().zip(self.queue.get(1).copied())
            && front.end() == next.first
        {
            self.queue.pop_front();
            if let Some(joined) = self.queue.front_mut() {
                *joined = Indices { first: front.first, count: front.count + next.count };
            }
        }
    }

    /// Puts the indices of a lost worker back at the front of the queue, in halves.
    pub fn put_back_in_halves(&mut self, indices: Indices) {
        let half = indices.count.div_ceil(2);
        let rest = Indices { first: indices.first + half, count: indices.count - half };
        if rest.count > 0 {
            self.queue.push_front(rest);
        }
        self.queue.push_front(Indices { first: indices.first, count: half });
    }

    /// Puts an index that was alone in a batch of a lost worker into quarantine.
    pub(crate) fn quarantine(&mut self, index: u64, loss: &LostWorker) {
        self.count_crash(index, loss);
        self.quarantine.push_back(index);
    }

    /// Counts the loss of a worker over one index of which another worker holds a duplicate.
    pub(crate) fn count_crash(&mut self, index: u64, loss: &LostWorker) {
        self.crashes.entry(index).or_default().add(loss);
    }

    /// Forgets the crashes of a worker that is back: nothing that it held is to blame.
    pub(crate) fn forget_crashes(&mut self, name: &WorkerName) {
        let judged = self.disputes.iter_mut().map(|dispute| &mut dispute.crashes);
        for crashes in self.crashes.values_mut().chain(judged) {
            crashes.forget(name);
        }
    }

    /// Fills the empty results of `indices` with the answer of `by`.
    pub fn fill(&mut self, indices: Indices, solved: &[RealizationResult], by: &WorkerName) {
        let known = self.workers.iter().position(|worker| worker == by);
        let place = known.unwrap_or_else(|| {
            self.workers.push(by.clone());
            self.last_answers.push(indices);
            self.workers.len() - 1
        });
        match self.unsaved.last_mut() {
            Some(last) if last.end() == indices.first => last.count += indices.count,
            _ => self.unsaved.push(indices),
        }
        let end = indices.end().min(self.realizations);
        let place_of = |index: u64| usize::try_from(index).unwrap_or(usize::MAX);
        let (first, most) = (place_of(indices.first), place_of(end.saturating_sub(indices.first)));
        let solved = solved.get(..most).unwrap_or(solved);
        // There are never so many workers that their positions do not fit into 32 bits.
        let owner = u32::try_from(place).unwrap_or(u32::MAX - 1);
        self.results.fill(first, solved, owner);
        let own = self.results.last_run_of(owner, first..first + solved.len());
        if let Some((last, run)) = self.last_answers.get_mut(place).zip(own) {
            *last = run;
            self.vouched.remove(&place);
        }
    }

    /// Notes that the last realization of a worker needs no further audit.
    pub(crate) fn vouch(&mut self, by: &WorkerName) {
        self.vouched.extend(self.workers.iter().position(|worker| worker == by));
    }

    /// Compares an answer of `by` with the results of `indices`. Returns the difference, from the
    /// first differing index to the last consecutive one that the same worker filled. Empty results
    /// count as agreement.
    pub(crate) fn compare(
        &self,
        indices: Indices,
        solved: &[RealizationResult],
        by: &WorkerName,
    ) -> Option<(Indices, [Vote; 2])> {
        let first = usize::try_from(indices.first).ok()?;
        let differs = |(place, later): (usize, &RealizationResult)| {
            let earlier = self.results.get(first + place);
            earlier.is_some_and(|earlier| !ballot::same(earlier, *later))
        };
        let at = solved.iter().enumerate().position(differs)?;
        let owner = self.owner(indices.first + at as u64)?;
        let count = self.results.of_same_owner(first + at, solved.len() - at);
        let places = first + at..first + at + count;
        let earlier = places.filter_map(|place| self.results.get(place)).collect();
        let later = solved.get(at..at + count)?.to_vec();
        let indices = Indices { first: indices.first + at as u64, count: count as u64 };
        let later = Vote { by: by.clone(), solved: later };
        Some((indices, [Vote { by: owner, solved: earlier }, later]))
    }

    /// Returns the worker that filled the result of an index.
    pub(crate) fn owner(&self, index: u64) -> Option<WorkerName> {
        let owner = self.results.owner(usize::try_from(index).ok()?)?;
        self.workers.get(usize::try_from(owner).ok()?).cloned()
    }

    /// Returns the results of `indices` that are filled, in pieces of at most `most` of the same worker.
    pub(crate) fn pieces(&self, indices: Indices, most: usize) -> Vec<PartPiece> {
        let end = usize::try_from(indices.end()).unwrap_or(usize::MAX).min(self.results.len());
        let mut first = usize::try_from(indices.first).unwrap_or(usize::MAX);
        let mut pieces = Vec::new();
        while first < end {
            let count = self.results.of_same_owner(first, most.min(end - first));
            let results = (first..first + count).filter_map(|place| self.results.get(place));
            if let Some(by) = self.owner(first as u64) {
                pieces.push(PartPiece { first: first as u64, by, results: results.collect() });
            }
            first += count.max(1);
        }
        pieces
    }

    /// Returns whether every index has an outcome and no check of them is pending.
    pub(crate) fn is_settled(&self) -> bool {
        self.filled() >= self.realizations
            && self.is_cleared
            && self.audits.is_empty()
            && self.audits_out == 0
            && self.disputes.is_empty()
    }

    /// Returns whether the evaluations stored after this one cannot be on its path, because the
    /// store has outcomes other than `outcomes` for it, or none.
    pub(crate) fn diverges_from_store(&self, outcomes: &Outcomes) -> bool {
        let bits = |outcome: &Outcome| {
            let (code, velocity) = encode(*outcome);
            (code, velocity.to_bits())
        };
        match &self.stored {
            StoredRecord::Missing => true,
            StoredRecord::Damaged => false,
            StoredRecord::Outcomes(before) => {
                let observables = |of: &Outcomes| {
                    of.observables().map(|values| {
                        let bits =
                            |values: &[f64]| values.iter().map(|one| one.to_bits()).collect();
                        values.map(bits).unwrap_or(Vec::new())
                    })
                };
                !before.iter().map(bits).eq(outcomes.iter().map(bits))
                    || observables(before) != observables(outcomes)
            }
        }
    }

    /// Returns all outcomes in index order, with these observables, and the estimated errors of the
    /// successes, once it is settled.
    pub fn complete(
        &self,
        observables: ObservableSet,
    ) -> Option<(Outcomes, Option<EstimatedError>)> {
        Some((self.outcomes(observables)?, self.estimated_error()))
    }

    /// Returns all outcomes in index order, with these observables, once it is settled.
    pub(crate) fn outcomes(&self, observables: ObservableSet) -> Option<Outcomes> {
        self.is_settled().then(|| self.results.outcomes(self.realizations, observables)).flatten()
    }

    /// Returns the estimated errors of the successes so far.
    pub(crate) fn estimated_error(&self) -> Option<EstimatedError> {
        self.results.estimated_error()
    }
}
