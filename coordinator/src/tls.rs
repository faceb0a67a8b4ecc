//! The coordinator's side of TLS: its files, and what a peer's certificate says of the peer.

use std::path::PathBuf;
use std::sync::Arc;

use osteon_proto::credential_file::{self, CredentialError};
use osteon_proto::credentials::{self, ALPN};
use thiserror::Error;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::CertificateDer;
use tokio_rustls::rustls::server::{VerifierBuilderError, WebPkiClientVerifier};
use tokio_rustls::rustls::version::TLS13;
use tokio_rustls::rustls::{self, ServerConfig};
use webpki::EndEntityCert;

use crate::access::{Purpose, WORKER_NAME};

/// The files of a listener with TLS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// Certificates of the authorities that workers' certificates may be signed by.
    pub ca: PathBuf,
    /// The coordinator's certificate.
    pub certificate: PathBuf,
    /// The key of the certificate.
    pub key: PathBuf,
}

/// Why TLS cannot be set up.
#[derive(Debug, Error)]
pub enum TlsError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] CredentialError),
    /// The authority's certificate cannot be used.
    #[error("the certificate of the authority in {} cannot be used: {source}", path.display())]
    Authority {
        /// The file.
        path: PathBuf,
        /// Why.
        source: VerifierBuilderError,
    },
    /// TLS refuses what the files hold.
    #[error("TLS cannot be set up: {source}")]
    Setup {
        /// Why.
        source: rustls::Error,
    },
}

/// Makes connections into TLS connections.
#[derive(Clone)]
pub struct Tls {
    pub(crate) acceptor: TlsAcceptor,
    /// A host name of the certificate that other machines can use.
    host: Option<String>,
}

impl Tls {
    /// Reads and checks the files.
    ///
    /// # Errors
    /// When one of them cannot be used.
    pub fn load(files: &TlsFiles) -> Result<Self, TlsError> {
        let setup = |source| TlsError::Setup { source };
        let provider = Arc::new(ring::default_provider());
        let identity = credential_file::identity(&files.certificate, &files.key)?;
        let host = identity.chain.first().and_then(host_name);
        let roots = Arc::new(credentials::roots(&files.ca)?);
        let verifier =
            WebPkiClientVerifier::builder_with_provider(roots, Arc::clone(&provider))
                // Clients come without; what they may call is decided call by call.
                .allow_unauthenticated()
                .build()
                .map_err(|source| TlsError::Authority { path: files.ca.clone(), source })?;
        let mut config = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&TLS13])
            .map_err(setup)?
            .with_client_cert_verifier(verifier)
            .with_single_cert(identity.chain, identity.key)
            .map_err(setup)?;
        config.alpn_protocols = vec![ALPN.to_vec()];
        Ok(Self { acceptor: TlsAcceptor::from(Arc::new(config)), host })
    }

    /// A host name that the certificate is for, other than `localhost`.
    pub(crate) fn host(&self) -> Option<&str> {
        self.host.as_deref()
    }
}

impl std::fmt::Debug for Tls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tls").field("host", &self.host).finish_non_exhaustive()
    }
}

/// What the first of a peer's certificates, which are verified, was made for.
pub(crate) fn purpose(certificates: &[CertificateDer<'_>]) -> Option<Purpose> {
    let first = certificates.first()?;
    let named = EndEntityCert::try_from(first)
        .is_ok_and(|certificate| certificate.valid_uri_names().any(|name| name == WORKER_NAME));
    Some(if named { Purpose::Worker } else { Purpose::Other })
}

fn host_name(certificate: &CertificateDer<'_>) -> Option<String> {
    let certificate = EndEntityCert::try_from(certificate).ok()?;
    let mut names = certificate.valid_dns_names();
    names.find(|name| *name != "localhost" && !name.contains('*')).map(str::to_owned)
}
