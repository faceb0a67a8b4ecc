//! Outcome of one realization: a velocity, or the kind of failure.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::observables::{Observable, ObservableSet, ObservedValues};

/// Reason why a realization has no velocity. The discriminant is the byte that encodes the failure
/// in the digest, on the wire and in the store, where 0 encodes success. Codes are never reused.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum FailureKind {
    /// At some receiver no extremum qualifies as the first arrival.
    NoArrival = 1,
    /// The picked extrema differ in sign, or their times do not lie on a straight line over the
    /// receiver positions.
    InconsistentArrival = 2,
    /// The direct wave in the coupling fluid arrives before the wave through the bone.
    DirectWaveFirst = 3,
    /// The computation produced a number that is not finite.
    NotFinite = 4,
    /// The computation would need more frequencies and wavenumbers, a larger mesh or more time steps
    /// than are allowed, or the given time step exceeds the stability limit.
    NoConvergence = 5,
}

impl FailureKind {
    /// All kinds, in the order of their codes.
    pub const ALL: [Self; 5] = [
        Self::NoArrival,
        Self::InconsistentArrival,
        Self::DirectWaveFirst,
        Self::NotFinite,
        Self::NoConvergence,
    ];

    /// Returns the code byte, 1 to 5.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoArrival => "no_arrival",
            Self::InconsistentArrival => "inconsistent_arrival",
            Self::DirectWaveFirst => "direct_wave_first",
            Self::NotFinite => "not_finite",
            Self::NoConvergence => "no_convergence",
        }
    }
}

/// Outcome of one realization: velocity of the first arriving signal in m/s, or the failure.
///
/// A velocity is finite and above 0.
pub type Outcome = Result<f64, FailureKind>;

/// Returns the two numbers that encode an outcome on the wire, in the store and in the digest: code
/// byte (0 = success) and velocity (0 on failure).
pub fn encode(outcome: Outcome) -> (u8, f64) {
    match outcome {
        Ok(velocity) => (0, velocity),
        Err(kind) => (kind.code(), 0.0),
    }
}

/// Returns the outcome encoded by [`encode`]; `None` if the pair is invalid (unknown code, a
/// velocity that is not finite and positive, a failure with a velocity).
pub fn decode(code: u8, velocity: f64) -> Option<Outcome> {
    if code == 0 {
        return (velocity.is_finite() && velocity > 0.0).then_some(Ok(velocity));
    }
    let kind = FailureKind::ALL.into_iter().find(|kind| kind.code() == code)?;
    (velocity.to_bits() == 0).then_some(Err(kind))
}

/// One realization as returned by a worker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealizationResult {
    /// The outcome.
    pub outcome: Outcome,
    /// Estimated relative error of the velocity due to discretisation, ≥ 0; 0 on failure.
    pub estimated_error: f64,
    /// Other observables, finite; 0 on failure, and where the job has no data of one.
    pub observables: ObservedValues,
}

impl RealizationResult {
    /// Creates a realization with a velocity (m/s), with the estimated relative error of that, and without
    /// other observables.
    pub const fn solved(velocity: f64, estimated_error: f64) -> Self {
        Self { outcome: Ok(velocity), estimated_error, observables: ObservedValues::NONE }
    }

    /// Creates a realization without a velocity.
    pub fn failed(kind: FailureKind) -> Self {
        Self { outcome: Err(kind), estimated_error: 0.0, observables: ObservedValues::NONE }
    }

    /// Returns whether the estimated error is valid: finite and not negative for a velocity, exactly 0
    /// for a failure.
    pub fn has_valid_error(&self) -> bool {
        match self.outcome {
            Ok(_) => self.estimated_error.is_finite() && self.estimated_error >= 0.0,
            Err(_) => self.estimated_error.to_bits() == 0,
        }
    }

    /// Returns the first observable whose value is not valid: it must be finite for a velocity, exactly 0
    /// for a failure.
    pub fn invalid_observable(&self) -> Option<Observable> {
        let is_valid = |value: f64| match self.outcome {
            Ok(_) => value.is_finite(),
            Err(_) => value.to_bits() == 0,
        };
        let mut invalid = self.observables.iter().filter(|(_, value)| !is_valid(**value));
        invalid.next().map(|(observable, _)| observable)
    }

