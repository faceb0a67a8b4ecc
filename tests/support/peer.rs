//! A worker controlled by the test: it computes like real ones, and the test decides what it
//! answers.

use std::time::Duration;

use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::realization::Ensemble;
use osteon_common::version;
use osteon_proto::announced::Received;
use osteon_proto::batch::{self, Work};
use osteon_proto::v1::attach_request::Message as Request;
use osteon_proto::v1::attach_response::Message as Response;
use osteon_proto::v1::{AttachRequest, AttachResponse, Heartbeat, WorkerHello};
use osteon_solver::{Solver, Workspace};
use osteon_transport::connection::{connect, workers_client};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, Streaming};

use crate::support::DEADLINE;

/// One attachment of such a worker. It sends heartbeats only while it waits for a batch.
pub(crate) struct Peer {
    outbound: mpsc::Sender<AttachRequest>,
    stream: Streaming<AttachResponse>,
    evaluations: Received,
}

/// Returns the hello of a worker of this version.
pub(crate) fn hello(process: u32) -> WorkerHello {
    WorkerHello {
        version: version::VERSION.to_owned(),
        fingerprint: version::fingerprint(),
        slots: 1,
        host: "peer".to_owned(),
        process,
        instance: process.into(),
    }
}

impl Peer {
    /// Attaches; the error is the coordinator's refusal.
    pub(crate) async fn attach(url: &str, hello: WorkerHello) -> Result<Self, Status> {
        let endpoint = url.parse().unwrap();
        let channel = connect(&endpoint, Duration::from_secs(10)).await;
        let channel = channel.map_err(|error| Status::unavailable(error.to_string()))?;
        let (outbound, messages) = mpsc::channel(64);
        outbound.send(AttachRequest { message: Some(Request::Hello(hello)) }).await.unwrap();
        let attached = workers_client(channel).attach(ReceiverStream::new(messages)).await?;
        let stream = attached.into_inner();
        let mut peer = Self { outbound, stream, evaluations: Received::default() };
        match peer.message().await? {
            Response::Welcome(_) => Ok(peer),
            other => panic!("{other:?} instead of a welcome"),
        }
    }

    /// Returns the next message, within the deadline; the error is the end of the attachment.
    pub(crate) async fn message(&mut self) -> Result<Response, Status> {
        let message = tokio::time::timeout(DEADLINE, self.stream.message()).await.unwrap()?;
        message
            .and_then(|message| message.message)
            .ok_or_else(|| Status::cancelled("the stream ended"))
    }

    /// Returns the next batch.
    pub(crate) async fn batch(&mut self) -> Result<(u64, Work), Status> {
        loop {
            match self.message().await? {
                Response::Evaluation(message) => self.evaluations.receive(&message).unwrap(),
                Response::Batch(message) => {
                    let work = batch::from_message(&message, &self.evaluations).unwrap();
                    return Ok((message.batch, work));
                }
                _ => self.send(Request::Heartbeat(Heartbeat {})).await,
            }
        }
    }

    /// Answers a batch.
    pub(crate) async fn answer(&self, batch: u64, solved: &[RealizationResult]) {
        let elapsed_s = 1e-3 * solved.len() as f64;
        self.send(Request::Result(batch::answer_to_message(batch, solved, elapsed_s))).await;
    }

    async fn send(&self, message: Request) {
        // The stream may have ended; reading it shows that.
        let _ = self.outbound.send(AttachRequest { message: Some(message) }).await;
    }
}

/// Computes all realizations of a batch, as every worker does.
pub(crate) fn solve(work: &Work) -> Vec<RealizationResult> {
    let solver = Solver::new(&work.evaluation.setup);
    let mut workspace = Workspace::default();
    let indices = work.first..work.first + u64::from(work.count);
    let Ok(ensemble) = Ensemble::drawn(&work.evaluation.point, work.evaluation.germs) else {
        return indices.map(|_| RealizationResult::failed(FailureKind::NotFinite)).collect();
    };
    let realization = |index| {
        let Ok(bone) = ensemble.bone(index) else {
            return RealizationResult::failed(FailureKind::NotFinite);
        };
        match solver.arrival(&bone, &mut workspace) {
            Ok(arrival) => RealizationResult::solved(arrival.velocity, arrival.estimated_error),
            Err(failure) => RealizationResult::failed(failure.kind),
        }
    };
    indices.map(realization).collect()
}

/// Same as [`solve`], with the last bit of the first velocity changed.
pub(crate) fn lie(work: &Work) -> Vec<RealizationResult> {
    let mut solved = solve(work);
    if let Some(velocity) = solved.iter_mut().find_map(|solved| solved.outcome.as_mut().ok()) {
        *velocity = velocity.next_up();
    }
    solved
}
