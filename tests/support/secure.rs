//! A coordinator with TLS, set up as by an operator: certificates by `osteon certs`, tokens by
//! `osteon token`.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use rcgen::{CertificateParams, ExtendedKeyUsagePurpose, Issuer, KeyPair, SanType};
use time::OffsetDateTime;

use super::support::{Finished, Owned, Scratch, osteon, run, text};

/// The roles of tokens.
pub(crate) const ROLES: [&str; 3] = ["read", "submit", "admin"];

/// A coordinator with TLS and tokens, and the files of its set-up.
pub(crate) struct Secure {
    pub(crate) process: Owned,
    pub(crate) url: String,
    pub(crate) scratch: Scratch,
}

impl Secure {
    /// Starts a coordinator that logs everything to `coordinator.log`.
    pub(crate) fn start() -> Self {
        let scratch = Scratch::new();
        set_up(&scratch);
        let (process, url) = serve(&scratch, "server");
        Self { process, url, scratch }
    }

    /// Returns the TLS options and the token of `role`.
    pub(crate) fn options(&self, role: &str) -> Vec<String> {
        let token = self.scratch.path(&format!("{role}.token"));
        vec![
            "--coordinator".to_owned(),
            self.url.clone(),
            "--tls-ca".to_owned(),
            text(&self.scratch.path("certs/ca.pem")).to_owned(),
            "--token-file".to_owned(),
            text(&token).to_owned(),
        ]
    }

    /// Runs a client's command with the token of `role`.
    pub(crate) fn client(&self, role: &str, arguments: &[&str]) -> Finished {
        let mut all: Vec<String> = arguments.iter().map(|&word| word.to_owned()).collect();
        all.extend(self.options(role));
        run(&all)
    }

    /// Starts a worker with the certificate `certs/NAME.pem`, which logs everything to a file.
    pub(crate) fn worker(&self, name: &str, log: &str) -> Owned {
        let mut command = osteon();
        command.args(["worker", "--coordinator", &self.url, "--threads", "1", "--tls-ca"]);
        command.arg(self.scratch.path("certs/ca.pem"));
        command.arg("--tls-cert").arg(self.scratch.path(&format!("certs/{name}.pem")));
        command.arg("--tls-key").arg(self.scratch.path(&format!("certs/{name}-key.pem")));
        Owned::spawn_logging(command.env("RUST_LOG", "trace"), &self.scratch.path(log))
    }

    /// Returns the content of a file.
    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.scratch.path(name)).unwrap()
    }
}

/// Creates certificates in `certs`, a list of tokens in `tokens`, and the tokens in `ROLE.token`.
pub(crate) fn set_up(scratch: &Scratch) {
    run(&["certs", text(&scratch.path("certs"))]).succeeded();
    for role in ROLES {
        let out = scratch.path(&format!("{role}.token"));
        let list = scratch.path("tokens");
        let name = format!("{role}-holder");
        run(&["token", &name, "--role", role, "--out", text(&out), "--tokens", text(&list)])
            .succeeded();
    }
}

/// Returns the options of a coordinator with the certificate `certs/NAME.pem`.
pub(crate) fn door(scratch: &Scratch, name: &str) -> Vec<String> {
    let option =
        |option: &str, file: &str| [option.to_owned(), text(&scratch.path(file)).to_owned()];
    [
        option("--tls-ca", "certs/ca.pem"),
        option("--tls-cert", &format!("certs/{name}.pem")),
        option("--tls-key", &format!("certs/{name}-key.pem")),
        option("--tokens", "tokens"),
        option("--store", "store"),
    ]
    .concat()
}

/// Starts a coordinator with the certificate `certs/NAME.pem`; returns the process and its URL.
pub(crate) fn serve(scratch: &Scratch, name: &str) -> (Owned, String) {
    let mut command = osteon();
    command.args(["coordinator", "--listen", "127.0.0.1:0"]).args(door(scratch, name));
    command.env("RUST_LOG", "trace");
    let mut process = Owned::spawn_logging(&mut command, &scratch.path("coordinator.log"));
    let url = process.line();
    assert!(url.starts_with("https://127.0.0.1:"), "{url}");
    (process, url)
}

/// Holder of a certificate that `osteon certs` cannot make.
#[derive(Clone, Copy)]
pub(crate) enum Made {
    /// A worker.
    Worker,
    /// A coordinator on this host.
    Server(&'static str),
}

/// Writes `certs/NAME.pem` and its key, signed by the authority of `certs`, valid to `end`.
pub(crate) fn certificate(
    scratch: &Scratch,
    name: &str,
    made: Made,
    end: OffsetDateTime,
) -> PathBuf {
    let read = |name: &str| fs::read_to_string(scratch.path(name)).unwrap();
    let authority = KeyPair::from_pem(&read("certs/ca-key.pem")).unwrap();
    let issuer = Issuer::from_ca_cert_pem(&read("certs/ca.pem"), authority).unwrap();
    let mut params = CertificateParams::default();
    let (usage, subject) = match made {
        Made::Worker => {
            let uri = SanType::URI("urn:osteon:worker".try_into().unwrap());
            (ExtendedKeyUsagePurpose::ClientAuth, uri)
        }
        Made::Server(host) => {
            let host = match host.parse() {
                Ok(address) => SanType::IpAddress(address),
                Err(_) => SanType::DnsName(host.try_into().unwrap()),
            };
            (ExtendedKeyUsagePurpose::ServerAuth, host)
        }
    };
    params.not_before = rcgen::date_time_ymd(2000, 1, 1);
    params.not_after = end;
    params.subject_alt_names = vec![subject];
    params.extended_key_usages = vec![usage];
    let key = KeyPair::generate().unwrap();
    let signed = params.signed_by(&key, &issuer).unwrap();
    let secret = scratch.write(&format!("certs/{name}-key.pem"), &key.serialize_pem());
    mode(&secret, 0o600);
    let path = scratch.write(&format!("certs/{name}.pem"), &signed.pem());
    mode(&path, 0o644);
    path
}

/// Changes the permissions of a file.
pub(crate) fn mode(path: &Path, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}
