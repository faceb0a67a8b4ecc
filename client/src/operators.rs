//! Requests of operators: workers, what delays a job, health, and a copy of the store.

use std::sync::Arc;
use std::time::Duration;

use osteon_proto::malformed::Malformed;
use osteon_proto::v1::backup_response::Part;
use osteon_proto::v1::{
    self, BackupEnd, ExplainResponse, JobSnapshot, ListWorkersResponse, WorkerSnapshot,
};
use osteon_transport::connection::{self, ConnectError};
use osteon_transport::credentials::CredentialFiles;
use osteon_transport::patience::Patience;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

use crate::client::{Client, load_credentials};
use crate::error::ClientError;
use crate::listener::RunListener;
use crate::peer::Peer;
use crate::remote::{Remote, answer_limit};

impl Client {
    /// Returns the attached workers, and those that left last.
    pub async fn workers(&mut self) -> Result<ListWorkersResponse, ClientError> {
        let call = self.jobs.list_workers(v1::ListWorkersRequest {});
        self.peer.wait_for_answer(call).await
    }

    /// Returns what decides how fast a job is.
    pub async fn explain(&mut self, job: &str) -> Result<ExplainResponse, ClientError> {
        let call = self.jobs.explain(v1::ExplainRequest { job: job.to_owned() });
        self.peer.wait_for_answer(call).await
    }

    /// Lifts the ban of a host; returns the worker that had been found to compute wrongly.
    pub async fn unban(&mut self, host: &str) -> Result<v1::BannedWorker, ClientError> {
        let call = self.jobs.lift_ban(v1::LiftBanRequest { host: host.to_owned() });
        let worker = self.peer.wait_for_answer(call).await?.worker;
        self.present(worker, "worker")
    }

    /// Has an ended job computed again that a banned host contributed to; returns its state afterwards.
    pub async fn recheck(&mut self, job: &str) -> Result<JobSnapshot, ClientError> {
        let call = self.jobs.recheck(v1::RecheckRequest { job: job.to_owned() });
        let snapshot = self.peer.wait_for_answer(call).await?.snapshot;
        self.present(snapshot, "snapshot")
    }

    /// Drains a worker; returns its state afterwards.
    pub async fn drain(&mut self, worker: u64) -> Result<WorkerSnapshot, ClientError> {
        let call = self.jobs.drain_worker(v1::DrainWorkerRequest { worker });
        let worker = self.peer.wait_for_answer(call).await?.worker;
        self.present(worker, "worker")
    }

    /// Passes a copy of the store to `take`, part by part; returns the size and digest that the
    /// whole copy must have. The outer error is that of `take`.
    pub async fn backup<E>(
        &mut self,
        mut take: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<Result<BackupEnd, ClientError>, E> {
        let call = self.jobs.backup(v1::BackupRequest {});
        let mut stream = match self.peer.wait_for_answer(call).await {
            Ok(stream) => stream,
            Err(error) => return Ok(Err(error)),
        };
        loop {
            let mut patience = Patience::new(answer_limit());
            let Ok(message) = patience.wait_for(stream.message()).await else {
                return Ok(Err(self.peer.silent()));
            };
            let part = match message {
                Ok(message) => message.and_then(|message| message.part),
                Err(status) => return Ok(Err(self.peer.interpret_refusal(&status))),
            };
            match part {
                Some(Part::Data(data)) => take(&data)?,
                Some(Part::End(end)) => return Ok(Ok(end)),
                None => {
                    return Ok(Err(self.malformed_answer(Malformed::Missing { field: "part" })));
                }
            }
        }
    }
}

/// Asks a coordinator once whether it serves, and waits at most `limit`. This requires no token,
/// and none is sent.
pub async fn health(
    remote: &Remote,
    limit: Duration,
    listener: Arc<dyn RunListener>,
) -> Result<bool, ClientError> {
    let Remote { endpoint, files, unused, .. } = remote;
    let files = CredentialFiles { token: None, ..files.clone() };
    let mut patience = Patience::new(limit);
    let connected = async {
        let credentials = load_credentials(&files, endpoint).await?;
        let connected = connection::connect_with(endpoint, &credentials, limit);
        // The connection keeps the limit by itself. The time that it took is lost for the answer.
        let late =
            |_| ConnectError::Timeout { endpoint: endpoint.clone(), seconds: limit.as_secs_f64() };
        Ok(patience.wait_for(connected).await.map_err(late)??)
    };
    let connection =
        connected.await.map_err(|error: ClientError| error.with_unused_variables(unused))?;
    let mut client = HealthClient::new(connection);
    let call = client.check(HealthCheckRequest::default());
    let answer = Peer::new(remote, listener).wait_for_answer_within(&mut patience, call).await?;
    Ok(answer.status() == ServingStatus::Serving)
}