    /// Returns whether it has a velocity and lacks one of these observables, as from a program that does
    /// not know it: no observable is exactly 0.
    pub fn lacks_one(&self, wanted: ObservableSet) -> bool {
        let lacks = |one: Observable| self.observables[one].to_bits() == 0;
        self.outcome.is_ok() && wanted.members().any(lacks)
    }

    /// Returns whether estimated error and observables are valid.
    pub fn is_consistent(&self) -> bool {
        self.has_valid_error() && self.invalid_observable().is_none()
    }
}

/// Number of failed realizations, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FailureCounts([u64; 5]);

impl FailureCounts {
    /// Counts the failures among `outcomes`.
    pub fn from_outcomes(outcomes: &[Outcome]) -> Self {
        let mut counts = Self::default();
        for kind in outcomes.iter().filter_map(|outcome| outcome.err()) {
            counts.add(kind, 1);
        }
        counts
    }

    /// Adds `count` failures of one kind.
    pub fn add(&mut self, kind: FailureKind, count: u64) {
        self.0[usize::from(kind.code()) - 1] += count;
    }

    /// Returns the number of failures of one kind.
    pub fn get(&self, kind: FailureKind) -> u64 {
        self.0[usize::from(kind.code()) - 1]
    }

    /// Returns the number of failures of all kinds.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Returns the kinds that occurred, with their counts, in the order of their codes.
    pub fn iter(&self) -> impl Iterator<Item = (FailureKind, u64)> + '_ {
        FailureKind::ALL
            .into_iter()
            .map(|kind| (kind, self.get(kind)))
            .filter(|&(_, count)| count > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_survives_encoding() {
        let outcomes =
            FailureKind::ALL.into_iter().map(Err).chain([Ok(3908.75), Ok(f64::MIN_POSITIVE)]);
        for outcome in outcomes {
            let (code, velocity) = encode(outcome);
            assert_eq!(decode(code, velocity), Some(outcome));
        }
    }

    #[test]
    fn decode_refuses_invalid_pairs() {
        for (code, velocity) in [
            (0, 0.0),
            (0, -1.0),
            (0, f64::NAN),
            (0, f64::INFINITY),
            (1, 3900.0),
            (1, -0.0),
            (6, 0.0),
        ] {
            assert_eq!(decode(code, velocity), None, "code {code}, velocity {velocity}");
        }
    }

    #[test]
    fn an_estimate_is_finite_and_a_failure_has_none() {
        let consistent = |outcome, estimated_error| {
            RealizationResult { outcome, ..RealizationResult::solved(1.0, estimated_error) }
                .is_consistent()
        };
        assert!(consistent(Ok(3900.0), 0.0) && consistent(Ok(3900.0), 2e-5));
        assert!(RealizationResult::failed(FailureKind::NoArrival).is_consistent());
        for estimate in [-1e-9, f64::NAN, f64::INFINITY] {
            assert!(!consistent(Ok(3900.0), estimate), "{estimate}");
        }
        for estimate in [-0.0, 1e-5, f64::NAN] {
            assert!(!consistent(Err(FailureKind::NoArrival), estimate), "{estimate}");
        }
    }

    #[test]
    fn an_observable_is_finite_and_a_failure_has_none() {
        let valid = |outcome, decay| {
            let mut result = RealizationResult { outcome, ..RealizationResult::solved(1.0, 0.0) };
            result.observables[Observable::Decay] = decay;
            result.invalid_observable().is_none()
        };
        assert!(valid(Ok(3900.0), 4.6) && valid(Ok(3900.0), -0.3) && valid(Ok(3900.0), 0.0));
        assert!(!valid(Ok(3900.0), f64::NAN) && !valid(Ok(3900.0), f64::INFINITY));
        let failed = Err(FailureKind::NoArrival);
        assert!(valid(failed, 0.0) && !valid(failed, -0.0) && !valid(failed, 4.6));
    }

    #[test]
    fn failures_are_counted_by_kind() {
        let counts = FailureCounts::from_outcomes(&[
            Ok(3900.0),
            Err(FailureKind::NotFinite),
            Err(FailureKind::NoArrival),
            Err(FailureKind::NotFinite),
        ]);
        let listed: Vec<_> = counts.iter().collect();
        assert_eq!(listed, [(FailureKind::NoArrival, 1), (FailureKind::NotFinite, 2)]);
        assert_eq!(counts.total(), 3);
    }
}
