//! Defects of messages between the programs of osteon.

use osteon_common::observables::Observable;
use osteon_common::violations::Violations;
use thiserror::Error;

/// A defect that no message of this version of osteon has.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Malformed {
    /// A required field is absent.
    #[error("field `{field}` is missing")]
    Missing {
        /// Name of the field in the `.proto` file.
        field: &'static str,
    },
    /// A repeated field has the wrong number of elements.
    #[error("field `{field}` has {found} elements, expected {expected}")]
    WrongLength {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// Number of elements found.
        found: usize,
        /// Number of elements required.
        expected: usize,
    },
    /// A number of an enumeration, or a code, is unknown.
    #[error("field `{field}` has the unknown value {value}")]
    UnknownValue {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// The number found.
        value: i64,
    },
    /// A number is out of range.
    #[error("field `{field}` is {value}; {allowed}")]
    OutOfRange {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// The number found.
        value: f64,
        /// The allowed values.
        allowed: &'static str,
    },
    /// A pair of code and velocity does not encode an outcome.
    #[error(
        "realization {index} has code {code} with velocity {velocity}, which is not a valid \
             outcome"
    )]
    Outcome {
        /// Position among the realizations of the message, from 0.
        index: usize,
        /// Code byte.
        code: u8,
        /// Velocity, m/s.
        velocity: f64,
    },
    /// An estimated error is not one that an outcome can have.
    #[error(
        "realization {index} has the estimated error {value}; it must be finite and at least 0, and \
         0 on failure"
    )]
    EstimatedError {
        /// Position among the realizations of the message, from 0.
        index: usize,
        /// The number found.
        value: f64,
    },
    /// An observable is not one that an outcome can have.
    #[error(
        "realization {index} has the {} {value}; it must be finite, and 0 on failure",
        .observable.row().title
    )]
    ObservedValue {
        /// Position among the realizations of the message, from 0.
        index: usize,
        /// The observable.
        observable: Observable,
        /// The number found.
        value: f64,
    },
    /// An observable is unknown, or comes twice.
    #[error("the observable {name:?} is unknown to this version of osteon, or comes twice")]
    Observable {
        /// Its name.
        name: String,
    },
    /// The setup of an evaluation lacks a field, so its results would depend on the worker's
    /// defaults.
    #[error("the setup of an evaluation is incomplete")]
    IncompleteSetup,
    /// The setup of an evaluation violates a rule.
    #[error("the setup of an evaluation is not valid: {0}")]
    InvalidSetup(Violations),
    /// A batch refers to an evaluation that is not among those its worker keeps.
    #[error("a batch refers to evaluation {evaluation}, which this worker does not have")]
    UnknownEvaluation {
        /// Number of the evaluation.
        evaluation: u64,
    },
    /// An evaluation that a worker keeps comes again.
    #[error("evaluation {evaluation} comes a second time")]
    RepeatedEvaluation {
        /// Number of the evaluation.
        evaluation: u64,
    },
    /// A text is not the JSON that its field holds.
    #[error("field `{field}`: {reason}")]
    Json {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// Why it is not.
        reason: String,
    },
    /// The specification of a fetched job violates a rule.
    #[error("the specification is not valid: {0}")]
    InvalidSpecification(Violations),
}

/// Returns the value of a required field.
pub(crate) fn present<T>(value: Option<T>, field: &'static str) -> Result<T, Malformed> {
    value.ok_or(Malformed::Missing { field })
}
