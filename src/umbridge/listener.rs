//! The listener: HTTP/1.1 within bounds on connections, headers and idle time.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio::time::sleep;

/// Maximum number of connections at a time, and so of requests; others wait to be accepted.
const CONNECTIONS_MAX: usize = 256;
/// Time limit for the header of a request, which also ends idle connections.
const HEADER_TIMEOUT: Duration = Duration::from_secs(60);
/// Maximum size of the header of a request, bytes.
const HEADER_BYTES_MAX: usize = 16 * 1024;
/// Pause after the operating system failed to accept a connection.
const REFUSED_WAIT: Duration = Duration::from_millis(100);

/// Error when the address cannot be bound.
#[derive(Debug, Error)]
#[error(
    "cannot listen on {address}: {source}; choose another --port (0 selects a free one) or --address"
)]
pub(crate) struct ModelBindError {
    address: SocketAddr,
    source: io::Error,
}

/// A bound address.
#[derive(Debug)]
pub(crate) struct ModelListener {
    listener: TcpListener,
    url: String,
}

impl ModelListener {
    /// Binds an address.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub(crate) async fn bind(address: SocketAddr) -> Result<Self, ModelBindError> {
        let refused = |source| ModelBindError { address, source };
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let url = format!("http://{}", listener.local_addr().map_err(refused)?);
        Ok(Self { listener, url })
    }

    /// Returns the URL for clients.
    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// Serves until the future is dropped, which closes every connection.
    pub(crate) async fn serve(&self, router: Router) {
        let places = Arc::new(Semaphore::new(CONNECTIONS_MAX));
        let mut connections = JoinSet::new();
        loop {
            let Ok(place) = Arc::clone(&places).acquire_owned().await else {
                return;
            };
            match self.listener.accept().await {
                Ok((stream, _)) => {
                    // Small answers must not wait for acknowledgements of earlier ones.
                    let _unsupported = stream.set_nodelay(true);
                    let service = TowerToHyperService::new(router.clone());
                    let connection = http1::Builder::new()
                        .timer(TokioTimer::new())
                        .header_read_timeout(HEADER_TIMEOUT)
                        .max_buf_size(HEADER_BYTES_MAX)
                        .serve_connection(TokioIo::new(stream), service);
                    connections.spawn(async move {
                        // Whether a client was slow or has gone makes no difference here.
                        let _ = connection.await;
                        drop(place);
                    });
                }
                // Too many files are open, say.
                Err(_) => sleep(REFUSED_WAIT).await,
            }
            while connections.try_join_next().is_some() {}
        }
    }
}
