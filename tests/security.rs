//! Access to a coordinator with TLS: the peers that are admitted or refused, the reasons given, and
//! that no secret is revealed.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[path = "support/secure.rs"]
mod secure;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use osteon_proto::v1::FILE_DESCRIPTOR_SET;
use osteon_transport::connection::{Connection, connect_with};
use osteon_transport::credentials::{CredentialFiles, Credentials};
use osteon_transport::endpoint::Endpoint;
use prost::Message as _;
use prost_types::FileDescriptorSet;
use secure::{Made, ROLES, Secure, certificate, mode, serve, set_up};
use support::{Owned, Scratch, eventually, job, osteon, run, text};
use time::OffsetDateTime;
use tonic::client::Grpc;
use tonic::{Code, Request, Status};
use tonic_prost::ProstCodec;

/// Time that a connection may take.
const TIMEOUT: Duration = Duration::from_secs(30);

#[test]
fn a_job_over_tls_ends_with_the_bits_of_an_embedded_run_and_tells_no_secret() {
    let secure = Secure::start();
    let scratch = &secure.scratch;
    let file = scratch.write("job.toml", &job(60, 8));
    let workers =
        [secure.worker("worker", "worker-1.log"), secure.worker("worker", "worker-2.log")];
    let mut remote = osteon();
    remote.args(["identify", text(&file), "--json"]).args(secure.options("submit"));
    remote.env("RUST_LOG", "trace");
    let output = remote.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stdout = String::from_utf8(output.stdout).unwrap();
    let embedded = run(&["identify", text(&file), "--json"]);
    assert_eq!(stdout, embedded.succeeded());
    assert!(secure.client("read", &["jobs"]).succeeded().contains("max_evaluations"));

    // The coordinator recorded the submitter.
    let log = secure.read("coordinator.log");
    assert!(log.contains("submit-holder"), "nobody is noted");
    assert!(log.contains("TRACE"), "the log is not at its finest level");
    // All logs, at the finest level, and the process data that other users can see.
    let mut told = vec![log, secure.read("worker-1.log"), secure.read("worker-2.log"), stdout];
    told.push(String::from_utf8_lossy(&output.stderr).into_owned());
    for process in workers.iter().chain([&secure.process]) {
        for name in ["cmdline", "environ"] {
            let bytes = fs::read(format!("/proc/{}/{name}", process.id())).unwrap();
            told.push(String::from_utf8_lossy(&bytes).into_owned());
        }
    }
    let secrets = secrets(scratch);
    assert!(secrets.len() >= 3 + 3 + 4 * 3, "{} secrets", secrets.len());
    for text in &told {
        assert!(!text.is_empty());
        for secret in &secrets {
            assert!(!text.contains(secret), "a secret is told");
        }
    }
}

/// Returns every token and every hash, without their common parts, and every line of every key.
fn secrets(scratch: &Scratch) -> Vec<String> {
    let mut secrets = Vec::new();
    for role in ROLES {
        let token = fs::read_to_string(scratch.path(&format!("{role}.token"))).unwrap();
        secrets.push(token.trim().strip_prefix("osteon_").unwrap().to_owned());
    }
    for line in fs::read_to_string(scratch.path("tokens")).unwrap().lines() {
        secrets.push(line.split_once("blake3:").unwrap().1.to_owned());
    }
    for name in ["ca", "server", "worker", "client"] {
        let key = fs::read_to_string(scratch.path(&format!("certs/{name}-key.pem"))).unwrap();
        let lines = key.lines().filter(|line| !line.starts_with("-----"));
        secrets.extend(lines.map(str::to_owned));
    }
    secrets
}

