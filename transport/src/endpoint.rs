//! Address of a coordinator.

use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;
use tokio_rustls::rustls::pki_types::ServerName;
use tonic::Status;
use tonic::transport::Uri;

use crate::error_causes::{innermost, is_refused};

/// Longest path of a Unix socket in bytes: the kernel's limit without the terminating zero.
const SOCKET_PATH_BYTES_MAX: usize = 107;
/// The forms of addresses, for error messages.
const FORMS: &str = "https://HOST:PORT, http://HOST:PORT or unix:PATH";

/// Address of a coordinator: `https://HOST:PORT`, `http://HOST:PORT` or `unix:PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// HTTP/2 in TLS over TCP; holds host and port.
    Https(String),
    /// Plain HTTP/2 over TCP; holds host and port.
    Http(String),
    /// A Unix socket; holds its path.
    Unix(PathBuf),
}

/// Reason why a text is not an address of a coordinator.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EndpointError {
    /// The scheme is unknown.
    #[error("`{text}` is not a valid coordinator URL; write {FORMS}")]
    Scheme {
        /// The text given.
        text: String,
    },
    /// The host or port is invalid.
    #[error(
        "`{text}` must be {scheme}://HOST:PORT with a port from 1 to 65535 and nothing after it"
    )]
    Authority {
        /// `http` or `https`.
        scheme: &'static str,
        /// The text given.
        text: String,
    },
    /// The path of the socket is empty or too long for the kernel.
    #[error("`{text}` needs a path of 1 to {SOCKET_PATH_BYTES_MAX} bytes, it has {bytes}")]
    SocketPath {
        /// The text given.
        text: String,
        /// Length of the path.
        bytes: usize,
    },
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let owned = || text.to_owned();
        if let Some(path) = text.strip_prefix("unix:") {
            let bytes = path.len();
            if bytes == 0 || bytes > SOCKET_PATH_BYTES_MAX {
                return Err(EndpointError::SocketPath { text: owned(), bytes });
            }
            return Ok(Self::Unix(PathBuf::from(path)));
        }
        if let Some(authority) = text.strip_prefix("https://") {
            return host_and_port(text, "https", authority).map(Self::Https);
        }
        match text.strip_prefix("http://") {
            Some(authority) => host_and_port(text, "http", authority).map(Self::Http),
            None => Err(EndpointError::Scheme { text: owned() }),
        }
    }
}

/// Returns the host and port of a URL, and refuses a URL that has more than these.
fn host_and_port(
    text: &str,
    scheme: &'static str,
    authority: &str,
) -> Result<String, EndpointError> {
    let authority = authority.strip_suffix('/').unwrap_or(authority);
    let uri: Option<Uri> = format!("{scheme}://{authority}").parse().ok();
    let whole = uri.filter(|uri| {
        let port = uri.port_u16().is_some_and(|port| port > 0);
        let host = uri.host().is_some_and(|host| !host.is_empty());
        port && host && uri.path() == "/" && uri.query().is_none() && !authority.contains('@')
    });
    match whole {
        Some(_) => Ok(authority.to_owned()),
        None => Err(EndpointError::Authority { scheme, text: text.to_owned() }),
    }
}

impl Endpoint {
    /// Returns an explanation of a failed call. If the connection broke before this peer had ever
    /// answered, and the error is not a refused connection, TLS may be the cause; a peer that has
    /// answered before uses the same protocol.
    pub fn explained(&self, status: &Status, ever_answered: bool) -> String {
        let Some(cause) = std::error::Error::source(status) else {
            return status.message().to_owned();
        };
        let reason = innermost(cause);
        match self {
            Self::Http(authority) if !ever_answered && !is_refused(cause) => {
                format!("{reason}; if the coordinator uses TLS, write https://{authority}")
            }
            _ => reason,
        }
    }

