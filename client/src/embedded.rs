//! A coordinator in this process, with worker processes on a private Unix socket.

mod workers;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use anyhow::Context as _;
use osteon_coordinator::store::Store;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::store::sqlite::{LostJobs, SqliteStore};
use osteon_coordinator::{Config, Coordinator, ListenAddress, Listener};
use osteon_transport::endpoint::Endpoint;
use tempfile::TempDir;

use crate::embedded::workers::Workers;
use crate::listener::RunListener;
use crate::run_error::RunError;

pub use crate::embedded::workers::BAD_MACHINE;

/// Longest path of a temporary directory that leaves room for the socket's name, bytes.
const TEMPORARY_PATH_BYTES_MAX: usize = 70;
/// A run ends if its store has accepted no write for this long, s; the same command resumes it.
const STORE_PATIENCE_S: u64 = 10;

/// Storage of the coordinator's jobs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StoreLocation {
    /// In memory: the jobs are lost when the process ends.
    Memory,
    /// In a directory, so that an interrupted run can be resumed.
    Directory(PathBuf),
}

/// What is started.
#[derive(Debug)]
pub struct EmbeddedSetup {
    /// The program `osteon`, for the workers.
    pub executable: PathBuf,
    /// The commit from which this program was built, if it is known; results state it.
    pub commit: Option<&'static str>,
    /// Storage of the jobs.
    pub store: StoreLocation,
    /// Number of worker processes.
    pub workers: u32,
    /// Number of threads of each worker.
    pub threads: u32,
    /// Address of the live page, on this machine only; `None`: no page.
    pub page: Option<SocketAddr>,
    /// Ended jobs are deleted after this time; `None`: they are kept.
    pub keep_ended: Option<Duration>,
}

/// A coordinator and its workers.
pub struct Embedded {
    coordinator: Coordinator,
    workers: Workers,
    endpoint: Endpoint,
    /// The directory of the socket; removed at the end.
    _directory: TempDir,
}

impl Embedded {
    /// Starts coordinator and workers. `progress` increases whenever the workers have completed
    /// something; the listener learns of workers that end and are started again.
    ///
    /// # Errors
    /// If the socket, the store or the page cannot be opened.
    pub async fn start(
        setup: EmbeddedSetup,
        progress: Arc<AtomicU64>,
        listener: Arc<dyn RunListener>,
    ) -> Result<Self, RunError> {
        let EmbeddedSetup { workers, threads, .. } = setup;
        let executable = setup.executable.clone();
        let directory = private_directory().map_err(RunError::Failed)?;
        let socket = directory.path().join("socket");
        let endpoint = Endpoint::Unix(socket.clone());
        let coordinator = start_coordinator(setup, socket, &*listener).await?;
        let workers = Workers::start(executable, &endpoint, (workers, threads), progress, listener);
        Ok(Self { coordinator, workers, endpoint, _directory: directory })
    }

    /// Returns the address of the coordinator.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// Returns the URL of the live page, if there is one.
    pub fn page_url(&self) -> Option<&str> {
        self.coordinator.page_url()
    }

    /// Completes when the workers or the coordinator cannot continue.
    pub async fn failed(&mut self) -> RunError {
        tokio::select! {
            failure = self.workers.failed() => failure,
            failed = self.coordinator.failed() => RunError::failed(failed),
        }
    }

    /// Drains the coordinator, ends and reaps the workers, then shuts the coordinator down.
    pub async fn end(mut self) {
        // The coordinator first: it would report workers that are ended with batches as lost.
        self.workers.mute();
        self.coordinator.drain().await;
        self.workers.end().await;
        self.coordinator.shutdown().await;
    }
}

async fn start_coordinator(
    setup: EmbeddedSetup,
    socket: PathBuf,
    user: &dyn RunListener,
) -> Result<Coordinator, RunError> {
    let EmbeddedSetup { store, page, keep_ended, commit, .. } = setup;
    let listener = Listener::bind(&ListenAddress::Unix(socket), false).await;
    let listener = listener.map_err(RunError::failed)?.with_spans(user.spans());
    let listener = match page {
        None => listener,
        Some(page) => with_page(listener, page).await?,
    };
    let store: Box<dyn Store + Send> = match store {
        StoreLocation::Memory => Box::new(MemoryStore::new()),
        // Lost jobs are accepted here: this process submits its job again, and it is recomputed.
        StoreLocation::Directory(path) => {
            let store = SqliteStore::open_with(&path, LostJobs::Accept);
            Box::new(store.map_err(RunError::failed)?)
        }
    };
    let store_give_up_after = Some(Duration::from_secs(STORE_PATIENCE_S));
    let config = Config { store_give_up_after, keep_ended, commit, ..Config::default() };
    osteon_coordinator::start(listener, store, config).await.map_err(RunError::failed)
}

/// Adds the live page.
#[cfg(feature = "live")]
async fn with_page(listener: Listener, page: SocketAddr) -> Result<Listener, RunError> {
    listener.with_page(page, false, Vec::new()).await.map_err(RunError::failed)
}

#[cfg(not(feature = "live"))]
async fn with_page(_: Listener, _: SocketAddr) -> Result<Listener, RunError> {
    Err(RunError::BadInput(anyhow::anyhow!("this program was built without the live page")))
}

/// Creates a directory that only this user can enter.
fn private_directory() -> anyhow::Result<TempDir> {
    use std::os::unix::fs::PermissionsExt as _;
    let mut builder = tempfile::Builder::new();
    builder.prefix("osteon-").permissions(std::fs::Permissions::from_mode(0o700));
    let parent = std::env::temp_dir();
    // The kernel accepts only short paths of sockets.
    let parent = if parent.as_os_str().len() <= TEMPORARY_PATH_BYTES_MAX {
        parent
    } else {
        PathBuf::from("/tmp")
    };
    builder
        .tempdir_in(&parent)
        .with_context(|| format!("cannot create a directory in {}", parent.display()))
}
