//! Files of certificates, keys and tokens: read with bounds, refused when others can read what is
//! secret or change what is trusted. Errors name the file and what to do, never what it holds.

use std::io;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use osteon_common::limits::{CREDENTIAL_FILE_BYTES_MAX, CREDENTIAL_PIPE_S_MAX};
use osteon_common::{user_file, visible};
use thiserror::Error;
use tokio_rustls::rustls;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject as _};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use tokio_rustls::rustls::sign::CertifiedKey;
use webpki::{EndEntityCert, KeyUsage};

use crate::pipe;
use crate::token::{NoToken, Token};

/// What others may do with a file.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// Nothing; the group may read, as services that get their secrets mounted need.
    Secret,
    /// Read, but not change.
    Trusted,
}

/// Why a file of certificates, keys or tokens cannot be used.
#[derive(Debug, Error)]
pub enum CredentialError {
    /// The operating system does not give it.
    #[error("cannot read {}: {source}", visible::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is no such file at all.
    #[error(
        "{} has more than {max} bytes, so it is not a file of certificates, keys or tokens",
        visible::path(path)
    )]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Most bytes.
        max: u64,
    },
    /// It is a pipe through which nothing came.
    #[error(
        "nothing came through the pipe {}; what came through a pipe once does not come again: name a \
         file where it is to be read again",
        visible::path(path)
    )]
    EmptyPipe {
        /// The pipe.
        path: PathBuf,
    },
    /// It is not a text file.
    #[error("{} is not a text file", visible::path(path))]
    NoText {
        /// The file.
        path: PathBuf,
    },
    /// Others can read a secret.
    #[error(
        "{0} is open to other users (mode {mode:04o}); it is a secret: chmod 600 {0}, and make it \
         anew if somebody may have read it",
        visible::path(path)
    )]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// Others can change what is trusted.
    #[error(
        "{0} can be changed by other users (mode {mode:04o}): chmod 644 {0}",
        visible::path(path)
    )]
    Changeable {
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// It is damaged.
    #[error("{} is not a valid PEM file: {fault}", visible::path(path))]
    Pem {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: PemFault,
    },
    /// It holds no certificate.
    #[error(
        "{} holds no certificate; give a PEM file with `BEGIN CERTIFICATE`, as `osteon certs` makes \
         them",
        visible::path(path)
    )]
    NoCertificate {
        /// The file.
        path: PathBuf,
    },
    /// It holds no private key.
    #[error(
        "{} holds no private key; give a PEM file with `BEGIN PRIVATE KEY`, as `osteon certs` makes \
         them",
        visible::path(path)
    )]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// It holds a key that cannot be used.
    #[error("the key in {} cannot be used: {source}", visible::path(path))]
    Key {
        /// The file.
        path: PathBuf,
        /// Why.
        source: rustls::Error,
    },
    /// Certificate and key do not belong together.
    #[error(
        "the key in {} is not the one of the certificate in {}; give the two that were made together",
        visible::path(key),
        visible::path(certificate)
    )]
    Mismatch {
        /// The file of the certificate.
        certificate: PathBuf,
        /// The file of the key.
        key: PathBuf,
    },
    /// The certificate's time is over.
    #[error("the certificate in {} has expired; make a new one", visible::path(path))]
    Expired {
        /// The file.
        path: PathBuf,
    },
    /// The certificate's time has not come.
    #[error(
        "the certificate in {} is not valid yet; is this machine's clock right?",
        visible::path(path)
    )]
    NotYetValid {
        /// The file.
        path: PathBuf,
    },
    /// The certificate cannot be understood.
    #[error("the certificate in {} cannot be used: {source}", visible::path(path))]
    Certificate {
        /// The file.
        path: PathBuf,
        /// Why.
        source: webpki::Error,
    },
    /// The certificate cannot be an authority's.
    #[error(
        "the certificate in {} is not a certificate authority's: {source}",
        visible::path(path)
    )]
    Root {
        /// The file.
        path: PathBuf,
        /// Why.
        source: rustls::Error,
    },
    /// It holds no token.
    #[error("what {} holds {source}", visible::path(path))]
    Token {
        /// The file.
        path: PathBuf,
        /// What a token is.
        source: NoToken,
    },
}

/// What is wrong with a PEM file. Not the parser's own error: that repeats what the file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PemFault {
    /// `-----BEGIN` without the rest.
    #[error("a line `-----BEGIN …-----` is damaged")]
    Begin,
    /// No `-----END`.
    #[error("a line `-----END …-----` is missing or damaged")]
    End,
    /// Anything else between the two.
    #[error("what stands between `-----BEGIN …-----` and `-----END …-----` is damaged")]
    Content,
}

impl From<&pem::Error> for PemFault {
    fn from(error: &pem::Error) -> Self {
        match error {
            pem::Error::IllegalSectionStart { .. } => Self::Begin,
            pem::Error::MissingSectionEnd { .. } => Self::End,
            _ => Self::Content,
        }
    }
}

/// A certificate with the chain above it, and its key.
#[derive(Debug)]
pub struct Identity {
    /// The certificate first.
    pub chain: Vec<CertificateDer<'static>>,
    /// The key of the first.
    pub key: PrivateKeyDer<'static>,
}

