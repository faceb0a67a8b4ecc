//! Listen addresses of a coordinator: TCP addresses and Unix sockets.
//!
//! Without TLS and tokens, exactly the local users are trusted: an address that other machines can
//! reach needs TLS, unless the operator insists.

use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::SystemTime;

use osteon_proto::identity::host_name;
use osteon_proto::spans::SpanRecorder;
use thiserror::Error;
use tokio::net::{TcpListener, UnixListener, UnixStream};

use crate::access::Policy;
use crate::access::tls::Tls;
use crate::access::tokens::Tokens;
use crate::service::accept::BoundSocket;
use crate::service::beside::BesideListener;
use crate::service::metrics_listener::MetricsListener;

/// An address to listen on: `127.0.0.1:7000`, `[::1]:0`, `localhost:0` or `unix:PATH`. With port 0
/// the system chooses a free port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ListenAddress {
    /// A TCP address.
    Tcp(SocketAddr),
    /// Path of a Unix socket.
    Unix(PathBuf),
}

/// A text that is not a valid listen address.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{text}` is not a valid listen address; write IP:PORT (for example 127.0.0.1:0, where port 0 \
     takes a free port), [IPV6]:PORT, localhost:PORT, or unix:PATH"
)]
pub struct AddressError {
    /// The text.
    pub text: String,
}

/// Error when an address cannot be bound.
#[derive(Debug, Error)]
pub enum BindError {
    /// Other machines could reach it.
    #[error(
        "{address} can be reached from other machines; give --tls-cert, --tls-key, --tls-ca and \
         --tokens, or listen on 127.0.0.1, on [::1] or on unix:PATH, or pass --insecure to trust \
         everybody who can reach the port"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The operating system refused a TCP address.
    #[error("cannot listen on {address}: {source}{}", tcp_advice(source.kind()))]
    Tcp {
        /// The address.
        address: SocketAddr,
        /// The cause.
        source: io::Error,
    },
    /// The operating system refused a Unix socket.
    #[error("cannot listen on unix:{}: {source}", path.display())]
    Unix {
        /// The path.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// Another coordinator listens there.
    #[error("another process listens on unix:{} already; choose another path", path.display())]
    InUse {
        /// The path.
        path: PathBuf,
    },
    /// The path exists and is not a socket.
    #[error(
        "{} exists, is not a socket and is not changed; choose another path",
        path.display()
    )]
    NotASocket {
        /// The path.
        path: PathBuf,
    },
}

/// Returns what to do about an error of this kind, as the end of its message.
fn tcp_advice(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::AddrInUse | io::ErrorKind::PermissionDenied => {
            "; choose another port, or port 0"
        }
        io::ErrorKind::AddrNotAvailable => "; this machine has no such address",
        _ => "",
    }
}

/// A bound address, ready to be served by [`crate::start`].
#[derive(Debug)]
pub struct Listener {
    pub(crate) bound: BoundSocket,
    /// Present for a Unix socket.
    pub(crate) file: Option<SocketFile>,
    pub(crate) tls: Option<Tls>,
    pub(crate) policy: Policy,
    /// What is served beside the API.
    pub(crate) beside: Vec<Box<dyn BesideListener>>,
    /// Present if spans are recorded.
    pub(crate) spans: Option<Arc<dyn SpanRecorder>>,
    url: String,
}

/// The file of a Unix socket. It is removed with its last user, unless another file has taken its
/// place.
#[derive(Debug)]
pub(crate) struct SocketFile {
    path: PathBuf,
    identity: FileIdentity,
}

/// Device, inode and, since inodes are reused, the creation time of the file.
type FileIdentity = (u64, u64, Option<SystemTime>);

impl Listener {
    /// Binds an address. `insecure` allows addresses that other machines can reach.
    ///
    /// A socket file that nobody listens on, left by a killed process, is replaced.
    ///
    /// # Errors
    /// If other machines can reach the address and `insecure` is false, if it is in use, or if the operating
    /// system refuses it.
    pub async fn bind(address: &ListenAddress, insecure: bool) -> Result<Self, BindError> {
        match address {
            ListenAddress::Tcp(address) => Self::bind_tcp(*address, insecure).await,
            ListenAddress::Unix(path) => Self::bind_unix(path).await,
        }
    }

    /// Binds an address that any machine may reach: certificates and `tokens` decide which callers
    /// are admitted.
    ///
    /// # Errors
    /// When the operating system refuses the address.
    pub async fn bind_tls(
        address: SocketAddr,
        tls: Tls,
        tokens: Tokens,
    ) -> Result<Self, BindError> {
        let (listener, local) = bind_port(address).await?;
        let url = match tls.host() {
            // The wildcard address stands for all addresses of this machine, so it cannot be part
            // of a URL.
            Some(host) if local.ip().is_unspecified() => format!("https://{host}:{}", local.port()),
            _ => format!("https://{local}"),
        };
        let open = Self::for_everybody(BoundSocket::Tcp(listener), None, url);
        Ok(Self { tls: Some(tls), policy: Policy::Tls(tokens), ..open })
    }

