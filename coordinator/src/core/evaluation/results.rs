//! The results that an evaluation has received, and the workers that gave them.

use std::ops::Range;
use std::sync::Arc;

use osteon_common::observables::{Observable, ObservableSet, PerObservable};
use osteon_common::outcome::{FailureKind, Outcome, RealizationResult};
use osteon_common::outcomes::Outcomes;
use osteon_common::quantile;
use osteon_common::results::EstimatedError;

use crate::core::indices::Indices;
use crate::store::PIECE_OUTCOMES;

/// The owner of an index that has no result.
const NOBODY: u32 = u32::MAX;
/// The estimated error of an index that has no velocity.
const NO_VELOCITY: f64 = -1.0;

/// A result for each index, up to the last one that has any: a large evaluation is not set up at once.
/// In columns, so that the outcomes of a complete evaluation need not be copied.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Results {
    outcomes: Arc<Vec<Outcome>>,
    /// [`NO_VELOCITY`] for a failure, otherwise at least 0. So the errors of the successes are found without
    /// reading the outcomes, of which there may be millions.
    estimated_errors: Vec<f64>,
    /// Each empty as long as every value is 0.
    observables: PerObservable<Arc<Vec<f64>>>,
    /// Number of the worker that gave each result, or [`NOBODY`].
    owners: Vec<u32>,
    /// Number of results.
    filled: u64,
    /// Number of results of each piece.
    filled_of_piece: Vec<usize>,
}

impl Results {
    /// Returns no results, with room for `realizations`.
    pub(crate) fn with_room_for(realizations: usize) -> Self {
        Self {
            outcomes: Arc::new(Vec::with_capacity(realizations)),
            estimated_errors: Vec::with_capacity(realizations),
            observables: PerObservable::default(),
            owners: Vec::with_capacity(realizations),
            filled: 0,
            filled_of_piece: Vec::new(),
        }
    }

    /// Returns the number of indices up to the last one that has a result.
    pub(crate) fn len(&self) -> usize {
        self.owners.len()
    }

    /// Returns the number of results.
    pub(crate) fn filled(&self) -> u64 {
        self.filled
    }

    /// Returns the number of the worker that gave the result of an index; `None` if it has none.
    pub(crate) fn owner(&self, index: usize) -> Option<u32> {
        self.owners.get(index).copied().filter(|owner| *owner != NOBODY)
    }

    /// Returns the result of an index; `None` if it has none.
    pub(crate) fn get(&self, index: usize) -> Option<RealizationResult> {
        self.owner(index)?;
        let outcome = *self.outcomes.get(index)?;
        let estimated_error = match outcome {
            Ok(_) => *self.estimated_errors.get(index)?,
            Err(_) => 0.0,
        };
        let value = |values: &Arc<Vec<f64>>| values.get(index).copied().unwrap_or_default();
        let observables = self.observables.as_ref().map(value);
        Some(RealizationResult { outcome, estimated_error, observables })
    }

    /// Fills the indices from `first` on that have no result with these results of a worker. The number of
    /// the worker must be below `u32::MAX`.
    pub(crate) fn fill(&mut self, first: usize, solved: &[RealizationResult], owner: u32) {
        let end = first + solved.len();
        let length = self.len().max(end);
        let outcomes = Arc::make_mut(&mut self.outcomes);
        outcomes.resize(length, Err(FailureKind::NotFinite));
        self.estimated_errors.resize(length, NO_VELOCITY);
        self.owners.resize(length, NOBODY);
        self.filled_of_piece.resize(length.div_ceil(PIECE_OUTCOMES), 0);
        let mut columns = Self::columns_with(&mut self.observables, solved, length);
        let places = self.owners[first..end].iter_mut().zip(solved).enumerate();
        for (index, (owned, result)) in places.filter(|(_, (owned, _))| **owned == NOBODY) {
            *owned = owner;
            self.filled += 1;
            self.filled_of_piece[(first + index) / PIECE_OUTCOMES] += 1;
            outcomes[first + index] = result.outcome;
            if result.outcome.is_ok() {
                self.estimated_errors[first + index] = result.estimated_error;
            }
            for (observable, column) in columns.iter_mut() {
                column[first + index] = result.observables[*observable];
            }
        }
    }