/// Reads a certificate and its key, and checks that they belong together and are in their time.
///
/// # Errors
/// When a file cannot be used.
pub fn identity(certificate: &Path, key: &Path) -> Result<Identity, CredentialError> {
    let chain = certificates(certificate)?;
    in_its_time(certificate, &chain)?;
    let private = private_key(key)?;
    let cannot = |source| CredentialError::Key { path: key.to_owned(), source };
    let provider = ring::default_provider();
    match CertifiedKey::from_der(chain.clone(), private.clone_key(), &provider) {
        Ok(_) => {}
        Err(rustls::Error::InconsistentKeys(_)) => {
            let (certificate, key) = (certificate.to_owned(), key.to_owned());
            return Err(CredentialError::Mismatch { certificate, key });
        }
        Err(source) => return Err(cannot(source)),
    }
    Ok(Identity { chain, key: private })
}

/// Reads a file of certificates; there is at least one.
///
/// # Errors
/// When the file cannot be used.
pub fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, CredentialError> {
    let bytes = read(path, Kind::Trusted)?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    let found = found.map_err(|error| damaged(path, &error))?;
    if found.is_empty() {
        return Err(CredentialError::NoCertificate { path: path.to_owned() });
    }
    Ok(found)
}

/// Reads a client's token.
///
/// # Errors
/// When the file cannot be used.
pub fn token(path: &Path) -> Result<Token, CredentialError> {
    let text = secret_text(path)?;
    Token::parse(&text).map_err(|source| CredentialError::Token { path: path.to_owned(), source })
}

/// Reads a text that others must not see.
///
/// # Errors
/// When the file cannot be used.
pub fn secret_text(path: &Path) -> Result<String, CredentialError> {
    text(path, Kind::Secret)
}

/// Reads a text that others may see, and must not change.
///
/// # Errors
/// When the file cannot be used.
pub fn trusted_text(path: &Path) -> Result<String, CredentialError> {
    text(path, Kind::Trusted)
}

fn text(path: &Path, kind: Kind) -> Result<String, CredentialError> {
    let bytes = read(path, kind)?;
    String::from_utf8(bytes).map_err(|_| CredentialError::NoText { path: path.to_owned() })
}

fn private_key(path: &Path) -> Result<PrivateKeyDer<'static>, CredentialError> {
    let bytes = read(path, Kind::Secret)?;
    PrivateKeyDer::from_pem_slice(&bytes).map_err(|source| match source {
        pem::Error::NoItemsFound => CredentialError::NoKey { path: path.to_owned() },
        error => damaged(path, &error),
    })
}

fn damaged(path: &Path, error: &pem::Error) -> CredentialError {
    CredentialError::Pem { path: path.to_owned(), fault: error.into() }
}

/// The permissions looked at are those of the file that is read, whatever its name means later. A pipe
/// will do, so that a secret need not be on a disk; it has permissions, too, and a named one that others
/// can read would let them have what is meant for us.
fn read(path: &Path, kind: Kind) -> Result<Vec<u8>, CredentialError> {
    let unreadable = |source| CredentialError::Unreadable { path: path.to_owned(), source };
    let file = user_file::open_or_pipe(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    let mode = metadata.permissions().mode() & 0o7777;
    match kind {
        Kind::Secret if mode & 0o027 != 0 => {
            return Err(CredentialError::Exposed { path: path.to_owned(), mode });
        }
        Kind::Trusted if mode & 0o022 != 0 => {
            return Err(CredentialError::Changeable { path: path.to_owned(), mode });
        }
        Kind::Secret | Kind::Trusted => {}
    }
    let max = CREDENTIAL_FILE_BYTES_MAX;
    let piped = metadata.file_type().is_fifo();
    let bytes = match piped {
        true => pipe::read(&file, max, Duration::from_secs(CREDENTIAL_PIPE_S_MAX)),
        false => user_file::read_opened(&file, max),
    };
    match bytes.map_err(unreadable)? {
        Some(bytes) if piped && bytes.is_empty() => {
            Err(CredentialError::EmptyPipe { path: path.to_owned() })
        }
        Some(bytes) => Ok(bytes),
        None => Err(CredentialError::TooLong { path: path.to_owned(), max }),
    }
}

/// Refuses a certificate that its peer would refuse for its dates. Who trusts it is the peer's
/// matter: here there is no trust anchor, and the search for one ends behind the check of dates.
fn in_its_time(path: &Path, chain: &[CertificateDer<'static>]) -> Result<(), CredentialError> {
    let path = || path.to_owned();
    let unusable = |source| CredentialError::Certificate { path: path(), source };
    let Some(first) = chain.first() else {
        return Err(CredentialError::NoCertificate { path: path() });
    };
    let certificate = EndEntityCert::try_from(first).map_err(unusable)?;
    let usage = KeyUsage::server_auth();
    let now = UnixTime::now();
    match certificate.verify_for_usage(
        webpki::ALL_VERIFICATION_ALGS,
        &[],
        &[],
        now,
        usage,
        None,
        None,
    ) {
        Err(webpki::Error::CertExpired { .. }) => Err(CredentialError::Expired { path: path() }),
        Err(webpki::Error::CertNotValidYet { .. }) => {
            Err(CredentialError::NotYetValid { path: path() })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
