//! A proxy between workers and a coordinator that changes the velocities of their answers, as a broken machine
//! would.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use osteon_proto::v1::workers_server::{Workers, WorkersServer};
use osteon_proto::v1::{
    AttachRequest, AttachResponse, BatchResult, attach_request, attach_response,
};
use osteon_transport::connection::{connect, workers_client};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use tokio_stream::wrappers::{ReceiverStream, TcpListenerStream};
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::Server;
use tonic::{Request, Response, Status, Streaming};

/// Messages on their way in one direction.
const WAITING_MAX: usize = 1024;

/// Which velocities of a broken machine are wrong, by a ten-millionth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fault {
    /// All after so many realizations of each attachment.
    After(usize),
    /// That of each index that this number divides.
    Every(u64),
}

/// A running proxy; dropping it ends it.
pub(crate) struct AlteringProxy {
    address: SocketAddr,
    _end: oneshot::Sender<()>,
}

impl AlteringProxy {
    /// Starts it before the coordinator at `url`.
    pub(crate) fn start(url: &str, fault: Fault) -> Self {
        let (address_sender, address) = std::sync::mpsc::channel();
        let (end, ended) = oneshot::channel();
        let service = Altering { url: url.to_owned(), fault };
        thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_multi_thread()
                .worker_threads(1)
                .enable_all()
                .build()
                .unwrap();
            runtime.block_on(async {
                let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
                address_sender.send(listener.local_addr().unwrap()).unwrap();
                let incoming = TcpListenerStream::new(listener);
                let router = Server::builder().add_service(WorkersServer::new(service));
                tokio::select! {
                    served = router.serve_with_incoming(incoming) => served.unwrap(),
                    _ = ended => {}
                }
            });
        });
        Self { address: address.recv().unwrap(), _end: end }
    }

    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }
}

struct Altering {
    url: String,
    fault: Fault,
}

/// First indices of the batches of an attachment, by number.
type FirstIndices = Arc<Mutex<BTreeMap<u64, u64>>>;

#[tonic::async_trait]
impl Workers for Altering {
    type AttachStream = Pin<Box<dyn Stream<Item = Result<AttachResponse, Status>> + Send>>;

    async fn attach(
        &self,
        request: Request<Streaming<AttachRequest>>,
    ) -> Result<Response<Self::AttachStream>, Status> {
        let channel = connect(&self.url.parse().unwrap(), Duration::from_secs(10)).await;
        let channel = channel.map_err(|error| Status::unavailable(error.to_string()))?;
        let (sender, messages) = mpsc::channel(WAITING_MAX);
        let (mut from_worker, fault, mut answered) = (request.into_inner(), self.fault, 0);
        let firsts = FirstIndices::default();
        let known = firsts.clone();
        tokio::spawn(async move {
            while let Some(Ok(mut message)) = from_worker.next().await {
                if let Some(attach_request::Message::Result(result)) = &mut message.message {
                    let first = known.lock().unwrap()[&result.batch];
                    alter(result, first, answered, fault);
                    answered += result.velocities.len();
                }
                if sender.send(message).await.is_err() {
                    return;
                }
            }
        });
        let answers = workers_client(channel).attach(ReceiverStream::new(messages)).await?;
        let passed = answers.into_inner().map(move |message| {
            if let Ok(AttachResponse { message: Some(attach_response::Message::Batch(batch)) }) =
                &message
            {
                firsts.lock().unwrap().insert(batch.batch, batch.first);
            }
            message
        });
        Ok(Response::new(Box::pin(passed)))
    }
}

/// Changes the wrong velocities of an answer that begins at index `first`, after `answered` others.
fn alter(result: &mut BatchResult, first: u64, answered: usize, fault: Fault) {
    for (place, velocity) in result.velocities.iter_mut().enumerate() {
        let is_wrong = match fault {
            Fault::After(right) => answered + place >= right,
            Fault::Every(divisor) => (first + place as u64).is_multiple_of(divisor),
        };
        if is_wrong {
            *velocity *= 1.0 + 1e-7;
        }
    }
}
