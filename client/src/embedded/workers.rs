//! The worker processes of an embedded coordinator: starting, supervising, restarting and ending
//! them.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use osteon_transport::endpoint::Endpoint;
use tokio::io::{AsyncBufReadExt as _, AsyncRead, AsyncReadExt as _, BufReader};
use tokio::process::{Child, Command};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use crate::environment;
use crate::listener::RunListener;
use crate::run_error::RunError;

/// Exit code of a worker whose machine computes wrongly.
pub const BAD_MACHINE: u8 = 77;
/// Time after which a worker ends by itself if it has lost this process, s.
const GIVE_UP_AFTER_S: u64 = 5;
/// Maximum number of consecutive deaths of one worker without progress of the run in between.
/// Deaths of other workers do not count, so killing all workers at once does not end the run.
const DEATHS_IN_A_ROW_MAX: u32 = 10;
/// Pause before a worker is restarted, ms, multiplied by the number of consecutive deaths.
const RESPAWN_MS: u64 = 50;
/// Number of last lines of a worker's stderr that are kept to explain its death.
const LINES_KEPT_MAX: usize = 20;
/// Longest line of a worker's stderr that is kept, bytes.
const LINE_BYTES_MAX: u64 = 4096;
/// Longest wait for the rest of a dead worker's stderr, ms.
const STDERR_DRAIN_MS: u64 = 500;

/// The worker processes; dropping this ends all of them.
pub(super) struct Workers {
    tasks: JoinSet<()>,
    stop: watch::Sender<bool>,
    failures: mpsc::Receiver<anyhow::Error>,
    /// Whether nothing is reported of the workers any more.
    muted: Arc<AtomicBool>,
}

/// Data shared by the supervisors of all workers.
struct SupervisorState {
    executable: PathBuf,
    endpoint: Endpoint,
    threads: u32,
    progress: Arc<AtomicU64>,
    muted: Arc<AtomicBool>,
    listener: Arc<dyn RunListener>,
}

/// Deaths of one worker since the last progress.
#[derive(Debug, Default)]
struct Deaths {
    in_a_row: u32,
    progress_at_last: u64,
}

impl Deaths {
    /// Counts a death at `progress`; returns the number of consecutive deaths.
    fn count(&mut self, progress: u64) -> u32 {
        self.in_a_row = if progress == self.progress_at_last { self.in_a_row + 1 } else { 1 };
        self.progress_at_last = progress;
        self.in_a_row
    }
}

impl Workers {
    /// Starts `count` worker processes of `executable`, with `threads` threads each.
    pub(super) fn start(
        executable: PathBuf,
        endpoint: &Endpoint,
        (count, threads): (u32, u32),
        progress: Arc<AtomicU64>,
        listener: Arc<dyn RunListener>,
    ) -> Self {
        let endpoint = endpoint.clone();
        let muted = Arc::<AtomicBool>::default();
        let muted_too = Arc::clone(&muted);
        let shared =
            SupervisorState { executable, endpoint, threads, progress, muted: muted_too, listener };
        let shared = Arc::new(shared);
        let (stop, stopped) = watch::channel(false);
        let (failure_sender, failures) = mpsc::channel(1);
        let mut tasks = JoinSet::new();
        for number in 1..=count {
            tasks.spawn(keep_running(
                number,
                Arc::clone(&shared),
                stopped.clone(),
                failure_sender.clone(),
            ));
        }
        Self { tasks, stop, failures, muted }
    }

    /// Completes when a worker has failed for good.
    pub(super) async fn failed(&mut self) -> RunError {
        match self.failures.recv().await {
            Some(error) => RunError::Failed(error),
            None => RunError::failed(anyhow!("all workers have ended")),
        }
    }

    /// Reports nothing of the workers from now on: that they lose their coordinator is intended.
    pub(super) fn mute(&self) {
        self.muted.store(true, Ordering::Relaxed);
    }

    /// Ends and reaps all processes.
    pub(super) async fn end(mut self) {
        // Fails only if every task has already ended.
        let _ended = self.stop.send(true);
        while self.tasks.join_next().await.is_some() {}
    }
}