    /// Admits only holders of tokens.
    #[must_use]
    pub fn with_tokens(self, tokens: Tokens) -> Self {
        Self { policy: Policy::Tokens(tokens), ..self }
    }

    /// Exports metrics on an address of their own.
    #[must_use]
    pub fn with_metrics(self, metrics: MetricsListener) -> Self {
        self.with_beside(Box::new(metrics))
    }

    /// Serves something beside the API.
    #[must_use]
    pub(crate) fn with_beside(mut self, listener: Box<dyn BesideListener>) -> Self {
        self.beside.push(listener);
        self
    }

    /// Records the spans of jobs, if there is a recorder.
    #[must_use]
    pub fn with_spans(self, spans: Option<Arc<dyn SpanRecorder>>) -> Self {
        Self { spans, ..self }
    }

    /// Returns the URL that clients and workers use: `https://HOST:PORT`, `http://127.0.0.1:PORT`
    /// or `unix:PATH`.
    pub fn url(&self) -> &str {
        &self.url
    }

    async fn bind_tcp(address: SocketAddr, insecure: bool) -> Result<Self, BindError> {
        if !address.ip().is_loopback() && !insecure {
            return Err(BindError::NotLoopback { address });
        }
        let (listener, local) = bind_port(address).await?;
        Ok(Self::for_everybody(BoundSocket::Tcp(listener), None, url(local).await))
    }

    async fn bind_unix(path: &Path) -> Result<Self, BindError> {
        let refused = |source| BindError::Unix { path: path.to_owned(), source };
        let listener = match UnixListener::bind(path) {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                remove_dead(path).await?;
                UnixListener::bind(path).map_err(refused)?
            }
            bound => bound.map_err(refused)?,
        };
        let identity = identity(path).map_err(refused)?;
        let file = SocketFile { path: path.to_owned(), identity };
        let url = format!("unix:{}", path.display());
        Ok(Self::for_everybody(BoundSocket::Unix(listener), Some(file), url))
    }

    /// Returns a listener that admits everybody.
    fn for_everybody(bound: BoundSocket, file: Option<SocketFile>, url: String) -> Self {
        Self {
            bound,
            file,
            tls: None,
            policy: Policy::Everybody,
            beside: Vec::new(),
            spans: None,
            url,
        }
    }
}

impl ListenAddress {
    /// Returns whether only this machine can reach the address.
    pub fn is_local(&self) -> bool {
        match self {
            Self::Tcp(address) => address.ip().is_loopback(),
            Self::Unix(_) => true,
        }
    }
}

impl FromStr for ListenAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let unreadable = || AddressError { text: text.to_owned() };
        if let Some(path) = text.strip_prefix("unix:") {
            return if path.is_empty() { Err(unreadable()) } else { Ok(Self::Unix(path.into())) };
        }
        let numeric = match text.strip_prefix("localhost:") {
            Some(port) => format!("127.0.0.1:{port}"),
            None => text.to_owned(),
        };
        numeric.parse().map(Self::Tcp).map_err(|_| unreadable())
    }
}

/// Binds a TCP address, and returns it with the port that it has.
async fn bind_port(address: SocketAddr) -> Result<(TcpListener, SocketAddr), BindError> {
    let bind = async {
        let listener = TcpListener::bind(address).await?;
        let local = listener.local_addr()?;
        Ok::<_, io::Error>((listener, local))
    };
    bind.await.map_err(|source| BindError::Tcp { address, source })
}

/// Returns the URL of an address. For a wildcard address it contains the machine's name, if that
/// can be resolved.
async fn url(local: SocketAddr) -> String {
    if local.ip().is_unspecified() {
        let host = host_name().map(|name| format!("{name}:{}", local.port()));
        if let Some(host) = host
            && tokio::net::lookup_host(&host).await.is_ok()
        {
            return format!("http://{host}");
        }
    }
    format!("http://{local}")
}

/// Removes a socket at `path` that a killed process left, that is, one that nobody listens on.
/// Nothing else is removed.
async fn remove_dead(path: &Path) -> Result<(), BindError> {
    let refused = |source| BindError::Unix { path: path.to_owned(), source };
    let is_socket = std::fs::symlink_metadata(path).map_err(refused)?.file_type().is_socket();
    if !is_socket {
        return Err(BindError::NotASocket { path: path.to_owned() });
    }
    match UnixStream::connect(path).await {
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
            std::fs::remove_file(path).map_err(refused)
        }
        // Its accept queue is full, so somebody listens.
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
            Err(BindError::InUse { path: path.to_owned() })
        }
        Ok(_) => Err(BindError::InUse { path: path.to_owned() }),
        Err(error) => Err(refused(error)),
    }
}

