//! The listener of the metrics: answers `GET /metrics` over HTTP/1.1, within bounds on connections,
//! requests and time.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::State;
use axum::http::header::{ALLOW, CONTENT_TYPE, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::response::Response;
use osteon_http::{ConnectionBounds, Connections};
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::timeout;

use crate::metrics::exposition;
use crate::metrics::families::{Scrape, families};
use crate::metrics::process::{ProcessUsage, unix_time_s};
use crate::metrics::write_times::WriteTimes;
use crate::service::beside::{BesideKind, BesideListener, BesideTask, SharedParts};
use crate::service::core_task::Message;
use crate::service::meter::CoreReport;

/// Path of the metrics.
pub const METRICS_PATH: &str = "/metrics";
/// Maximum number of connections at a time; others wait to be accepted.
const CONNECTIONS_MAX: usize = 16;
/// A connection has one request and its answer.
const BOUNDS: ConnectionBounds = ConnectionBounds {
    header: Duration::from_secs(5),
    whole: Some(Duration::from_secs(10)),
    keep_alive: false,
};
/// Time limit for the answer of the core task.
const CORE_TIMEOUT: Duration = Duration::from_secs(5);

/// Error when the address of the metrics cannot be bound.
#[derive(Debug, Error)]
#[error(
    "cannot listen on {address} for metrics: {source}; choose another port in --metrics, or port 0"
)]
pub struct MetricsBindError {
    /// The address.
    pub address: SocketAddr,
    /// The cause.
    pub source: io::Error,
}

/// A bound address for metrics, to be served beside a coordinator's own.
#[derive(Debug)]
pub struct MetricsListener {
    listener: TcpListener,
    url: String,
}

impl MetricsListener {
    /// Binds an address. Whoever can reach it can read the metrics, which are numbers without names.
    ///
    /// # Errors
    /// When the operating system refuses the address.
    pub async fn bind(address: SocketAddr) -> Result<Self, MetricsBindError> {
        let refused = |source| MetricsBindError { address, source };
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let url = format!("http://{}{METRICS_PATH}", listener.local_addr().map_err(refused)?);
        Ok(Self { listener, url })
    }

    /// Returns the URL of the metrics.
    pub fn url(&self) -> &str {
        &self.url
    }
}

impl BesideListener for MetricsListener {
    fn start(self: Box<Self>, parts: SharedParts<'_>) -> BesideTask {
        let sources = MetricSources::new(parts.messages.clone(), parts.write_times.clone());
        let url = self.url.clone();
        tracing::info!(%url, "metrics are exported");
        BesideTask::start(BesideKind::Metrics, url, serve(*self, sources))
    }
}

/// Where the numbers come from.
struct MetricSources {
    messages: mpsc::Sender<Message>,
    write_times: WriteTimes,
    started_s: f64,
}

impl MetricSources {
    fn new(messages: mpsc::Sender<Message>, write_times: WriteTimes) -> Self {
        Self { messages, write_times, started_s: unix_time_s() }
    }

    /// Returns all metrics as text; `None` if the core task does not answer in time.
    async fn text(&self) -> Option<String> {
        let core_queue = self.messages.max_capacity() - self.messages.capacity();
        let report = timeout(CORE_TIMEOUT, self.report()).await.ok()??;
        let scrape = Scrape {
            counts: report.counts,
            state: report.state,
            event_times: report.event_times,
            write_times: self.write_times.read(),
            core_queue: core_queue as u64,
            store_queue: report.store_queue as u64,
            process: ProcessUsage::read(),
            started_s: self.started_s,
        };
        exposition::text(families(&scrape)).ok()
    }

    async fn report(&self) -> Option<CoreReport> {
        let (reply, report) = oneshot::channel();
        self.messages.send(Message::Measure(reply)).await.ok()?;
        report.await.ok()
    }
}

/// Serves until the future is dropped, which closes every connection.
async fn serve(listener: MetricsListener, sources: MetricSources) {
    let router = Router::new().fallback(answer).with_state(Arc::new(sources));
    let places = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    let mut connections = Connections::default();
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        let stream = osteon_http::accept(&listener.listener).await;
        let answered = BOUNDS.answer(stream, router.clone());
        connections.begin(async move {
            answered.await;
            drop(place);
        });
    }
}

async fn answer(State(sources): State<Arc<MetricSources>>, method: Method, uri: Uri) -> Response {
    match uri.path() {
        METRICS_PATH if ![Method::GET, Method::HEAD].contains(&method) => {
            let mut refused = plain_response(StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD\n");
            refused.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            refused
        }
        METRICS_PATH => match sources.text().await {
            Some(text) => typed_response(StatusCode::OK, exposition::CONTENT_TYPE, text),
            None => plain_response(
                StatusCode::SERVICE_UNAVAILABLE,
                "the coordinator does not answer; its log may say why\n",
            ),
        },
        _ => plain_response(StatusCode::NOT_FOUND, "the metrics are at /metrics\n"),
    }
}

fn plain_response(status: StatusCode, text: &'static str) -> Response {
    typed_response(status, "text/plain; charset=utf-8", text)
}

fn typed_response(
    status: StatusCode,
    content_type: &'static str,
    text: impl Into<Body>,
) -> Response {
    let mut response = Response::new(text.into());
    *response.status_mut() = status;
    let content_type = HeaderValue::from_static(content_type);
    response.headers_mut().insert(CONTENT_TYPE, content_type);
    response
}