/// Keeps one worker running until `stopped` changes, the workers are muted, or it has failed for good.
async fn keep_running(
    number: u32,
    shared: Arc<SupervisorState>,
    mut stopped: watch::Receiver<bool>,
    failures: mpsc::Sender<anyhow::Error>,
) {
    let mut deaths = Deaths::default();
    loop {
        let mut is_bad_machine = false;
        let (death, words) = match spawn(&shared.executable, &shared.endpoint, shared.threads) {
            Ok(mut child) => {
                let words =
                    tokio::spawn(forward_stderr(number, child.stderr.take(), Arc::clone(&shared)));
                tokio::select! {
                    status = child.wait() => {
                        let code = status.as_ref().ok().and_then(ExitStatus::code);
                        is_bad_machine = code == Some(BAD_MACHINE.into());
                        (describe_death(status), last_words(words).await)
                    }
                    _ = stopped.changed() => {
                        // Kills and reaps the process; it is not an error if it is already dead.
                        drop(child.kill().await);
                        return;
                    }
                }
            }
            Err(error) => (format!("could not be started: {error:#}"), String::new()),
        };
        if shared.muted.load(Ordering::Relaxed) {
            return;
        }
        if is_bad_machine {
            drop(failures.try_send(anyhow!("worker {number} cannot compute here:{words}")));
            return;
        }
        let in_a_row = deaths.count(shared.progress.load(Ordering::Relaxed));
        if in_a_row >= DEATHS_IN_A_ROW_MAX {
            let error = anyhow!(
                "worker {number} failed {in_a_row} times in a row without any progress; \
                 the last time it {death}{words}"
            );
            // If the channel is full, it already contains the failure of another worker.
            drop(failures.try_send(error));
            return;
        }
        shared.listener.note(&format!("worker {number} {death}; trying again"));
        let wait = Duration::from_millis(RESPAWN_MS * u64::from(in_a_row));
        tokio::select! {
            () = sleep(wait) => {}
            _ = stopped.changed() => return,
        }
    }
}

