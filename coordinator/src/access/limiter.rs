//! Concurrency limiter for calls that hold much memory: few run at a time, and fewer of one caller,
//! so that a slow caller does not block the others. Nobody waits for long.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use osteon_proto::status;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;
use tonic::Status;
use tonic::codegen::http::Extensions;

use crate::access::HolderName;
use crate::service::accept::PeerInfo;

/// A call that gets no permit within this time is refused.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time after which a refused call may be repeated.
const RETRY: Duration = Duration::from_secs(5);

/// Identity of a caller.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Caller {
    /// The holder of the token with this name.
    Holder(String),
    /// Without tokens: the peer of this connection.
    Connection(u64),
}

/// A pool of permits.
#[derive(Debug, Clone)]
pub(crate) struct Limiter {
    all: Arc<Semaphore>,
    per_caller: usize,
    /// Semaphores of the callers that hold or await a permit.
    own: Arc<Mutex<BTreeMap<Caller, Weak<Semaphore>>>>,
}

/// A permit, held until it is dropped.
#[derive(Debug)]
pub(crate) struct Permit {
    _own: OwnedSemaphorePermit,
    _of_all: OwnedSemaphorePermit,
}

impl Caller {
    /// Returns the caller as noted by the access layer and the listener.
    pub(crate) fn from_extensions(extensions: &Extensions) -> Self {
        match (extensions.get::<HolderName>(), extensions.get::<PeerInfo>()) {
            (Some(HolderName(name)), _) => Self::Holder(name.clone()),
            (None, Some(peer)) => Self::Connection(peer.connection),
            // Numbers of connections begin above 0.
            (None, None) => Self::Connection(0),
        }
    }
}

impl Limiter {
    /// Returns a pool of `all` permits, of which one caller can hold `per_caller`.
    pub(crate) fn new(all: usize, per_caller: usize) -> Self {
        Self { all: Arc::new(Semaphore::new(all)), per_caller, own: Arc::default() }
    }

    /// Waits for a permit.
    ///
    /// # Errors
    /// `RESOURCE_EXHAUSTED` when there is no permit within the time limit.
    pub(crate) async fn acquire(&self, caller: Caller) -> Result<Permit, Status> {
        let own = self.own_semaphore(caller);
        let both = async {
            // The caller's own permit comes first: whoever waits for it blocks nobody else.
            let own = own.acquire_owned().await.ok()?;
            let of_all = Arc::clone(&self.all).acquire_owned().await.ok()?;
            Some(Permit { _own: own, _of_all: of_all })
        };
        // Semaphores are never closed.
        timeout(PATIENCE, both).await.ok().flatten().ok_or_else(full)
    }

    fn own_semaphore(&self, caller: Caller) -> Arc<Semaphore> {
        // Nothing panics while the lock is held.
        let mut own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        own.retain(|_, semaphore| semaphore.strong_count() > 0);
        if let Some(semaphore) = own.get(&caller).and_then(Weak::upgrade) {
            return semaphore;
        }
        let semaphore = Arc::new(Semaphore::new(self.per_caller));
        own.insert(caller, Arc::downgrade(&semaphore));
        semaphore
    }
}

fn full() -> Status {
    let waited = PATIENCE.as_secs();
    let message = format!(
        "too many large requests of other callers are in progress; this one waited {waited} s; \
         try again"
    );
    status::resource_exhausted(message, RETRY)
}

#[cfg(test)]
mod tests {
    use std::slice;

    use tonic::Code;

    use super::*;

    async fn acquire(limiter: &Limiter, connection: u64) -> Result<Permit, Code> {
        limiter.acquire(Caller::Connection(connection)).await.map_err(|status| status.code())
    }

    #[tokio::test(start_paused = true)]
    async fn nobody_takes_all_and_nobody_waits_for_ever() {
        let limiter = Limiter::new(3, 2);
        let mut held =
            vec![acquire(&limiter, 1).await.unwrap(), acquire(&limiter, 1).await.unwrap()];
        assert_eq!(acquire(&limiter, 1).await.unwrap_err(), Code::ResourceExhausted);
        held.push(acquire(&limiter, 2).await.unwrap());
        assert_eq!(acquire(&limiter, 3).await.unwrap_err(), Code::ResourceExhausted);
        drop(held.remove(0));
        let per_caller = acquire(&limiter, 1).await.unwrap();
        drop((per_caller, held));
        // Callers that have gone are not remembered.
        drop(acquire(&limiter, 4).await.unwrap());
        let known: Vec<Caller> = limiter.own.lock().unwrap().keys().cloned().collect();
        assert_eq!(known, slice::from_ref(&Caller::Connection(4)));
    }

    #[tokio::test(start_paused = true)]
    async fn who_waits_for_an_own_place_is_in_nobodys_way() {
        let limiter = Limiter::new(2, 1);
        let _held = acquire(&limiter, 1).await.unwrap();
        let waiting = tokio::spawn({
            let limiter = limiter.clone();
            async move { acquire(&limiter, 1).await.map(drop) }
        });
        tokio::task::yield_now().await;
        assert!(timeout(Duration::ZERO, acquire(&limiter, 2)).await.is_ok());
        assert_eq!(waiting.await.unwrap(), Err(Code::ResourceExhausted));
    }
}