/// The roles that may call each method of the services, and whether a certificate is sufficient.
/// Methods that are not listed here, including new ones, may be called by admins only.
const CALLERS: [(&str, &[&str], bool); 14] = [
    ("/grpc.health.v1.Health/", &["none", "stranger", "read", "submit", "admin"], true),
    ("/grpc.reflection.v1.ServerReflection/", &["read", "submit", "admin"], true),
    ("/grpc.reflection.v1alpha.ServerReflection/", &["read", "submit", "admin"], true),
    ("/osteon.v1.Jobs/Get", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/Explain", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/List", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/ListBans", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/ListWorkers", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/Watch", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/Fetch", &["read", "submit", "admin"], false),
    ("/osteon.v1.Jobs/Submit", &["submit", "admin"], false),
    ("/osteon.v1.Jobs/Cancel", &["submit", "admin"], false),
    ("/osteon.v1.Jobs/Recheck", &["submit", "admin"], false),
    ("/osteon.v1.Workers/Attach", &[], true),
];

/// Returns every method of the coordinator's services, including reflection and health, with the
/// roles that may call it, and whether a certificate is sufficient.
fn methods() -> Vec<(String, &'static [&'static str], bool)> {
    let described = [
        FILE_DESCRIPTOR_SET,
        tonic_health::pb::FILE_DESCRIPTOR_SET,
        tonic_reflection::pb::v1::FILE_DESCRIPTOR_SET,
        tonic_reflection::pb::v1alpha::FILE_DESCRIPTOR_SET,
    ];
    let mut methods = Vec::new();
    for set in described {
        for file in FileDescriptorSet::decode(set).unwrap().file {
            for service in &file.service {
                for method in &service.method {
                    let service = format!("/{}.{}/", file.package(), service.name());
                    let path = format!("{service}{}", method.name());
                    let known = CALLERS.iter().find(|(of, ..)| *of == path || *of == service);
                    let (roles, enough): (&[&str], bool) =
                        known.map_or((&["admin"], false), |(_, roles, enough)| (roles, *enough));
                    methods.push((path, roles, enough));
                }
            }
        }
    }
    // Prune, LiftBan, DrainWorker and Backup are for admins; all others are listed.
    assert!(methods.len() >= CALLERS.len() + 3, "{methods:?}");
    methods
}

/// Returns a connection with a token and a certificate, each by name, if given.
async fn connection(secure: &Secure, token: Option<&str>, certificate: Option<&str>) -> Connection {
    let file = |name: String| Some(secure.scratch.path(&name));
    let files = CredentialFiles {
        ca: file("certs/ca.pem".to_owned()),
        certificate: certificate.and_then(|name| file(format!("certs/{name}.pem"))),
        key: certificate.and_then(|name| file(format!("certs/{name}-key.pem"))),
        token: token.and_then(|name| file(format!("{name}.token"))),
    };
    let endpoint: Endpoint = secure.url.parse().unwrap();
    let credentials = Credentials::load(&files, &endpoint).unwrap();
    connect_with(&endpoint, &credentials, TIMEOUT).await.unwrap()
}

/// Calls a method with an empty message; returns the status of its answer.
async fn call(connection: &Connection, path: &str, header: Option<&str>) -> Status {
    let mut grpc = Grpc::new(connection.clone());
    grpc.ready().await.unwrap();
    let mut request = Request::new(());
    if let Some(header) = header {
        request.metadata_mut().insert("authorization", header.parse().unwrap());
    }
    let path = path.parse().unwrap();
    let codec = ProstCodec::<(), ()>::default();
    let answer = tokio::time::timeout(TIMEOUT, async {
        let mut stream = grpc.server_streaming(request, path, codec).await?.into_inner();
        // Some streams do not end.
        stream.message().await?;
        Ok::<_, Status>(())
    });
    answer.await.unwrap().err().unwrap_or_else(|| Status::ok(""))
}

fn is_let_in(status: &Status) -> bool {
    !matches!(status.code(), Code::Unauthenticated | Code::PermissionDenied)
}