/// Starts one worker, in a process group of its own: the terminal's Ctrl-C must reach only this
/// process, which ends its workers itself.
fn spawn(executable: &Path, endpoint: &Endpoint, threads: u32) -> anyhow::Result<Child> {
    let mut command = Command::new(executable);
    command
        .arg("worker")
        .args(["--coordinator", &endpoint.to_string()])
        .args(["--threads", &threads.to_string()])
        .args(["--give-up-after", &GIVE_UP_AFTER_S.to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .process_group(0)
        .kill_on_drop(true);
    // These credentials are meant for other coordinators.
    for variable in environment::FILES {
        command.env_remove(variable);
    }
    if std::env::var_os("RUST_LOG").is_none() {
        command.env("RUST_LOG", "warn");
    }
    command.spawn().with_context(|| format!("cannot start {}", executable.display()))
}

/// Forwards a worker's stderr line by line; returns its last lines.
async fn forward_stderr(
    number: u32,
    stderr: Option<impl AsyncRead + Unpin>,
    shared: Arc<SupervisorState>,
) -> VecDeque<String> {
    let mut lines = VecDeque::new();
    let Some(stderr) = stderr else { return lines };
    let mut reader = BufReader::new(stderr);
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        match (&mut reader).take(LINE_BYTES_MAX).read_until(b'\n', &mut bytes).await {
            Ok(0) | Err(_) => return lines,
            Ok(_) => {}
        }
        let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
        if !shared.muted.load(Ordering::Relaxed) {
            shared.listener.note(&format!("worker {number}: {line}"));
        }
        if lines.len() == LINES_KEPT_MAX {
            lines.pop_front();
        }
        lines.push_back(line);
    }
}

/// Waits for the last lines of a worker that has ended; returns them for a message.
async fn last_words(words: tokio::task::JoinHandle<VecDeque<String>>) -> String {
    match timeout(Duration::from_millis(STDERR_DRAIN_MS), words).await {
        Ok(Ok(lines)) => lines.iter().map(|line| format!("\n  {line}")).collect(),
        _ => String::new(),
    }
}

fn describe_death(status: std::io::Result<ExitStatus>) -> String {
    match status {
        Ok(status) => format!("ended unexpectedly ({status})"),
        Err(error) => format!("could not be waited for: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listener::Silent;

    fn shared() -> Arc<SupervisorState> {
        Arc::new(SupervisorState {
            executable: PathBuf::new(),
            endpoint: "unix:/nonexistent".parse().unwrap(),
            threads: 1,
            progress: Arc::default(),
            muted: Arc::default(),
            listener: Arc::new(Silent),
        })
    }

    #[test]
    fn progress_forgives_deaths() {
        let mut deaths = Deaths::default();
        assert_eq!([deaths.count(0), deaths.count(0), deaths.count(0)], [1, 2, 3]);
        assert_eq!([deaths.count(5), deaths.count(5), deaths.count(7)], [1, 2, 1]);
    }

    #[tokio::test]
    async fn the_last_lines_are_kept() {
        let text: String = (0..100).map(|i| format!("line {i}\n")).collect();
        let lines = forward_stderr(1, Some(text.as_bytes()), shared()).await;
        assert_eq!(lines.len(), LINES_KEPT_MAX);
        assert_eq!(lines.back().map(String::as_str), Some("line 99"));
        let endless = vec![b'x'; 3 * 4096];
        let lines = forward_stderr(1, Some(endless.as_slice()), shared()).await;
        assert_eq!(lines.len(), 3);
    }

    #[tokio::test]
    async fn workers_that_only_die_end_the_run_with_their_last_words() {
        let endpoint: Endpoint = "unix:/nonexistent".parse().unwrap();
        // A program that rejects the options of a worker with a message, and ends.
        let executable = PathBuf::from("cat");
        let mut workers =
            Workers::start(executable, &endpoint, (2, 1), Arc::default(), Arc::new(Silent));
        let failure = workers.failed().await.to_string();
        workers.end().await;
        assert!(failure.contains("failed 10 times in a row"), "{failure}");
        assert!(failure.contains("--coordinator"), "{failure}");
    }

    #[tokio::test]
    async fn workers_that_all_die_at_once_are_started_again() {
        use std::os::unix::fs::PermissionsExt as _;
        let directory = tempfile::tempdir().unwrap();
        let starts = directory.path().join("starts");
        std::fs::create_dir(&starts).unwrap();
        let count = || std::fs::read_dir(&starts).unwrap().count();
        // Dies at once, until there were twice as many starts as one worker may have deaths.
        let script = directory.path().join("worker");
        let place = starts.display();
        let text = format!(
            "#!/bin/sh\nmktemp -p {place} >&2\n[ $(ls {place} | wc -l) -lt 20 ] && exit 1\nexec sleep 60\n"
        );
        std::fs::write(&script, text).unwrap();
        std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o700)).unwrap();
        let endpoint: Endpoint = "unix:/nonexistent".parse().unwrap();
        let mut workers =
            Workers::start(script, &endpoint, (12, 1), Arc::default(), Arc::new(Silent));
        let started = async {
            while count() < 20 {
                sleep(Duration::from_millis(10)).await;
            }
        };
        let failure = tokio::select! {
            () = started => None,
            failure = workers.failed() => Some(failure),
            () = sleep(Duration::from_secs(60)) => panic!("{} starts", count()),
        };
        workers.end().await;
        assert!(failure.is_none(), "{failure:?}");
    }

    #[tokio::test]
    async fn a_program_that_cannot_be_started_is_named() {
        let endpoint: Endpoint = "unix:/nonexistent".parse().unwrap();
        let executable = PathBuf::from("/nonexistent/osteon");
        let mut workers =
            Workers::start(executable, &endpoint, (1, 1), Arc::default(), Arc::new(Silent));
        let failure = workers.failed().await.to_string();
        assert!(failure.contains("/nonexistent/osteon"), "{failure}");
    }
}
