//! A flood of control frames of HTTP/2 ends its own connection, and others are answered meanwhile: with TLS and without.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot go on should say where, and what it measured"
)]

#[cfg(test)]
#[path = "support/secure.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod secure;
#[cfg(test)]
#[path = "support/service.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod service;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::sync::Arc;
use std::time::Instant;

use osteon_proto::v1::ListRequest;
use osteon_transport::connection::{Connection, connect_with, jobs_client};
use osteon_transport::credentials::{ALPN, CredentialFiles, Credentials, roots};
use osteon_transport::endpoint::Endpoint;
use secure::Secure;
use service::Service;
use support::{DEADLINE, Scratch};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt as _, sink};
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::timeout;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::ClientConfig;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::ServerName;

/// Frames that a server must answer or may ignore, whenever they come.
const FRAMES: [(&str, &[u8]); 4] = [
    ("SETTINGS", b"\0\0\0\x04\0\0\0\0\0"),
    ("PING", b"\0\0\x08\x06\0\0\0\0\0osteonic"),
    ("PRIORITY", b"\0\0\x05\x02\0\0\0\0\x03\0\0\0\0\x10"),
    ("of an unknown type", b"\0\0\0\xfa\0\0\0\0\0"),
];
/// Frames in one write.
const AT_ONCE: usize = 4096;
/// Calls beside the floods.
const CALLS: usize = 50;

/// Where a coordinator listens, and how to trust it.
#[derive(Clone)]
struct Place {
    address: String,
    tls: Option<TlsConnector>,
}

/// Sends frames until the connection ends; returns how many were sent.
async fn flood(stream: impl AsyncRead + AsyncWrite, frame: &[u8]) -> usize {
    let (mut reader, mut writer) = tokio::io::split(stream);
    let write = async {
        let begin = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
        let (frames, mut sent) = (frame.repeat(AT_ONCE), 0);
        let mut written = writer.write_all(begin).await;
        while written.is_ok() {
            sent += AT_ONCE;
            written = writer.write_all(&frames).await;
        }
        sent
    };
    // Answers are read, since a server need not read from whom takes none.
    let mut nowhere = sink();
    let read = tokio::io::copy(&mut reader, &mut nowhere);
    let (sent, _) = tokio::join!(write, read);
    sent
}

/// Floods one connection until it ends.
async fn flood_once(place: Place, name: &str, frame: &[u8]) -> usize {
    let stream = TcpStream::connect(&place.address).await.unwrap();
    let flooded = async {
        match place.tls {
            None => flood(stream, frame).await,
            Some(tls) => {
                let host = ServerName::try_from("127.0.0.1").unwrap();
                flood(tls.connect(host, stream).await.unwrap(), frame).await
            }
        }
    };
    timeout(DEADLINE, flooded).await.unwrap_or_else(|_| panic!("frames {name} without an end"))
}

/// Floods a coordinator with frames of every kind, from several connections, while an honest client calls.
async fn attack(place: Place, honest: Connection) {
    let mut floods = JoinSet::new();
    for (name, frame) in FRAMES.into_iter().cycle().take(2 * FRAMES.len()) {
        let place = place.clone();
        floods.spawn(async move { (name, flood_once(place, name, frame).await) });
    }
    let (mut client, mut longest) = (jobs_client(honest), None);
    for _ in 0..CALLS {
        let begun = Instant::now();
        let listed = timeout(DEADLINE, client.list(ListRequest::default())).await;
        listed.unwrap().unwrap();
        longest = longest.max(Some(begun.elapsed()));
    }
    for (name, sent) in floods.join_all().await {
        println!("{name}: ended after at most {sent} frames");
    }
    println!("longest call beside the floods: {longest:?}");
    // The connection of the honest client is still there.
    client.list(ListRequest::default()).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_control_frames_ends_its_connection() {
    let scratch = Scratch::new();
    let mut service = Service::start(&scratch, &[]);
    let endpoint: Endpoint = service.url().parse().unwrap();
    let honest = connect_with(&endpoint, &Credentials::default(), DEADLINE).await.unwrap();
    let address = service.url().strip_prefix("http://").unwrap().to_owned();
    attack(Place { address, tls: None }, honest).await;
    assert_eq!(service.log().matches("a connection is ended").count(), 1, "{}", service.log());
    service.end();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_inside_of_tls_ends_its_connection() {
    let secure = Secure::start();
    let ca = secure.scratch.path("certs/ca.pem");
    let token = secure.scratch.path("read.token");
    let files = CredentialFiles { ca: Some(ca.clone()), token: Some(token), ..Default::default() };
    let endpoint: Endpoint = secure.url.parse().unwrap();
    let credentials = Credentials::load(&files, &endpoint).unwrap();
    let honest = connect_with(&endpoint, &credentials, DEADLINE).await.unwrap();
    let address = secure.url.strip_prefix("https://").unwrap().to_owned();
    attack(Place { address, tls: Some(connector(&ca)) }, honest).await;
    assert!(secure.read("coordinator.log").contains("a connection is ended"));
}

/// Returns a connector that trusts an authority.
fn connector(ca: &std::path::Path) -> TlsConnector {
    let mut config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots(ca).unwrap())
        .with_no_client_auth();
    config.alpn_protocols = vec![ALPN.to_vec()];
    TlsConnector::from(Arc::new(config))
}
