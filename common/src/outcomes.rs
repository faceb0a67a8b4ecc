//! All outcomes of one evaluation, with the observables that its job has data of.

use std::ops::Deref;
use std::sync::Arc;

use crate::observables::{ObservableSet, PerObservable};
use crate::outcome::{Outcome, RealizationResult};

/// A value of each realization for those observables that were asked for, in index order; 0 on failure.
pub type ObservableColumns = PerObservable<Option<Arc<Vec<f64>>>>;

/// Outcomes of one evaluation in index order; dereferences to them. Copies share the memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcomes {
    velocities: Arc<Vec<Outcome>>,
    observables: ObservableColumns,
}

impl Outcomes {
    /// Creates the outcomes of these realizations, with these observables.
    pub fn of_results(
        results: impl Iterator<Item = RealizationResult> + Clone,
        observables: ObservableSet,
    ) -> Self {
        let column = |one| results.clone().map(move |result| result.observables[one]).collect();
        let columns = PerObservable::new(|one| observables[one].then(|| Arc::new(column(one))));
        Self::shared(Arc::new(results.map(|result| result.outcome).collect()), columns)
    }

    /// Creates outcomes that share these lists, which are all of the same length.
    pub fn shared(velocities: Arc<Vec<Outcome>>, observables: ObservableColumns) -> Self {
        Self { velocities, observables }
    }

    /// Returns them with these values of observables: of each as many as outcomes, 0 on failure.
    #[must_use]
    pub fn with_observables(self, values: PerObservable<Option<Vec<f64>>>) -> Self {
        Self { observables: values.map(|values| values.map(Arc::new)), ..self }
    }

    /// Returns the values of the observables that the job has data of, in index order, 0 on failure.
    pub fn observables(&self) -> PerObservable<Option<&[f64]>> {
        self.observables.as_ref().map(|values| values.as_ref().map(|values| values.as_slice()))
    }

    /// Returns whether both are copies of the same outcomes, without comparing these.
    pub fn are_copies_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.velocities, &other.velocities)
    }
}

impl Deref for Outcomes {
    type Target = [Outcome];

    fn deref(&self) -> &[Outcome] {
        &self.velocities
    }
}

impl From<Vec<Outcome>> for Outcomes {
    fn from(outcomes: Vec<Outcome>) -> Self {
        Self { velocities: Arc::new(outcomes), observables: ObservableColumns::default() }
    }
}

impl<const N: usize> From<[Outcome; N]> for Outcomes {
    fn from(outcomes: [Outcome; N]) -> Self {
        Vec::from(outcomes).into()
    }
}

impl FromIterator<Outcome> for Outcomes {
    fn from_iter<I: IntoIterator<Item = Outcome>>(outcomes: I) -> Self {
        outcomes.into_iter().collect::<Vec<Outcome>>().into()
    }
}
