//! States in result files that hosts which computed a part of a result were banned after the job had ended.

use osteon_common::results::{Integrity, JobResult};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Hosts that computed a part of the job, and were banned for wrong answers after it had ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct IntegrityReport {
    /// Names of the hosts.
    pub banned_hosts: Vec<String>,
    /// Whether the result was computed again without them.
    pub rechecked: bool,
    /// Whether a bit of it has changed by that; null before.
    pub changed: Option<bool>,
    /// Digest of the result before; null if it was not computed again.
    pub earlier_digest: Option<String>,
    /// The same as a sentence.
    pub statement: String,
}

impl IntegrityReport {
    /// Returns the statement of a result; `None` if no such host is known.
    pub(super) fn from_result(result: &JobResult) -> Option<Self> {
        let found: &Integrity = result.integrity.as_ref()?;
        Some(Self {
            banned_hosts: found.banned_hosts.clone(),
            rechecked: found.is_rechecked(),
            changed: found.has_changed(&result.digest),
            earlier_digest: found.earlier_digest.clone(),
            statement: found.statement(&result.digest),
        })
    }
}
