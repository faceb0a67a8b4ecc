//! The errors of the protocol: four types, each with its HTTP status.

use axum::http::StatusCode;
use osteon_common::violations::Violations;

/// Longest part of a request that an error quotes, characters.
const QUOTED_MAX: usize = 100;

/// An answer that is an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ProtocolError {
    /// Its type.
    pub(super) kind: ProtocolErrorKind,
    /// HTTP status.
    pub(super) status: StatusCode,
    /// What is wrong, and what is allowed.
    pub(super) message: String,
    /// Whether the request is well-formed, but the model has no value at its input; true
    /// only after [`ProtocolError::without_value`].
    pub(super) no_value: bool,
}

/// Type of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProtocolErrorKind {
    /// There is no model of this name.
    ModelNotFound,
    /// The model does not support the operation.
    UnsupportedFeature,
    /// The request cannot be evaluated.
    InvalidInput,
    /// The evaluation has no result.
    InvalidOutput,
}

impl ProtocolErrorKind {
    /// Returns the name in answers.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::ModelNotFound => "ModelNotFound",
            Self::UnsupportedFeature => "UnsupportedFeature",
            Self::InvalidInput => "InvalidInput",
            Self::InvalidOutput => "InvalidOutput",
        }
    }

    /// Returns the HTTP status that the protocol gives it.
    fn status(self) -> StatusCode {
        match self {
            Self::InvalidOutput => StatusCode::INTERNAL_SERVER_ERROR,
            Self::ModelNotFound | Self::UnsupportedFeature | Self::InvalidInput => {
                StatusCode::BAD_REQUEST
            }
        }
    }
}

impl ProtocolError {
    /// Creates an error with the status of its type.
    pub(super) fn new(kind: ProtocolErrorKind, message: impl Into<String>) -> Self {
        Self { kind, status: kind.status(), message: message.into(), no_value: false }
    }

    /// Creates the error of a request that cannot be evaluated.
    pub(super) fn input(message: impl Into<String>) -> Self {
        Self::new(ProtocolErrorKind::InvalidInput, message)
    }

    /// Creates the error of an evaluation without a result.
    pub(super) fn output(message: impl Into<String>) -> Self {
        Self::new(ProtocolErrorKind::InvalidOutput, message)
    }

    /// Creates the error of a request whose job violates rules.
    pub(super) fn violations(violations: &Violations) -> Self {
        let lines: Vec<String> = violations.iter().map(ToString::to_string).collect();
        Self::input(lines.join("; "))
    }

    /// Returns the same error for an input at which the model has no value.
    pub(super) fn without_value(self) -> Self {
        Self { no_value: true, ..self }
    }

    /// Returns the same error with another HTTP status.
    pub(super) fn with_status(self, status: StatusCode) -> Self {
        Self { status, ..self }
    }
}

/// Returns a text of a request in quotes, shortened.
pub(super) fn quoted(text: &str) -> String {
    let mut short: String = text.chars().take(QUOTED_MAX).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("{short:?}")
}
