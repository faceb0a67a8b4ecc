//! Files of certificates, keys and tokens: read within limits, and refused if others can read a
//! secret or change trusted data. Errors name the file and the remedy, but never the file's
//! content.

use std::io;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use osteon_common::limits::{CREDENTIAL_FILE_BYTES_MAX, CREDENTIAL_PIPE_SECONDS_MAX};
use osteon_common::visible;
use osteon_files::user_file;
use thiserror::Error;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject as _};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use tokio_rustls::rustls::sign::CertifiedKey;
use tokio_rustls::rustls::{self, InconsistentKeys};
use webpki::{EndEntityCert, KeyUsage};
use zeroize::Zeroizing;

use crate::pipe;
use crate::token::{NoToken, Token};

/// Access that other users may have to a file.
#[derive(Debug, Clone, Copy)]
enum FileAccess {
    /// No access for others. The group may read, as needed by services whose secrets are mounted.
    Secret,
    /// Others may read, but not write.
    Trusted,
}

/// Reason why a file of certificates, keys or tokens cannot be used.
#[derive(Debug, Error)]
pub enum CredentialError {
    /// The operating system cannot read it.
    #[error("cannot read {}: {source}", visible::path(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// It is too long to be such a file.
    #[error(
        "{} has more than {max} bytes, so it is not a file of certificates, keys or tokens",
        visible::path(path)
    )]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Maximum number of bytes.
        max: u64,
    },
    /// It is a pipe that delivered no bytes.
    #[error(
        "the pipe {} is empty; a pipe can be read only once: give a regular file if it must be \
         read again",
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
        "{0} is open to other users (mode {mode:04o}); it is a secret: run chmod 600 {0}, and \
         replace it if somebody may have read it",
        visible::path(path)
    )]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Its permission bits.
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
        /// Its permission bits.
        mode: u32,
    },
    /// It is a damaged PEM file.
    #[error("{} is not a valid PEM file: {fault}", visible::path(path))]
    Pem {
        /// The file.
        path: PathBuf,
        /// The defect.
        fault: PemFault,
    },
    /// It contains no certificate.
    #[error(
        "{} holds no certificate; give a PEM file with `BEGIN CERTIFICATE`, as `osteon certs` \
         makes \
         them",
        visible::path(path)
    )]
    NoCertificate {
        /// The file.
        path: PathBuf,
    },
    /// It contains no private key.
    #[error(
        "{} holds no private key; give a PEM file with `BEGIN PRIVATE KEY`, as `osteon certs` \
         makes \
         them",
        visible::path(path)
    )]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// It contains a key that cannot be used.
    #[error("the key in {} cannot be used: {source}", visible::path(path))]
    Key {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: rustls::Error,
    },
    /// Certificate and key do not match.
    #[error(
        "the key in {} is not the one of the certificate in {}; give a certificate and a key \
         that were made together",
        visible::path(key),
        visible::path(certificate)
    )]
    Mismatch {
        /// The file of the certificate.
        certificate: PathBuf,
        /// The file of the key.
        key: PathBuf,
    },
    /// The certificate has expired.
    #[error("the certificate in {} has expired; make a new one", visible::path(path))]
    Expired {
        /// The file.
        path: PathBuf,
    },
    /// The certificate is not valid yet.
    #[error(
        "the certificate in {} is not valid yet; check the clock of this machine",
        visible::path(path)
    )]
    NotYetValid {
        /// The file.
        path: PathBuf,
    },
    /// The certificate cannot be parsed.
    #[error("the certificate in {} cannot be used: {source}", visible::path(path))]
    Certificate {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: webpki::Error,
    },
    /// The certificate is not one of a certificate authority.
    #[error(
        "the certificate in {} is not a certificate authority's: {source}",
        visible::path(path)
    )]
    Root {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: rustls::Error,
    },
    /// It does not contain a token.
    #[error("what {} holds {source}", visible::path(path))]
    Token {
        /// The file.
        path: PathBuf,
        /// The expected form of a token.
        source: NoToken,
    },
}

/// Defect of a PEM file. It replaces the parser's own error, which quotes the file's content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PemFault {
    /// The `-----BEGIN` line is incomplete.
    #[error("a line `-----BEGIN …-----` is damaged")]
    Begin,
    /// The `-----END` line is missing.
    #[error("a line `-----END …-----` is missing or damaged")]
    End,
    /// The content between the two lines is invalid.
    #[error("the text between `-----BEGIN …-----` and `-----END …-----` is damaged")]
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

