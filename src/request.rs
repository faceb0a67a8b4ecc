//! The request that stands for a job: whoever submits it again gets the same job.

use osteon_common::limits::NAME_BYTES_MAX;

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
    pub(crate) fn new() -> Self {
        Self::with_id(random_id())
    }

    /// One that this user has chosen.
    pub(crate) fn with_id(id: String) -> Self {
        Self { id, client: user() }
    }
}

/// Who this is for the sharing of workers between users: user and host.
fn user() -> String {
    let user = ["USER", "LOGNAME"].iter().find_map(|name| std::env::var(name).ok());
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let mut name = format!("{}@{}", user.unwrap_or_default(), host.trim());
    while name.len() > NAME_BYTES_MAX {
        name.pop();
    }
    name
}

/// 128 random bits.
fn random_id() -> String {
    use std::hash::{BuildHasher as _, RandomState};
    let process = std::process::id();
    let half = |salt: u8| RandomState::new().hash_one((process, salt));
    format!("{:016x}{:016x}", half(0), half(1))
}
