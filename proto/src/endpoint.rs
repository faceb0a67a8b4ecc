//! Where a coordinator is, and a channel to it.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use hyper_util::rt::TokioIo;
use osteon_common::limits::MESSAGE_BYTES_MAX;
use thiserror::Error;
use tokio::net::UnixStream;
use tonic::transport::{Channel, Endpoint as Transport, Uri};
use tower::service_fn;

use crate::v1::jobs_client::JobsClient;
use crate::v1::workers_client::WorkersClient;

/// Longest path of a Unix socket, bytes: the kernel's limit without the closing zero.
const SOCKET_PATH_BYTES_MAX: usize = 107;
/// A silent connection is probed this often, s.
const KEEPALIVE_INTERVAL_S: u64 = 5;
/// A connection is given up when a probe stays unanswered for this long, s.
const KEEPALIVE_TIMEOUT_S: u64 = 10;

/// Address of a coordinator: `http://HOST:PORT` or `unix:PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// Plain HTTP/2 over TCP; the host and port.
    Http(String),
    /// A Unix socket.
    Unix(PathBuf),
}

/// Why a text is no address of a coordinator.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EndpointError {
    /// Neither of the known schemes.
    #[error("`{text}` is no coordinator URL; write http://HOST:PORT or unix:PATH")]
    Scheme {
        /// What was given.
        text: String,
    },
    /// TLS is asked for.
    #[error(
        "`{text}` asks for TLS, which this build does not have; use http://HOST:PORT or unix:PATH"
    )]
    Tls {
        /// What was given.
        text: String,
    },
    /// The host or port cannot be read.
    #[error("`{text}` must be http://HOST:PORT with a port from 1 to 65535 and nothing behind it")]
    Authority {
        /// What was given.
        text: String,
    },
    /// The path of the socket is empty or too long for the kernel.
    #[error("`{text}` needs a path of 1 to {SOCKET_PATH_BYTES_MAX} bytes, it has {bytes}")]
    SocketPath {
        /// What was given.
        text: String,
        /// Length of the path.
        bytes: usize,
    },
}

/// Why there is no channel to a coordinator.
#[derive(Debug, Error)]
pub enum ConnectError {
    /// Nothing answers there.
    #[error("cannot reach the coordinator at {endpoint}: {reason}")]
    Unreachable {
        /// The address.
        endpoint: Endpoint,
        /// What the operating system says.
        reason: String,
    },
    /// No connection in time.
    #[error("the coordinator at {endpoint} did not answer within {seconds} s")]
    Timeout {
        /// The address.
        endpoint: Endpoint,
        /// How long was waited, s.
        seconds: f64,
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
        if text.starts_with("https://") {
            return Err(EndpointError::Tls { text: owned() });
        }
        let Some(authority) = text.strip_prefix("http://") else {
            return Err(EndpointError::Scheme { text: owned() });
        };
        let authority = authority.strip_suffix('/').unwrap_or(authority);
        let uri: Option<Uri> = format!("http://{authority}").parse().ok();
        let whole = uri.filter(|uri| {
            let port = uri.port_u16().is_some_and(|port| port > 0);
            let host = uri.host().is_some_and(|host| !host.is_empty());
            port && host && uri.path() == "/" && uri.query().is_none() && !authority.contains('@')
        });
        match whole {
            Some(_) => Ok(Self::Http(authority.to_owned())),
            None => Err(EndpointError::Authority { text: owned() }),
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Http(authority) => write!(f, "http://{authority}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

/// A channel to the coordinator at `endpoint`; dead connections are noticed by keepalive probes.
///
/// # Errors
/// When nothing answers there, or not within `timeout`.
pub async fn connect(endpoint: &Endpoint, timeout: Duration) -> Result<Channel, ConnectError> {
    let attempt = async {
        match endpoint {
            Endpoint::Http(authority) => {
                transport(format!("http://{authority}"), timeout)?.connect().await
            }
            Endpoint::Unix(path) => {
                let path = path.clone();
                // The URI only fills the requests' `:authority`.
                let connector = service_fn(move |_: Uri| {
                    let path = path.clone();
                    async move {
                        Ok::<_, std::io::Error>(TokioIo::new(UnixStream::connect(path).await?))
                    }
                });
                transport("http://localhost".to_owned(), timeout)?
                    .connect_with_connector(connector)
                    .await
            }
        }
    };
    match tokio::time::timeout(timeout, attempt).await {
        Ok(Ok(channel)) => Ok(channel),
        Ok(Err(error)) => {
            Err(ConnectError::Unreachable { endpoint: endpoint.clone(), reason: innermost(&error) })
        }
        Err(_) => Err(ConnectError::Timeout {
            endpoint: endpoint.clone(),
            seconds: timeout.as_secs_f64(),
        }),
    }
}

/// A client of the service of jobs, with this project's limit of message sizes.
pub fn jobs_client(channel: Channel) -> JobsClient<Channel> {
    JobsClient::new(channel)
        .max_decoding_message_size(MESSAGE_BYTES_MAX)
        .max_encoding_message_size(MESSAGE_BYTES_MAX)
}

/// A client of the service of workers, with this project's limit of message sizes.
pub fn workers_client(channel: Channel) -> WorkersClient<Channel> {
    WorkersClient::new(channel)
        .max_decoding_message_size(MESSAGE_BYTES_MAX)
        .max_encoding_message_size(MESSAGE_BYTES_MAX)
}

fn transport(uri: String, timeout: Duration) -> Result<Transport, tonic::transport::Error> {
    Ok(Transport::from_shared(uri)?
        .connect_timeout(timeout)
        .tcp_nodelay(true)
        .http2_keep_alive_interval(Duration::from_secs(KEEPALIVE_INTERVAL_S))
        .keep_alive_timeout(Duration::from_secs(KEEPALIVE_TIMEOUT_S))
        .keep_alive_while_idle(true))
}

/// The last cause of an error: for a transport error it is the operating system's.
fn innermost(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(next) = cause.source() {
        cause = next;
    }
    cause.to_string()
}

#[cfg(test)]
mod tests {
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
            check(text, "write http://HOST:PORT or unix:PATH");
        }
        check("https://a:1", "TLS");
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

    #[tokio::test]
    async fn an_absent_coordinator_is_named() {
        let directory = std::env::temp_dir();
        let endpoint = Endpoint::Unix(directory.join("no such socket of osteon"));
        let error = connect(&endpoint, Duration::from_secs(5)).await.unwrap_err();
        assert!(error.to_string().contains("no such socket of osteon"), "{error}");
        let refused: Endpoint = "http://127.0.0.1:1".parse().unwrap();
        let error = connect(&refused, Duration::from_secs(5)).await.unwrap_err().to_string();
        assert!(error.contains("http://127.0.0.1:1") && error.contains("refused"), "{error}");
    }
}
