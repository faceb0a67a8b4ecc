//! The observables of one realization.

use osteon_common::outcome::{FailureKind, Outcome};
use osteon_solver::{FirstSignal, ObservedRealization};

/// One realization. Without a velocity, the other observables are `None`, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Observation {
    pub(super) outcome: Outcome,
    /// Velocity of the extremum that the job does not pick, m/s.
    pub(super) other_velocity: Option<f64>,
    /// dB/cm.
    pub(super) decay: Option<f64>,
    /// Hz.
    pub(super) center_frequency: Option<f64>,
}

impl Observation {
    /// Creates that of a realization without a velocity.
    pub(super) fn failed(kind: FailureKind) -> Self {
        Self { outcome: Err(kind), other_velocity: None, decay: None, center_frequency: None }
    }

    /// Returns velocity, other velocity, decay and frequency.
    pub(super) fn values(&self) -> [Option<f64>; 4] {
        [self.outcome.ok(), self.other_velocity, self.decay, self.center_frequency]
    }
}

impl From<&ObservedRealization> for Observation {
    fn from(observed: &ObservedRealization) -> Self {
        let FirstSignal { other_velocity, decay, center_frequency, .. } = &observed.signal;
        Self {
            outcome: Ok(observed.velocity),
            other_velocity: other_velocity.as_ref().ok().copied(),
            decay: Some(*decay),
            center_frequency: *center_frequency,
        }
    }
}
