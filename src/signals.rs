//! Signals by which a user or the system asks the program to end.

use std::time::Duration;

use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot;

use crate::exit_status::{CommandFailure, Interruption};
use crate::progress::say;

/// Signals that follow the first one within this time count as part of it: some programs send a
/// signal both to a process and to its group.
const SIGNAL_DEBOUNCE: Duration = Duration::from_millis(300);
/// A command that cannot stop, because nobody reads its output, is killed after this long.
const EXIT_TIMEOUT: Duration = Duration::from_secs(2);

/// From the call on, a file that grows above the limit of the session (`ulimit -f`) is an error of its write, which
/// the program can report, and does not end the process. Must be called within the runtime.
pub(crate) fn report_large_files() {
    // A handler stays for the life of the process; without one, the limit is as sudden as before.
    drop(signal(SignalKind::from_raw(rustix::process::Signal::XFSZ.as_raw())));
}

/// Completes at the first SIGINT or SIGTERM after the call; from the call on, these signals do not
/// end the process by themselves. SIGHUP is left alone, so that `nohup` keeps its effect, unless
/// [`hangups`] handles it.
///
/// If the user then presses Ctrl-C again, instead of waiting for an orderly end, the process exits
/// with code 130.
///
/// # Errors
/// If the system does not allow signals to be handled.
pub(crate) fn interruption() -> Result<impl Future<Output = Interruption>, CommandFailure> {
    let listen = |kind| {
        signal(kind).map_err(|error| {
            CommandFailure::failed(anyhow::Error::new(error).context("cannot listen for signals"))
        })
    };
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    Ok(async move {
        let interruption = tokio::select! {
            _ = interrupt.recv() => Interruption::Interrupted,
            _ = terminate.recv() => Interruption::Terminated,
        };
        tokio::spawn(exit_at_the_next());
        interruption
    })
}

/// Returns the outcome of `command`, or ends it at the first SIGINT or SIGTERM; for commands that
/// can be interrupted at any moment. `left` says what happens to the work begun.
///
/// # Errors
/// The error of the command, or the signal.
pub(crate) async fn unless_interrupted<T>(
    command: impl Future<Output = Result<T, CommandFailure>>,
    left: &'static str,
) -> Result<T, CommandFailure> {
    let interruption = interruption()?;
    let (sender, received) = oneshot::channel();
    // Runs in a separate task, which makes progress even while the command blocks.
    tokio::spawn(async move {
        let interruption = interruption.await;
        // Fails only if the command has ended.
        let _ended = sender.send(interruption);
        tokio::time::sleep(EXIT_TIMEOUT).await;
        std::process::exit(interruption.exit_code().into());
    });
    tokio::select! {
        result = command => result,
        Ok(interruption) = received => Err(CommandFailure::Interrupted(interruption, left)),
    }
}

/// Handles SIGHUP from now on, so that it does not end the process.
///
/// # Errors
/// If the system does not allow signals to be handled.
pub(crate) fn hangups() -> Result<Signal, CommandFailure> {
    signal(SignalKind::hangup()).map_err(|error| {
        CommandFailure::failed(anyhow::Error::new(error).context("cannot listen for signals"))
    })
}

/// Waits for the next signal; waits forever if there is no source of signals.
pub(crate) async fn next(signals: &mut Option<Signal>) {
    if let Some(signals) = signals
        && signals.recv().await.is_some()
    {
        return;
    }
    std::future::pending().await
}

/// Ends the process at the next SIGINT.
async fn exit_at_the_next() {
    tokio::time::sleep(SIGNAL_DEBOUNCE).await;
    // Receives only signals sent after this point.
    if let Ok(mut interrupt) = signal(SignalKind::interrupt())
        && interrupt.recv().await.is_some()
    {
        say("osteon: interrupted again; exiting immediately");
        std::process::exit(Interruption::Interrupted.exit_code().into());
    }
}
