//! A TCP proxy that simulates network faults: it delays, cuts, half-closes, and goes silent in one
//! direction.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// Interval at which a connection's faults are polled.
const POLL: Duration = Duration::from_millis(5);

/// Direction of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// From the client or worker to the coordinator.
    Up,
    /// From the coordinator to the client or worker.
    Down,
}

/// A proxy; its connections end with it.
pub(crate) struct Proxy {
    address: SocketAddr,
    shared: Arc<Shared>,
}

struct Shared {
    coordinator: SocketAddr,
    /// Delay before each piece is forwarded, ms.
    delay_ms: AtomicU64,
    over: AtomicBool,
    links: Mutex<Vec<Arc<Link>>>,
    rewritten: Mutex<Option<(Vec<u8>, Vec<u8>)>>,
}

/// One connection: its client side, and its coordinator side.
struct Link {
    client: TcpStream,
    server: TcpStream,
    stalled: [AtomicBool; 2],
    over: AtomicBool,
}

impl Proxy {
    /// Starts a proxy in front of the coordinator at `url`.
    pub(crate) fn start(url: &str) -> Self {
        let coordinator = url.trim_start_matches("http://").parse().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let shared = Arc::new(Shared {
            coordinator,
            delay_ms: AtomicU64::new(0),
            over: AtomicBool::new(false),
            links: Mutex::default(),
            rewritten: Mutex::default(),
        });
        let accepting = Arc::clone(&shared);
        thread::spawn(move || accept(&listener, &accepting));
        Self { address, shared }
    }

    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Delays every piece by this time.
    pub(crate) fn delay(&self, delay: Duration) {
        let delay = u64::try_from(delay.as_millis()).unwrap();
        self.shared.delay_ms.store(delay, Ordering::Relaxed);
    }

    /// Replaces bytes by the same number of others on the way to the coordinator.
    pub(crate) fn rewrite(&self, from: &[u8], to: &[u8]) {
        assert_eq!(from.len(), to.len());
        *self.shared.rewritten.lock().unwrap() = Some((from.to_vec(), to.to_vec()));
    }

    /// Cuts all open connections; returns their number.
    pub(crate) fn cut(&self) -> usize {
        let links = std::mem::take(&mut *self.shared.links.lock().unwrap());
        links.iter().filter(|link| link.end()).count()
    }

    /// Closes one direction, so that its receiver sees the end of the stream; the other direction
    /// stays open.
    pub(crate) fn half_close(&self, way: Way) {
        for link in self.shared.links.lock().unwrap().iter() {
            let receiver = match way {
                Way::Up => &link.server,
                Way::Down => &link.client,
            };
            // It may already be closed.
            let _ = receiver.shutdown(Shutdown::Write);
        }
    }

    /// Stops forwarding in one direction, on the open connections.
    pub(crate) fn stall(&self, way: Way) {
        for link in self.shared.links.lock().unwrap().iter() {
            link.stalled[way as usize].store(true, Ordering::Relaxed);
        }
    }

    /// Forwards the bytes that were held back.
    pub(crate) fn release(&self, way: Way) {
        for link in self.shared.links.lock().unwrap().iter() {
            link.stalled[way as usize].store(false, Ordering::Relaxed);
        }
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        self.cut();
    }
}

impl Link {
    /// Ends both directions; returns whether the link was still open.
    fn end(&self) -> bool {
        self.over.store(true, Ordering::Relaxed);
        let open = self.client.shutdown(Shutdown::Both).is_ok();
        self.server.shutdown(Shutdown::Both).is_ok() && open
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    while !shared.over.load(Ordering::Relaxed) {
        let Ok((client, _)) = listener.accept() else {
            thread::sleep(POLL);
            continue;
        };
        // Without a coordinator the client's connection is closed.
        let Ok(server) = TcpStream::connect(shared.coordinator) else { continue };
        for stream in [&client, &server] {
            stream.set_nonblocking(false).unwrap();
            stream.set_nodelay(true).unwrap();
            stream.set_read_timeout(Some(POLL)).unwrap();
        }
        let over = AtomicBool::new(false);
        let link = Arc::new(Link { client, server, stalled: Default::default(), over });
        shared.links.lock().unwrap().push(Arc::clone(&link));
        for way in [Way::Up, Way::Down] {
            let (shared, link) = (Arc::clone(shared), Arc::clone(&link));
            thread::spawn(move || pump(&shared, &link, way));
        }
    }
}

/// Forwards bytes in one direction until the connection ends.
fn pump(shared: &Shared, link: &Link, way: Way) {
    let (mut from, mut to) = match way {
        Way::Up => (&link.client, &link.server),
        Way::Down => (&link.server, &link.client),
    };
    let mut buffer = vec![0; 64 << 10];
    while !shared.over.load(Ordering::Relaxed) && !link.over.load(Ordering::Relaxed) {
        if link.stalled[way as usize].load(Ordering::Relaxed) {
            thread::sleep(POLL);
            continue;
        }
        let length = match from.read(&mut buffer) {
            Ok(0) => break,
            Ok(length) => length,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                continue;
            }
            Err(_) => break,
        };
        thread::sleep(Duration::from_millis(shared.delay_ms.load(Ordering::Relaxed)));
        let piece = &mut buffer[..length];
        if way == Way::Up {
            rewrite(shared, piece);
        }
        if to.write_all(piece).is_err() {
            break;
        }
    }
    // Everything sent before the end has been forwarded; the other direction may continue.
    let _ = to.shutdown(Shutdown::Write);
}

fn rewrite(shared: &Shared, piece: &mut [u8]) {
    if let Some((from, to)) = &*shared.rewritten.lock().unwrap() {
        for start in 0..(piece.len() + 1).saturating_sub(from.len()) {
            if piece[start..].starts_with(from) {
                piece[start..start + to.len()].copy_from_slice(to);
            }
        }
    }
}
