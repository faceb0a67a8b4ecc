use std::time::Instant;

use futures::StreamExt as _;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

use super::*;

async fn listener() -> (BoundSocket, std::net::SocketAddr) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    (BoundSocket::Tcp(listener), address)
}

/// The clock is paused, and jumps whenever all tasks wait.
#[tokio::test(start_paused = true)]
async fn a_connection_that_says_nothing_ends_and_one_that_spoke_may_be_silent() {
    let (bound, address) = listener().await;
    let mut connections = Box::pin(connections(bound, None, Places::new(10)));
    let mut client = TcpStream::connect(address).await.unwrap();
    let mut silent = connections.next().await.unwrap().unwrap();
    let started = Instant::now();
    let read = timeout(2 * HANDSHAKE_TIMEOUT, silent.read_u8()).await;
    let error = read.expect("the connection has no end").unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    assert!(started.elapsed() < HANDSHAKE_TIMEOUT, "the clock did not jump");

    client.write_all(b"ab").await.unwrap();
    let mut client = TcpStream::connect(address).await.unwrap();
    let mut spoken = connections.next().await.unwrap().unwrap();
    client.write_all(b"a").await.unwrap();
    assert_eq!(spoken.read_u8().await.unwrap(), b'a');
    let more = timeout(100 * HANDSHAKE_TIMEOUT, spoken.read_u8()).await;
    assert!(more.is_err(), "{more:?}");
}

#[tokio::test]
async fn there_are_no_more_connections_than_places() {
    let (bound, address) = listener().await;
    let places = Arc::new(Semaphore::new(1));
    let _first_client = TcpStream::connect(address).await.unwrap();
    let _second_client = TcpStream::connect(address).await.unwrap();
    let (io, place) = accept(&bound, &places).await.unwrap();
    let first = AcceptedConnection::new(Either::Right(io), None, Certificate::Absent, place);
    assert_eq!(places.available_permits(), 0);
    drop(first);
    // The permit is free again.
    let (_, place) = accept(&bound, &places).await.unwrap();
    drop(place);
}
