//! Tokens, hashes, addresses and files of credentials, damaged: never a panic, a bound on the
//! work, and what is accepted is accepted again when it is written out.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use osteon_fuzz::{bounded, bytes, damaged, damaged_text, properties, texts};
use osteon_transport::credential_file::{self, CredentialError};
use osteon_transport::endpoint::Endpoint;
use osteon_transport::token::{Token, TokenHash};

fn check_text(text: &str) {
    if let Ok(token) = bounded(text.len(), || Token::parse(text)) {
        assert_eq!(Token::parse(token.reveal()), Ok(token.clone()));
        assert_eq!(TokenHash::parse(&token.hash().to_string()), Some(token.hash()));
    }
    if let Some(hash) = bounded(text.len(), || TokenHash::parse(text)) {
        assert_eq!(TokenHash::parse(&hash.to_string()), Some(hash));
    }
    if let Ok(endpoint) = bounded(text.len(), || text.parse::<Endpoint>()) {
        assert_eq!(endpoint.to_string().parse::<Endpoint>().unwrap(), endpoint);
    }
}

fn short_texts() -> Vec<String> {
    let urls = ["http://127.0.0.1:7000", "https://node-1.example:7000/", "http://[::1]:1"];
    let others = ["unix:/run/osteon.sock", "unix:relative", "localhost:7000"];
    let mut all = texts("tokens");
    all.extend(urls.into_iter().chain(others).map(str::to_owned));
    all.push(format!("blake3:{}", "0a".repeat(32)));
    all
}

/// A certificate, the same with its key, both made here, and what holds a token.
fn credentials() -> Vec<Vec<u8>> {
    let key = rcgen::KeyPair::generate().unwrap();
    let certificate = rcgen::CertificateParams::default().self_signed(&key).unwrap().pem();
    let both = certificate.clone() + &key.serialize_pem();
    let mut all = [bytes("tokens"), bytes("credentials")].concat();
    all.extend([certificate.into_bytes(), both.into_bytes()]);
    all
}

/// Reads a file as everything that it could be; whether it is a certificate with its key, and
/// whether it is a token.
fn check_file(bytes: &[u8]) -> (bool, bool) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("credential");
    fs::write(&path, bytes).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
    let check_error = |error: CredentialError| {
        let text = error.to_string();
        assert!(text.len() < 4096 && text.contains("credential"), "{text}");
    };
    match bounded(bytes.len(), || credential_file::certificates(&path)) {
        Ok(found) => assert!(!found.is_empty()),
        Err(error) => check_error(error),
    }
    let identity = bounded(bytes.len(), || credential_file::identity(&path, &path));
    let token = bounded(bytes.len(), || credential_file::token(&path));
    let are = (identity.is_ok(), token.is_ok());
    match identity {
        Ok(identity) => assert!(!identity.cert.is_empty()),
        Err(error) => check_error(error),
    }
    match token {
        // It stands in the file as it is.
        Ok(token) => assert!(std::str::from_utf8(bytes).unwrap().contains(token.reveal())),
        Err(error) => check_error(error),
    }
    are
}

#[test]
fn every_seed_is_read_or_refused() {
    short_texts().iter().for_each(|text| check_text(text));
    let read: Vec<_> = credentials().iter().map(|bytes| check_file(bytes)).collect();
    assert!(read.contains(&(true, false)), "no identity among {read:?}");
    assert!(read.contains(&(false, true)), "no token among {read:?}");
}

#[test]
fn large_files_take_no_more_than_their_share() {
    let block = "-----BEGIN CERTIFICATE-----\n-----END CERTIFICATE-----\n";
    check_file(block.repeat(20_000).as_bytes());
    check_file("-----BEGIN CERTIFICATE-----\n".repeat(30_000).as_bytes());
    check_file(&credentials().concat().repeat(500));
    check_file(&[b'-'; 1 << 20]);
    check_file(&[0xff; 1 << 20]);
    check_text(&"osteon_".repeat(100_000));
    check_text(&format!("http://{}:1", "a.".repeat(500_000)));
    check_text(&format!("http://[{}]:1", ":".repeat(500_000)));
}

properties! {
    fn damaged_tokens_and_addresses_are_read_or_refused(text in damaged_text(short_texts())) {
        check_text(&text);
    }

    fn damaged_files_are_read_or_refused(bytes in damaged(credentials())) {
        check_file(&bytes);
    }
}
