//! The listener of the metrics: answers `GET /metrics` over HTTP/1.1, within bounds on connections,
//! requests and time.

use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{ALLOW, CONTENT_TYPE};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use crate::metrics::exposition;
use crate::metrics::families::{Scrape, families};
use crate::metrics::process::{ProcessUsage, unix_time_s};
use crate::metrics::write_times::WriteTimes;
use crate::service::core_task::Message;
use crate::service::meter::CoreReport;

/// Path of the metrics.
pub const METRICS_PATH: &str = "/metrics";
/// Maximum number of connections at a time; others wait to be accepted.
const CONNECTIONS_MAX: usize = 16;
/// Time limit for a whole connection: one request and its answer.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(10);
/// Time limit for the header of a request.
const HEADER_TIMEOUT: Duration = Duration::from_secs(5);
/// Time limit for the answer of the core task.
const CORE_TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum size of the header of a request, bytes.
const HEADER_BYTES_MAX: usize = 16 * 1024;
/// Pause after the operating system failed to accept a connection.
const REFUSED_WAIT: Duration = Duration::from_millis(100);

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

/// Where the numbers come from.
pub(crate) struct MetricSources {
    messages: mpsc::Sender<Message>,
    write_times: WriteTimes,
    started_s: f64,
}

impl MetricSources {
    pub(crate) fn new(messages: mpsc::Sender<Message>, write_times: WriteTimes) -> Self {
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
pub(crate) async fn serve(listener: MetricsListener, sources: MetricSources) {
    let (sources, places) = (Arc::new(sources), Arc::new(Semaphore::new(CONNECTIONS_MAX)));
    let mut connections = JoinSet::new();
    loop {
        let Ok(place) = Arc::clone(&places).acquire_owned().await else {
            return;
        };
        match listener.listener.accept().await {
            Ok((stream, _)) => {
                let sources = Arc::clone(&sources);
                connections.spawn(async move {
                    connection(stream, sources).await;
                    drop(place);
                });
            }
            // Too many files are open, say.
            Err(_) => sleep(REFUSED_WAIT).await,
        }
        while connections.try_join_next().is_some() {}
    }
}

async fn connection(stream: TcpStream, sources: Arc<MetricSources>) {
    let service = service_fn(move |request: Request<Incoming>| {
        let sources = Arc::clone(&sources);
        async move { Ok::<_, Infallible>(answer(&request, &sources).await) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER_TIMEOUT)
        .max_buf_size(HEADER_BYTES_MAX)
        .keep_alive(false)
        .serve_connection(TokioIo::new(stream), service);
    // Whether the client was slow or has gone makes no difference here.
    let _ = timeout(CONNECTION_TIMEOUT, connection).await;
}

async fn answer(request: &Request<Incoming>, sources: &MetricSources) -> Response<Full<Bytes>> {
    let get = [Method::GET, Method::HEAD].contains(request.method());
    match request.uri().path() {
        METRICS_PATH if !get => {
            let mut refused = plain_response(StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD\n");
            refused
                .headers_mut()
                .insert(ALLOW, hyper::header::HeaderValue::from_static("GET, HEAD"));
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

fn plain_response(status: StatusCode, text: &'static str) -> Response<Full<Bytes>> {
    typed_response(status, "text/plain; charset=utf-8", text)
}

fn typed_response(
    status: StatusCode,
    content_type: &'static str,
    text: impl Into<Bytes>,
) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(text.into()));
    *response.status_mut() = status;
    let content_type = hyper::header::HeaderValue::from_static(content_type);
    response.headers_mut().insert(CONTENT_TYPE, content_type);
    response
}
