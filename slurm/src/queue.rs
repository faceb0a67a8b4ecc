//! The workers in Slurm's queue, as `squeue` lists them.

use std::time::Duration;

use super::SlurmError;

/// Format of the lines for [`parse`]: id, name, state, time used, reason.
pub(crate) const FORMAT: &str = "%i|%j|%T|%M|%r";
/// End of the name of a worker that stays without work.
pub(crate) const LASTING: &str = "-min";

/// A worker in Slurm's queue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct QueuedWorker {
    /// Id of its job, or of its element of an array.
    pub(crate) id: String,
    /// Whether it stays without work.
    pub(crate) lasting: bool,
    /// State of the job.
    pub(crate) stage: QueueStage,
    /// Time for which it has run.
    pub(crate) running_for: Duration,
    /// Slurm's word for the state, and the reason why it waits or has ended.
    pub(crate) why: String,
}

/// State of a job of Slurm, as far as it matters here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum QueueStage {
    /// It waits for nodes.
    Waiting,
    /// It runs.
    Running,
    /// It has ended as intended, or was preempted.
    Ended,
    /// It was cancelled.
    Cancelled,
    /// It failed.
    Failed,
}

/// Reads the output of `squeue` in the [`FORMAT`].
///
/// # Errors
/// If a line has another form.
pub(crate) fn parse(text: &str) -> Result<Vec<QueuedWorker>, SlurmError> {
    text.lines().filter(|line| !line.trim().is_empty()).map(worker).collect()
}

fn worker(line: &str) -> Result<QueuedWorker, SlurmError> {
    let malformed = || SlurmError::NotUnderstood { program: "squeue", line: line.to_owned() };
    let fields: Vec<&str> = line.trim().splitn(5, '|').collect();
    let [id, name, state, used, reason] = fields[..] else { return Err(malformed()) };
    // It becomes an argument of `scancel`.
    let known = |c: char| c.is_ascii_digit() || "_[]-,%".contains(c);
    if !id.starts_with(|c: char| c.is_ascii_digit()) || !id.chars().all(known) {
        return Err(malformed());
    }
    Ok(QueuedWorker {
        id: id.to_owned(),
        lasting: name.ends_with(LASTING),
        stage: stage(state),
        running_for: time_used(used).ok_or_else(malformed)?,
        why: match reason {
            "" | "None" => state.to_owned(),
            reason => format!("{state}: {reason}"),
        },
    })
}

/// A state that is not known counts as running, so that no worker is submitted in its place.
fn stage(state: &str) -> QueueStage {
    match state {
        "PENDING" | "CONFIGURING" | "REQUEUED" | "REQUEUE_FED" | "REQUEUE_HOLD"
        | "RESV_DEL_HOLD" | "SPECIAL_EXIT" => QueueStage::Waiting,
        "COMPLETED" | "COMPLETING" | "TIMEOUT" | "PREEMPTED" | "REVOKED" => QueueStage::Ended,
        "CANCELLED" => QueueStage::Cancelled,
        "FAILED" | "NODE_FAIL" | "BOOT_FAIL" | "OUT_OF_MEMORY" | "DEADLINE" => QueueStage::Failed,
        _ => QueueStage::Running,
    }
}

/// Reads a time of the form `[days-][hours:]minutes:seconds`.
fn time_used(text: &str) -> Option<Duration> {
    if text == "INVALID" || text == "UNLIMITED" {
        return Some(Duration::ZERO);
    }
    let (days, rest) = text.split_once('-').unwrap_or(("0", text));
    let mut seconds: u64 = days.parse::<u32>().ok()?.into();
    let parts: Vec<&str> = rest.split(':').collect();
    seconds *= 24;
    let (hours, parts) = match parts[..] {
        [hours, minutes, rest] => (hours, [minutes, rest]),
        [minutes, rest] => ("0", [minutes, rest]),
        _ => return None,
    };
    seconds += u64::from(hours.parse::<u32>().ok()?);
    for part in parts {
        seconds = seconds * 60 + u64::from(part.parse::<u32>().ok()?);
    }
    Some(Duration::from_secs(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_squeue_are_read() {
        let text = "12_3|osteon-worker-1|PENDING|0:00|Resources\n\
                    12_[4-9]|osteon-worker-1-min|RUNNING|1-02:03:04|None\n\n\
                    7|osteon-worker-1|NODE_FAIL|2:05|NonZeroExitCode|x\n";
        let found = parse(text).unwrap();
        let seen: Vec<_> = found
            .iter()
            .map(|it| {
                (it.id.as_str(), it.lasting, it.stage, it.running_for.as_secs(), it.why.as_str())
            })
            .collect();
        assert_eq!(
            seen,
            [
                ("12_3", false, QueueStage::Waiting, 0, "PENDING: Resources"),
                ("12_[4-9]", true, QueueStage::Running, 93_784, "RUNNING"),
                ("7", false, QueueStage::Failed, 125, "NODE_FAIL: NonZeroExitCode|x"),
            ]
        );
        assert_eq!(parse("").unwrap(), []);
    }

    #[test]
    fn states_are_those_of_slurm() {
        for (state, expected) in [
            ("CONFIGURING", QueueStage::Waiting),
            ("SUSPENDED", QueueStage::Running),
            ("NEW_IN_SOME_VERSION", QueueStage::Running),
            ("COMPLETING", QueueStage::Ended),
            ("TIMEOUT", QueueStage::Ended),
            ("CANCELLED", QueueStage::Cancelled),
            ("OUT_OF_MEMORY", QueueStage::Failed),
        ] {
            assert_eq!(stage(state), expected, "{state}");
        }
    }

    #[test]
    fn other_lines_are_refused() {
        for line in
            ["12", "a|b|c", "x|n|PENDING|0:00|", "12|n|PENDING|soon|", "12|n|PENDING|1:2:3:4|r"]
        {
            assert!(matches!(parse(line), Err(SlurmError::NotUnderstood { .. })), "{line}");
        }
    }
}
