//! The ways in which a command ends, with their exit codes.

use std::fmt;

use osteon_client::client::ClientError;
use osteon_client::environment::EnvironmentError;
use osteon_client::result_status;
use osteon_client::run_error::RunError;
use osteon_common::job::JobSpecification;
use osteon_files::report::ResultFile;

/// Outcome of a command that ran to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExitStatus {
    /// The command succeeded: exit code 0.
    Done,
    /// There is a result, which says that the run failed or was cancelled: exit code 1.
    RunFailed,
}

/// Exit code of a worker whose machine computes wrongly (EX_NOPERM of sysexits.h): service managers are told not
/// to start it again.
pub(crate) use osteon_client::embedded::BAD_MACHINE;

/// Reason why a command did not run to its end.
#[derive(Debug)]
pub(crate) enum CommandFailure {
    /// Bad usage or bad input; nothing was started. Exit code 2.
    BadInput(anyhow::Error),
    /// Any other error. Exit code 1.
    Failed(anyhow::Error),
    /// This machine computes wrongly, or is banned for wrong answers: it must be repaired before the command is
    /// run again. Exit code 77.
    BadMachine(anyhow::Error),
    /// A signal ended the command; the text says what happens to the work begun. Exit code 130 or
    /// 143.
    Interrupted(Interruption, &'static str),
    /// The reader of stdout has closed it. Exit code 0.
    ClosedPipe,
}

/// A signal that asks a command to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interruption {
    /// SIGINT: Ctrl-C.
    Interrupted,
    /// SIGTERM.
    Terminated,
}

impl Interruption {
    /// Returns the exit code by the convention of shells: 128 plus the number of the signal.
    pub(crate) fn exit_code(self) -> u8 {
        match self {
            Self::Interrupted => 130,
            Self::Terminated => 143,
        }
    }
}

impl ExitStatus {
    /// Returns how a command ends that shows this result.
    pub(crate) fn of_result(specification: &JobSpecification, result: &ResultFile) -> Self {
        match result_status::is_complete(specification, result) {
            true => Self::Done,
            false => Self::RunFailed,
        }
    }
}

impl CommandFailure {
    /// Creates the failure of bad usage or bad input.
    pub(crate) fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self::BadInput(error.into())
    }

    /// Creates a failure that is not caused by the user's input.
    pub(crate) fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self::Failed(error.into())
    }

    /// Creates the failure of a path that cannot be used: bad input if another path could be,
    /// failed if the machine is the cause, as with a full disk.
    pub(crate) fn unusable_path(error: std::io::Error, context: String) -> Self {
        RunError::unusable_path(error, context).into()
    }

    /// Returns the exit code of the process.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted(interruption, _) => interruption.exit_code(),
            Self::BadInput(_) => 2,
            Self::Failed(_) => 1,
            Self::BadMachine(_) => BAD_MACHINE,
            Self::ClosedPipe => 0,
        }
    }
}

/// Returns whether a file would have grown above the limit of the session.
fn is_above_limit(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let cause = cause.downcast_ref::<std::io::Error>();
        cause.is_some_and(|cause| cause.kind() == std::io::ErrorKind::FileTooLarge)
    })
}

impl fmt::Display for CommandFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadInput(error) | Self::Failed(error) | Self::BadMachine(error) => {
                write!(f, "{error}")?;
                // Append only the causes that the message does not contain already.
                let mut told = error.to_string();
                for cause in error.chain().skip(1) {
                    let text = cause.to_string();
                    if !told.contains(&text) {
                        write!(f, ": {text}")?;
                        told.push_str(&text);
                    }
                }
                if is_above_limit(error) {
                    f.write_str(" (the limit on the size of files of this session: ulimit -f)")?;
                }
                Ok(())
            }
            Self::Interrupted(Interruption::Interrupted, left) => write!(f, "interrupted; {left}"),
            Self::Interrupted(Interruption::Terminated, left) => write!(f, "terminated; {left}"),
            Self::ClosedPipe => f.write_str("stdout is closed"),
        }
    }
}

impl From<RunError> for CommandFailure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::BadInput(error) => Self::BadInput(error),
            RunError::Failed(error) => Self::Failed(error),
        }
    }
}

impl From<EnvironmentError> for CommandFailure {
    fn from(error: EnvironmentError) -> Self {
        Self::bad_input(error)
    }
}

impl From<ClientError> for CommandFailure {
    fn from(error: ClientError) -> Self {
        RunError::from(error).into()
    }
}

/// Converts an error of writing to stdout.
pub(crate) fn stdout_failure(error: std::io::Error) -> CommandFailure {
    if error.kind() == std::io::ErrorKind::BrokenPipe {
        return CommandFailure::ClosedPipe;
    }
    CommandFailure::failed(anyhow::Error::new(error).context("cannot write to stdout"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_are_told_once() {
        let cause = std::io::Error::other("disk full");
        let failure = CommandFailure::failed(anyhow::Error::new(cause).context("cannot write DIR"));
        assert_eq!(failure.to_string(), "cannot write DIR: disk full");
        assert_eq!(failure.exit_code(), 1);
        let cause = std::io::Error::other("disk full");
        let failure =
            CommandFailure::bad_input(anyhow::Error::new(cause).context("refused: disk full"));
        assert_eq!(failure.to_string(), "refused: disk full");
        assert_eq!(failure.exit_code(), 2);
    }

    #[test]
    fn a_signal_has_the_code_that_shells_give_it() {
        let failure = |interruption| CommandFailure::Interrupted(interruption, "nothing was saved");
        let (interrupted, terminated) =
            (failure(Interruption::Interrupted), failure(Interruption::Terminated));
        assert_eq!(interrupted.to_string(), "interrupted; nothing was saved");
        assert_eq!(terminated.to_string(), "terminated; nothing was saved");
        assert_eq!((interrupted.exit_code(), terminated.exit_code()), (130, 143));
    }

    #[test]
    fn a_closed_pipe_is_no_failure() {
        let closed = std::io::Error::from(std::io::ErrorKind::BrokenPipe);
        assert_eq!(stdout_failure(closed).exit_code(), 0);
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        assert_eq!(stdout_failure(full).exit_code(), 1);
    }
}
