use std::fs;
use std::io::Write as _;
use std::os::fd::AsRawFd as _;

use rcgen::{CertificateParams, KeyPair};
use tempfile::TempDir;

use super::*;

/// A directory with files as an operator may have them.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>, mode: u32) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        path
    }

    /// Creates a certificate with its key, valid between these two years.
    fn pair(&self, name: &str, from: i32, to: i32) -> (PathBuf, PathBuf) {
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::default();
        params.not_before = rcgen::date_time_ymd(from, 1, 1);
        params.not_after = rcgen::date_time_ymd(to, 1, 1);
        let certificate = params.self_signed(&key).unwrap();
        (
            self.write(&format!("{name}.pem"), certificate.pem(), 0o644),
            self.write(&format!("{name}-key.pem"), key.serialize_pem(), 0o600),
        )
    }
}

#[test]
fn a_certificate_and_its_key_are_read() {
    let place = Place::new();
    let (certificate, key) = place.pair("good", 2000, 4000);
    assert_eq!(identity(&certificate, &key).unwrap().cert.len(), 1);
    // The permissions of mounted secrets.
    fs::set_permissions(&key, fs::Permissions::from_mode(0o440)).unwrap();
    assert!(identity(&certificate, &key).is_ok());
}

#[test]
fn what_cannot_be_used_is_named_with_what_to_do() {
    let place = Place::new();
    let (certificate, key) = place.pair("good", 2000, 4000);
    let (_, other_key) = place.pair("other", 2000, 4000);
    let (expired, expired_key) = place.pair("expired", 2000, 2001);
    let (future, future_key) = place.pair("future", 3999, 4000);
    let text = fs::read_to_string(&key).unwrap();
    let half = &text[..text.len() / 2];
    let begin = "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n";
    let absent = place.0.path().join("absent");
    let check = |certificate: &Path, key: &Path, named: &Path, expected: &str| {
        let error = identity(certificate, key).unwrap_err().to_string();
        let name = named.to_str().unwrap();
        assert!(error.contains(expected) && error.contains(name), "{name}, {expected}: {error}");
        assert!(!error.contains(text.lines().nth(1).unwrap()), "the key is told: {error}");
    };
    check(&absent, &key, &absent, "cannot read");
    check(&certificate, &absent, &absent, "cannot read");
    check(place.0.path(), &key, place.0.path(), "can");
    check(&certificate, &other_key, &other_key, "is not the one of the certificate");
    check(&expired, &expired_key, &expired, "has expired; make a new one");
    check(&future, &future_key, &future, "not valid yet");
    check(&key, &key, &key, "holds no certificate");
    check(&certificate, &certificate, &certificate, "open to other users");
    for (name, bytes, mode, expected) in [
        ("world", text.as_bytes(), 0o604, "chmod 600"),
        ("open", text.as_bytes(), 0o644, "(mode 0644)"),
        ("group", text.as_bytes(), 0o660, "open to other users"),
        ("empty", b"", 0o600, "holds no private key"),
        ("half", half.as_bytes(), 0o600, "PEM"),
        ("wrong", begin.as_bytes(), 0o600, "cannot be used"),
        ("long", &vec![b'x'; CREDENTIAL_FILE_BYTES_MAX as usize + 1], 0o600, "more than 4194304"),
    ] {
        let path = place.write(name, bytes, mode);
        check(&certificate, &path, &path, expected);
    }
    let garbled = place.write(
        "garbled.pem",
        "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n",
        0o644,
    );
    check(&garbled, &key, &garbled, "garbled");
    let changeable = place.write("changeable.pem", fs::read(&certificate).unwrap(), 0o666);
    check(&changeable, &key, &changeable, "chmod 644");
}

#[test]
fn a_token_is_read_or_refused_without_being_told() {
    let place = Place::new();
    let good = Token::generate().unwrap();
    let file = place.write("token", format!("{}\n", good.reveal()), 0o600);
    assert_eq!(token(&file).unwrap(), good);
    for (name, bytes, mode, expected) in [
        ("open", good.reveal().as_bytes(), 0o644, "chmod 600"),
        ("word", b"correct horse".as_slice(), 0o600, "is not a valid osteon token"),
        ("hash", good.hash().to_string().as_bytes(), 0o600, "is not a valid osteon token"),
        ("bytes", b"\xff\xfe", 0o600, "is not a text file"),
        ("empty", b"", 0o600, "is not a valid osteon token"),
    ] {
        let path = place.write(name, bytes, mode);
        let error = token(&path).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains(name), "{name}: {error}");
        for secret in [good.reveal(), "correct horse"] {
            assert!(!error.contains(secret), "{error}");
        }
    }
}

/// Like a shell's process substitution: `--token-file <(pass show osteon)`.
#[test]
fn what_comes_through_a_pipe_is_read_once() {
    let place = Place::new();
    let secret = format!("osteon_{}", "0123456789abcdef".repeat(4));
    let (reader, mut writer) = std::io::pipe().unwrap();
    let path = PathBuf::from(format!("/dev/fd/{}", reader.as_raw_fd()));
    writeln!(writer, "{secret}").unwrap();
    drop(writer);
    assert_eq!(token(&path).unwrap().reveal(), secret);
    let again = token(&path).unwrap_err();
    assert!(matches!(again, CredentialError::EmptyPipe { .. }), "{again}");
    assert!(again.to_string().contains("give a regular file"), "{again}");

    // Certificates, keys, and named pipes.
    let (certificate, key) = place.pair("good", 2000, 4000);
    let named = place.0.path().join("named");
    assert!(std::process::Command::new("mkfifo").arg(&named).status().unwrap().success());
    let exposed = identity(&certificate, &named).unwrap_err();
    assert!(matches!(exposed, CredentialError::Exposed { .. }), "{exposed}");
    fs::set_permissions(&named, fs::Permissions::from_mode(0o600)).unwrap();
    let pem = fs::read(&key).unwrap();
    let writer = std::thread::spawn({
        let named = named.clone();
        move || fs::write(named, pem).unwrap()
    });
    assert!(identity(&certificate, &named).is_ok());
    writer.join().unwrap();
}
