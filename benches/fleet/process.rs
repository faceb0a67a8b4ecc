//! The coordinator's process, and what it and this process take from the system.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use tempfile::TempDir;

use crate::service::Service;

/// Ticks per second in `/proc/PID/stat`: the same on every architecture that osteon runs on.
const TICKS: f64 = 100.0;

/// A coordinator with a store of its own, on a free port.
pub(crate) struct CoordinatorProcess {
    folder: TempDir,
    url: String,
    running: Option<Service>,
    /// Processor time (s, summed) and peak memory (bytes, the largest) of the coordinator processes that
    /// [`CoordinatorProcess::restart`] has killed so far.
    before: (f64, u64),
}

impl CoordinatorProcess {
    pub(crate) fn start() -> Result<Self> {
        let mut coordinator = Self {
            folder: tempfile::tempdir()?,
            url: "http://127.0.0.1:0".to_owned(),
            running: None,
            before: (0.0, 0),
        };
        coordinator.start_again()?;
        Ok(coordinator)
    }

    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// Kills it by SIGKILL, and starts it on the same store and port.
    pub(crate) fn restart(&mut self) -> Result<()> {
        self.before = (self.processor_s()?, self.memory_bytes()?);
        // Dropping it kills it.
        self.running = None;
        self.start_again()
    }

    fn start_again(&mut self) -> Result<()> {
        let address = self.address();
        if address.exists() {
            fs::remove_file(&address)?;
        }
        let listen = self.url.trim_start_matches("http://");
        self.running = Some(Service::coordinator(listen, &self.store(), &[])?);
        self.url = fs::read_to_string(address)?.trim().to_owned();
        Ok(())
    }

    fn store(&self) -> PathBuf {
        self.folder.path().join("store")
    }

    fn address(&self) -> PathBuf {
        self.store().join("address")
    }

    /// Returns the processor time that it has taken, s, over all its lives.
    pub(crate) fn processor_s(&self) -> Result<f64> {
        Ok(self.before.0 + processor_s(self.id()?)?)
    }

    /// Returns its largest memory, bytes, over all its lives.
    pub(crate) fn memory_bytes(&self) -> Result<u64> {
        let status = fs::read_to_string(format!("/proc/{}/status", self.id()?))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
        let kilobytes: u64 = kilobytes.context("the coordinator's status has no VmHWM")?;
        Ok(self.before.1.max(1024 * kilobytes))
    }

    fn id(&self) -> Result<u32> {
        Ok(self.running.as_ref().context("the coordinator does not run")?.id())
    }
}

/// Returns the processor time of a process with all its threads, s: in user code and in the system.
pub(crate) fn processor_s(process: u32) -> Result<f64> {
    let path = format!("/proc/{process}/stat");
    let text = fs::read_to_string(&path)?;
    // The name of the program, in parentheses, may contain anything.
    let (_, fields) = text.rsplit_once(") ").with_context(|| format!("{path}: no name"))?;
    let ticks = fields.split(' ').skip(11).take(2).map(str::parse::<u64>);
    let ticks: u64 = ticks.sum::<Result<u64, _>>().with_context(|| format!("{path}: no times"))?;
    Ok(ticks as f64 / TICKS)
}
