//! Channels to a coordinator.

use std::io;
use std::time::Duration;

use hyper_util::rt::TokioIo;
use osteon_common::limits::MESSAGE_BYTES_MAX;
use thiserror::Error;
use tokio::net::{TcpStream, UnixStream};
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::pki_types::ServerName;
use tonic::body::Body;
use tonic::client::GrpcService;
use tonic::codegen::{self, StdError};
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint as Transport, Uri};
use tower::service_fn;

use crate::credentials::{Connector, Credentials, TokenInterceptor};
use crate::endpoint::{Endpoint, host};
use crate::error_causes::innermost;
use crate::patience::Patience;
use crate::tls_failure::TlsFailure;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::workers_client::WorkersClient;

/// Interval of keepalive probes on a silent connection, s.
const KEEPALIVE_INTERVAL_S: u64 = 5;
/// Time after which a connection with an unanswered probe is closed, s.
const KEEPALIVE_TIMEOUT_S: u64 = 10;

/// Reason why there is no channel to a coordinator.
#[derive(Debug, Error)]
pub enum ConnectError {
    /// No answer at the address.
    #[error("cannot reach the coordinator at {endpoint}: {reason}")]
    Unreachable {
        /// The address.
        endpoint: Endpoint,
        /// The operating system's error.
        reason: String,
    },
    /// TLS could not be established.
    #[error("cannot trust the coordinator at {endpoint}: {failure}")]
    Tls {
        /// The address.
        endpoint: Endpoint,
        /// The TLS failure.
        failure: TlsFailure,
    },
    /// The connection was not established in time.
    #[error("the coordinator at {endpoint} did not answer within {seconds} s")]
    Timeout {
        /// The address.
        endpoint: Endpoint,
        /// Time waited, s.
        seconds: f64,
    },
}

/// A channel that sends a token with every call, if there is one.
pub type Connection = InterceptedService<Channel, TokenInterceptor>;

/// Same as [`connect_with`], without credentials.
///
/// # Errors
/// If there is no answer, or none within `timeout`.
pub async fn connect(endpoint: &Endpoint, timeout: Duration) -> Result<Channel, ConnectError> {
    channel(endpoint, None, timeout).await
}

/// Connects to the coordinator at `endpoint`. Keepalive probes detect dead connections.
///
/// # Errors
/// If there is no answer, or none within `timeout`, or TLS cannot be established.
pub async fn connect_with(
    endpoint: &Endpoint,
    credentials: &Credentials,
    timeout: Duration,
) -> Result<Connection, ConnectError> {
    let channel = channel(endpoint, credentials.tls.clone(), timeout).await?;
    Ok(InterceptedService::new(channel, credentials.bearer.clone()))
}

async fn channel(
    endpoint: &Endpoint,
    tls: Option<Connector>,
    timeout: Duration,
) -> Result<Channel, ConnectError> {
    let attempt = async {
        match endpoint {
            Endpoint::Https(authority) => {
                let dialed = authority.clone();
                let connector = service_fn(move |_: Uri| dial_tls(dialed.clone(), tls.clone()));
                let origin = Uri::try_from(format!("https://{authority}"));
                let mut transport = transport(format!("http://{authority}"), timeout)?;
                if let Ok(origin) = origin {
                    transport = transport.origin(origin);
                }
                transport.connect_with_connector(connector).await
            }
            Endpoint::Http(authority) => {
                transport(format!("http://{authority}"), timeout)?.connect().await
            }
            Endpoint::Unix(path) => {
                let path = path.clone();
                // The URI only sets the requests' `:authority`.
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
    match Patience::new(timeout).wait_for(attempt).await {
        Ok(Ok(channel)) => Ok(channel),
        Ok(Err(error)) => Err(unconnected(endpoint, &error)),
        Err(_) => Err(ConnectError::Timeout {
            endpoint: endpoint.clone(),
            seconds: timeout.as_secs_f64(),
        }),
    }
}

/// Opens a TLS connection to HOST:PORT. Without credentials no certificate is trusted.
async fn dial_tls(
    authority: String,
    tls: Option<Connector>,
) -> io::Result<TokioIo<TlsStream<TcpStream>>> {
    let unnamed = |_| io::Error::new(io::ErrorKind::InvalidInput, "the host name is not valid");
    let name = ServerName::try_from(host(&authority).to_owned()).map_err(unnamed)?;
    let Connector(connector) =
        tls.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "TLS needs --tls-ca FILE"))?;
    let stream = TcpStream::connect(authority).await?;
    stream.set_nodelay(true)?;
    Ok(TokioIo::new(connector.connect(name, stream).await?))
}

fn unconnected(endpoint: &Endpoint, error: &(dyn std::error::Error + 'static)) -> ConnectError {
    let endpoint = endpoint.clone();
    match TlsFailure::find_cause(error) {
        Some(failure) => ConnectError::Tls { endpoint, failure },
        None => ConnectError::Unreachable { endpoint, reason: innermost(error) },
    }
}

/// Returns a client of the jobs service, with this project's limit of message sizes.
pub fn jobs_client<T>(channel: T) -> JobsClient<T>
where
    T: GrpcService<Body>,
    T::Error: Into<StdError>,
    T::ResponseBody: codegen::Body<Data = codegen::Bytes> + Send + 'static,
    <T::ResponseBody as codegen::Body>::Error: Into<StdError> + Send,
{
    JobsClient::new(channel)
        .max_decoding_message_size(MESSAGE_BYTES_MAX)
        .max_encoding_message_size(MESSAGE_BYTES_MAX)
}

/// Returns a client of the workers service, with this project's limit of message sizes.
pub fn workers_client<T>(channel: T) -> WorkersClient<T>
where
    T: GrpcService<Body>,
    T::Error: Into<StdError>,
    T::ResponseBody: codegen::Body<Data = codegen::Bytes> + Send + 'static,
    <T::ResponseBody as codegen::Body>::Error: Into<StdError> + Send,
{
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

#[cfg(test)]
mod tests {
    use super::*;

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
