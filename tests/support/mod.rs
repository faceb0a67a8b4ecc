//! Common support of the tests with real processes: running `osteon`, owning its services, polling
//! states until a deadline.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Longest wait for any state.
pub(crate) const DEADLINE: Duration = Duration::from_secs(120);
/// Interval of polling.
const POLL: Duration = Duration::from_millis(20);

/// The seven parameters at the paper's optimum: name, value, lower and upper bound of a search.
pub(crate) const OPTIMUM: [(&str, f64, f64, f64); 7] = [
    ("density", 1598.8, 1500.0, 2000.0),
    ("longitudinal_young_modulus", 17.717e9, 12e9, 25e9),
    ("longitudinal_poisson_ratio", 0.3816, 0.2, 0.45),
    ("longitudinal_shear_modulus", 4.795e9, 3e9, 6.5e9),
    ("transverse_young_modulus", 9.8254e9, 8e9, 16e9),
    ("transverse_poisson_ratio", 0.4495, 0.2, 0.5),
    ("dispersion", 0.1029, 0.02, 0.3),
];

/// A small identification of e_L and δ, with `realizations` and at most `evaluations`.
pub(crate) fn job(realizations: u32, evaluations: u32) -> String {
    let mut text = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n".to_owned();
    for (name, value, lower, upper) in OPTIMUM {
        text.push_str(&format!("[parameters.{name}]\n"));
        if ["longitudinal_young_modulus", "dispersion"].contains(&name) {
            let start = 1.1 * value;
            text.push_str(&format!("start = {start:?}\nbounds = [{lower:?}, {upper:?}]\n"));
        } else {
            text.push_str(&format!("fixed = {value:?}\n"));
        }
    }
    text.push_str(&format!(
        "[monte_carlo]\nrealizations = {realizations}\nseed = 7\n[search]\nmax_evaluations = {evaluations}\n"
    ));
    text
}

/// The directory of one test, removed at its end.
pub(crate) struct Scratch(tempfile::TempDir);

impl Scratch {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file; returns its path.
    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    }
}

/// Returns a path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Returns a command for the program under test, without the caller's settings.
pub(crate) fn osteon() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_osteon"));
    remove_settings(&mut command);
    command.stdin(Stdio::null());
    command
}

/// Takes the caller's settings of the program under test out of a command's environment. Those of
/// colours belong to them: `CI` lets a terminal of any kind show them.
pub(crate) fn remove_settings(command: &mut Command) {
    for name in [
        "OSTEON_COORDINATOR",
        "OSTEON_TLS_CA",
        "OSTEON_TLS_CERT",
        "OSTEON_TLS_KEY",
        "OSTEON_TOKEN_FILE",
        "OSTEON_INSTRUCTION_SET",
        "RUST_LOG",
        "COLUMNS",
        "CI",
        "NO_COLOR",
        "CLICOLOR",
        "CLICOLOR_FORCE",
    ] {
        command.env_remove(name);
    }
}

/// Runs the program to its end.
pub(crate) fn run<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Finished {
    Finished::of(osteon().args(arguments).output().unwrap())
}

/// Runs the program to its end with one variable of the environment set.
pub(crate) fn run_with<S: AsRef<std::ffi::OsStr>>(
    (name, value): (&str, &str),
    arguments: &[S],
) -> Finished {
    Finished::of(osteon().env(name, value).args(arguments).output().unwrap())
}

/// A program that has ended.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Finished {
    pub(crate) fn of(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Checks that the exit code is 0; returns stdout.
    pub(crate) fn succeeded(&self) -> &str {
        assert_eq!(self.code, Some(0), "{self:?}");
        &self.stdout
    }

    /// Checks that the exit code is 0; returns stdout as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(self.succeeded()).unwrap()
    }
}

/// Returns the lines of a log that warn or tell of errors, but for those of a machine so busy that
/// the coordinator was not run for seconds.
pub(crate) fn warnings(log: &str) -> Vec<&str> {
    let is_warning = |line: &&str| line.contains("WARN") || line.contains("ERROR");
    let is_pause = |line: &&str| line.contains("the coordinator was paused");
    log.lines().filter(is_warning).filter(|line| !is_pause(line)).collect()
}

/// A process that is killed when the test ends, however it ends.
pub(crate) struct Owned(Child);

impl Owned {
    pub(crate) fn spawn(command: &mut Command) -> Self {
        Self(command.stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn().unwrap())
    }

