//! Accepts connections: limited in number, each with limited time for its handshake.

use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use futures::{Stream, stream};
use osteon_common::limits::HANDSHAKES_MAX;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream, UnixListener, UnixStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, Sleep, sleep, timeout};
use tokio_rustls::server::TlsStream;
use tokio_util::either::Either;
use tonic::transport::server::Connected;

use crate::access::Certificate;
use crate::access::tls::Tls;
use crate::service::control_frames::{ControlFrames, TooManyControlFrames};
use crate::service::open_files;

/// Time limit for a peer's handshake, and again for its first bytes.
pub(crate) const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// Pause after the operating system failed to accept a connection, e.g. because too many files are
/// open.
const REFUSED_WAIT: Duration = Duration::from_millis(100);
/// Minimum time between two log lines about such failures, or about peers whose connections were ended.
const COMPLAINT_INTERVAL: Duration = Duration::from_secs(60);

#[derive(Debug)]
pub(crate) enum BoundSocket {
    Tcp(TcpListener),
    Unix(UnixListener),
}

/// A connection that has completed its handshake.
#[derive(Debug)]
pub(crate) struct AcceptedConnection {
    number: u64,
    io: Io,
    certificate: Certificate,
    /// Counts the peer's control frames; `None` for browsers, which do not speak HTTP/2 here.
    frames: Option<ControlFrames>,
    /// Time limit for the first byte; `None` once it has arrived.
    patience: Option<Pin<Box<Sleep>>>,
    /// Permit, one of those of its listener.
    _place: OwnedSemaphorePermit,
}

/// Facts about the peer of a call.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PeerInfo {
    /// Number of its connection, from 1.
    pub(crate) connection: u64,
    /// Result of the check of its certificate.
    pub(crate) certificate: Certificate,
}

/// Byte stream to and from a peer.
type Io = Either<Box<TlsStream<TcpStream>>, Plain>;
type Plain = Either<TcpStream, UnixStream>;

/// Returns the connections as they arrive, with TLS if configured. A peer that does not complete
/// its handshake is dropped silently.
pub(crate) fn connections(
    bound: BoundSocket,
    tls: Option<watch::Receiver<Tls>>,
    places: Places,
) -> impl Stream<Item = io::Result<AcceptedConnection>> {
    let acceptor = Acceptor::new(bound, tls, places);
    stream::unfold(acceptor, |mut acceptor| async {
        let connection = acceptor.next().await;
        Some((Ok(connection), acceptor))
    })
}

/// The places of the connections of one listener.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    free: Arc<Semaphore>,
    most: usize,
}

impl Places {
    /// Returns the places of a coordinator, as many as open files allow.
    pub(crate) fn for_coordinator() -> Self {
        Self::new(open_files::connections_max())
    }

    fn new(most: usize) -> Self {
        Self { free: Arc::new(Semaphore::new(most)), most }
    }

    /// Returns how many are taken, and how many there are.
    pub(crate) fn usage(&self) -> (u64, u64) {
        let taken = self.most.saturating_sub(self.free.available_permits());
        (taken as u64, self.most as u64)
    }
}

/// Accepts connections of one listener.
pub(crate) struct Acceptor {
    bound: BoundSocket,
    /// Read for each connection, because it may be replaced while the coordinator runs.
    tls: Option<watch::Receiver<Tls>>,
    places: Places,
    handshakes: JoinSet<Option<AcceptedConnection>>,
    /// Time of the last log line about failures to accept connections.
    complaint: Option<Instant>,
    /// The connections are those of browsers.
    is_of_pages: bool,
}

impl Acceptor {
    fn new(bound: BoundSocket, tls: Option<watch::Receiver<Tls>>, places: Places) -> Self {
        Self { bound, tls, places, handshakes: JoinSet::new(), complaint: None, is_of_pages: false }
    }

    /// Returns an acceptor of at most `most` connections of browsers at a time.
    #[cfg_attr(
        not(feature = "live"),
        expect(dead_code, reason = "only the live page is for browsers")
    )]
    pub(crate) fn for_pages(
        listener: TcpListener,
        tls: Option<watch::Receiver<Tls>>,
        most: usize,
    ) -> Self {
        Self { is_of_pages: true, ..Self::new(BoundSocket::Tcp(listener), tls, Places::new(most)) }
    }

    pub(crate) async fn next(&mut self) -> AcceptedConnection {
        loop {
            tokio::select! {
                Some(ended) = self.handshakes.join_next() => {
                    if let Ok(Some(connection)) = ended {
                        return connection;
                    }
                }
                accepted = accept(&self.bound, &self.places.free),
                    if self.handshakes.len() < HANDSHAKES_MAX =>
                {
                    let (io, place) = match accepted {
                        Ok(accepted) => accepted,
                        Err(error) => {
                            self.complain(&error);
                            sleep(REFUSED_WAIT).await;
                            continue;
                        }
                    };
                    match (&self.tls, io) {
                        (Some(tls), Either::Left(stream)) => {
                            let tls = tls.borrow().clone();
                            let handshake = handshake(tls, self.is_of_pages, stream, place);
                            self.handshakes.spawn(handshake);
                        }
                        (_, plain) => {
                            let io = Either::Right(plain);
                            let frames = (!self.is_of_pages).then(ControlFrames::new);
                            return AcceptedConnection::new(io, frames, Certificate::Absent, place);
                        }
                    }
                }
            }
        }
    }
}

