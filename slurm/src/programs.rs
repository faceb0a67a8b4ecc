//! Runs Slurm's commands, each within a time limit.

use std::io::ErrorKind;
use std::process::Stdio;
use std::time::Duration;

use tokio::io::AsyncWriteExt as _;
use tokio::process::Command;
use tokio::time::timeout;

use super::SlurmError;
use super::queue::{self, QueuedWorker};

/// Longest run of a command, s. A busy controller may take its time.
const RUN_S_MAX: u64 = 60;
/// Longest error message of a command that is shown, characters.
const MESSAGE_CHARS_MAX: usize = 500;

/// Returns the jobs of this user with one of these names, those that ended lately included.
///
/// # Errors
/// If `squeue` fails.
pub(crate) async fn queue(names: &[&str]) -> Result<Vec<QueuedWorker>, SlurmError> {
    let (names, format) =
        (format!("--name={}", names.join(",")), format!("--format={}", queue::FORMAT));
    let words = ["--me", "--array", "--noheader", "--states=all", &names, &format];
    queue::parse(&run("squeue", &words, "").await?)
}

/// Submits a script; returns the id of its job.
///
/// # Errors
/// If `sbatch` fails.
pub(crate) async fn submit(script: &str) -> Result<String, SlurmError> {
    let printed = run("sbatch", &["--parsable"], script).await?;
    let id = printed.trim().split(';').next().unwrap_or_default();
    match !id.is_empty() && id.chars().all(|c| c.is_ascii_digit()) {
        true => Ok(id.to_owned()),
        false => Err(SlurmError::NotUnderstood { program: "sbatch", line: shown(&printed) }),
    }
}

/// Cancels jobs, unless they have begun meanwhile.
///
/// # Errors
/// If `scancel` fails.
pub(crate) async fn cancel_waiting(ids: &[String]) -> Result<(), SlurmError> {
    let mut words = vec!["--quiet", "--state=PENDING"];
    words.extend(ids.iter().map(String::as_str));
    run("scancel", &words, "").await.map(drop)
}

/// Runs a program to its end; returns what it printed.
async fn run(program: &'static str, words: &[&str], input: &str) -> Result<String, SlurmError> {
    let mut command = Command::new(program);
    command.args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // Forms of output that the user prefers would not be understood.
    for name in ["SQUEUE_FORMAT", "SQUEUE_FORMAT2", "SQUEUE_STATES", "SQUEUE_NAMES"] {
        command.env_remove(name);
    }
    let mut child = command.kill_on_drop(true).spawn().map_err(|source| match source.kind() {
        ErrorKind::NotFound => SlurmError::NotInstalled { program },
        _ => SlurmError::NotRun { program, source },
    })?;
    let stdin = child.stdin.take();
    let ended = async {
        if let Some(mut stdin) = stdin {
            // A program that does not read its input says why by its exit code.
            drop(stdin.write_all(input.as_bytes()).await);
        }
        child.wait_with_output().await
    };
    let output = timeout(Duration::from_secs(RUN_S_MAX), ended)
        .await
        .map_err(|_| SlurmError::TimedOut { program, seconds: RUN_S_MAX })?
        .map_err(|source| SlurmError::NotRun { program, source })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let message = if said.trim().is_empty() { output.status.to_string() } else { shown(&said) };
        return Err(SlurmError::Failed { program, message });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Returns a message on one line, and not all of a long one.
fn shown(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines.join("; ").chars().take(MESSAGE_CHARS_MAX).collect()
}

#[cfg(test)]
mod tests {
    use tokio::time::Instant;

    use super::*;

    /// The clock jumps whenever nothing but it is waited for.
    #[tokio::test(start_paused = true)]
    async fn a_program_that_hangs_delays_by_its_time_limit_only() {
        let begun = Instant::now();
        let hung = run("sleep", &["600"], "").await.unwrap_err();
        assert!(matches!(hung, SlurmError::TimedOut { program: "sleep", .. }), "{hung}");
        assert_eq!(begun.elapsed().as_secs(), RUN_S_MAX);
    }

    #[tokio::test]
    async fn a_program_that_has_vanished_delays_nothing() {
        let gone = run("no-such-program-of-slurm", &[], "").await.unwrap_err();
        assert!(matches!(gone, SlurmError::NotInstalled { .. }), "{gone}");
    }
}
