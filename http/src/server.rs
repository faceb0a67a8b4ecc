//! Accepts connections, and answers their requests within bounds.

use std::future::Future;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use crate::stalled::ReadPeer;

/// Maximum size of the header of a request, bytes.
const HEADER_BYTES_MAX: usize = 16 * 1024;
/// Pause after the operating system failed to accept a connection.
const ACCEPT_FAILED_PAUSE: Duration = Duration::from_millis(100);

/// Bounds on one connection.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionBounds {
    /// Time limit for the header of a request, which also ends idle connections.
    pub header: Duration,
    /// Time limit for the whole connection; `None` if it lasts as long as its client sends requests and reads the answers.
    pub whole: Option<Duration>,
    /// Whether its client may send further requests after the first.
    pub keep_alive: bool,
}

impl ConnectionBounds {
    /// Answers the requests of a connection until it ends.
    pub async fn answer<C>(self, connection: C, router: Router)
    where
        C: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let connection = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(self.header)
            .max_buf_size(HEADER_BYTES_MAX)
            .keep_alive(self.keep_alive)
            .serve_connection(
                TokioIo::new(ReadPeer::new(connection)),
                TowerToHyperService::new(router),
            );
        // Whether a client was slow or has gone makes no difference here.
        match self.whole {
            Some(limit) => drop(timeout(limit, connection).await),
            None => drop(connection.await),
        }
    }
}

/// Returns the next connection of a listener.
pub async fn accept(listener: &TcpListener) -> TcpStream {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                // Small answers must not wait for acknowledgements of earlier ones; if it fails, they are only
                // slower.
                drop(stream.set_nodelay(true));
                return stream;
            }
            // Too many files are open, say.
            Err(_) => sleep(ACCEPT_FAILED_PAUSE).await,
        }
    }
}

/// The connections of a server, each of which is answered at the same time as the others. When this is
/// dropped, every connection is closed.
#[derive(Debug, Default)]
pub struct Connections(JoinSet<()>);

impl Connections {
    /// Begins to answer a connection.
    pub fn begin(&mut self, answered: impl Future<Output = ()> + Send + 'static) {
        self.0.spawn(answered);
        while self.0.try_join_next().is_some() {}
    }
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, duplex};
    use tokio::time::Instant;

    use super::*;

    const LONG: Duration = Duration::from_secs(30);
    const REQUEST: &str = "GET / HTTP/1.1\r\nHost: x\r\n\r\n";

    /// Sends something, and reads until the connection ends; returns what was read, and the time that it took.
    async fn exchange(bounds: ConnectionBounds, sent: &str) -> (String, Duration) {
        let (near, mut far) = duplex(1 << 16);
        let router = Router::new().route("/", get(async || "here"));
        let answering = tokio::spawn(bounds.answer(near, router));
        let (begun, mut read) = (Instant::now(), String::new());
        far.write_all(sent.as_bytes()).await.unwrap();
        far.read_to_string(&mut read).await.unwrap();
        answering.await.unwrap();
        (read, begun.elapsed())
    }

    #[tokio::test(start_paused = true)]
    async fn silence_ends_a_connection() {
        let bounds = ConnectionBounds { header: LONG, whole: None, keep_alive: true };
        for begun in ["", "GET / HT", REQUEST] {
            let (read, time) = exchange(bounds, begun).await;
            assert_eq!(read.ends_with("here"), begun == REQUEST, "{read}");
            assert!(time >= LONG && time < LONG * 2, "{time:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn one_request_and_a_whole_time_are_enough_where_that_is_the_rule() {
        let bounds = ConnectionBounds { header: LONG, whole: Some(LONG / 3), keep_alive: false };
        let (read, time) = exchange(bounds, REQUEST).await;
        assert!(read.ends_with("here") && time < Duration::from_secs(1), "{read} {time:?}");
        let (read, time) = exchange(bounds, "GET / HT").await;
        assert!(read.is_empty() && time >= LONG / 3 && time < LONG, "{read} {time:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_long_header_is_refused() {
        let bounds = ConnectionBounds { header: LONG, whole: None, keep_alive: true };
        let header = "x".repeat(HEADER_BYTES_MAX);
        let (read, _) = exchange(bounds, &format!("GET / HTTP/1.1\r\nX: {header}\r\n\r\n")).await;
        assert!(read.starts_with("HTTP/1.1 431 "), "{read}");
    }
}