fn identity(path: &Path) -> io::Result<FileIdentity> {
    let found = std::fs::symlink_metadata(path)?;
    // Some file systems do not record the creation time.
    Ok((found.dev(), found.ino(), found.created().ok()))
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        if identity(&self.path).is_ok_and(|found| found == self.identity) {
            // A failure to remove the file cannot be handled.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_or_refused() {
        let tcp = |text: &str| Some(ListenAddress::Tcp(text.parse().unwrap()));
        for (text, expected) in [
            ("127.0.0.1:0", tcp("127.0.0.1:0")),
            ("[::1]:7000", tcp("[::1]:7000")),
            ("localhost:7000", tcp("127.0.0.1:7000")),
            ("unix:/tmp/o.sock", Some(ListenAddress::Unix("/tmp/o.sock".into()))),
            ("unix:", None),
            ("", None),
            ("127.0.0.1", None),
            ("127.0.0.1:65536", None),
            ("http://127.0.0.1:1", None),
        ] {
            assert_eq!(text.parse::<ListenAddress>().ok(), expected, "{text}");
        }
    }

    #[tokio::test]
    async fn other_machines_are_let_in_only_on_request() {
        let everywhere = "0.0.0.0:0".parse().unwrap();
        let error = Listener::bind(&everywhere, false).await.unwrap_err();
        assert!(error.to_string().contains("--insecure"), "{error}");
        assert!(error.to_string().contains("--tls-cert"), "{error}");
        assert!(Listener::bind(&everywhere, true).await.is_ok());
    }

    #[tokio::test]
    async fn the_url_of_every_address_is_one_that_can_be_dialled() {
        let listener = Listener::bind(&"0.0.0.0:0".parse().unwrap(), true).await.unwrap();
        let name = host_name().unwrap();
        let address = listener.url().strip_prefix("http://").unwrap().to_owned();
        // On a machine whose own name cannot be resolved the URL keeps the address.
        let host = address.rsplit_once(':').unwrap().0;
        let known = tokio::net::lookup_host((name.as_str(), 1)).await.is_ok();
        assert_eq!(host, if known { &name } else { "0.0.0.0" });
        tokio::net::TcpStream::connect(&address).await.unwrap();
    }

    #[tokio::test]
    async fn an_address_that_cannot_be_bound_is_refused_with_what_to_do() {
        let taken = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
        let taken = taken.url().strip_prefix("http://").unwrap().to_owned();
        // 192.0.2.0/24 is for documentation: no machine has an address of it.
        for (address, expected) in [
            (taken.as_str(), "; choose another port, or port 0"),
            ("192.0.2.1:0", "; this machine has no such address"),
        ] {
            let error = Listener::bind(&address.parse().unwrap(), true).await.unwrap_err();
            assert!(error.to_string().ends_with(expected), "{error}");
        }
    }

    #[tokio::test]
    async fn port_zero_takes_a_free_port() {
        let listener = Listener::bind(&"127.0.0.1:0".parse().unwrap(), false).await.unwrap();
        let port = listener.url().strip_prefix("http://127.0.0.1:").unwrap();
        assert_ne!(port.parse::<u16>().unwrap(), 0);
    }

    #[tokio::test]
    async fn a_dead_socket_is_replaced_and_a_live_one_is_not() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("o.sock");
        let address = ListenAddress::Unix(path.clone());
        // A killed process leaves the file.
        drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
        let listener = Listener::bind(&address, false).await.unwrap();
        let error = Listener::bind(&address, false).await.unwrap_err();
        assert!(matches!(error, BindError::InUse { .. }), "{error}");
        drop(listener);
        assert!(!path.exists());
    }

    #[tokio::test]
    async fn what_is_no_socket_is_left_as_it_is() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("thesis.tex");
        let link = directory.path().join("link");
        std::fs::write(&path, "years of work").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        for there in [&path, &link] {
            let address = ListenAddress::Unix(there.clone());
            let error = Listener::bind(&address, false).await.unwrap_err();
            assert!(matches!(error, BindError::NotASocket { .. }), "{error}");
            assert_eq!(std::fs::read(there).unwrap(), b"years of work");
        }
    }

    #[tokio::test]
    async fn a_socket_whose_queue_is_full_is_alive() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("o.sock");
        let address = ListenAddress::Unix(path.clone());
        let socket = tokio::net::UnixSocket::new_stream().unwrap();
        socket.bind(&path).unwrap();
        // Connections are never accepted.
        let _listener = socket.listen(1).unwrap();
        let mut waiting = Vec::new();
        while let Ok(stream) = UnixStream::connect(&path).await {
            waiting.push(stream);
        }
        let error = Listener::bind(&address, false).await.unwrap_err();
        assert!(matches!(error, BindError::InUse { .. }), "{error}");
        assert!(path.exists());
    }

    #[tokio::test]
    async fn what_took_the_place_of_the_socket_stays() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("o.sock");
        let address = ListenAddress::Unix(path.clone());
        let first = Listener::bind(&address, false).await.unwrap();
        std::fs::remove_file(&path).unwrap();
        let second = Listener::bind(&address, false).await.unwrap();
        drop(first);
        UnixStream::connect(&path).await.unwrap();
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, "another's").unwrap();
        drop(second);
        assert_eq!(std::fs::read(&path).unwrap(), b"another's");
    }
}
