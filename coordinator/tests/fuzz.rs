//! Damaged inputs of a coordinator other than messages: lists of tokens, headers, paths, addresses.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use osteon_coordinator::access::tokens::{self, Role, TokensError};
use osteon_coordinator::access::{self, Presented, Requirement};
use osteon_coordinator::core::ids::JobId;
use osteon_coordinator::{ListenAddress, Tokens};
use osteon_fuzz::{bounded, bytes, damaged, damaged_text, properties};
use osteon_transport::token::TokenHash;

fn read(path: &Path, bytes: &[u8]) -> Result<Tokens, TokensError> {
    fs::write(path, bytes).unwrap();
    fs::set_permissions(path, fs::Permissions::from_mode(0o600)).unwrap();
    bounded(bytes.len(), || Tokens::read(path))
}

fn check_tokens(bytes: &[u8]) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("list");
    match read(&path, bytes) {
        Ok(tokens) => {
            let text = std::str::from_utf8(bytes).unwrap();
            let lines: String = text.lines().filter_map(line_again).collect();
            assert_eq!(read(&path, lines.as_bytes()).unwrap(), tokens);
        }
        Err(error) => {
            let error = error.to_string();
            assert!(error.len() < 4096 && error.contains("list"), "{error}");
            // No message may contain anything that could be a secret.
            assert!(!error.contains("osteon_0") && !error.contains(&"0".repeat(32)), "{error}");
        }
    }
}

/// Returns an accepted line in the form that osteon writes; `None` if it has no contents.
fn line_again(line: &str) -> Option<String> {
    let mut words = line.split('#').next()?.split_whitespace();
    let (name, role, hash) = (words.next()?, words.next()?, words.next()?);
    let hash = TokenHash::parse(hash).unwrap();
    Some(tokens::line(name, Role::named(role).unwrap(), &hash) + "\n")
}

fn check_header(bytes: &[u8]) {
    if let Presented::Token(token) = bounded(bytes.len(), || access::presented(Some(bytes))) {
        let again = format!("Bearer {token}");
        assert_eq!(access::presented(Some(again.as_bytes())), Presented::Token(token));
    }
}

fn check_path(path: &str) {
    let open = bounded(path.len(), || access::requirement(path)) == Requirement::Nothing;
    assert_eq!(open, path.starts_with("/grpc.health.v1.Health/"), "{path}");
}

fn check_address(text: &str) {
    if let Ok(address) = bounded(text.len(), || text.parse::<ListenAddress>()) {
        let again = match &address {
            ListenAddress::Tcp(address) => address.to_string(),
            ListenAddress::Unix(path) => format!("unix:{}", path.display()),
        };
        assert_eq!(again.parse::<ListenAddress>().unwrap(), address);
    }
    if let Some(job) = bounded(text.len(), || JobId::parse(text)) {
        assert_eq!(JobId::parse(&job.to_string()), Some(job));
    }
}

fn owned(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|&text| text.to_owned()).collect()
}

fn headers() -> Vec<Vec<u8>> {
    let token = format!("Bearer osteon_{}", "0a".repeat(32));
    vec![token.clone().into_bytes(), token.to_lowercase().into_bytes(), b"Basic YTpi".to_vec()]
}

fn paths() -> Vec<String> {
    owned(&[
        "/grpc.health.v1.Health/Check",
        "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
        "/osteon.v1.Jobs/Submit",
        "/osteon.v1.Workers/Attach",
    ])
}

fn addresses() -> Vec<String> {
    owned(&["127.0.0.1:7000", "[::1]:0", "localhost:7000", "unix:/run/osteon.sock", "17"])
}

#[test]
fn every_seed_is_read_or_refused() {
    bytes("tokens").iter().for_each(|bytes| check_tokens(bytes));
    headers().iter().for_each(|bytes| check_header(bytes));
    paths().iter().for_each(|path| check_path(path));
    addresses().iter().for_each(|text| check_address(text));
}

#[test]
fn a_list_of_the_longest_file_takes_no_more_than_its_share() {
    let hash = |i: usize| format!("blake3:{i:064x}");
    let lines: String = (0..20_000).map(|i| format!("n{i} read {}\n", hash(i))).collect();
    check_tokens(lines.as_bytes());
    check_tokens(format!("ann read {}\n", hash(1)).repeat(20_000).as_bytes());
    check_tokens("# \n".repeat(1_000_000).as_bytes());
    check_tokens("a ".repeat(1_000_000).as_bytes());
}

properties! {
    fn damaged_lists_of_tokens_are_read_or_refused(bytes in damaged(bytes("tokens"))) {
        check_tokens(&bytes);
    }

    fn damaged_headers_are_read_or_refused(bytes in damaged(headers())) {
        check_header(&bytes);
    }

    fn no_damaged_path_opens_what_is_closed(path in damaged_text(paths())) {
        check_path(&path);
    }

    fn damaged_addresses_are_read_or_refused(text in damaged_text(addresses())) {
        check_address(&text);
    }
}