    /// Returns the columns of the observables that these results or earlier ones have, of this length.
    fn columns_with<'a>(
        columns: &'a mut PerObservable<Arc<Vec<f64>>>,
        solved: &[RealizationResult],
        length: usize,
    ) -> Vec<(Observable, &'a mut Vec<f64>)> {
        let has_values =
            |one: Observable| solved.iter().any(|result| result.observables[one].to_bits() != 0);
        let all = Observable::ALL.into_iter().zip(&mut columns.0);
        let used = all.filter(|(one, column)| !column.is_empty() || has_values(*one));
        let sized = used.map(|(one, column)| {
            let column = Arc::make_mut(column);
            column.resize(length, 0.0);
            (one, column)
        });
        sized.collect()
    }

    /// Returns the runs of consecutive indices that have a result, or that have none.
    pub(crate) fn runs(&self, with_result: bool) -> Vec<Indices> {
        let mut found = Vec::new();
        let mut first = 0;
        for run in self.owners.chunk_by(|one, other| (*one == NOBODY) == (*other == NOBODY)) {
            let count = run.len() as u64;
            if run.first().is_some_and(|owner| (*owner != NOBODY) == with_result) {
                found.push(Indices { first, count });
            }
            first += count;
        }
        found
    }

    /// Returns the number of indices from `first` on that the same worker gave a result to, at most `most`.
    pub(crate) fn of_same_owner(&self, first: usize, most: usize) -> usize {
        let owners = self.owners.get(first..).unwrap_or_default();
        let Some(owner) = owners.first().filter(|owner| **owner != NOBODY) else {
            return 0;
        };
        owners.iter().take(most).take_while(|of| *of == owner).count()
    }

    /// Returns the last consecutive indices of `range` whose results a worker gave; `None` if it gave none.
    pub(crate) fn last_run_of(&self, owner: u32, range: Range<usize>) -> Option<Indices> {
        let owners = self.owners.get(range.clone())?;
        let end = owners.iter().rposition(|of| *of == owner)? + 1;
        let before = owners[..end].iter().rposition(|of| *of != owner);
        let begin = before.map_or(0, |place| place + 1);
        Some(Indices { first: (range.start + begin) as u64, count: (end - begin) as u64 })
    }

    /// Returns the numbers of the pieces that have all their results.
    pub(crate) fn full_pieces(&self) -> impl Iterator<Item = usize> {
        let counts = self.filled_of_piece.iter().enumerate();
        counts.filter(|(_, filled)| **filled == PIECE_OUTCOMES).map(|(piece, _)| piece)
    }

    /// Returns a copy of the outcomes of indices that have a result, with these observables; `None` if
    /// there are fewer indices.
    pub(crate) fn outcomes_in(
        &self,
        indices: Range<usize>,
        observables: ObservableSet,
    ) -> Option<Outcomes> {
        let outcomes = self.outcomes.get(indices.clone())?.to_vec();
        let columns = PerObservable::new(|one| {
            observables[one].then(|| match self.observables[one].get(indices.clone()) {
                Some(values) => values.to_vec(),
                None => vec![0.0; outcomes.len()],
            })
        });
        Some(Outcomes::from(outcomes).with_observables(columns))
    }

    /// Returns all outcomes in index order, with these observables; `None` unless there are as many as
    /// `realizations`.
    pub(crate) fn outcomes(
        &self,
        realizations: u64,
        observables: ObservableSet,
    ) -> Option<Outcomes> {
        if self.filled != realizations || self.len() as u64 != realizations {
            return None;
        }
        let columns = PerObservable::new(|one| {
            observables[one].then(|| match self.observables[one].is_empty() {
                true => Arc::new(vec![0.0; self.len()]),
                false => Arc::clone(&self.observables[one]),
            })
        });
        Some(Outcomes::shared(Arc::clone(&self.outcomes), columns))
    }

    /// Returns the estimated errors of the successes.
    pub(crate) fn estimated_error(&self) -> Option<EstimatedError> {
        let all = self.estimated_errors.iter().copied();
        quantile::estimated_error(all.filter(|error| *error >= 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solved(velocities: &[f64]) -> Vec<RealizationResult> {
        velocities.iter().map(|one| RealizationResult::solved(*one, *one)).collect()
    }

    #[test]
    fn only_indices_without_a_result_are_filled() {
        let mut results = Results::with_room_for(6);
        results.fill(3, &solved(&[3.0]), 0);
        assert_eq!((results.len(), results.filled()), (4, 1));
        assert_eq!(results.runs(true), [Indices { first: 3, count: 1 }]);
        assert_eq!(results.runs(false), [Indices { first: 0, count: 3 }]);
        results.fill(1, &solved(&[11.0, 12.0, 13.0, 14.0]), 1);
        assert_eq!((results.len(), results.filled()), (5, 4));
        let velocity = |index| results.get(index).map(|result| result.outcome.unwrap());
        assert_eq!(
            [0, 1, 2, 3, 4, 5].map(velocity),
            [None, Some(11.0), Some(12.0), Some(3.0), Some(14.0), None]
        );
        assert_eq!(
            [0, 1, 3, 4, 5].map(|index| results.owner(index)),
            [None, Some(1), Some(0), Some(1), None]
        );
        let last_run = |owner, range| results.last_run_of(owner, range);
        assert_eq!(last_run(1, 1..5), Some(Indices { first: 4, count: 1 }));
        assert_eq!(last_run(1, 0..3), Some(Indices { first: 1, count: 2 }));
        assert_eq!((last_run(0, 0..3), last_run(1, 3..6)), (None, None));
        let same = |first| results.of_same_owner(first, 9);
        assert_eq!([0, 1, 2, 3, 4, 5].map(same), [0, 2, 1, 1, 1, 0]);
        assert_eq!(results.of_same_owner(1, 1), 1);
        assert_eq!(results.outcomes(5, ObservableSet::NONE), None);
        results.fill(0, &solved(&[10.0]), 2);
        assert_eq!(results.outcomes(6, ObservableSet::NONE), None);
        let complete = results.outcomes(5, ObservableSet::NONE).unwrap();
        assert_eq!(&*complete, [10.0, 11.0, 12.0, 3.0, 14.0].map(Ok));
    }

    #[test]
    fn observables_are_kept_from_the_first_one_on() {
        let wanted = PerObservable::new(|one| one == Observable::Decay);
        let decays = |results: &Results, count, wanted| {
            let outcomes = results.outcomes(count, wanted).unwrap();
            outcomes.observables()[Observable::Decay].map(<[f64]>::to_vec)
        };
        let mut results = Results::with_room_for(3);
        results.fill(0, &solved(&[1.0]), 0);
        assert_eq!(decays(&results, 1, wanted), Some(vec![0.0]));
        let mut later = solved(&[2.0, 3.0]);
        later[1].observables[Observable::Decay] = -4.5;
        results.fill(1, &later, 0);
        assert_eq!(results.get(2), Some(later[1]));
        assert_eq!(decays(&results, 3, wanted), Some(vec![0.0, 0.0, -4.5]));
        assert_eq!(decays(&results, 3, ObservableSet::NONE), None);
    }

    #[test]
    fn errors_are_those_of_the_velocities() {
        let mut results = Results::with_room_for(4);
        assert_eq!(results.estimated_error(), None);
        let failed = RealizationResult::failed(FailureKind::NoArrival);
        results.fill(1, &[failed], 0);
        assert_eq!((results.get(1), results.estimated_error()), (Some(failed), None));
        results.fill(2, &solved(&[1.0, 3.0]), 0);
        let found = results.estimated_error().unwrap();
        assert_eq!((found.median, found.largest), (2.0, 3.0));
    }
}
