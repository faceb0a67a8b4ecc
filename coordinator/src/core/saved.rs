//! Results of incomplete evaluations. They are saved while a coordinator runs: as parts, which the next coordinator
//! uses, and as pieces, of which the record of the evaluation will consist.
//!
//! A large evaluation takes a while, and so do many that wait for their search to ask for them. If the
//! coordinator dies, only what was answered last is computed again.

use std::collections::BTreeMap;

use osteon_common::observables::ObservableSet;
use osteon_common::parameters::PointBits;

use crate::core::audit::{self, AuditKey};
use crate::core::evaluation::{Audit, PendingEvaluation, StoredRecord};
use crate::core::ids::JobId;
use crate::core::indices::Indices;
use crate::core::policy::PIECE_MAX;
use crate::core::worker_name::WorkerName;
use crate::store::{PIECE_OUTCOMES, PartPiece, PartRecord, PieceRecord};

/// Results that an earlier coordinator saved for a job, by the points of their evaluations.
#[derive(Debug, Default)]
pub(crate) struct SavedParts(BTreeMap<PointBits, Vec<PartPiece>>);

impl SavedParts {
    /// Returns the results in these records, without those of the workers for which `banned` is true.
    pub(crate) fn new(records: Vec<PartRecord>, banned: impl Fn(&WorkerName) -> bool) -> Self {
        let mut saved = Self::default();
        for PartRecord { point, pieces, .. } in records {
            let sound = pieces.into_iter().filter(|piece| !banned(&piece.by));
            saved.0.entry(point.bits()).or_default().extend(sound);
        }
        saved
    }

    /// Fills a new evaluation with the results that were saved for its point. They are audited like
    /// answers that have just arrived.
    pub(crate) fn restore(
        &mut self,
        evaluation: &mut PendingEvaluation,
        job: JobId,
        (key, fraction): (&AuditKey, f64),
    ) {
        let Some(pieces) = self.0.remove(&evaluation.point.bits()) else {
            return;
        };
        let number = evaluation.number;
        for PartPiece { first, by, results } in pieces {
            let indices = Indices { first, count: results.len() as u64 };
            if indices.end() > evaluation.realizations() {
                continue;
            }
            evaluation.fill(indices, &results, &by);
            if audit::is_saved_part_chosen(key, job, number, first, fraction) {
                evaluation.audits.push_back(Audit { indices, by, lost: 0 });
            }
        }
        // They are in the store already.
        evaluation.unsaved.clear();
        evaluation.queue_unfilled();
    }

    /// Drops the results of a host.
    pub(crate) fn forget(&mut self, host: &str) {
        self.0.values_mut().for_each(|pieces| pieces.retain(|piece| piece.by.host() != host));
    }
}

/// Takes results of an evaluation that are not in the store yet, at most `most` of them, as a record;
/// `None` if there are none, or if any are disputed.
pub(crate) fn take_unsaved(
    evaluation: &mut PendingEvaluation,
    job: JobId,
    most: u64,
) -> Option<PartRecord> {
    if evaluation.unsaved.is_empty() || !evaluation.disputes.is_empty() {
        return None;
    }
    let mut pieces = Vec::new();
    for indices in take_first(&mut evaluation.unsaved, most) {
        pieces.extend(evaluation.pieces(indices, PIECE_MAX));
    }
    let point = evaluation.point;
    (!pieces.is_empty()).then_some(PartRecord { job, point, pieces })
}

/// Returns the pieces of an evaluation that have all their outcomes and were not sent to the store before. If
/// the store has a record with the number of the evaluation, returns none: they would damage that record.
/// The record of the evaluation contains all pieces; it is written sooner if most are in the store already.
pub(crate) fn take_pieces(
    evaluation: &mut PendingEvaluation,
    job: JobId,
    observables: ObservableSet,
) -> Vec<PieceRecord> {
    if evaluation.stored != StoredRecord::Missing {
        return Vec::new();
    }
    let sent = evaluation.pieces.take(evaluation.results.full_pieces());
    let taken = sent.into_iter().filter_map(|piece| {
        let first = piece * PIECE_OUTCOMES;
        let outcomes =
            evaluation.results.outcomes_in(first..first + PIECE_OUTCOMES, observables)?;
        Some(PieceRecord { job, number: evaluation.number, first: first as u64, outcomes })
    });
    taken.collect()
}

