//! The observables of one realization.

use osteon_common::observables::{Observable, ObservableValues};
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_solver::ObservedRealization;

/// One realization. Without a velocity, there are no other observables, either.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Observation {
    pub(super) outcome: Outcome,
    pub(super) observables: ObservableValues,
}

impl Observation {
    /// Creates that of a realization without a velocity.
    pub(super) fn failed(kind: FailureKind) -> Self {
        Self { outcome: Err(kind), observables: ObservableValues::default() }
    }

    /// Returns the velocity, or another observable.
    pub(super) fn value(&self, which: Option<Observable>) -> Option<f64> {
        which.map_or_else(|| self.outcome.ok(), |observable| self.observables[observable])
    }
}

impl From<ObservedRealization> for Observation {
    fn from(ObservedRealization { velocity, observables }: ObservedRealization) -> Self {
        Self { outcome: Ok(velocity), observables }
    }
}
