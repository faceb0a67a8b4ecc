//! A proxy between workers and a coordinator that changes the velocities of their answers, as a broken machine
//! would.

use std::net::SocketAddr;
use std::thread;
use std::time::Duration;

use osteon_proto::endpoint::{connect, workers_client};
use osteon_proto::v1::attach_request::Message;
use osteon_proto::v1::workers_server::{Workers, WorkersServer};
use osteon_proto::v1::{AttachRequest, AttachResponse};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::{ReceiverStream, TcpListenerStream};
use tonic::transport::Server;
use tonic::{Request, Response, Status, Streaming};

/// Messages on their way in one direction.
const WAITING_MAX: usize = 1024;

/// A running proxy; dropping it ends it.
pub(crate) struct AlteringProxy {
    address: SocketAddr,
    _end: oneshot::Sender<()>,
}

impl AlteringProxy {
    /// Starts it before the coordinator at `url`. It leaves the first `right` realizations of each attachment as
    /// they are.
    pub(crate) fn start(url: &str, right: usize) -> Self {
        let (address_sender, address) = std::sync::mpsc::channel();
        let (end, ended) = oneshot::channel();
        let service = Altering { url: url.to_owned(), right };
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
    right: usize,
}

#[tonic::async_trait]
impl Workers for Altering {
    type AttachStream = Streaming<AttachResponse>;

    async fn attach(
        &self,
        request: Request<Streaming<AttachRequest>>,
    ) -> Result<Response<Self::AttachStream>, Status> {
        let channel = connect(&self.url.parse().unwrap(), Duration::from_secs(10)).await;
        let channel = channel.map_err(|error| Status::unavailable(error.to_string()))?;
        let (sender, messages) = mpsc::channel(WAITING_MAX);
        let (mut from_worker, mut right) = (request.into_inner(), self.right);
        tokio::spawn(async move {
            while let Some(Ok(mut message)) = from_worker.next().await {
                alter(&mut message, &mut right);
                if sender.send(message).await.is_err() {
                    return;
                }
            }
        });
        workers_client(channel).attach(ReceiverStream::new(messages)).await
    }
}

/// Changes the velocities of an answer by a ten-millionth, but for the first `right` ones.
fn alter(message: &mut AttachRequest, right: &mut usize) {
    if let Some(Message::Result(result)) = &mut message.message {
        let kept = result.velocities.len().min(*right);
        *right -= kept;
        result.velocities[kept..].iter_mut().for_each(|velocity| *velocity *= 1.0 + 1e-7);
    }
}