    /// Same as [`spawn`](Self::spawn), with stderr appended to a file.
    pub(crate) fn spawn_logging(command: &mut Command, log: &Path) -> Self {
        let log = fs::OpenOptions::new().create(true).append(true).open(log).unwrap();
        Self(command.stdout(Stdio::piped()).stderr(log).spawn().unwrap())
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// Sends SIGKILL, and waits until the process has ended.
    pub(crate) fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    /// Sends a signal by name, e.g. `TERM`.
    pub(crate) fn signal(&self, name: &str) {
        signal(self.id(), name);
    }

    /// Waits for the end within the deadline; returns the exit code.
    pub(crate) fn code(&mut self) -> Option<i32> {
        let child = &mut self.0;
        let mut code = None;
        eventually("the process ends", || {
            code = child.try_wait().unwrap();
            code.is_some()
        });
        code.and_then(|status| status.code())
    }

    /// Returns the exit code, if the process has ended.
    pub(crate) fn ended(&mut self) -> Option<i32> {
        self.0.try_wait().unwrap().and_then(|status| status.code())
    }

    /// Returns the next line of stdout.
    pub(crate) fn line(&mut self) -> String {
        let mut line = String::new();
        // The reader may consume more than the line, so this is used only for the first line of a
        // service.
        BufReader::new(self.0.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        let _gone = self.0.kill();
        let _reaped = self.0.wait();
    }
}

/// Sends a signal to one process.
pub(crate) fn signal(process: u32, name: &str) {
    let status = Command::new("kill").args(["-s", name, &process.to_string()]).status().unwrap();
    assert!(status.success(), "kill -s {name} {process}");
}

/// Polls until `state` holds; panics with `what` at the deadline.
pub(crate) fn eventually(what: &str, mut state: impl FnMut() -> bool) {
    let start = Instant::now();
    while !state() {
        assert!(start.elapsed() < DEADLINE, "not within {DEADLINE:?}: {what}");
        std::thread::sleep(POLL);
    }
}

/// A coordinator as a service of its own.
pub(crate) struct Coordinator {
    pub(crate) process: Owned,
    pub(crate) url: String,
}

impl Coordinator {
    /// Starts a coordinator on a free port, with its store in `directory`.
    pub(crate) fn start(directory: &Path) -> Self {
        let mut command = osteon();
        command.args(["coordinator", "--listen", "127.0.0.1:0", "--store"]).arg(directory);
        let mut process = Owned::spawn(command.env("RUST_LOG", "warn"));
        let url = process.line();
        assert!(url.starts_with("http://127.0.0.1:"), "{url}");
        Self { process, url }
    }

    /// Starts a worker of this coordinator.
    pub(crate) fn worker(&self, threads: u32) -> Owned {
        let mut command = osteon();
        command.args(["worker", "--coordinator", &self.url, "--threads", &threads.to_string()]);
        Owned::spawn(command.env("RUST_LOG", "warn"))
    }

    /// Runs a client's command.
    pub(crate) fn client(&self, arguments: &[&str]) -> Finished {
        let output = osteon().args(arguments).args(["--coordinator", &self.url]).output().unwrap();
        Finished::of(output)
    }

    /// Submits a job; returns its id.
    pub(crate) fn submit(&self, job: &Path) -> String {
        let submitted = self.client(&["submit", job.to_str().unwrap(), "--json"]).json();
        submitted["job"].as_str().unwrap().to_owned()
    }

    /// Returns the job as in `jobs --json`.
    pub(crate) fn job(&self, id: &str) -> Value {
        let jobs = self.client(&["jobs", "--json"]).json();
        let found = jobs.as_array().unwrap().iter().find(|job| job["job"] == id);
        found.unwrap_or_else(|| panic!("no job {id} in {jobs}")).clone()
    }
}

/// Returns the processes whose parent is `parent` (Linux).
pub(crate) fn children(parent: u32) -> Vec<u32> {
    let mut children = Vec::new();
    for entry in fs::read_dir("/proc").unwrap().flatten() {
        let Ok(process) = entry.file_name().to_string_lossy().parse::<u32>() else { continue };
        let Ok(stat) = fs::read_to_string(entry.path().join("stat")) else { continue };
        // The name in brackets may contain spaces, so fields are counted after it.
        let Some((_, fields)) = stat.rsplit_once(')') else { continue };
        if fields.split_whitespace().nth(1) == Some(&parent.to_string()) {
            children.push(process);
        }
    }
    children
}

/// Returns the value of an option on a process's command line (Linux).
pub(crate) fn option(process: u32, name: &str) -> Option<String> {
    let line = fs::read_to_string(format!("/proc/{process}/cmdline")).ok()?;
    line.split('\0').skip_while(|&word| word != name).nth(1).map(str::to_owned)
}

/// Returns whether a process exists and is not a zombie (Linux).
pub(crate) fn is_alive(process: u32) -> bool {
    fs::read_to_string(format!("/proc/{process}/stat"))
        .ok()
        .and_then(|stat| stat.rsplit_once(')').map(|(_, fields)| !fields.trim().starts_with('Z')))
        .unwrap_or(false)
}