impl Acceptor {
    /// Logs a failure to accept a connection, at most once per interval.
    fn complain(&mut self, error: &io::Error) {
        if self.complaint.is_none_or(|last| last.elapsed() >= COMPLAINT_INTERVAL) {
            self.complaint = Some(Instant::now());
            tracing::warn!(%error, "cannot accept connections (logged at most once a minute)");
        }
    }
}

async fn accept(
    bound: &BoundSocket,
    places: &Arc<Semaphore>,
) -> io::Result<(Plain, OwnedSemaphorePermit)> {
    let place = Arc::clone(places).acquire_owned().await.map_err(io::Error::other)?;
    let io = match bound {
        BoundSocket::Tcp(listener) => {
            let (stream, _) = listener.accept().await?;
            // Avoids delays of small messages; if it fails, they are only slower.
            drop(stream.set_nodelay(true));
            Either::Left(stream)
        }
        BoundSocket::Unix(listener) => Either::Right(listener.accept().await?.0),
    };
    Ok((io, place))
}

async fn handshake(
    tls: Tls,
    is_of_pages: bool,
    stream: TcpStream,
    place: OwnedSemaphorePermit,
) -> Option<AcceptedConnection> {
    let peer = stream.peer_addr().ok();
    let acceptor = if is_of_pages { &tls.pages } else { &tls.acceptor };
    match timeout(HANDSHAKE_TIMEOUT, acceptor.accept(stream)).await {
        Ok(Ok(stream)) => {
            let certificate = tls.certificate(stream.get_ref().1.peer_certificates());
            let frames = (!is_of_pages).then(ControlFrames::new);
            let io = Either::Left(Box::new(stream));
            Some(AcceptedConnection::new(io, frames, certificate, place))
        }
        Ok(Err(error)) => {
            tracing::debug!(?peer, %error, "a TLS handshake failed");
            None
        }
        Err(_) => {
            tracing::debug!(?peer, "a TLS handshake took too long");
            None
        }
    }
}

impl AcceptedConnection {
    fn new(
        io: Io,
        frames: Option<ControlFrames>,
        certificate: Certificate,
        place: OwnedSemaphorePermit,
    ) -> Self {
        static LAST: AtomicU64 = AtomicU64::new(0);
        let number = LAST.fetch_add(1, Ordering::Relaxed) + 1;
        let patience = Some(Box::pin(sleep(HANDSHAKE_TIMEOUT)));
        Self { number, io, certificate, frames, patience, _place: place }
    }

    /// Looks at what the peer has sent; an error ends the connection.
    fn inspect(&mut self, arrived: &[u8]) -> io::Result<()> {
        let Some(frames) = &mut self.frames else { return Ok(()) };
        frames.follow_arrived(arrived).map_err(|error| {
            tell_of_flood(self.number, &error);
            io::Error::new(io::ErrorKind::ConnectionAborted, error)
        })
    }

    /// Notes what was sent to the peer.
    fn note_sent(&mut self, written: &Poll<io::Result<usize>>) {
        if let (Some(frames), Poll::Ready(Ok(bytes))) = (&mut self.frames, written) {
            frames.note_sent(*bytes);
        }
    }
}

/// Logs the end of a connection that sent too many control frames, at most once per interval: there may be many.
fn tell_of_flood(connection: u64, error: &TooManyControlFrames) {
    static LAST: Mutex<Option<Instant>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if last.is_none_or(|last| last.elapsed() >= COMPLAINT_INTERVAL) {
        *last = Some(Instant::now());
        tracing::warn!(connection, %error, "a connection is ended (logged at most once a minute)");
    }
}

impl Connected for AcceptedConnection {
    type ConnectInfo = PeerInfo;

    fn connect_info(&self) -> PeerInfo {
        PeerInfo { connection: self.number, certificate: self.certificate }
    }
}

impl AsyncRead for AcceptedConnection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        match Pin::new(&mut self.io).poll_read(cx, buffer) {
            Poll::Ready(read) => {
                if buffer.filled().len() > before {
                    self.patience = None;
                }
                Poll::Ready(read.and_then(|()| self.inspect(&buffer.filled()[before..])))
            }
            Poll::Pending => {
                if let Some(patience) = &mut self.patience {
                    ready!(patience.as_mut().poll(cx));
                    return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
                }
                Poll::Pending
            }
        }
    }
}

impl AsyncWrite for AcceptedConnection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.io).poll_write(cx, bytes);
        self.note_sent(&written);
        written
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.io).poll_write_vectored(cx, slices);
        self.note_sent(&written);
        written
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests;
