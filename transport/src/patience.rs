//! Waiting for a peer, for a limited time. Time in which this process itself did not run (stopped, on a machine that was
//! suspended or out of memory) is no silence of the peer: its answer may be here and not read yet, and if
//! both stood still, it did not have the time to answer.

use std::pin::pin;
use std::time::Duration;

use thiserror::Error;
use tokio::time::{Instant, sleep, timeout};

/// The clock is read at least so often while something is waited for.
const SLICE: Duration = Duration::from_millis(250);
/// A slice counts for at most this long. A process that runs reads the clock earlier, even on a busy machine.
const SLICE_MAX: Duration = Duration::from_millis(500);
/// Time that is left after a pause, once, so that a peer that paused, too, can answer.
const AFTER_PAUSE: Duration = Duration::from_secs(2);

/// What is left of a limit on a wait, or on several in a row.
#[derive(Debug, Clone)]
pub struct Patience {
    left: Duration,
    /// A pause has prolonged it already.
    prolonged: bool,
}

/// The limit has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the wait took too long")]
pub struct Exhausted;

impl Patience {
    /// Begins with a limit.
    pub fn new(limit: Duration) -> Self {
        Self { left: limit, prolonged: false }
    }

    /// Returns what is left.
    pub fn left(&self) -> Duration {
        self.left
    }

    /// Waits for a future, for at most what is left.
    ///
    /// # Errors
    /// If it has not completed by then.
    pub async fn wait_for<T>(&mut self, future: impl Future<Output = T>) -> Result<T, Exhausted> {
        let mut future = pin!(future);
        loop {
            let begun = Instant::now();
            let completed = timeout(SLICE.min(self.left), future.as_mut()).await;
            self.take(begun.elapsed());
            match completed {
                Ok(completed) => return Ok(completed),
                Err(_) if self.left.is_zero() => return Err(Exhausted),
                Err(_) => {}
            }
        }
    }

    /// Waits before another attempt, for at most what is left.
    pub async fn rest(&mut self, pause: Duration) {
        // Either end is the end of the rest.
        let _ = self.wait_for(sleep(pause)).await;
    }

    /// Takes the time of a slice.
    fn take(&mut self, time: Duration) {
        self.left = self.left.saturating_sub(time.min(SLICE_MAX));
        if time > SLICE_MAX && !self.prolonged {
            self.prolonged = true;
            self.left = self.left.max(AFTER_PAUSE);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use tokio::sync::oneshot;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_limit_is_kept_over_several_waits() {
        let begun = Instant::now();
        let mut patience = Patience::new(Duration::from_secs(10));
        assert_eq!(patience.wait_for(async { 7 }).await, Ok(7));
        patience.rest(Duration::from_millis(3100)).await;
        assert_eq!(patience.left(), Duration::from_millis(6900));
        assert_eq!(patience.wait_for(pending::<()>()).await, Err(Exhausted));
        assert_eq!(begun.elapsed(), Duration::from_secs(10));
        // What is there already is taken even then.
        assert_eq!(patience.wait_for(async { 7 }).await, Ok(7));
        assert_eq!(patience.wait_for(pending::<()>()).await, Err(Exhausted));
    }

    /// The only thread stands still for longer than the limit, and the peer on it, too.
    #[tokio::test]
    async fn a_pause_of_this_process_does_not_count() {
        for limit in [Duration::from_millis(600), Duration::from_secs(10)] {
            let (sender, answer) = oneshot::channel();
            let peer = tokio::spawn(async move {
                sleep(Duration::from_millis(100)).await;
                std::thread::sleep(Duration::from_secs(1));
                // The answer takes a little after the pause.
                sleep(Duration::from_millis(100)).await;
                sender.send(7)
            });
            let mut patience = Patience::new(limit);
            assert_eq!(patience.wait_for(answer).await, Ok(Ok(7)), "{limit:?}");
            peer.await.unwrap().unwrap();
        }
    }

    /// A machine that is paused again and again does not make a wait endless.
    #[test]
    fn pauses_prolong_once() {
        let mut patience = Patience::new(Duration::from_secs(1));
        let mut slices = 0;
        while !patience.left().is_zero() {
            patience.take(Duration::from_secs(60));
            slices += 1;
        }
        assert_eq!(slices, 5);
    }
}