/// Reads a certificate with its chain, and its key, and checks that they match and that the certificate is
/// currently valid. Of the key, only what signs is left in memory.
///
/// # Errors
/// If a file cannot be used.
pub fn identity(certificate: &Path, key: &Path) -> Result<CertifiedKey, CredentialError> {
    let chain = certificates(certificate)?;
    check_validity_dates(certificate, &chain)?;
    let private = private_key(key)?;
    let cannot = |source| CredentialError::Key { path: key.to_owned(), source };
    let signing = ring::sign::any_supported_type(&private).map_err(cannot)?;
    let identity = CertifiedKey::new(chain, signing);
    match identity.keys_match() {
        // Of some keys that cannot be known.
        Ok(()) | Err(rustls::Error::InconsistentKeys(InconsistentKeys::Unknown)) => Ok(identity),
        Err(rustls::Error::InconsistentKeys(_)) => {
            let (certificate, key) = (certificate.to_owned(), key.to_owned());
            Err(CredentialError::Mismatch { certificate, key })
        }
        Err(source) => Err(cannot(source)),
    }
}

/// Reads a file of certificates, which contains at least one.
///
/// # Errors
/// If the file cannot be used.
pub fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, CredentialError> {
    let bytes = read(path, FileAccess::Trusted)?;
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
/// If the file cannot be used.
pub fn token(path: &Path) -> Result<Token, CredentialError> {
    let text = secret_text(path)?;
    Token::parse(&text).map_err(|source| CredentialError::Token { path: path.to_owned(), source })
}

/// Reads a text file that others must not be able to read.
///
/// # Errors
/// If the file cannot be used.
pub fn secret_text(path: &Path) -> Result<Zeroizing<String>, CredentialError> {
    text(path, FileAccess::Secret)
}

/// Reads a text file that others may read but must not be able to change.
///
/// # Errors
/// If the file cannot be used.
pub fn trusted_text(path: &Path) -> Result<String, CredentialError> {
    Ok(std::mem::take(&mut *text(path, FileAccess::Trusted)?))
}

fn text(path: &Path, kind: FileAccess) -> Result<Zeroizing<String>, CredentialError> {
    let mut bytes = read(path, kind)?;
    String::from_utf8(std::mem::take(&mut *bytes)).map(Zeroizing::new).map_err(|error| {
        drop(Zeroizing::new(error.into_bytes()));
        CredentialError::NoText { path: path.to_owned() }
    })
}

fn private_key(path: &Path) -> Result<Zeroizing<PrivateKeyDer<'static>>, CredentialError> {
    let bytes = read(path, FileAccess::Secret)?;
    let key = PrivateKeyDer::from_pem_slice(&bytes).map_err(|source| match source {
        pem::Error::NoItemsFound => CredentialError::NoKey { path: path.to_owned() },
        error => damaged(path, &error),
    });
    key.map(Zeroizing::new)
}

fn damaged(path: &Path, error: &pem::Error) -> CredentialError {
    CredentialError::Pem { path: path.to_owned(), fault: error.into() }
}

/// Reads a file after checking its permissions. They are those of the opened file, even if its name
/// is later given to another one. A pipe is accepted, so that a secret need not be on a disk. Its
/// permissions are checked, too, since a named pipe that others can read would let them take the
/// secret.
fn read(path: &Path, kind: FileAccess) -> Result<Zeroizing<Vec<u8>>, CredentialError> {
    let unreadable = |source| CredentialError::Unreadable { path: path.to_owned(), source };
    let file = user_file::open_or_pipe(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    let mode = metadata.permissions().mode() & 0o7777;
    match kind {
        FileAccess::Secret if mode & 0o027 != 0 => {
            return Err(CredentialError::Exposed { path: path.to_owned(), mode });
        }
        FileAccess::Trusted if mode & 0o022 != 0 => {
            return Err(CredentialError::Changeable { path: path.to_owned(), mode });
        }
        FileAccess::Secret | FileAccess::Trusted => {}
    }
    let max = CREDENTIAL_FILE_BYTES_MAX;
    let piped = metadata.file_type().is_fifo();
    let bytes = match piped {
        true => pipe::read(&file, max, Duration::from_secs(CREDENTIAL_PIPE_SECONDS_MAX)),
        false => user_file::read_opened(&file, max).map(|bytes| bytes.map(Zeroizing::new)),
    };
    match bytes.map_err(unreadable)? {
        Some(bytes) if piped && bytes.is_empty() => {
            Err(CredentialError::EmptyPipe { path: path.to_owned() })
        }
        Some(bytes) => Ok(bytes),
        None => Err(CredentialError::TooLong { path: path.to_owned(), max }),
    }
}

/// Refuses a certificate whose dates the peer would refuse. Whether it is trusted is for the peer
/// to decide: no trust anchor is given here, and the search for one comes after the check of dates.
fn check_validity_dates(
    path: &Path,
    chain: &[CertificateDer<'static>],
) -> Result<(), CredentialError> {
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
