//! Why a request to a coordinator failed. Every error names the coordinator.

use osteon_common::violations::Violations;
use osteon_proto::malformed::Malformed;
use osteon_transport::connection::ConnectError;
use osteon_transport::credentials::CredentialsError;
use osteon_transport::endpoint::Endpoint;
use thiserror::Error;
use tonic::Code;

use crate::environment::Unused;

/// Longest wait for a coordinator, s.
pub(crate) const ANSWER_S_MAX: u64 = 10;

/// Reason why a request to a coordinator failed.
#[derive(Debug, Error)]
pub enum ClientError {
    /// A file of certificates or a token cannot be used.
    #[error(transparent)]
    Credentials(#[from] CredentialsError),
    /// No coordinator could be reached.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The coordinator did not answer in time.
    #[error("the coordinator at {endpoint} did not answer within {ANSWER_S_MAX} s")]
    Unanswered {
        /// Address of the coordinator.
        endpoint: Endpoint,
    },
    /// The connection was lost.
    #[error("lost the coordinator at {endpoint}: {reason}")]
    Lost {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The transport's error.
        reason: String,
    },
    /// The coordinator cannot serve the request now.
    #[error("the coordinator at {endpoint} is unavailable: {reason}")]
    Unavailable {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The coordinator's explanation.
        reason: String,
    },
    /// The coordinator rejects the specification.
    #[error("{}", violation_count(.0))]
    Violations(Violations),
    /// The coordinator refuses the request.
    #[error("{reason}{hint} (coordinator {endpoint})")]
    Refused {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The gRPC status code.
        code: Code,
        /// The coordinator's explanation.
        reason: String,
        /// Advice for the user, or an empty text.
        hint: &'static str,
    },
    /// It is unknown whether the coordinator has accepted the job.
    #[error(
        "{cause}; the coordinator may have accepted the job: `osteon job submit` of the same job with \
         --request-id {request_id} prints its id and does not create a second job"
    )]
    Uncertain {
        /// Error of the last attempt.
        cause: Box<ClientError>,
        /// Id of the request.
        request_id: String,
    },
    /// Coordinator and client do not trust each other, possibly because credentials in the
    /// environment were meant for another coordinator and therefore not used.
    #[error("{cause}; {unused}")]
    Untrusted {
        /// The error.
        cause: Box<ClientError>,
        /// The environment variables that were not used.
        unused: Unused,
    },
    /// The coordinator sent a message that cannot be read.
    #[error("invalid answer of the coordinator at {endpoint}: {source}")]
    Malformed {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The defect of the message.
        source: Malformed,
    },
}

impl ClientError {
    /// Returns whether the cause is the user's input.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Violations(_) | Self::Credentials(_) => true,
            Self::Untrusted { cause, .. } => cause.is_bad_input(),
            Self::Refused { code, .. } => {
                matches!(code, Code::NotFound | Code::InvalidArgument | Code::AlreadyExists)
            }
            _ => false,
        }
    }

    /// Adds the environment variables that were not used, if that may be the reason of the error.
    pub(crate) fn with_unused_variables(self, unused: &Unused) -> Self {
        let of_trust = matches!(
            self,
            Self::Credentials(CredentialsError::NoAuthority { .. })
                | Self::Connect(ConnectError::Tls { .. })
                | Self::Refused { code: Code::Unauthenticated, .. }
        );
        match of_trust && !unused.is_empty() {
            true => Self::Untrusted { cause: Box::new(self), unused: unused.clone() },
            false => self,
        }
    }
}

fn violation_count(violations: &Violations) -> String {
    let lines: Vec<String> =
        violations.iter().map(|violation| format!("\n  {violation}")).collect();
    let errors = if lines.len() == 1 { "error" } else { "errors" };
    format!("the coordinator rejected the job: {} {errors}{}", lines.len(), lines.concat())
}
