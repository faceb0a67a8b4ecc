//! Admission of connections: a fixed number is served at a time, a fixed number waits to be served, and all
//! others are refused at once.
//!
//! Clients of UM-Bridge do not repeat a refused request, and a sampler ends at the first refusal. So some
//! connections wait, for a limited time, instead of being refused: evaluations are often short.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

/// Bounds on connections.
#[derive(Debug, Clone, Copy)]
pub(super) struct CrowdLimits {
    /// Maximum number of connections that are served at a time, and so of requests.
    pub(super) served: usize,
    /// Maximum number of connections that wait to be served.
    pub(super) waiting: usize,
    /// Maximum number of connections that are being refused without a wait.
    pub(super) refused: usize,
    /// Maximum time for which a connection waits to be served.
    pub(super) wait: Duration,
    /// Time limit for the header of a request, which also ends idle connections. Together with that of a
    /// body it is not longer than `wait`, so that a client that sends nothing loses its connection before
    /// those that wait for it are refused.
    pub(super) header: Duration,
    /// Maximum time of a refusal, from the arrival of the request to the end of the connection.
    pub(super) refusal: Duration,
}

/// The bounds of the program: 576 connections in all, since a process may usually have 1024 open files.
pub(super) const LIMITS: CrowdLimits = CrowdLimits {
    served: 256,
    waiting: 256,
    refused: 64,
    wait: Duration::from_secs(60),
    header: Duration::from_secs(30),
    refusal: Duration::from_secs(10),
};

/// Counts the connections that are served, that wait and that are being refused.
#[derive(Debug)]
pub(super) struct Crowd {
    limits: CrowdLimits,
    served: Arc<Semaphore>,
    waiting: Arc<Semaphore>,
    refused: Arc<Semaphore>,
}

/// Decision on a connection. Each variant holds a permit that counts the connection; it is dropped when the
/// connection has ended.
#[derive(Debug)]
pub(super) enum Admission {
    /// It is served.
    Served(OwnedSemaphorePermit),
    /// It may wait until it is served.
    Waits(OwnedSemaphorePermit),
    /// It is told to come back later.
    Refused(OwnedSemaphorePermit),
}

impl Crowd {
    pub(super) fn new(limits: CrowdLimits) -> Self {
        let places = |count| Arc::new(Semaphore::new(count));
        let [served, waiting, refused] =
            [limits.served, limits.waiting, limits.refused].map(places);
        Self { limits, served, waiting, refused }
    }

    /// Decides on a new connection; `None` if the server is ending. Waits only while the maximum number of
    /// connections is being refused; each refusal ends within [`CrowdLimits::refusal`].
    pub(super) async fn admit(&self) -> Option<Admission> {
        // The semaphore gives a permit that becomes free to the connection that has waited longest. So a new
        // connection gets none while others wait.
        let place = |places: &Arc<Semaphore>| Arc::clone(places).try_acquire_owned().ok();
        if let Some(place) = place(&self.served) {
            return Some(Admission::Served(place));
        }
        if let Some(place) = place(&self.waiting) {
            return Some(Admission::Waits(place));
        }
        Arc::clone(&self.refused).acquire_owned().await.ok().map(Admission::Refused)
    }

    /// Waits until a waiting connection may be served or has waited for too long. Returns the decision:
    /// served or refused.
    pub(super) async fn settle(&self, admission: Admission) -> Admission {
        let Admission::Waits(waiting) = admission else { return admission };
        let place = Arc::clone(&self.served).acquire_owned();
        match timeout(self.limits.wait, place).await {
            Ok(Ok(place)) => Admission::Served(place),
            _ => Admission::Refused(waiting),
        }
    }

    /// Returns whether connections wait to be served.
    pub(super) fn waits(&self) -> bool {
        self.waiting.available_permits() < self.limits.waiting
    }
}

impl CrowdLimits {
    /// Returns the error message for refused clients.
    pub(super) fn message(&self) -> String {
        let Self { served, waiting, wait, .. } = self;
        format!(
            "the server is busy: {served} connections are served at a time, and {waiting} more wait for \
             up to {} s; send fewer requests at a time, or ask again later",
            wait.as_secs_f64()
        )
    }
}

#[cfg(test)]
mod tests {
    use tokio::time::Instant;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_wait_ends_with_a_place_or_in_time() {
        let crowd = Crowd::new(CrowdLimits { served: 1, waiting: 2, refused: 1, ..LIMITS });
        let served = crowd.admit().await.unwrap();
        let [first, second] = [crowd.admit().await.unwrap(), crowd.admit().await.unwrap()];
        let refused = crowd.admit().await.unwrap();
        let kinds = [&served, &first, &second, &refused].map(|admission| match admission {
            Admission::Served(_) => "served",
            Admission::Waits(_) => "waits",
            Admission::Refused(_) => "refused",
        });
        assert_eq!(kinds, ["served", "waits", "waits", "refused"]);
        // The next connection is not decided on before the refusal under way has ended.
        assert!(timeout(Duration::from_secs(3600), crowd.admit()).await.is_err());
        drop(refused);
        assert!(matches!(crowd.admit().await, Some(Admission::Refused(_))));
        drop(served);
        let first = crowd.settle(first).await;
        assert!(matches!(first, Admission::Served(_)), "{first:?}");
        let began = Instant::now();
        let second = crowd.settle(second).await;
        assert!(matches!(second, Admission::Refused(_)), "{second:?}");
        assert_eq!(began.elapsed().as_secs(), LIMITS.wait.as_secs());
        assert!(crowd.waits());
        drop(second);
        assert!(!crowd.waits());
    }
}
