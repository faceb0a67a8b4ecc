//! Why a message between the programs of osteon cannot be read.

use osteon_common::violations::Violations;
use thiserror::Error;

/// A message that no osteon of this version writes.
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
        /// How many it has.
        found: usize,
        /// How many it must have.
        expected: usize,
    },
    /// A number of an enumeration, or a code, that is not known.
    #[error("field `{field}` has the unknown value {value}")]
    UnknownValue {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// What was found.
        value: i64,
    },
    /// A number that is not allowed.
    #[error("field `{field}` is {value}; {allowed}")]
    OutOfRange {
        /// Name of the field in the `.proto` file.
        field: &'static str,
        /// What was found.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A pair of code and velocity that no outcome encodes to.
    #[error("realization {index} has code {code} with velocity {velocity}, which no outcome has")]
    Outcome {
        /// Index within the block.
        index: usize,
        /// Code byte.
        code: u8,
        /// Velocity, m/s.
        velocity: f64,
    },
    /// An estimated error that no outcome has.
    #[error(
        "realization {index} has the estimated error {value}; it must be finite and at least 0, and \
         0 on failure"
    )]
    EstimatedError {
        /// Index within the block.
        index: usize,
        /// What was found.
        value: f64,
    },
    /// The setup of a batch lacks a field: its result would depend on the worker's defaults.
    #[error("the setup of a batch is incomplete")]
    IncompleteSetup,
    /// The setup of a batch breaks a rule.
    #[error("the setup of a batch is not valid: {0}")]
    InvalidSetup(Violations),
    /// A stored specification breaks a rule.
    #[error("the specification is not valid: {0}")]
    InvalidSpecification(Violations),
}
