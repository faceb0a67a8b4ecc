//! A command, ready to be executed.

use std::pin::Pin;

use crate::arguments::LogFormat;
use crate::exit_status::{CommandFailure, ExitStatus};
use crate::signals::unless_interrupted;

/// How a command ends.
pub(crate) type Ended = Result<ExitStatus, CommandFailure>;

/// A command with environment and defaults resolved; files have not been read, and
/// nothing has been done.
pub(crate) struct PreparedCommand {
    performance: Pin<Box<dyn Future<Output = Ended>>>,
    left_by_interruption: Option<&'static str>,
    /// Name of the process in exported traces.
    pub(crate) name: &'static str,
    /// Default log level.
    pub(crate) log_level: &'static str,
    /// Format of the log.
    pub(crate) log_format: LogFormat,
}

impl PreparedCommand {
    /// Creates a command that treats interruptions itself and logs problems only.
    pub(crate) fn new(performance: impl Future<Output = Ended> + 'static) -> Self {
        Self {
            performance: Box::pin(performance),
            left_by_interruption: None,
            name: "osteon",
            log_level: "warn",
            log_format: LogFormat::Text,
        }
    }

    /// Creates a command that ends at once.
    pub(crate) fn brief(perform: impl FnOnce() -> Ended + 'static) -> Self {
        Self::new(async { perform() })
    }

    /// Creates a command that may be interrupted at any moment; `left` is the message that then says what it leaves
    /// behind.
    pub(crate) fn interruptible(
        left: &'static str,
        performance: impl Future<Output = Ended> + 'static,
    ) -> Self {
        Self { left_by_interruption: Some(left), ..Self::new(performance) }
    }

    /// Creates a command that may be interrupted at any moment and changes nothing.
    pub(crate) fn harmless(performance: impl Future<Output = Ended> + 'static) -> Self {
        Self::interruptible("nothing was changed", performance)
    }

    /// Creates a service, which logs its events.
    pub(crate) fn service(
        name: &'static str,
        log_format: LogFormat,
        performance: impl Future<Output = Ended> + 'static,
    ) -> Self {
        Self { name, log_format, ..Self::new(performance).with_events() }
    }

    /// Returns the same command, which then logs its events.
    pub(crate) fn with_events(self) -> Self {
        Self { log_level: "info", ..self }
    }

    /// Executes the command.
    ///
    /// # Errors
    /// If the command fails, or was interrupted.
    pub(crate) async fn perform(self) -> Ended {
        match self.left_by_interruption {
            Some(left) => unless_interrupted(self.performance, left).await,
            None => self.performance.await,
        }
    }
}
