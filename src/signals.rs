//! The wish of a user, or of the system, that the program ends.

use tokio::signal::unix::{SignalKind, signal};

use crate::ending::Failure;

/// Completes at the first SIGINT or SIGTERM after the call; these signals no longer end the process
/// by themselves from then on. SIGHUP is left alone, so that `nohup` keeps its meaning.
///
/// # Errors
/// When the system does not let signals be handled.
pub(crate) fn interruption() -> Result<impl Future<Output = ()>, Failure> {
    let listen = |kind| {
        signal(kind).map_err(|error| {
            Failure::failed(anyhow::Error::new(error).context("cannot listen for signals"))
        })
    };
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}
