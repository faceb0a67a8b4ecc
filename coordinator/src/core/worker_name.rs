//! Identity of a worker over all its stays: a process on a host, and a random number that it drew.

use std::fmt;
use std::sync::Arc;

use osteon_common::visible;

/// A process on a host. A worker that attaches again has the same name. Two containers may have host and
/// process in common: the number that each process drew at its start distinguishes them. When answers are
/// compared, all workers of a host count as one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerName {
    host: Arc<str>,
    process: u32,
    instance: u64,
}

impl WorkerName {
    /// Returns the name of process `process` on `host` that drew `instance`, 0 if none; invisible
    /// characters in the host name are replaced.
    pub fn new(host: &str, process: u32, instance: u64) -> Self {
        let show = |c: char| if visible::is_hidden(c) { '?' } else { c };
        Self { host: host.chars().map(show).collect::<String>().into(), process, instance }
    }

    /// Returns whether any of these workers is of this host.
    pub(crate) fn any_of<'a>(workers: impl IntoIterator<Item = &'a Self>, host: &str) -> bool {
        workers.into_iter().any(|worker| worker.host() == host)
    }

    /// Host name, as the worker sent it.
    pub fn host(&self) -> &str {
        &self.host
    }

    /// Process id, as the worker sent it.
    pub fn process(&self) -> u32 {
        self.process
    }

    /// Number that the process drew at its start; 0 if it sent none.
    pub fn instance(&self) -> u64 {
        self.instance
    }
}

impl fmt::Display for WorkerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.host, self.process)
    }
}
