//! The listener of the live page: HTTP/1.1, with TLS where the coordinator has it, within bounds on
//! connections, headers and time.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::{Extension, Router};
use osteon_http::{ConnectionBounds, Connections};
use osteon_proto::identity::host_name;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tonic::transport::server::Connected as _;

use crate::access::Policy;
use crate::access::tls::Tls;
use crate::live::gate::Gate;
use crate::live::routes;
use crate::live::source::PageSource;
use crate::service::accept::Acceptor;
use crate::service::beside::{BesideKind, BesideListener, BesideTask, SharedParts};
use crate::service::listen::Listener;

/// Maximum number of connections at a time; others wait to be accepted.
const CONNECTIONS_MAX: usize = 128;
/// A connection lasts as long as its browser asks and reads.
const BOUNDS: ConnectionBounds =
    ConnectionBounds { header: Duration::from_secs(30), whole: None, keep_alive: true };

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
struct PageListener {
    listener: TcpListener,
    address: SocketAddr,
    url: String,
    /// Further names under which browsers may ask for it.
    hosts: Vec<String>,
}

impl PageListener {
    /// Binds an address. The rules are those of a coordinator's own: addresses that other machines can
    /// reach need TLS, unless `insecure`.
    ///
    /// # Errors
    /// When the address is against these rules, or the operating system refuses it.
    async fn bind(
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

    /// Returns the command that makes a loopback address reachable from another machine; `None` for
    /// other addresses.
    fn tunnel(&self) -> Option<String> {
        let Self { address, .. } = self;
        let host = host_name().unwrap_or_else(|| "HOST".to_owned());
        let port = address.port();
        address.ip().is_loopback().then(|| format!("ssh -L {port}:{address} {host}"))
    }
}

impl BesideListener for PageListener {
    fn start(self: Box<Self>, parts: SharedParts<'_>) -> BesideTask {
        let SharedParts { messages, store, write_times, policy, tls } = parts;
        let url = self.url.clone();
        match self.tunnel() {
            Some(tunnel) => {
                tracing::info!(%url, "live page; to see it from another machine: {tunnel}");
            }
            None => tracing::info!(%url, "live page"),
        }
        let source = PageSource::new(messages.clone(), store, write_times.clone());
        let gate = Gate::new(policy.clone(), self.hosts.clone());
        let router = routes::router(Arc::new(source), gate);
        BesideTask::start(BesideKind::Page, url, serve(*self, tls.cloned(), router))
    }
}

impl Listener {
    /// Serves the live page on an address of its own, to the same callers and with the same certificates.
    /// It answers for the names `hosts`, too.
    ///
    /// # Errors
    /// When the address can be reached from other machines without TLS, and `insecure` is not given, or
    /// the operating system refuses it.
    pub async fn with_page(
        self,
        address: SocketAddr,
        insecure: bool,
        hosts: Vec<String>,
    ) -> Result<Self, PageBindError> {
        let (tls, policy) = (self.tls.as_ref(), &self.policy);
        let page = PageListener::bind(address, insecure, hosts, tls, policy).await?;
        Ok(self.with_beside(Box::new(page)))
    }
}

/// Serves until the future is dropped, which closes every connection.
async fn serve(listener: PageListener, tls: Option<watch::Receiver<Tls>>, router: Router) {
    let mut acceptor = Acceptor::for_pages(listener.listener, tls, CONNECTIONS_MAX);
    let mut connections = Connections::default();
    loop {
        let connection = acceptor.next().await;
        let router = router.clone().layer(Extension(connection.connect_info()));
        connections.begin(BOUNDS.answer(connection, router));
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
