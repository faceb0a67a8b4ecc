//! The pieces of a large evaluation that were sent to the store before it is complete.

/// Maximum number of pieces of an evaluation that are being stored: copying them blocks the core, and other
/// records wait in the store until they are written.
const BEING_STORED_MAX: usize = 8;

/// The pieces of an evaluation that were sent to the store.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SentPieces {
    /// Whether each piece was sent, by its number.
    sent: Vec<bool>,
    /// Number of those that the store has not reported yet.
    being_stored: usize,
}

impl SentPieces {
    /// Marks those of the `full` pieces that are to be sent now, and returns them.
    pub(crate) fn take(&mut self, full: impl Iterator<Item = usize>) -> Vec<usize> {
        // The first outcomes are in the row of the evaluation itself.
        let unsent = |piece: &usize| *piece > 0 && !self.sent.get(*piece).is_some_and(|sent| *sent);
        let most = BEING_STORED_MAX.saturating_sub(self.being_stored);
        let pieces: Vec<usize> = full.filter(unsent).take(most).collect();
        self.being_stored += pieces.len();
        for piece in &pieces {
            self.sent.resize(self.sent.len().max(piece + 1), false);
            self.sent[*piece] = true;
        }
        pieces
    }

    /// Counts a piece as stored, or as refused by the store.
    pub(crate) fn count_report(&mut self) {
        self.being_stored = self.being_stored.saturating_sub(1);
    }

    /// Returns the number of those that are not reported yet.
    #[cfg(test)]
    pub(crate) fn being_stored(&self) -> usize {
        self.being_stored
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_piece_is_sent_once_and_few_at_a_time() {
        let mut pieces = SentPieces::default();
        assert_eq!(pieces.take([0, 3].into_iter()), [3]);
        assert_eq!(pieces.take([0, 1, 3].into_iter()), [1]);
        assert_eq!(pieces.take(0..12), [2, 4, 5, 6, 7, 8]);
        assert_eq!(pieces.take(0..12), [0; 0]);
        (0..2).for_each(|_| pieces.count_report());
        assert_eq!(pieces.take(0..12), [9, 10]);
        (0..9).for_each(|_| pieces.count_report());
        assert_eq!(pieces.being_stored(), 0);
        assert_eq!(pieces.take(0..12), [11]);
    }
}
