//! Credentials of a client or a worker, and the authorities that it trusts: read from files and
//! checked before anything is sent.

use std::path::PathBuf;
use std::sync::Arc;

use thiserror::Error;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::sign::SingleCertAndKey;
use tokio_rustls::rustls::version::TLS13;
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};
use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::{Request, Status};
use zeroize::Zeroizing;

use crate::credential_file::{self, CredentialError};
use crate::endpoint::Endpoint;
use crate::token::Token;

/// The only protocol inside TLS.
pub const ALPN: &[u8] = b"h2";

/// Credential files named on the command line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CredentialFiles {
    /// Certificates of the authorities that may have signed the coordinator's certificate.
    pub ca: Option<PathBuf>,
    /// The client's own certificate.
    pub certificate: Option<PathBuf>,
    /// The key of that certificate.
    pub key: Option<PathBuf>,
    /// A bearer token.
    pub token: Option<PathBuf>,
}

/// The credentials for one coordinator.
#[derive(Debug, Clone, Default)]
pub struct Credentials {
    pub(crate) tls: Option<Connector>,
    pub(crate) bearer: TokenInterceptor,
}

/// Reason why the credential options contradict each other or cannot be used.
#[derive(Debug, Error)]
pub enum CredentialsError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] CredentialError),
    /// No authority is given that could be trusted.
    #[error(
        "{endpoint} needs --tls-ca FILE: the certificate of the authority that signed the coordinator's"
    )]
    NoAuthority {
        /// The address.
        endpoint: Endpoint,
    },
    /// One of two files that belong together is missing.
    #[error("--tls-cert and --tls-key belong together; {missing} is missing")]
    Half {
        /// The missing option.
        missing: &'static str,
    },
    /// A TLS option is given for an address without TLS.
    #[error("{option} requires TLS, which {endpoint} does not use; write https://HOST:PORT")]
    NoTls {
        /// The option.
        option: &'static str,
        /// The address.
        endpoint: Endpoint,
    },
    /// The token would be sent unencrypted.
    #[error(
        "a token is not sent to {endpoint} in the clear, where others could read it; write \
         https://HOST:PORT, or leave --token-file out"
    )]
    TokenInTheClear {
        /// The address.
        endpoint: Endpoint,
    },
    /// TLS refuses the content of the files.
    #[error("TLS cannot be set up: {source}")]
    Tls {
        /// The reason.
        source: rustls::Error,
    },
}

/// Turns connections into TLS connections.
#[derive(Clone)]
pub(crate) struct Connector(pub(crate) TlsConnector);

/// Adds a token to every call, if there is one.
#[derive(Debug, Clone, Default)]
pub struct TokenInterceptor(Option<MetadataValue<Ascii>>);

impl Credentials {
    /// Reads the credentials for the coordinator at `endpoint`.
    ///
    /// # Errors
    /// If a file cannot be used, or does not fit the address.
    pub fn load(files: &CredentialFiles, endpoint: &Endpoint) -> Result<Self, CredentialsError> {
        let encrypted = matches!(endpoint, Endpoint::Https(_));
        let endpoint_of = || endpoint.clone();
        for (option, file) in files.tls_options() {
            if file.is_some() && !encrypted {
                return Err(CredentialsError::NoTls { option, endpoint: endpoint_of() });
            }
        }
        if files.token.is_some() && !encrypted && !endpoint.is_local() {
            return Err(CredentialsError::TokenInTheClear { endpoint: endpoint_of() });
        }
        let token = files.token.as_deref().map(credential_file::token).transpose()?;
        let tls = if encrypted { Some(connector(files, endpoint)?) } else { None };
        Ok(Self { tls, bearer: TokenInterceptor::new(token.as_ref()) })
    }
}

impl CredentialFiles {
    /// Returns the names of the TLS options, with their files.
    pub fn tls_options(&self) -> [(&'static str, &Option<PathBuf>); 3] {
        [("--tls-ca", &self.ca), ("--tls-cert", &self.certificate), ("--tls-key", &self.key)]
    }

    /// Returns the first option that was given, if any.
    pub fn first_given(&self) -> Option<&'static str> {
        let token = [("--token-file", &self.token)];
        let mut all = self.tls_options().into_iter().chain(token);
        all.find(|(_, file)| file.is_some()).map(|(option, _)| option)
    }
}

impl TokenInterceptor {
    fn new(token: Option<&Token>) -> Self {
        let bearer = |token: &Token| Zeroizing::new(format!("Bearer {}", token.reveal()));
        let header = token.and_then(|token| bearer(token).parse().ok());
        Self(header.map(|mut header: MetadataValue<Ascii>| {
            // Sensitive headers are not printed and not kept in the table of header compression.
            header.set_sensitive(true);
            header
        }))
    }
}

impl Interceptor for TokenInterceptor {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(header) = &self.0 {
            request.metadata_mut().insert("authorization", header.clone());
        }
        Ok(request)
    }
}

impl std::fmt::Debug for Connector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Connector(TLS)")
    }
}

/// Reads certificates as trusted roots.
///
/// # Errors
/// If one of them cannot be a trusted root.
pub fn roots(path: &std::path::Path) -> Result<RootCertStore, CredentialError> {
    let mut roots = RootCertStore::empty();
    for certificate in credential_file::certificates(path)? {
        roots
            .add(certificate)
            .map_err(|source| CredentialError::Root { path: path.to_owned(), source })?;
    }
    Ok(roots)
}

fn connector(files: &CredentialFiles, endpoint: &Endpoint) -> Result<Connector, CredentialsError> {
    let Some(ca) = &files.ca else {
        return Err(CredentialsError::NoAuthority { endpoint: endpoint.clone() });
    };
    let tls = |source| CredentialsError::Tls { source };
    let provider = Arc::new(ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&TLS13])
        .map_err(tls)?
        .with_root_certificates(roots(ca)?);
    let mut config = match (&files.certificate, &files.key) {
        (Some(certificate), Some(key)) => {
            let identity = credential_file::identity(certificate, key)?;
            config.with_client_cert_resolver(Arc::new(SingleCertAndKey::from(identity)))
        }
        (None, None) => config.with_no_client_auth(),
        (Some(_), None) => return Err(CredentialsError::Half { missing: "--tls-key" }),
        (None, Some(_)) => return Err(CredentialsError::Half { missing: "--tls-cert" }),
    };
    config.alpn_protocols = vec![ALPN.to_vec()];
    Ok(Connector(TlsConnector::from(Arc::new(config))))
}

#[cfg(test)]
mod tests;