/// Takes the first `most` indices.
fn take_first(of: &mut Vec<Indices>, most: u64) -> Vec<Indices> {
    let mut left = most;
    let whole = of.iter().take_while(|indices| {
        let fits = indices.count <= left;
        left -= if fits { indices.count } else { 0 };
        fits
    });
    let whole = whole.count();
    let mut taken: Vec<Indices> = of.drain(..whole).collect();
    if let Some(next) = of.first_mut().filter(|_| left > 0) {
        taken.push(Indices { first: next.first, count: left });
        next.first += left;
        next.count -= left;
    }
    taken
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::RealizationResult;
    use osteon_common::outcomes::Outcomes;
    use osteon_common::parameters::Point;

    use super::*;

    #[test]
    fn indices_are_taken_from_the_front() {
        let indices = |ranges: &[(u64, u64)]| -> Vec<Indices> {
            ranges.iter().map(|&(first, count)| Indices { first, count }).collect()
        };
        let all = [(7, 3), (20, 5), (0, 2)];
        for (most, taken, left) in [
            (0, &[][..], &all[..]),
            (2, &[(7, 2)], &[(9, 1), (20, 5), (0, 2)]),
            (3, &[(7, 3)], &[(20, 5), (0, 2)]),
            (4, &[(7, 3), (20, 1)], &[(21, 4), (0, 2)]),
            (10, &all, &[]),
            (u64::MAX, &all, &[]),
        ] {
            let mut of = indices(&all);
            assert_eq!(take_first(&mut of, most), indices(taken), "{most}");
            assert_eq!(of, indices(left), "{most}");
        }
    }
    const PIECE: u64 = PIECE_OUTCOMES as u64;

    fn result(index: u64) -> RealizationResult {
        RealizationResult::solved(3000.0 + index as f64, 1e-5)
    }

    fn fill(evaluation: &mut PendingEvaluation, first: u64, count: u64) {
        let solved: Vec<_> = (first..first + count).map(result).collect();
        evaluation.fill(Indices { first, count }, &solved, &WorkerName::new("node", 1, 2));
    }

    /// Returns the numbers of the pieces that are taken, and checks what is in them.
    fn take_numbers(evaluation: &mut PendingEvaluation) -> Vec<u64> {
        let pieces = take_pieces(evaluation, JobId(5), ObservableSet::NONE);
        for piece in &pieces {
            assert_eq!((piece.job, piece.number), (JobId(5), 3));
            let expected: Outcomes =
                (piece.first..piece.first + PIECE).map(|index| result(index).outcome).collect();
            assert!(piece.outcomes == expected, "other outcomes from {}", piece.first);
        }
        pieces.iter().map(|piece| piece.first / PIECE).collect()
    }

    #[test]
    fn full_pieces_are_taken_once() {
        let mut evaluation = PendingEvaluation::new(3, 7, Point::of_bone([1.0; 7]), 4 * PIECE + 9);
        fill(&mut evaluation, 0, 2 * PIECE - 1);
        fill(&mut evaluation, 3 * PIECE, PIECE);
        assert_eq!(take_numbers(&mut evaluation), [3]);
        fill(&mut evaluation, 2 * PIECE - 1, PIECE);
        assert_eq!(take_numbers(&mut evaluation), [1]);
        // What is filled already counts once.
        fill(&mut evaluation, 2 * PIECE - 1, PIECE);
        assert_eq!(take_numbers(&mut evaluation), [0; 0]);
        // The last one is not full.
        fill(&mut evaluation, 3 * PIECE - 1, PIECE + 10);
        assert_eq!(take_numbers(&mut evaluation), [2]);
    }

    #[test]
    fn a_record_that_is_there_is_not_touched() {
        let mut evaluation = PendingEvaluation::new(3, 7, Point::of_bone([1.0; 7]), 3 * PIECE);
        evaluation.stored = StoredRecord::Damaged;
        fill(&mut evaluation, 0, 3 * PIECE);
        assert_eq!(take_numbers(&mut evaluation), [0; 0]);
    }
}
