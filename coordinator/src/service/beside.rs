//! Servers beside the API, each on an address of its own: the metrics, and the live page.

use std::fmt::Debug;
use std::future::Future;
use std::sync::Arc;

use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;

use crate::access::Policy;
use crate::access::tls::Tls;
use crate::metrics::write_times::WriteTimes;
use crate::service::core_task::Message;
use crate::store::thread::StoreCommand;

/// What a server beside the API may use of a coordinator.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(not(feature = "live"), expect(dead_code, reason = "metrics need some of them only"))]
pub(crate) struct SharedParts<'a> {
    pub(crate) messages: &'a mpsc::Sender<Message>,
    pub(crate) store: &'a mpsc::Sender<StoreCommand>,
    pub(crate) write_times: &'a WriteTimes,
    pub(crate) policy: &'a watch::Receiver<Arc<Policy>>,
    pub(crate) tls: Option<&'a watch::Receiver<Tls>>,
}

/// A bound address beside that of the API.
pub(crate) trait BesideListener: Debug + Send {
    /// Starts to serve.
    fn start(self: Box<Self>, parts: SharedParts<'_>) -> BesideTask;
}

/// What is served beside the API.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BesideKind {
    Metrics,
    Page,
}

/// The task of a server; it ends when this is dropped.
#[derive(Debug)]
pub(crate) struct BesideTask {
    pub(crate) kind: BesideKind,
    pub(crate) url: String,
    task: JoinHandle<()>,
}

impl BesideTask {
    /// Starts the task of a server.
    pub(crate) fn start(
        kind: BesideKind,
        url: String,
        serving: impl Future<Output = ()> + Send + 'static,
    ) -> Self {
        Self { kind, url, task: tokio::spawn(serving) }
    }
}

impl Drop for BesideTask {
    fn drop(&mut self) {
        self.task.abort();
    }
}
