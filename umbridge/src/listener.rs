//! The listener: HTTP/1.1 within bounds on connections, headers, idle time and unread answers.

use std::future::ready;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::http::header::{CONNECTION, HeaderValue};
use axum::middleware::map_response;
use axum::response::Response;
use osteon_http::{ConnectionBounds, Connections};
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};

use super::answers;
use super::crowd::{Admission, Crowd, CrowdLimits, LIMITS};

/// Error when the address cannot be bound.
#[derive(Debug, Error)]
#[error(
    "cannot listen on {address}: {source}; choose another --port (0 selects a free one) or --address"
)]
pub struct ModelBindError {
    address: SocketAddr,
    source: io::Error,
}

/// A bound address.
#[derive(Debug)]
pub struct ModelListener {
    listener: TcpListener,
    url: String,
}

impl ModelListener {
    /// Binds an address.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub async fn bind(address: SocketAddr) -> Result<Self, ModelBindError> {
        let refused = |source| ModelBindError { address, source };
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let url = format!("http://{}", listener.local_addr().map_err(refused)?);
        Ok(Self { listener, url })
    }

    /// Returns the URL for clients.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Serves until the future is dropped, which closes every connection.
    pub async fn serve(&self, router: Router) {
        self.serve_within(LIMITS, router).await;
    }

    async fn serve_within(&self, limits: CrowdLimits, router: Router) {
        let service = Arc::new(Service::new(limits, router));
        let mut connections = Connections::default();
        loop {
            let stream = osteon_http::accept(&self.listener).await;
            // Connections are admitted in the order in which they arrive.
            let Some(admission) = service.crowd.admit().await else { return };
            connections.begin(Arc::clone(&service).connection(stream, admission));
        }
    }
}

/// The router, and the bounds on connections, which all connections use.
#[derive(Debug)]
struct Service {
    limits: CrowdLimits,
    crowd: Arc<Crowd>,
    /// Answers the requests of connections that are served.
    router: Router,
    /// Answers the requests of connections that are refused, with the status 503.
    busy: Router,
}

impl Service {
    fn new(limits: CrowdLimits, router: Router) -> Self {
        let crowd = Arc::new(Crowd::new(limits));
        let others = Arc::clone(&crowd);
        // While other connections wait to be served, a connection is closed after its next answer. Otherwise
        // a client that keeps its connection open would be served for as long as it likes.
        let leave = move |mut response: Response| {
            if others.waits() {
                response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
            }
            ready(response)
        };
        let busy = answers::busy(limits.message());
        Self { limits, crowd, router: router.layer(map_response(leave)), busy }
    }

    /// Serves a connection, or refuses it.
    async fn connection(self: Arc<Self>, stream: TcpStream, admission: Admission) {
        let (_place, served) = match self.crowd.settle(admission).await {
            Admission::Served(place) => (place, true),
            Admission::Waits(place) | Admission::Refused(place) => (place, false),
        };
        let router = if served { &self.router } else { &self.busy };
        let CrowdLimits { header, refusal, .. } = self.limits;
        let whole = (!served).then_some(refusal);
        let bounds = ConnectionBounds { header, whole, keep_alive: served };
        bounds.answer(stream, router.clone()).await;
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use axum::routing::get;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    const SHORT: Duration = Duration::from_millis(300);

    /// One connection is served, and another one may wait.
    const NARROW: CrowdLimits = CrowdLimits { served: 1, waiting: 1, refused: 1, ..LIMITS };

    const REQUEST: &str = "GET / HTTP/1.1\r\nHost: x\r\n\r\n";

    /// Starts a server, and returns its address.
    async fn start(limits: CrowdLimits) -> SocketAddr {
        let listener = ModelListener::bind("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = listener.listener.local_addr().unwrap();
        let router = Router::new().route("/", get(async || "here"));
        tokio::spawn(async move { listener.serve_within(limits, router).await });
        address
    }

    /// Connects and sends something.
    async fn sent(address: SocketAddr, text: &str) -> TcpStream {
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(text.as_bytes()).await.unwrap();
        stream
    }

    /// Reads one answer, whose body is `here`.
    async fn answer(stream: &mut TcpStream) -> String {
        let mut read = Vec::new();
        while !read.ends_with(b"here") {
            read.push(stream.read_u8().await.unwrap());
        }
        String::from_utf8(read).unwrap().to_lowercase()
    }

    /// Reads until the connection ends.
    async fn rest(mut stream: TcpStream) -> String {
        let mut read = String::new();
        stream.read_to_string(&mut read).await.unwrap();
        read
    }

    #[tokio::test]
    async fn a_wait_that_is_too_long_ends_with_an_answer() {
        let address = start(CrowdLimits { wait: SHORT, ..NARROW }).await;
        let mut served = sent(address, REQUEST).await;
        answer(&mut served).await;
        let began = Instant::now();
        // Its body is read, because a connection that is closed with unread bytes loses its answer.
        let body = "x".repeat(100_000);
        let request = format!("POST /Evaluate HTTP/1.1\r\nContent-Length: 100000\r\n\r\n{body}");
        let refused = rest(sent(address, &request).await).await;
        assert!(began.elapsed() >= SHORT);
        assert!(refused.starts_with("HTTP/1.1 503 "), "{refused}");
        assert!(refused.contains("\r\nretry-after: 10\r\n"), "{refused}");
        assert!(refused.contains("1 more wait for up to 0.3 s; send fewer"), "{refused}");
        // Whoever has a place keeps it.
        served.write_all(REQUEST.as_bytes()).await.unwrap();
        answer(&mut served).await;
    }

    #[tokio::test]
    async fn a_connection_that_stays_open_makes_room() {
        let address = start(NARROW).await;
        let mut open = sent(address, REQUEST).await;
        assert!(!answer(&mut open).await.contains("connection: close"));
        let mut waiting = sent(address, REQUEST).await;
        // The third one is refused as soon as the second one waits.
        assert!(rest(sent(address, REQUEST).await).await.starts_with("HTTP/1.1 503 "));
        open.write_all(REQUEST.as_bytes()).await.unwrap();
        assert!(answer(&mut open).await.contains("connection: close"));
        assert!(!answer(&mut waiting).await.contains("connection: close"));
    }

    #[tokio::test]
    async fn who_sends_no_request_loses_the_place() {
        let address = start(CrowdLimits { header: SHORT, ..NARROW }).await;
        for begun in ["", "GET / HT", REQUEST] {
            let silent = sent(address, begun).await;
            let mut waiting = sent(address, REQUEST).await;
            answer(&mut waiting).await;
            drop((silent, waiting));
        }
    }
}
