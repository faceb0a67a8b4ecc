//! TLS failures, with messages that say what to do.

use std::error::Error;
use std::io;

use thiserror::Error;
use tokio_rustls::rustls::{self, CertificateError};

/// Reason why TLS could not be established with a peer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TlsFailure {
    /// The peer's certificate was signed by an unknown authority.
    #[error(
        "its certificate is not signed by the authority in --tls-ca; check that it is the \
             right file"
    )]
    UnknownAuthority,
    /// The peer's certificate has expired.
    #[error("its certificate has expired; it needs a new one")]
    Expired,
    /// The peer's certificate is not valid yet.
    #[error("its certificate is not valid yet; check the clocks")]
    NotYetValid,
    /// The peer's certificate is for another host name.
    #[error("its certificate is not for this host name; it is for {names}")]
    WrongHostName {
        /// The names in the certificate.
        names: String,
    },
    /// The peer's certificate is not for this purpose.
    #[error("its certificate is not valid for a coordinator")]
    WrongPurpose,
    /// The peer does not use TLS.
    #[error("it does not use TLS; write http://HOST:PORT if that is intended")]
    NoTls,
    /// Any other TLS error.
    #[error("TLS failed: {0}")]
    Other(rustls::Error),
}

impl TlsFailure {
    /// Returns the TLS failure that caused an error, if there is one.
    pub fn find_cause(error: &(dyn Error + 'static)) -> Option<Self> {
        let mut cause = Some(error);
        while let Some(error) = cause {
            if let Some(tls) = error.downcast_ref::<rustls::Error>() {
                return Some(Self::from_rustls(tls));
            }
            // An I/O error omits its inner error from the chain of sources.
            let hidden = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
            cause = match hidden {
                Some(hidden) => Some(hidden),
                None => error.source(),
            };
        }
        None
    }

    fn from_rustls(error: &rustls::Error) -> Self {
        use rustls::Error as Tls;
        match error {
            Tls::InvalidCertificate(certificate) => Self::from_certificate(certificate, error),
            Tls::InvalidMessage(_) => Self::NoTls,
            other => Self::Other(other.clone()),
        }
    }

    fn from_certificate(certificate: &CertificateError, error: &rustls::Error) -> Self {
        use CertificateError as Certificate;
        match certificate {
            Certificate::UnknownIssuer | Certificate::BadSignature => Self::UnknownAuthority,
            Certificate::Expired | Certificate::ExpiredContext { .. } => Self::Expired,
            Certificate::NotValidYet | Certificate::NotValidYetContext { .. } => Self::NotYetValid,
            Certificate::NotValidForName => Self::WrongHostName { names: "other names".to_owned() },
            Certificate::NotValidForNameContext { presented, .. } if presented.is_empty() => {
                Self::WrongHostName { names: "no name".to_owned() }
            }
            Certificate::NotValidForNameContext { presented, .. } => {
                Self::WrongHostName { names: presented.join(", ") }
            }
            Certificate::InvalidPurpose | Certificate::InvalidPurposeContext { .. } => {
                Self::WrongPurpose
            }
            _ => Self::Other(error.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_found_under_others_and_told_in_words() {
        let check = |error: rustls::Error, expected: &str| {
            let hidden = io::Error::new(io::ErrorKind::InvalidData, error);
            let outer = io::Error::other(tonic::Status::from_error(Box::new(hidden)));
            let failure = TlsFailure::find_cause(&outer).map(|failure| failure.to_string());
            assert!(failure.as_ref().is_some_and(|text| text.contains(expected)), "{failure:?}");
        };
        let certificate = rustls::Error::InvalidCertificate;
        check(certificate(CertificateError::UnknownIssuer), "--tls-ca");
        check(certificate(CertificateError::Expired), "expired");
        check(certificate(CertificateError::NotValidYet), "clocks");
        check(certificate(CertificateError::NotValidForName), "host name");
        check(certificate(CertificateError::InvalidPurpose), "not valid for a coordinator");
        let alert = rustls::AlertDescription::InternalError;
        check(rustls::Error::AlertReceived(alert), "TLS failed");
        let no_tls = rustls::InvalidMessage::InvalidContentType;
        check(rustls::Error::InvalidMessage(no_tls), "http://");
        assert_eq!(TlsFailure::find_cause(&io::Error::other("reset")), None);
    }
}
