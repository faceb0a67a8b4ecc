//! The listener of the live page: HTTP/1.1, with TLS where the coordinator has it, within bounds on
//! connections, headers and time.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use osteon_proto::identity::host_name;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tonic::transport::server::Connected as _;

use crate::access::Policy;
use crate::access::tls::Tls;
use crate::live::stalled::ReadPeer;
use crate::service::accept::Acceptor;

/// Maximum number of connections at a time; others wait to be accepted.
const CONNECTIONS_MAX: usize = 128;
/// Time limit for the header of a request, which also ends idle connections.
const HEADER_TIMEOUT: Duration = Duration::from_secs(30);
/// Maximum size of the header of a request, bytes.
const HEADER_BYTES_MAX: usize = 16 * 1024;

/// Error when the page cannot be served at an address.
#[derive(Debug, Error)]
pub enum PageBindError {
    /// Other machines could reach it, and nothing protects it.
    #[error(
        "--http {address} can be reached from other machines; give --tls-cert, --tls-key, --tls-ca and \
         --tokens, or a loopback address (127.0.0.1:PORT or [::1]:PORT), or pass --insecure to trust \
         everybody who can reach the port"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// Tokens would travel without encryption.
    #[error(
        "tokens would be readable on their way to --http {address}; give --tls-cert, --tls-key and \
         --tls-ca, or a loopback address (127.0.0.1:PORT or [::1]:PORT)"
    )]
    ReadableTokens {
        /// The address.
        address: SocketAddr,
    },
    /// The operating system refused the address.
    #[error(
        "cannot listen on {address} for the live page: {source}; choose another port in --http, or \
         port 0"
    )]
    Refused {
        /// The address.
        address: SocketAddr,
        /// The cause.
        source: io::Error,
    },
}

/// A bound address for the live page, to be served beside a coordinator's own.
#[derive(Debug)]
pub struct PageListener {
    listener: TcpListener,
    address: SocketAddr,
    url: String,
    /// Further names under which browsers may ask for it.
    pub(crate) hosts: Vec<String>,
}

impl PageListener {
    /// Binds an address. The rules are those of a coordinator's own: addresses that other machines can
    /// reach need TLS, unless `insecure`.
    ///
    /// # Errors
    /// When the address is against these rules, or the operating system refuses it.
    pub(crate) async fn bind(
        address: SocketAddr,
        insecure: bool,
        hosts: Vec<String>,
        tls: Option<&Tls>,
        policy: &Policy,
    ) -> Result<Self, PageBindError> {
        if !address.ip().is_loopback() && tls.is_none() {
            if matches!(policy, Policy::Tokens(_)) {
                return Err(PageBindError::ReadableTokens { address });
            }
            if !insecure {
                return Err(PageBindError::NotLoopback { address });
            }
        }
        let refused = |source| PageBindError::Refused { address, source };
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        let scheme = if tls.is_some() { "https" } else { "http" };
        // The wildcard address stands for all addresses of this machine.
        let host = match tls.map(Tls::host) {
            _ if !address.ip().is_unspecified() => None,
            Some(host) => host.map(str::to_owned),
            None => host_name(),
        };
        let place = host.map_or(address.to_string(), |host| format!("{host}:{}", address.port()));
        Ok(Self { listener, address, url: format!("{scheme}://{place}/"), hosts })
    }

    /// Returns the URL of the page.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns the command that makes a loopback address reachable from another machine; `None` for
    /// other addresses.
    pub(crate) fn tunnel(&self) -> Option<String> {
        let Self { address, .. } = self;
        let host = host_name().unwrap_or_else(|| "HOST".to_owned());
        let port = address.port();
        address.ip().is_loopback().then(|| format!("ssh -L {port}:{address} {host}"))
    }
}

/// Serves until the future is dropped, which closes every connection.
pub(crate) async fn serve(
    listener: PageListener,
    tls: Option<watch::Receiver<Tls>>,
    router: Router,
) {
    let mut acceptor = Acceptor::for_pages(listener.listener, tls, CONNECTIONS_MAX);
    let mut connections = JoinSet::new();
    loop {
        let connection = acceptor.next().await;
        let router = router.clone().layer(Extension(connection.connect_info()));
        let connection = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(HEADER_TIMEOUT)
            .max_buf_size(HEADER_BYTES_MAX)
            .serve_connection(
                TokioIo::new(ReadPeer::new(connection)),
                TowerToHyperService::new(router),
            );
        connections.spawn(async move {
            // Whether a browser was slow or has gone makes no difference here.
            let _ = connection.await;
        });
        while connections.try_join_next().is_some() {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::tokens::Tokens;

    async fn bound(address: &str, insecure: bool, policy: &Policy) -> Result<String, String> {
        let address = address.parse().unwrap();
        let page = PageListener::bind(address, insecure, Vec::new(), None, policy).await;
        page.map(|page| page.url).map_err(|error| error.to_string())
    }

    #[tokio::test]
    async fn other_machines_are_let_in_as_by_the_coordinator_itself() {
        let tokens = Policy::Tokens(Tokens::default());
        for (address, insecure, policy, refusal) in [
            ("127.0.0.1:0", false, &Policy::Everybody, None),
            ("127.0.0.1:0", false, &tokens, None),
            ("0.0.0.0:0", false, &Policy::Everybody, Some("--insecure")),
            ("0.0.0.0:0", true, &Policy::Everybody, None),
            ("0.0.0.0:0", false, &tokens, Some("readable")),
            ("0.0.0.0:0", true, &tokens, Some("readable")),
        ] {
            match (bound(address, insecure, policy).await, refusal) {
                (Ok(url), None) => assert!(url.starts_with("http://"), "{url}"),
                (Err(error), Some(word)) => assert!(error.contains(word), "{error}"),
                (found, _) => panic!("{address} {insecure}: {found:?}"),
            }
        }
    }

    #[tokio::test]
    async fn a_loopback_address_names_its_tunnel() {
        for (address, loopback) in [("127.0.0.1:0", true), ("0.0.0.0:0", false)] {
            let address = address.parse().unwrap();
            let page = PageListener::bind(address, true, Vec::new(), None, &Policy::Everybody);
            let page = page.await.unwrap();
            let port = page.address.port();
            let expected = format!("ssh -L {port}:127.0.0.1:{port} {}", host_name().unwrap());
            assert_eq!(page.tunnel(), loopback.then_some(expected));
        }
    }
}
