//! Services of the program, each in a process of its own.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

/// The program.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_osteon");
/// How long a service may take to start.
const START_LIMIT: Duration = Duration::from_secs(10);

/// A process that ends with its owner.
pub(crate) struct Service(Child);

impl Service {
    /// Starts one.
    pub(crate) fn start(arguments: &[&str]) -> Result<Self> {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        Ok(Self(command.spawn()?))
    }

    /// Starts a coordinator at `url` with its store in a new folder `store`; returns when it listens.
    pub(crate) fn coordinator(url: &str, store: &Path, more: &[&str]) -> Result<Self> {
        let folder = store.display().to_string();
        let first = ["coordinator", "--listen", url, "--store", &folder];
        let service = Self::start(&[&first, more].concat())?;
        let address = store.join("address");
        let start = Instant::now();
        while !address.exists() {
            ensure!(start.elapsed() < START_LIMIT, "{} does not appear", address.display());
            thread::sleep(Duration::from_millis(10));
        }
        Ok(service)
    }

    /// Its process id.
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended already; there is nobody to tell of anything else.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}
