//! A coordinator that can be killed and restarted on the same directory and port, with workers, and
//! the evaluation of their logs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::support::{Owned, Scratch, eventually, osteon, text};

/// A coordinator with a store of its own.
pub(crate) struct Service {
    directory: PathBuf,
    log: PathBuf,
    /// Prefix of the command line that starts it.
    enter: Vec<String>,
    options: Vec<String>,
    url: String,
    process: Option<Owned>,
}

impl Service {
    /// Starts it on a free port, with its store and its log in `scratch`.
    pub(crate) fn start(scratch: &Scratch, options: &[&str]) -> Self {
        Self::start_in(scratch, &scratch.path("store"), &[], options)
    }

    /// Starts it with its store in `directory`, by the command prefix `enter`.
    pub(crate) fn start_in(
        scratch: &Scratch,
        directory: &Path,
        enter: &[String],
        options: &[&str],
    ) -> Self {
        let mut service = Self {
            directory: directory.to_owned(),
            log: scratch.path("coordinator.log"),
            enter: enter.to_vec(),
            options: options.iter().map(|&option| option.to_owned()).collect(),
            url: "http://127.0.0.1:0".to_owned(),
            process: None,
        };
        service.start_again();
        service
    }

    /// Restarts it on the same directory and port.
    pub(crate) fn start_again(&mut self) {
        assert!(self.process.is_none(), "it runs");
        let listen = self.url.trim_start_matches("http://").to_owned();
        // Another process's connection may occupy the port for a moment.
        eventually("the coordinator starts", || {
            let mut command = match self.enter.split_first() {
                None => osteon(),
                Some((program, arguments)) => {
                    let mut command = Command::new(program);
                    command.args(arguments).arg(osteon().get_program());
                    command
                }
            };
            command.args(["coordinator", "--listen", &listen, "--store"]).arg(&self.directory);
            command.args(&self.options).env("RUST_LOG", "info");
            let mut process = Owned::spawn_logging(&mut command, &self.log);
            let url = process.line();
            let started = !url.is_empty();
            if started {
                self.url = url;
                self.process = Some(process);
            }
            started
        });
    }

    /// Sends SIGKILL.
    pub(crate) fn kill(&mut self) {
        self.process.take().unwrap().kill();
    }

    /// Sends SIGTERM, and waits for a clean shutdown.
    pub(crate) fn end(&mut self) {
        let mut process = self.process.take().unwrap();
        process.signal("TERM");
        assert_eq!(process.code(), Some(0));
    }

    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    pub(crate) fn process(&mut self) -> &mut Owned {
        self.process.as_mut().unwrap()
    }

    /// Returns the log of all its runs.
    pub(crate) fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap()
    }

    /// Returns the number of leases that ended because their workers were silent.
    pub(crate) fn expirations(&self) -> usize {
        self.log().matches("no message came from this worker").count()
    }

    /// Returns the number of batches that were reassigned from lost workers.
    pub(crate) fn retries(&self) -> usize {
        let log = self.log();
        let lost = log.lines().filter(|line| line.contains("worker lost"));
        let batches = lost.filter_map(|line| line.split("batches=").nth(1)?.split(' ').next());
        batches.map(|batches| batches.parse::<usize>().unwrap()).sum()
    }

    /// Attaches a worker with one thread, as if on a machine of its own.
    pub(crate) fn worker(&self, scratch: &Scratch) -> Owned {
        worker(scratch, &self.url)
    }
}

/// Starts a worker with one thread for the coordinator at `url`, as if on a machine of its own; it logs to
/// `workers.log`.
pub(crate) fn worker(scratch: &Scratch, url: &str) -> Owned {
    static MACHINES: AtomicU32 = AtomicU32::new(1);
    worker_on(scratch, url, &format!("machine-{}", MACHINES.fetch_add(1, Ordering::Relaxed)))
}

/// As [`worker`], on the machine of this name.
pub(crate) fn worker_on(scratch: &Scratch, url: &str, host: &str) -> Owned {
    let mut command = osteon();
    command.args(["worker", "--coordinator", url, "--threads", "1", "--host", host]);
    command.env("RUST_LOG", "info");
    Owned::spawn_logging(&mut command, &scratch.path("workers.log"))
}

/// Returns the digest of the job in a file, computed without a disturbance in one embedded run.
pub(crate) fn undisturbed(command: &str, job: &Path) -> String {
    let result = crate::support::run(&[command, text(job), "--json"]).json();
    result["digest"].as_str().unwrap().to_owned()
}
