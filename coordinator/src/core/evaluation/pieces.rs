//! Pieces of a large evaluation that are stored before it is complete.
//!
//! Its record is as large as all its pieces. If most of them are in the store already, whoever waits for
//! the record waits only for the rest.

use super::{PendingEvaluation, StoredRecord};
use crate::core::ids::JobId;
use crate::store::{PIECE_OUTCOMES, PieceRecord};

/// Maximum number of pieces of an evaluation that are being stored: nothing else happens while they are
/// copied, and records wait for those that are written.
const BEING_STORED_MAX: usize = 8;

/// The pieces of an evaluation that were sent to the store.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SentPieces {
    /// Whether each was, up to the last that was.
    sent: Vec<bool>,
    /// Number of those that are not reported yet.
    pub(crate) being_stored: usize,
}

/// Returns pieces of an evaluation of `job` that have all their outcomes and were not sent before, as
/// records; none for one whose number has a record already, which they would damage.
pub(crate) fn take_pieces(
    evaluation: &mut PendingEvaluation,
    job: JobId,
    with_decays: bool,
) -> Vec<PieceRecord> {
    if evaluation.stored != StoredRecord::Missing {
        return Vec::new();
    }
    let most = BEING_STORED_MAX.saturating_sub(evaluation.pieces.being_stored);
    let pieces = evaluation.results.full_pieces();
    // The first outcomes are in the row of the evaluation itself.
    let unsent = pieces.filter(|piece| *piece > 0 && !evaluation.pieces.is_sent(*piece));
    let unsent: Vec<usize> = unsent.take(most).collect();
    let taken = unsent.into_iter().filter_map(|piece| {
        evaluation.pieces.send(piece);
        let first = piece * PIECE_OUTCOMES;
        let outcomes =
            evaluation.results.outcomes_in(first..first + PIECE_OUTCOMES, with_decays)?;
        Some(PieceRecord { job, number: evaluation.number, first: first as u64, outcomes })
    });
    taken.collect()
}

impl SentPieces {
    fn is_sent(&self, piece: usize) -> bool {
        self.sent.get(piece).is_some_and(|sent| *sent)
    }

    fn send(&mut self, piece: usize) {
        self.sent.resize(self.sent.len().max(piece + 1), false);
        self.sent[piece] = true;
        self.being_stored += 1;
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::RealizationResult;
    use osteon_common::outcomes::Outcomes;
    use osteon_common::parameters::Point;

    use super::*;
    use crate::core::indices::Indices;
    use crate::core::worker_name::WorkerName;

    const PIECE: u64 = PIECE_OUTCOMES as u64;

    fn result(index: u64) -> RealizationResult {
        RealizationResult { outcome: Ok(3000.0 + index as f64), estimated_error: 1e-5, decay: 0.0 }
    }

    /// Returns an evaluation of 20 pieces and 9 outcomes.
    fn evaluation() -> PendingEvaluation {
        PendingEvaluation::new(3, 7, Point::of_bone([1.0; 7]), 20 * PIECE + 9)
    }

    fn fill(evaluation: &mut PendingEvaluation, first: u64, count: u64) {
        let solved: Vec<_> = (first..first + count).map(result).collect();
        evaluation.fill(Indices { first, count }, &solved, &WorkerName::new("node", 1, 2));
    }

    fn taken(evaluation: &mut PendingEvaluation) -> Vec<u64> {
        let pieces = take_pieces(evaluation, JobId(5), false);
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
        let mut evaluation = evaluation();
        fill(&mut evaluation, 0, 2 * PIECE - 1);
        fill(&mut evaluation, 3 * PIECE, PIECE);
        assert_eq!(taken(&mut evaluation), [3]);
        fill(&mut evaluation, 2 * PIECE - 1, PIECE);
        assert_eq!(taken(&mut evaluation), [1]);
        // What is filled already counts once.
        fill(&mut evaluation, 2 * PIECE - 1, PIECE);
        assert_eq!(taken(&mut evaluation), [0; 0]);
    }

    #[test]
    fn a_store_that_is_slow_gets_no_more() {
        let mut evaluation = evaluation();
        fill(&mut evaluation, 0, 20 * PIECE + 9);
        assert_eq!(taken(&mut evaluation), [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(taken(&mut evaluation), [0; 0]);
        evaluation.pieces.being_stored -= 3;
        assert_eq!(taken(&mut evaluation), [9, 10, 11]);
        evaluation.pieces.being_stored = 0;
        assert_eq!(taken(&mut evaluation), [12, 13, 14, 15, 16, 17, 18, 19]);
    }

    #[test]
    fn a_record_that_is_there_is_not_touched() {
        let mut evaluation = evaluation();
        evaluation.stored = StoredRecord::Damaged;
        fill(&mut evaluation, 0, 3 * PIECE);
        assert_eq!(taken(&mut evaluation), [0; 0]);
    }
}
