//! Idempotent submission: submitting the same request again gives the same job.

use osteon_common::limits::NAME_BYTES_MAX;
use osteon_proto::identity::{self, NoRandomness};

/// Id of a submission. A coordinator keeps the ids of different clients apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestId {
    /// The id itself; never empty.
    pub id: String,
    /// Name of the submitting client.
    pub client: String,
}

impl RequestId {
    /// Creates a new random id.
    ///
    /// # Errors
    /// If the operating system provides no random numbers.
    pub fn new() -> Result<Self, NoRandomness> {
        identity::random_digits::<16>().map(Self::with_id)
    }

    /// Takes an id that the user has chosen, which is not empty.
    pub fn with_id(id: String) -> Self {
        Self { id, client: user() }
    }
}

/// Returns user and host, by which workers are shared fairly between users.
fn user() -> String {
    let user = ["USER", "LOGNAME"].iter().find_map(|name| std::env::var(name).ok());
    let host = identity::host_name().unwrap_or_default();
    let mut name = format!("{}@{host}", user.unwrap_or_default());
    name.truncate(name.floor_char_boundary(NAME_BYTES_MAX));
    name
}
