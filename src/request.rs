//! The request that stands for a job: whoever submits it again gets the same job.

use osteon_common::limits::NAME_BYTES_MAX;
use osteon_proto::identity::{self, NoRandomness};

/// Names a submission. A coordinator keeps the ids of different clients apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Request {
    /// Chosen by who submits; never empty.
    pub(crate) id: String,
    /// Who submits.
    pub(crate) client: String,
}

impl Request {
    /// One that there was never before.
    ///
    /// # Errors
    /// When the operating system gives no random numbers.
    pub(crate) fn new() -> Result<Self, NoRandomness> {
        identity::random_digits::<16>().map(Self::with_id)
    }

    /// One that this user has chosen.
    pub(crate) fn with_id(id: String) -> Self {
        Self { id, client: user() }
    }
}

/// Who this is for the sharing of workers between users: user and host.
fn user() -> String {
    let user = ["USER", "LOGNAME"].iter().find_map(|name| std::env::var(name).ok());
    let host = identity::host_name().unwrap_or_default();
    let mut name = format!("{}@{host}", user.unwrap_or_default());
    while name.len() > NAME_BYTES_MAX {
        name.pop();
    }
    name
}
