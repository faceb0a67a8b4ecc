//! A certificate authority for one installation, and the certificates that it signs. No file is read or
//! written here.

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose, SanType,
};
use time::{Duration, OffsetDateTime};
use zeroize::Zeroizing;

/// The name that marks a worker's certificate (a URI among its subject alternative names).
pub const WORKER_NAME: &str = "urn:osteon:worker";
/// The name that marks a client's certificate (a URI among its subject alternative names).
pub const CLIENT_NAME: &str = "urn:osteon:client";
/// Validity of an authority in days.
const AUTHORITY_DAYS: i64 = 3650;
/// Certificates are valid from this long before their creation, because clocks differ.
const CLOCK_MARGIN: Duration = Duration::hours(1);
/// Names of the local machine that every coordinator's certificate includes.
const LOCAL_HOSTS: [&str; 3] = ["localhost", "127.0.0.1", "::1"];

/// A certificate and its key, both in PEM.
pub struct PemPair {
    /// The certificate.
    pub certificate: String,
    /// Its private key, which is secret.
    pub key: Zeroizing<String>,
}

/// An authority that can sign.
pub struct Authority(Issuer<'static, KeyPair>);

/// The holder of a certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CertificateHolder<'a> {
    /// A coordinator, with the hosts under which it can be reached, besides the local machine's own
    /// names.
    Coordinator(&'a [String]),
    /// A worker.
    Worker,
    /// A client.
    Client,
}

impl Authority {
    /// Creates an authority that is valid from `now` on, and returns its certificate and key with it.
    ///
    /// # Errors
    /// If no key can be made.
    pub fn new(now: OffsetDateTime) -> Result<(Self, PemPair), rcgen::Error> {
        let key = KeyPair::generate()?;
        let mut params = CertificateParams::default();
        params.distinguished_name =
            distinguished_name(&format!("osteon authority of {}", now.date()));
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.not_before = now - CLOCK_MARGIN;
        params.not_after = now + Duration::days(AUTHORITY_DAYS);
        let certificate = params.self_signed(&key)?.pem();
        let made = PemPair { certificate, key: Zeroizing::new(key.serialize_pem()) };
        Ok((Self(Issuer::new(params, key)), made))
    }

    /// Loads an existing authority from its certificate and key, both in PEM.
    ///
    /// # Errors
    /// If either is not what it should be.
    pub fn from_pem(certificate: &str, key: &str) -> Result<Self, rcgen::Error> {
        Ok(Self(Issuer::from_ca_cert_pem(certificate, KeyPair::from_pem(key)?)?))
    }

    /// Issues a certificate for `bearer` that is valid for `days` from `now` on.
    ///
    /// # Errors
    /// If a host is no name that a certificate can hold.
    pub fn sign(
        &self,
        bearer: CertificateHolder<'_>,
        now: OffsetDateTime,
        days: u16,
    ) -> Result<PemPair, rcgen::Error> {
        let mut params = match bearer {
            CertificateHolder::Coordinator(hosts) => {
                let local = LOCAL_HOSTS.map(str::to_owned);
                CertificateParams::new(hosts.iter().cloned().chain(local).collect::<Vec<_>>())?
            }
            CertificateHolder::Worker => with_uri(WORKER_NAME)?,
            CertificateHolder::Client => with_uri(CLIENT_NAME)?,
        };
        let (name, usage) = match bearer {
            CertificateHolder::Coordinator(_) => {
                ("osteon coordinator", ExtendedKeyUsagePurpose::ServerAuth)
            }
            CertificateHolder::Worker => ("osteon worker", ExtendedKeyUsagePurpose::ClientAuth),
            CertificateHolder::Client => ("osteon client", ExtendedKeyUsagePurpose::ClientAuth),
        };
        params.distinguished_name = distinguished_name(name);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![usage];
        params.use_authority_key_identifier_extension = true;
        params.not_before = now - CLOCK_MARGIN;
        params.not_after = now + Duration::days(i64::from(days));
        let key = Zeroizing::new(KeyPair::generate()?);
        let certificate = params.signed_by(&*key, &self.0)?.pem();
        Ok(PemPair { certificate, key: Zeroizing::new(key.serialize_pem()) })
    }
}

fn distinguished_name(name: &str) -> rcgen::DistinguishedName {
    let mut distinguished = rcgen::DistinguishedName::new();
    distinguished.push(DnType::OrganizationName, "osteon");
    distinguished.push(DnType::CommonName, name);
    distinguished
}

fn with_uri(uri: &str) -> Result<CertificateParams, rcgen::Error> {
    let mut params = CertificateParams::default();
    params.subject_alt_names = vec![SanType::URI(uri.try_into()?)];
    Ok(params)
}
