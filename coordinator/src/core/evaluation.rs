//! An evaluation under way: a result for each index, and the indices that nobody computes yet.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use osteon_common::outcome::{FailureKind, Outcome, RealizationResult, encode};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::quantile;
use osteon_common::results::EstimatedError;

use crate::core::crashes::{Crashes, LostWorker};
use crate::core::dispute::{self, Dispute, Vote};
use crate::core::indices::Indices;
use crate::core::worker_name::WorkerName;

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
    /// Result of each index, up to the last one that has been filled: a large evaluation is not set up
    /// at once.
    pub(crate) results: Vec<Option<RealizationResult>>,
    /// Number of results that are filled.
    pub(crate) filled: u64,
    /// Indices to be sent, from the front.
    pub(crate) queue: VecDeque<Indices>,
    /// Indices that were alone in a batch of a lost worker, with the workers that were lost while
    /// they held nothing else. Those that wait for another attempt are in `quarantine`.
    pub(crate) crashes: BTreeMap<u64, Crashes>,
    /// Quarantined indices that wait to be sent, each alone to a worker that holds nothing else.
    pub(crate) quarantine: VecDeque<u64>,
    /// All workers whose answers are among the results.
    pub(crate) workers: Vec<WorkerName>,
    /// Position in `workers` of the worker that gave each result; meaningless while the result is
    /// empty.
    owners: Vec<u32>,
    /// Audits that have not been sent yet.
    pub(crate) audits: VecDeque<Audit>,
    /// Number of audits that are being computed.
    pub(crate) audits_out: usize,
    /// Undecided disputes.
    pub(crate) disputes: Vec<Dispute>,
    /// Indices that were filled since its results were last saved.
    pub(crate) unsaved: Vec<Indices>,
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
            results: Vec::with_capacity(length),
            filled: 0,
            queue: VecDeque::from([Indices { first: 0, count: realizations }]),
            crashes: BTreeMap::new(),
            quarantine: VecDeque::new(),
            workers: Vec::new(),
            owners: Vec::with_capacity(length),
            audits: VecDeque::new(),
            audits_out: 0,
            disputes: Vec::new(),
            unsaved: Vec::new(),
            save_at: None,
            has_crashed_worker: false,
        }
    }

    /// Queues exactly the indices that are not filled: nothing of it has been sent yet.
    pub(crate) fn queue_unfilled(&mut self) {
        self.queue = runs(&self.results, Option::is_none).into();
        let first = self.results.len() as u64;
        if first < self.realizations {
            self.queue.push_back(Indices { first, count: self.realizations - first });
        }
    }

    /// Counts all results as not saved.
    pub(crate) fn save_again(&mut self) {
        self.unsaved = runs(&self.results, Option::is_some);
    }

    /// Returns the number of realizations.
    pub fn realizations(&self) -> u64 {
        self.realizations
    }

    /// Returns the number of realizations that have an outcome.
    pub fn filled(&self) -> u64 {
        self.filled
    }

    /// Returns the number of realizations that wait to be sent, without the quarantined ones.
    pub fn queued(&self) -> u64 {
        self.queue.iter().map(|indices| indices.count).sum()
    }

    /// Takes at most `most` indices from the front of the queue.
    pub fn take(&mut self, most: u64) -> Option<Indices> {
        let front = self.queue.front_mut()?;
        let taken = Indices { first: front.first, count: front.count.min(most.max(1)) };
        front.first += taken.count;
        front.count -= taken.count;
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
            _ => self.queue.push_front(indices),
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
            self.workers.len() - 1
        });
        let owner = u32::try_from(place).unwrap_or(u32::MAX);
        match self.unsaved.last_mut() {
            Some(last) if last.end() == indices.first => last.count += indices.count,
            _ => self.unsaved.push(indices),
        }
        let first = usize::try_from(indices.first).unwrap_or(usize::MAX);
        let end = usize::try_from(indices.end().min(self.realizations)).unwrap_or(usize::MAX);
        if self.results.len() < end {
            self.results.resize(end, None);
            self.owners.resize(end, 0);
        }
        let results = self.results.get_mut(first..).unwrap_or_default();
        let owners = self.owners.get_mut(first..).unwrap_or_default();
        for ((result, owned), solved) in results.iter_mut().zip(owners).zip(solved) {
            if result.is_none() {
                *result = Some(*solved);
                *owned = owner;
                self.filled += 1;
            }
        }
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
        let results = self.results.get(first..)?;
        let differs = |(result, later): (&Option<RealizationResult>, &RealizationResult)| {
            result.is_some_and(|earlier| !dispute::same(earlier, *later))
        };
        let at = results.iter().zip(solved).position(differs)?;
        let owner = self.owners.get(first + at)?;
        let whose = self.owners.get(first + at..)?.iter().zip(results.get(at..)?);
        let run = whose.take_while(|(of, _)| *of == owner).map_while(|(_, result)| *result);
        let earlier: Vec<RealizationResult> = run.take(solved.len() - at).collect();
        let later = solved.get(at..at + earlier.len())?.to_vec();
        let indices = Indices { first: indices.first + at as u64, count: earlier.len() as u64 };
        let owner = self.workers.get(usize::try_from(*owner).ok()?)?.clone();
        let later = Vote { by: by.clone(), solved: later };
        Some((indices, [Vote { by: owner, solved: earlier }, later]))
    }

    /// Returns the worker that filled the result of an index.
    pub(crate) fn owner(&self, index: u64) -> Option<WorkerName> {
        let owner = self.owners.get(usize::try_from(index).ok()?)?;
        self.workers.get(usize::try_from(*owner).ok()?).cloned()
    }

    /// Passes the filled results of `indices` to `visit`, in runs of at most `most` of the same worker:
    /// the first index, the worker, and the results, none of which is empty.
    pub(crate) fn visit_runs(
        &self,
        indices: Indices,
        most: usize,
        mut visit: impl FnMut(u64, &WorkerName, &[Option<RealizationResult>]),
    ) {
        let end = usize::try_from(indices.end()).unwrap_or(usize::MAX).min(self.results.len());
        let mut first = usize::try_from(indices.first).unwrap_or(usize::MAX);
        while let Some(rest) = self.results.get(first..end).filter(|rest| !rest.is_empty()) {
            let owners = self.owners.get(first..end).unwrap_or_default();
            let owner = owners.first().copied();
            let same = |(result, of): &(&Option<RealizationResult>, &u32)| {
                result.is_some() && Some(**of) == owner
            };
            let count = rest.iter().zip(owners).take(most).take_while(same).count();
            let by = owner.and_then(|owner| self.workers.get(usize::try_from(owner).ok()?));
            if let Some(by) = by.filter(|_| count > 0) {
                visit(first as u64, by, &rest[..count]);
            }
            first += count.max(1);
        }
    }

    /// Returns whether every index has an outcome and no check of them is pending.
    pub(crate) fn is_settled(&self) -> bool {
        self.filled >= self.realizations
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
                let decays = |of: &Outcomes| -> Option<Vec<u64>> {
                    of.decays().map(|all| all.iter().map(|decay| decay.to_bits()).collect())
                };
                !before.iter().map(bits).eq(outcomes.iter().map(bits))
                    || decays(before) != decays(outcomes)
            }
        }
    }

    /// Returns all outcomes in index order, `with_decays` or without, and the estimated errors of the
    /// successes, once it is settled.
    pub fn complete(&self, with_decays: bool) -> Option<(Outcomes, Option<EstimatedError>)> {
        Some((self.outcomes(with_decays)?, self.estimated_error()))
    }

    /// Returns all outcomes in index order, `with_decays` or without, once it is settled.
    pub(crate) fn outcomes(&self, with_decays: bool) -> Option<Outcomes> {
        if !self.is_settled() || self.results.iter().any(Option::is_none) {
            return None;
        }
        // None is empty. With a known length they are written to their place at once.
        let empty = Err(FailureKind::NotFinite);
        let outcomes: Outcomes =
            self.results.iter().map(|result| result.map_or(empty, |it| it.outcome)).collect();
        let decays =
            with_decays.then(|| self.results.iter().flatten().map(|solved| solved.decay).collect());
        Some(outcomes.with_decays(decays))
    }

    /// Returns the estimated errors of the successes so far.
    pub(crate) fn estimated_error(&self) -> Option<EstimatedError> {
        let mut errors = Vec::with_capacity(self.results.len());
        let successes = self.results.iter().flatten().filter(|solved| solved.outcome.is_ok());
        errors.extend(successes.map(|solved| solved.estimated_error));
        quantile::estimated_error(errors)
    }
}

/// Returns the runs of consecutive indices whose results satisfy `of`.
fn runs(
    results: &[Option<RealizationResult>],
    of: impl Fn(&Option<RealizationResult>) -> bool,
) -> Vec<Indices> {
    let mut found = Vec::new();
    let mut first = 0;
    for run in results.chunk_by(|one, other| of(one) == of(other)) {
        let count = run.len() as u64;
        if run.first().is_some_and(&of) {
            found.push(Indices { first, count });
        }
        first += count;
    }
    found
}
