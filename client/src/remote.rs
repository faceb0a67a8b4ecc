//! Where a coordinator is, and how long it is waited for.

use std::time::Duration;

use osteon_transport::credentials::CredentialFiles;
use osteon_transport::endpoint::Endpoint;

use crate::environment::Unused;
use crate::error::ANSWER_S_MAX;

/// Time without a coordinator after which the user is told that the client is waiting for it, s.
pub(crate) const SILENCE_S_MAX: u64 = 1;

/// Address of a coordinator and the credential files for it, which have not been read yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remote {
    /// Address of the coordinator.
    pub endpoint: Endpoint,
    /// The credential files.
    pub files: CredentialFiles,
    /// Whether the address comes from the environment and not from the command line.
    pub from_environment: bool,
    /// Environment variables that were not used for this coordinator.
    pub unused: Unused,
}

impl Remote {
    /// Returns the coordinator at `endpoint`, without credentials.
    pub fn at(endpoint: Endpoint) -> Self {
        let (files, unused) = (CredentialFiles::default(), Unused::default());
        Self { endpoint, files, from_environment: false, unused }
    }
}

/// Returns the longest wait for an answer.
pub(crate) fn answer_limit() -> Duration {
    Duration::from_secs(ANSWER_S_MAX)
}
