//! The coordinator's side of TLS: its files, and the check of peers' certificates.

use std::path::PathBuf;
use std::sync::Arc;

use osteon_transport::certificates::WORKER_NAME;
use osteon_transport::credential_file::{self, CredentialError};
use osteon_transport::credentials::{self, ALPN};
use osteon_transport::tls_failure::TlsFailure;
use thiserror::Error;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::client::danger::HandshakeSignatureValid;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::{CertificateDer, UnixTime};
use tokio_rustls::rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use tokio_rustls::rustls::server::{VerifierBuilderError, WebPkiClientVerifier};
use tokio_rustls::rustls::sign::SingleCertAndKey;
use tokio_rustls::rustls::version::TLS13;
use tokio_rustls::rustls::{
    self, DigitallySignedStruct, DistinguishedName, ServerConfig, SignatureScheme,
};
use webpki::EndEntityCert;

use crate::access::{Certificate, Fault};

/// The protocol of the live page.
const PAGES_ALPN: &[u8] = b"http/1.1";

/// The files of a listener with TLS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// Certificates of the authorities that may sign workers' certificates.
    pub ca: PathBuf,
    /// The coordinator's certificate.
    pub certificate: PathBuf,
    /// The key of the certificate.
    pub key: PathBuf,
}

/// Error when TLS cannot be set up.
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
        /// The cause.
        source: VerifierBuilderError,
    },
    /// The TLS library rejects the contents of the files.
    #[error("TLS cannot be set up: {source}")]
    Setup {
        /// The cause.
        source: rustls::Error,
    },
}

/// Server side of TLS connections.
#[derive(Clone)]
pub struct Tls {
    pub(crate) acceptor: TlsAcceptor,
    /// As `acceptor`, for browsers: HTTP/1.1, and no question for a certificate.
    pub(crate) pages: TlsAcceptor,
    /// Verifies the certificates of peers.
    verifier: Arc<dyn ClientCertVerifier>,
    /// A host name that the certificate is for, preferably one that other machines can use.
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
        let identity = Arc::new(credential_file::identity(&files.certificate, &files.key)?);
        let host = identity.cert.first().and_then(host_name);
        let roots = Arc::new(credentials::roots(&files.ca)?);
        let verifier: Arc<dyn ClientCertVerifier> =
            WebPkiClientVerifier::builder_with_provider(roots, Arc::clone(&provider))
                // Clients connect without certificates; access is decided call by call.
                .allow_unauthenticated()
                .build()
                .map_err(|source| TlsError::Authority { path: files.ca.clone(), source })?;
        let mut pages = ServerConfig::builder_with_provider(Arc::clone(&provider))
            .with_protocol_versions(&[&TLS13])
            .map_err(setup)?
            .with_no_client_auth()
            .with_cert_resolver(Arc::new(SingleCertAndKey::from(Arc::clone(&identity))));
        pages.alpn_protocols = vec![PAGES_ALPN.to_vec()];
        let mut config = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&TLS13])
            .map_err(setup)?
            .with_client_cert_verifier(Arc::new(LateVerifier(Arc::clone(&verifier))))
            .with_cert_resolver(Arc::new(SingleCertAndKey::from(identity)));
        config.alpn_protocols = vec![ALPN.to_vec()];
        let [acceptor, pages] = [config, pages].map(|config| TlsAcceptor::from(Arc::new(config)));
        Ok(Self { acceptor, pages, verifier, host })
    }

    /// Returns the result of the check of a peer's certificates; the peer has proved that it holds
    /// the key of the first.
    pub(crate) fn certificate(&self, chain: Option<&[CertificateDer<'_>]>) -> Certificate {
        let Some((first, intermediates)) = chain.and_then(|chain| chain.split_first()) else {
            return Certificate::Absent;
        };
        match self.verifier.verify_client_cert(first, intermediates, UnixTime::now()) {
            Ok(_) if is_workers(first) => Certificate::Worker,
            Ok(_) => Certificate::Other,
            Err(error) => Certificate::Faulty(fault(&error)),
        }
    }

    /// Returns a host name that the certificate is for.
    pub(crate) fn host(&self) -> Option<&str> {
        self.host.as_deref()
    }
}

impl std::fmt::Debug for Tls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tls").field("host", &self.host).finish_non_exhaustive()
    }
}

/// Accepts in the handshake every certificate whose key the peer holds. Whether it is valid is
/// checked after the handshake ([`Tls::certificate`]) and reported in the answer to the first call:
/// a TLS alert may be lost with the connection, and users would have to guess the reason.
#[derive(Debug)]
struct LateVerifier(Arc<dyn ClientCertVerifier>);

impl ClientCertVerifier for LateVerifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.0.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        _: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: UnixTime,
    ) -> Result<ClientCertVerified, rustls::Error> {
        Ok(ClientCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.0.verify_tls12_signature(message, certificate, signed)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.0.verify_tls13_signature(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.0.supported_verify_schemes()
    }

    fn client_auth_mandatory(&self) -> bool {
        false
    }
}

fn is_workers(certificate: &CertificateDer<'_>) -> bool {
    EndEntityCert::try_from(certificate)
        .is_ok_and(|certificate| certificate.valid_uri_names().any(|name| name == WORKER_NAME))
}

fn fault(error: &rustls::Error) -> Fault {
    match TlsFailure::find_cause(error) {
        Some(TlsFailure::UnknownAuthority) => Fault::UnknownAuthority,
        Some(TlsFailure::Expired) => Fault::Expired,
        Some(TlsFailure::NotYetValid) => Fault::NotYetValid,
        Some(TlsFailure::WrongPurpose) => Fault::OtherUsage,
        _ => Fault::Unusable,
    }
}

/// Returns the first of the certificate's names, `localhost` only if there is no other.
fn host_name(certificate: &CertificateDer<'_>) -> Option<String> {
    let certificate = EndEntityCert::try_from(certificate).ok()?;
    let names = || certificate.valid_dns_names().filter(|name| !name.contains('*'));
    names().find(|name| *name != "localhost").or_else(|| names().next()).map(str::to_owned)
}
