//! Reports the first failure after which a coordinator cannot continue to the process that runs it.

use std::time::Duration;

use thiserror::Error;
use tokio::sync::watch;

/// Reason why a running coordinator cannot continue.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ComponentFailure {
    /// The core task ended unexpectedly.
    #[error("the coordinator's core ended unexpectedly; {START_AGAIN}")]
    Core,
    /// The server of its port ended unexpectedly.
    #[error("the coordinator's server ended unexpectedly; {START_AGAIN}")]
    Server,
    /// The thread of the store ended unexpectedly.
    #[error("the thread of the coordinator's store ended unexpectedly; {START_AGAIN}")]
    Store,
    /// The store no longer accepts records.
    #[error(
        "the store has refused a record for {} s: {error}; make room or repair it, then \
         {START_AGAIN}",
        waited.as_secs()
    )]
    StoreRefuses {
        /// Last error of the store.
        error: String,
        /// Time for which it has refused a record.
        waited: Duration,
    },
}

/// The program is the coordinator's own, or one that runs a job with a coordinator inside it.
const START_AGAIN: &str =
    "start this program again: every job continues from its last stored evaluation";

#[derive(Debug)]
enum Health {
    Well,
    /// The coordinator is being stopped: the end of a part is no failure from now on.
    Stopping,
    Failed(ComponentFailure),
}

/// Shared channel on which the parts of a coordinator report that it cannot continue.
#[derive(Debug, Clone)]
pub(crate) struct FailureReporter(watch::Sender<Health>);

/// Held by a part of a coordinator while it runs; reports its end, by panic or otherwise.
#[derive(Debug)]
pub(crate) struct Guard {
    /// The failure that is reported when this part ends.
    failure: ComponentFailure,
    reporter: FailureReporter,
}

impl FailureReporter {
    pub(crate) fn new() -> Self {
        Self(watch::Sender::new(Health::Well))
    }

    /// Reports that the coordinator cannot continue.
    pub(crate) fn report(&self, failure: ComponentFailure) {
        self.change_if_well(Health::Failed(failure));
    }

    /// Records that the coordinator is about to be stopped.
    pub(crate) fn disarm(&self) {
        self.change_if_well(Health::Stopping);
    }

    /// Returns the guard of a part whose end is reported as `failure`.
    pub(crate) fn guard(&self, failure: ComponentFailure) -> Guard {
        Guard { failure, reporter: self.clone() }
    }

    /// Returns the first failure; never completes if there is none.
    pub(crate) fn first(&self) -> impl Future<Output = ComponentFailure> + Send + use<> {
        let mut health = self.0.subscribe();
        async move {
            let is_failed = |health: &Health| matches!(health, Health::Failed(_));
            if let Ok(known) = health.wait_for(is_failed).await
                && let Health::Failed(failure) = &*known
            {
                return failure.clone();
            }
            // No sender is left that could report a failure.
            std::future::pending().await
        }
    }

    /// Changes the health, unless a failure or the stop was recorded before.
    fn change_if_well(&self, next: Health) {
        self.0.send_if_modified(|health| {
            // The first failure is the cause of all others.
            let well = matches!(health, Health::Well);
            if well {
                *health = next;
            }
            well
        });
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.reporter.report(self.failure.clone());
    }
}

#[cfg(test)]
mod tests {
    use std::task::Poll;

    use super::*;

    async fn check(what: impl FnOnce(&FailureReporter), expected: Option<ComponentFailure>) {
        let reporter = FailureReporter::new();
        let mut first = std::pin::pin!(reporter.first());
        what(&reporter);
        let told = futures::poll!(&mut first);
        assert_eq!(told, expected.map_or(Poll::Pending, Poll::Ready));
    }

    #[tokio::test]
    async fn the_first_failure_is_told_and_no_stop() {
        check(|_| {}, None).await;
        check(
            |reporter| drop(reporter.guard(ComponentFailure::Core)),
            Some(ComponentFailure::Core),
        )
        .await;
        let both = |reporter: &FailureReporter| {
            drop(reporter.guard(ComponentFailure::Store));
            drop(reporter.guard(ComponentFailure::Core));
        };
        check(both, Some(ComponentFailure::Store)).await;
        let stopped = |reporter: &FailureReporter| {
            reporter.disarm();
            drop(reporter.guard(ComponentFailure::Core));
        };
        check(stopped, None).await;
    }

    #[tokio::test]
    async fn a_panic_is_told() {
        let reporter = FailureReporter::new();
        let guard = reporter.guard(ComponentFailure::Server);
        let panics = async move {
            let _guard = guard;
            panic!("a part of the coordinator that this test breaks");
        };
        assert!(tokio::spawn(panics).await.is_err());
        assert_eq!(reporter.first().await, ComponentFailure::Server);
    }
}