    /// Returns whether the traffic stays on this machine: a Unix socket or a loopback address.
    pub fn is_local(&self) -> bool {
        let authority = match self {
            Self::Unix(_) => return true,
            Self::Https(authority) | Self::Http(authority) => authority,
        };
        let host = host(authority);
        host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
    }
}

/// Returns whether `text` is a host name or an IP address for which a certificate can be issued.
pub fn is_host(text: &str) -> bool {
    ServerName::try_from(text).is_ok()
}

/// Returns the host of `HOST:PORT`, without the brackets of an IPv6 address.
pub(crate) fn host(authority: &str) -> &str {
    let host = authority.rsplit_once(':').map_or(authority, |(host, _)| host);
    host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host)
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Https(authority) => write!(f, "https://{authority}"),
            Self::Http(authority) => write!(f, "http://{authority}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    fn read(text: &str) -> Result<String, String> {
        text.parse::<Endpoint>()
            .map(|endpoint| endpoint.to_string())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn addresses_are_read_and_written_back() {
        for text in [
            "http://127.0.0.1:50051",
            "https://node-3.cluster:443",
            "http://[::1]:1",
            "http://node-3.cluster:65535",
            "unix:/tmp/a b",
            "unix:relative",
        ] {
            assert_eq!(read(text), Ok(text.to_owned()));
        }
        assert_eq!(read("http://localhost:80/"), Ok("http://localhost:80".to_owned()));
    }

    #[test]
    fn what_is_no_address_is_refused_with_what_is_allowed() {
        let check = |text: &str, expected: &str| {
            let message = read(text).unwrap_err();
            assert!(message.contains(expected) && message.contains(text), "{message}");
        };
        for text in ["", "localhost:80", "ftp://a:1", "/tmp/socket"] {
            check(text, "write https://HOST:PORT, http://HOST:PORT or unix:PATH");
        }
        check("https://a", "must be https://HOST:PORT");
        for text in [
            "http://",
            "http://host",
            "http://:80",
            "http://host:0",
            "http://host:65536",
            "http://host:80/path",
            "http://user@host:80",
            "http://host:80?x",
        ] {
            check(text, "with a port from 1 to 65535");
        }
        check("unix:", "it has 0");
        check(&format!("unix:/{}", "x".repeat(107)), "it has 108");
    }

    #[test]
    fn what_stays_on_this_machine_is_known() {
        for (url, local) in [
            ("unix:a", true),
            ("http://127.0.0.1:1", true),
            ("http://127.9.9.9:1", true),
            ("http://[::1]:1", true),
            ("https://localhost:1", true),
            ("http://localhost.example:1", false),
            ("http://10.0.0.1:1", false),
            ("http://0.0.0.0:1", false),
            ("http://node-3:1", false),
        ] {
            assert_eq!(url.parse::<Endpoint>().unwrap().is_local(), local, "{url}");
        }
    }

    #[test]
    fn what_may_be_tls_is_said_so() {
        let broken = |kind: io::ErrorKind| {
            let cause = io::Error::other(io::Error::from(kind));
            Status::from_error(Box::new(io::Error::other(cause)))
        };
        let reset = broken(io::ErrorKind::ConnectionReset);
        let refused = broken(io::ErrorKind::ConnectionRefused);
        let answer = Status::unavailable("the coordinator stops");
        let hint = "; if the coordinator uses TLS, write https://a:1";
        for (url, status, ever_answered, expected) in [
            ("http://a:1", &reset, false, format!("connection reset{hint}")),
            ("http://a:1", &reset, true, "connection reset".to_owned()),
            ("http://a:1", &refused, false, "connection refused".to_owned()),
            ("http://a:1", &answer, false, "the coordinator stops".to_owned()),
            ("https://a:1", &reset, false, "connection reset".to_owned()),
            ("unix:a", &reset, false, "connection reset".to_owned()),
        ] {
            let endpoint: Endpoint = url.parse().unwrap();
            let explained = endpoint.explained(status, ever_answered);
            assert_eq!(explained, expected, "{url}: {status}, {ever_answered}");
        }
    }
}