#[tokio::test(flavor = "multi_thread")]
async fn every_method_lets_in_whom_it_should_and_tells_the_others_why() {
    let secure = Secure::start();
    // A token that is not in the list.
    let out = secure.scratch.path("stranger.token");
    run(&["token", "stranger", "--role", "admin", "--out", text(&out)]).succeeded();
    for token in ["none", "stranger", "read", "submit", "admin"] {
        let given = (token != "none").then_some(token);
        let connection = connection(&secure, given, None).await;
        for (path, allowed, _) in methods() {
            let status = call(&connection, &path, None).await;
            let context = format!("{path} with {token}: {status}");
            assert_eq!(is_let_in(&status), allowed.contains(&token), "{context}");
            if is_let_in(&status) {
                continue;
            }
            let worker = path.ends_with("/Attach");
            let (code, message) = match token {
                _ if worker => (Code::Unauthenticated, "give --tls-cert and --tls-key"),
                "none" => (Code::Unauthenticated, "give --token-file"),
                "stranger" => (Code::Unauthenticated, "does not accept the token"),
                _ if allowed.contains(&"submit") => (
                    Code::PermissionDenied,
                    "`read-holder` has role read, and this needs role submit",
                ),
                _ => (Code::PermissionDenied, "and this needs role admin"),
            };
            assert_eq!(status.code(), code, "{context}");
            assert!(status.message().contains(message), "{context}");
        }
    }
    let bare = connection(&secure, None, None).await;
    for header in ["Basic YTpi", "Bearer", "Bearer secret"] {
        let status = call(&bare, "/osteon.v1.Jobs/List", Some(header)).await;
        assert_eq!(status.code(), Code::Unauthenticated, "{header}: {status}");
        assert!(status.message().contains("must be `Bearer`"), "{header}: {status}");
    }
    // None of the calls has started anything.
    assert_eq!(secure.client("read", &["jobs", "--json"]).json(), serde_json::json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_certificate_opens_the_service_of_workers_and_no_other() {
    let secure = Secure::start();
    for (certificate, works) in [("worker", true), ("client", false)] {
        let connection = connection(&secure, None, Some(certificate)).await;
        for (path, _, enough) in methods() {
            let status = call(&connection, &path, None).await;
            let expected = enough && (works || !path.ends_with("/Attach"));
            assert_eq!(is_let_in(&status), expected, "{path} with {certificate}: {status}");
        }
    }
}

#[test]
fn a_worker_without_a_workers_certificate_is_told_why_and_ends() {
    let secure = Secure::start();
    let scratch = &secure.scratch;
    run(&["certs", text(&scratch.path("foreign"))]).succeeded();
    for name in ["worker", "worker-key"] {
        let from = scratch.path(&format!("foreign/{name}.pem"));
        fs::copy(from, scratch.path(&format!("certs/foreign-{name}.pem"))).unwrap();
    }
    for (name, key, expected) in [
        (None, None, "give --tls-cert and --tls-key"),
        (Some("client"), Some("client-key"), "lacks the name `urn:osteon:worker`"),
        (Some("server"), Some("server-key"), "not for clients or workers"),
        (
            Some("foreign-worker"),
            Some("foreign-worker-key"),
            "not signed by the coordinator's certificate authority (its --tls-ca)",
        ),
    ] {
        let mut command = osteon();
        command.args(["worker", "--coordinator", &secure.url]);
        command.arg("--tls-ca").arg(scratch.path("certs/ca.pem"));
        for (option, file) in [("--tls-cert", name), ("--tls-key", key)] {
            if let Some(file) = file {
                command.arg(option).arg(scratch.path(&format!("certs/{file}.pem")));
            }
        }
        let log = scratch.path("refused.log");
        let mut worker = Owned::spawn_logging(&mut command, &log);
        assert_eq!(worker.code(), Some(1), "{name:?}");
        let told = fs::read_to_string(&log).unwrap();
        assert!(told.contains(expected) && told.contains(&secure.url), "{name:?}: {told}");
    }
    // A certificate of another authority is reported with any token, too.
    let mut options = secure.options("admin");
    options.extend(["--tls-cert", "--tls-key"].into_iter().zip(["", "-key"]).flat_map(
        |(option, suffix)| {
            let file = scratch.path(&format!("certs/foreign-worker{suffix}.pem"));
            [option.to_owned(), text(&file).to_owned()]
        },
    ));
    let client = run(&[vec!["jobs".to_owned()], options].concat());
    assert_eq!(client.code, Some(1), "{client:?}");
    assert!(client.stderr.contains("is not signed by"), "{client:?}");
}

/// Returns the messages of a client and a worker that trust the authority `ca` and connect to
/// `url`.
fn distrust(scratch: &Scratch, url: &str, ca: &str) -> [String; 2] {
    let (ca, token) = (scratch.path(ca), scratch.path("admin.token"));
    ["jobs", "worker"].map(|command| {
        let options = ["--tls-ca", text(&ca), "--token-file", text(&token), "--coordinator", url];
        let finished = run(&[&[command], &options[..]].concat());
        assert_eq!(finished.code, Some(1), "{finished:?}");
        assert!(finished.stderr.contains(url), "{finished:?}");
        finished.stderr
    })
}

#[test]
fn a_coordinator_that_cannot_be_trusted_is_named_with_the_reason() {
    let secure = Secure::start();
    run(&["certs", text(&secure.scratch.path("foreign"))]).succeeded();
    for told in distrust(&secure.scratch, &secure.url, "foreign/ca.pem") {
        assert!(told.contains("not signed by the authority in --tls-ca"), "{told}");
    }
    let scratch = Scratch::new();
    set_up(&scratch);
    let later = OffsetDateTime::now_utc() + time::Duration::days(1);
    certificate(&scratch, "elsewhere", Made::Server("elsewhere.example"), later);
    let (_process, url) = serve(&scratch, "elsewhere");
    for told in distrust(&scratch, &url, "certs/ca.pem") {
        assert!(told.contains("not for this host name"), "{told}");
        assert!(told.contains("elsewhere.example"), "{told}");
    }
}

#[test]
fn an_expired_certificate_is_told_to_whoever_meets_it() {
    let secure = Secure::start();
    let scratch = &secure.scratch;
    // The owner of an expired certificate is informed before anything is sent.
    certificate(scratch, "old", Made::Worker, rcgen::date_time_ymd(2001, 1, 1));
    let mut worker = secure.worker("old", "old.log");
    assert_eq!(worker.code(), Some(2));
    assert!(secure.read("old.log").contains("old.pem has expired"), "{}", secure.read("old.log"));
    // So is a client of a coordinator whose certificate expires while it runs.
    let scratch = &Scratch::new();
    set_up(scratch);
    let soon = OffsetDateTime::now_utc() + time::Duration::seconds(15);
    certificate(scratch, "brief", Made::Server("127.0.0.1"), soon);
    let (_process, url) = serve(scratch, "brief");
    let token = scratch.path("read.token");
    let ca = scratch.path("certs/ca.pem");
    let options = ["--tls-ca", text(&ca), "--token-file", text(&token), "--coordinator", &url];
    let jobs = [&["jobs"], &options[..]].concat();
    run(&jobs).succeeded();
    eventually("the certificate has expired", || run(&jobs).code == Some(1));
    for told in distrust(scratch, &url, "certs/ca.pem") {
        assert!(told.contains("its certificate has expired"), "{told}");
    }
}

#[test]
fn tls_and_plain_http_meet_with_an_explanation() {
    let secure = Secure::start();
    let plain = secure.url.replace("https://", "http://");
    let token = secure.scratch.path("read.token");
    let hint = format!("if the coordinator uses TLS, write {}", secure.url);
    for options in [&[] as &[&str], &["--token-file", text(&token)]] {
        let finished = run(&[&["jobs", "--coordinator", &plain], options].concat());
        assert_eq!(finished.code, Some(1), "{finished:?}");
        assert!(finished.stderr.contains(&plain), "{finished:?}");
        assert!(finished.stderr.contains(&hint), "{finished:?}");
    }
    let worker = run(&["worker", "--coordinator", &plain, "--give-up-after", "0.5"]);
    assert_eq!(worker.code, Some(1), "{worker:?}");
    assert!(worker.stderr.contains(&hint), "{worker:?}");

    let open = support::Coordinator::start(&secure.scratch.path("open"));
    let tls = open.url.replace("http://", "https://");
    let ca = secure.scratch.path("certs/ca.pem");
    let finished = run(&["jobs", "--coordinator", &tls, "--tls-ca", text(&ca)]);
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.contains(&tls), "{finished:?}");
    assert!(finished.stderr.contains("does not use TLS"), "{finished:?}");
}

#[test]
fn garbage_on_the_port_does_no_harm() {
    let mut secure = Secure::start();
    let address = secure.url.strip_prefix("https://").unwrap().to_owned();
    // The beginning of a ClientHello that announces more bytes than are sent.
    let hello = [0x16, 3, 1, 2, 0, 1, 0, 1, 0xfc, 3, 3, 0, 0, 0];
    let noise: Vec<u8> =
        (0..100_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let garbage: [&[u8]; 6] = [
        b"GET / HTTP/1.1\r\nHost: a\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0",
        &hello,
        &[0; 4096],
        &noise,
        b"",
    ];
    // These connections stay open, silent or in the middle of a handshake, while others are served.
    let mut open = Vec::new();
    for bytes in garbage {
        for _ in 0..20 {
            let mut stream = TcpStream::connect(&address).unwrap();
            // The coordinator may have closed before everything was sent.
            let _sent = stream.write_all(bytes);
            open.push(stream);
        }
    }
    secure.client("read", &["jobs"]).succeeded();
    // Bytes that are not TLS are rejected at once with a TLS alert.
    open[0].set_read_timeout(Some(TIMEOUT)).unwrap();
    let mut answer = Vec::new();
    let _reset = open[0].read_to_end(&mut answer);
    assert!(answer.is_empty() || answer[0] == 0x15, "{answer:?}");
    secure.client("read", &["jobs"]).succeeded();
    drop(open);
    secure.process.signal("TERM");
    assert_eq!(secure.process.code(), Some(0));
}

#[test]
fn silent_handshakes_end_and_make_room() {
    let secure = Secure::start();
    let address = secure.url.strip_prefix("https://").unwrap().to_owned();
    // Occupies all handshakes, so that the next client waits until they time out.
    let silent: Vec<_> = (0..osteon_common::limits::HANDSHAKES_MAX)
        .map(|_| TcpStream::connect(&address).unwrap())
        .collect();
    let mut closed = silent.first().unwrap().try_clone().unwrap();
    closed.set_read_timeout(Some(TIMEOUT)).unwrap();
    assert_eq!(closed.read(&mut [0]).unwrap(), 0, "the coordinator said something");
    eventually("others are served", || secure.client("read", &["jobs"]).code == Some(0));
    drop(silent);
}

#[test]
fn tokens_count_on_a_listener_without_tls_too() {
    let scratch = Scratch::new();
    set_up(&scratch);
    let socket = scratch.path("socket");
    let url = format!("unix:{}", socket.display());
    let mut command = osteon();
    command.args(["coordinator", "--listen", &url, "--store"]).arg(scratch.path("store"));
    command.arg("--tokens").arg(scratch.path("tokens"));
    let mut process = Owned::spawn_logging(&mut command, &scratch.path("log"));
    assert_eq!(process.line(), url);
    let with = |words: &[&str], token: Option<&str>| {
        let mut command = osteon();
        command.args(words).args(["--coordinator", &url]);
        if let Some(token) = token {
            command.arg("--token-file").arg(scratch.path(&format!("{token}.token")));
        }
        command
    };
    let code = |words: &[&str], token| with(words, token).output().unwrap().status.code();
    assert_eq!(code(&["jobs"], None), Some(1));
    assert_eq!(code(&["jobs"], Some("read")), Some(0));
    assert_eq!(code(&["worker"], Some("submit")), Some(1));
    let file = scratch.write("job.toml", &job(20, 1));
    let identify = ["identify", text(&file)];
    assert_eq!(code(&identify, Some("read")), Some(1));
    let _worker = Owned::spawn(&mut with(&["worker", "--threads", "1"], Some("admin")));
    assert_eq!(code(&identify, Some("submit")), Some(0));
}

#[test]
fn an_open_secret_is_refused_before_anything_is_sent() {
    let secure = Secure::start();
    let token = secure.scratch.path("read.token");
    mode(&token, 0o644);
    let refused = secure.client("read", &["jobs"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("read.token is open to other users"), "{refused:?}");
    mode(&token, 0o600);
    secure.client("read", &["jobs"]).succeeded();
}
