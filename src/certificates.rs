//! A certificate authority for one installation, and the certificates that it signs. This file
//! reads and writes no files.

use osteon_coordinator::access::{CLIENT_NAME, WORKER_NAME};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose, SanType,
};
use time::{Duration, OffsetDateTime};
use zeroize::Zeroizing;

/// Validity of an authority in days.
const AUTHORITY_DAYS: i64 = 3650;
/// Certificates are valid from this long before their creation, because clocks differ.
const CLOCK_MARGIN: Duration = Duration::hours(1);
/// Names of the local machine that every coordinator's certificate includes.
const LOCAL_HOSTS: [&str; 3] = ["localhost", "127.0.0.1", "::1"];

/// A certificate and its key, both in PEM.
pub(crate) struct PemPair {
    /// The certificate.
    pub(crate) certificate: String,
    /// Its private key, which is secret.
    pub(crate) key: Zeroizing<String>,
}

/// An authority that can sign.
pub(crate) struct Authority(Issuer<'static, KeyPair>);

/// The holder of a certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CertificateHolder<'a> {
    /// A coordinator, with the hosts under which it can be reached, besides the local machine's own
    /// names.
    Coordinator(&'a [String]),
    /// A worker.
    Worker,
    /// A client.
    Client,
}

impl Authority {
    /// Creates an authority that is valid from `now` on.
    pub(crate) fn new(now: OffsetDateTime) -> Result<(Self, PemPair), rcgen::Error> {
        let key = KeyPair::generate()?;
        let mut params = CertificateParams::default();
        params.distinguished_name = named(&format!("osteon authority of {}", now.date()));
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.not_before = now - CLOCK_MARGIN;
        params.not_after = now + Duration::days(AUTHORITY_DAYS);
        let certificate = params.self_signed(&key)?.pem();
        let made = PemPair { certificate, key: Zeroizing::new(key.serialize_pem()) };
        Ok((Self(Issuer::new(params, key)), made))
    }

    /// Loads an existing authority.
    pub(crate) fn from_pem(certificate: &str, key: &str) -> Result<Self, rcgen::Error> {
        Ok(Self(Issuer::from_ca_cert_pem(certificate, KeyPair::from_pem(key)?)?))
    }

    /// Issues a certificate for `bearer` that is valid for `days` from `now` on.
    pub(crate) fn sign(
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
        params.distinguished_name = named(name);
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

fn named(name: &str) -> rcgen::DistinguishedName {
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
