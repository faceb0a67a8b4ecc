//! Who a worker is over all its stays: a process on a host.

use std::fmt;
use std::sync::Arc;

/// A process on a host. A worker that attaches again has the same name; two stays with one name
/// are one worker to those who compare answers.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerName {
    host: Arc<str>,
    process: u32,
}

impl WorkerName {
    /// The process `process` on `host`; control characters of the host are replaced.
    pub fn new(host: &str, process: u32) -> Self {
        let shown = |c: char| if c.is_control() { '?' } else { c };
        Self { host: host.chars().map(shown).collect::<String>().into(), process }
    }

    /// Host name, as the worker told it.
    pub fn host(&self) -> &str {
        &self.host
    }

    /// Process id, as the worker told it.
    pub fn process(&self) -> u32 {
        self.process
    }
}

impl fmt::Display for WorkerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.host, self.process)
    }
}
