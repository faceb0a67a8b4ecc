//! The wish of a user, or of the system, that the program ends.

use std::time::Duration;

use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot;

use crate::ending::{Failure, Interruption};
use crate::progress::say;

/// Signals that come so soon after the first are one with it: some programs send it to a process
/// and to its group.
const ONE_WISH: Duration = Duration::from_millis(300);
/// A command that cannot stop, because nobody reads what it writes, is ended after this long.
const PATIENCE: Duration = Duration::from_secs(2);

/// Completes at the first SIGINT or SIGTERM after the call; these signals no longer end the process
/// by themselves from then on. SIGHUP is left alone, so that `nohup` keeps its meaning, unless [`hangups`] asks for it.
///
/// Who then presses Ctrl-C again does not want to wait for an orderly end: the process exits, with
/// code 130.
///
/// # Errors
/// When the system does not let signals be handled.
pub(crate) fn interruption() -> Result<impl Future<Output = Interruption>, Failure> {
    let listen = |kind| {
        signal(kind).map_err(|error| {
            Failure::failed(anyhow::Error::new(error).context("cannot listen for signals"))
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

/// What `command` ends with, or the first SIGINT or SIGTERM: for commands that can be left at any
/// moment. `left` says what becomes of what was begun.
///
/// # Errors
/// That of the command, or the signal.
pub(crate) async fn unless_interrupted<T>(
    command: impl Future<Output = Result<T, Failure>>,
    left: &'static str,
) -> Result<T, Failure> {
    let interruption = interruption()?;
    let (sender, received) = oneshot::channel();
    // In a task of its own, which runs even while the command is kept by what does not wait.
    tokio::spawn(async move {
        let interruption = interruption.await;
        // Fails only when the command has ended.
        let _ended = sender.send(interruption);
        tokio::time::sleep(PATIENCE).await;
        std::process::exit(interruption.exit_code().into());
    });
    tokio::select! {
        result = command => result,
        Ok(interruption) = received => Err(Failure::Interrupted(interruption, left)),
    }
}

/// SIGHUP from now on, which no longer ends the process.
///
/// # Errors
/// When the system does not let signals be handled.
pub(crate) fn hangups() -> Result<Signal, Failure> {
    signal(SignalKind::hangup()).map_err(|error| {
        Failure::failed(anyhow::Error::new(error).context("cannot listen for signals"))
    })
}

/// The next signal; waits for ever without a source of them.
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
    tokio::time::sleep(ONE_WISH).await;
    // Hears only what comes from now on.
    if let Ok(mut interrupt) = signal(SignalKind::interrupt())
        && interrupt.recv().await.is_some()
    {
        say("osteon: interrupted again, ends at once");
        std::process::exit(Interruption::Interrupted.exit_code().into());
    }
}
