//! A client of the jobs service: every wait is limited, and every error names the coordinator.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use osteon_common::job::JobSpecification;
use osteon_common::results::Status as JobStatus;
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::malformed::Malformed;
use osteon_proto::spans::{AttributeValue, OpenSpan, TRACEPARENT, TraceContext};
use osteon_proto::specification;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{self, JobSnapshot};
use osteon_transport::connection::{self, ConnectError, Connection};
use osteon_transport::credentials::{CredentialFiles, Credentials};
use osteon_transport::endpoint::Endpoint;
use osteon_transport::patience::Patience;
use tokio::task::spawn_blocking;
use tokio::time::sleep;

use crate::error::ANSWER_S_MAX;
use crate::listener::RunListener;
use crate::parts::FetchedParts;
use crate::peer::{Peer, with_wait_notice};
use crate::remote::{SILENCE_S_MAX, answer_limit};
use crate::request_id::RequestId;

pub use crate::error::ClientError;
pub use crate::fetched::Fetched;
pub use crate::remote::Remote;

/// Name of the span of a submission.
const SUBMIT: &str = "osteon.submit";
/// Pause between two attempts to reconnect to a coordinator, ms.
const RETRY_MS: u64 = 250;
/// Maximum number of attempts to fetch a result. The coordinator ends a fetch whose reader stands still, as
/// this process does when the machine is suspended.
const FETCHES_MAX: u32 = 3;
/// Maximum number of pages of a job list; each holds up to 1000 jobs.
const PAGES_MAX: usize = 10_000;

/// Properties of a submitted job besides its specification.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SubmitOptions {
    /// Priority among the user's own jobs.
    pub priority: u32,
    /// Name for display; may be empty.
    pub name: String,
}

/// A connection to a coordinator.
#[derive(Debug, Clone)]
pub struct Client {
    pub(crate) peer: Peer,
    pub(crate) jobs: JobsClient<Connection>,
}

impl Client {
    /// Reads the credentials and connects to the coordinator; waits if it is still starting.
    pub async fn connect(
        remote: &Remote,
        listener: Arc<dyn RunListener>,
    ) -> Result<Self, ClientError> {
        let Remote { endpoint, files, unused, .. } = remote;
        let found = async {
            let credentials = load_credentials(files, endpoint).await?;
            let left = ANSWER_S_MAX - SILENCE_S_MAX;
            let notice = || format!("cannot reach {endpoint}; trying for {left} more seconds");
            with_wait_notice(Self::find(endpoint, &credentials), &*listener, notice).await
        };
        let jobs = found.await.map_err(|error: ClientError| error.with_unused_variables(unused))?;
        Ok(Self { peer: Peer::new(remote, listener), jobs })
    }

    /// Returns the listener that receives the client's notes.
    #[must_use]
    pub fn listener(&self) -> &dyn RunListener {
        &*self.peer.listener
    }

    /// Retries until there is a connection or the time limit has passed.
    async fn find(
        endpoint: &Endpoint,
        credentials: &Credentials,
    ) -> Result<JobsClient<Connection>, ClientError> {
        let mut patience = Patience::new(answer_limit());
        loop {
            let left = patience.left();
            let attempt = connection::connect_with(endpoint, credentials, left);
            let error = match patience.wait_for(attempt).await {
                Ok(Ok(found)) => return Ok(connection::jobs_client(found)),
                Ok(Err(error)) => error,
                Err(_) => ConnectError::Timeout {
                    endpoint: endpoint.clone(),
                    seconds: answer_limit().as_secs_f64(),
                },
            };
            let again = matches!(error, ConnectError::Unreachable { .. });
            if !again || patience.left() <= retry_pause() {
                return Err(error.into());
            }
            patience.rest(retry_pause()).await;
        }
    }

    /// Submits a job and returns its id. If a failure leaves unknown whether the coordinator has
    /// the job, the same request is sent again, within the client's time limit for an answer.
    pub async fn submit(
        &mut self,
        specification: &JobSpecification,
        request: &RequestId,
        options: SubmitOptions,
    ) -> Result<String, ClientError> {
        let span = self.peer.listener.spans().and_then(|recorder| {
            Some((recorder, OpenSpan::begin(SUBMIT, None, SystemTime::now())?))
        });
        let context = span.as_ref().map(|(_, span)| span.context());
        let submitted = self.submit_within(context, specification, request, options).await;
        if let Some((recorder, mut span)) = span {
            if let Ok(job) = &submitted {
                span.set("job", AttributeValue::Text(job.clone()));
            }
            let error = submitted.as_ref().err().map(ToString::to_string);
            recorder.record(span.end(SystemTime::now(), error));
        }
        submitted
    }

    async fn submit_within(
        &mut self,
        span: Option<TraceContext>,
        specification: &JobSpecification,
        request: &RequestId,
        options: SubmitOptions,
    ) -> Result<String, ClientError> {
        let message = v1::SubmitRequest {
            specification: Some(specification::to_message(specification)),
            request_id: request.id.clone(),
            client: request.client.clone(),
            priority: options.priority,
            name: options.name,
        };
        let (mut patience, mut uncertain) = (Patience::new(answer_limit()), false);
        loop {
            let mut call = tonic::Request::new(message.clone());
            let context = span.and_then(|span| span.to_string().parse().ok());
            if let Some(context) = context {
                call.metadata_mut().insert(TRACEPARENT, context);
            }
            let call = self.jobs.submit(call);
            let error = match self.peer.wait_for_answer_within(&mut patience, call).await {
                Ok(response) => return Ok(response.job),
                Err(error) => error,
            };
            let lost = matches!(error, ClientError::Lost { .. });
            uncertain |= lost || matches!(error, ClientError::Unanswered { .. });
            if !uncertain {
                return Err(error);
            }
            if !lost || patience.left() <= retry_pause() {
                let (cause, request_id) = (Box::new(error), request.id.clone());
                return Err(ClientError::Uncertain { cause, request_id });
            }
            patience.rest(retry_pause()).await;
        }
    }

    /// Returns all jobs, oldest first.
    pub async fn list(&mut self) -> Result<Vec<JobSnapshot>, ClientError> {
        Ok(self.list_with_concerns().await?.0)
    }

    /// Returns all jobs, oldest first, and what the coordinator's operator should know.
    pub async fn list_with_concerns(
        &mut self,
    ) -> Result<(Vec<JobSnapshot>, Vec<String>), ClientError> {
        let (mut jobs, mut concerns) = (Vec::new(), Vec::new());
        let mut page_token = String::new();
        for _ in 0..PAGES_MAX {
            let call = self.jobs.list(v1::ListRequest { page_size: 0, page_token });
            let page = self.peer.wait_for_answer(call).await?;
            jobs.extend(page.jobs);
            concerns.extend(page.concerns);
            page_token = page.next_page_token;
            if page_token.is_empty() {
                break;
            }
        }
        Ok((jobs, concerns))
    }

    /// Returns the workers that are banned because they computed wrongly.
    pub async fn banned(&mut self) -> Result<Vec<v1::BannedWorker>, ClientError> {
        let call = self.jobs.list_bans(v1::ListBansRequest {});
        Ok(self.peer.wait_for_answer(call).await?.workers)
    }

    /// Deletes ended jobs; returns the ids of the deleted ones.
    pub async fn prune(
        &mut self,
        older_than: Option<Duration>,
        keep_last: Option<u64>,
    ) -> Result<Vec<String>, ClientError> {
        let keep_for_s = older_than.map(|age| age.as_secs_f64());
        let call = self.jobs.prune(v1::PruneRequest { keep_for_s, keep_last });
        Ok(self.peer.wait_for_answer(call).await?.jobs)
    }

    /// Cancels a job; returns its state afterwards.
    pub async fn cancel(&mut self, job: &str) -> Result<JobSnapshot, ClientError> {
        let call = self.jobs.cancel(v1::CancelRequest { job: job.to_owned() });
        let snapshot = self.peer.wait_for_answer(call).await?.snapshot;
        self.present(snapshot, "snapshot")
    }

    /// Follows a job until it has ended, and passes every snapshot to `show`. Reconnects to a
    /// coordinator that comes back within 10 s.
    pub async fn watch<E: From<ClientError>>(
        &mut self,
        job: &str,
        mut show: impl FnMut(&JobSnapshot) -> Result<(), E>,
    ) -> Result<JobSnapshot, E> {
        // What is left of the time to find a coordinator that is lost.
        let mut search: Option<Patience> = None;
        loop {
            let error = match self.watch_stream(job, &mut show, &mut search).await? {
                Ok(snapshot) => return Ok(snapshot),
                Err(error) => error,
            };
            let gone = matches!(
                error,
                ClientError::Lost { .. }
                    | ClientError::Unavailable { .. }
                    | ClientError::Connect(
                        ConnectError::Unreachable { .. } | ConnectError::Timeout { .. }
                    )
                    | ClientError::Unanswered { .. }
            );
            let search = search.get_or_insert_with(|| Patience::new(answer_limit()));
            if !gone || search.left().is_zero() {
                return Err(error.into());
            }
            search.rest(retry_pause()).await;
        }
    }

    /// Follows a job over one stream; returns the last snapshot, or the error that ended the
    /// stream. The outer error is that of `show`.
    async fn watch_stream<E>(
        &mut self,
        job: &str,
        show: &mut impl FnMut(&JobSnapshot) -> Result<(), E>,
        search: &mut Option<Patience>,
    ) -> Result<Result<JobSnapshot, ClientError>, E> {
        let call = self.jobs.watch(v1::WatchRequest { job: job.to_owned(), after: 0 });
        let limit = || Patience::new(answer_limit());
        let answered = match search {
            None => self.peer.wait_for_answer_within(&mut limit(), call).await,
            Some(search) => self.peer.wait_for_answer_within(search, call).await,
        };
        let mut stream = match answered {
            Ok(stream) => stream,
            Err(error) => return Ok(Err(error)),
        };
        loop {
            // No time limit here: a job may take long, and a silent connection is probed by
            // keepalives.
            let snapshot = match stream.message().await {
                Ok(Some(message)) => match self.present(message.snapshot, "snapshot") {
                    Ok(snapshot) => snapshot,
                    Err(error) => return Ok(Err(error)),
                },
                Ok(None) => {
                    let reason = "the stream of snapshots ended before the job".to_owned();
                    let endpoint = self.peer.endpoint.clone();
                    return Ok(Err(ClientError::Lost { endpoint, reason }));
                }
                Err(status) => return Ok(Err(self.peer.interpret_refusal(&status))),
            };
            *search = None;
            show(&snapshot)?;
            if snapshot.state() == v1::JobState::Ended {
                return Ok(Ok(snapshot));
            }
        }
    }

    /// Fetches the specification, result and history of an ended job. If the connection breaks meanwhile, it begins
    /// again, a few times.
    pub async fn fetch(&mut self, job: &str) -> Result<Fetched, ClientError> {
        for _ in 1..FETCHES_MAX {
            match self.fetch_once(job).await {
                Err(ClientError::Lost { .. }) => sleep(retry_pause()).await,
                fetched => return fetched,
            }
        }
        self.fetch_once(job).await
    }

    async fn fetch_once(&mut self, job: &str) -> Result<Fetched, ClientError> {
        let call = self.jobs.fetch(v1::FetchRequest { job: job.to_owned() });
        let mut stream = self.peer.wait_for_answer(call).await?;
        let mut parts = FetchedParts::default();
        loop {
            let mut patience = Patience::new(answer_limit());
            let Ok(message) = patience.wait_for(stream.message()).await else {
                return Err(self.peer.silent());
            };
            match message {
                Ok(Some(message)) => {
                    let part = self.present(message.part, "part")?;
                    parts.add(part).map_err(|source| self.malformed_answer(source))?;
                }
                Ok(None) => break,
                Err(status) => return Err(self.peer.interpret_refusal(&status)),
            }
        }
        parts.assemble().map_err(|source| self.malformed_answer(source))
    }

    pub(crate) fn present<T>(
        &self,
        field: Option<T>,
        name: &'static str,
    ) -> Result<T, ClientError> {
        field.ok_or_else(|| self.malformed_answer(Malformed::Missing { field: name }))
    }

    pub(crate) fn malformed_answer(&self, source: Malformed) -> ClientError {
        ClientError::Malformed { endpoint: self.peer.endpoint.clone(), source }
    }
}

/// Returns the final status of a job; `None` while it has not ended.
pub fn job_status(snapshot: &JobSnapshot) -> Option<JobStatus> {
    JOB_STATUS.value(snapshot.status)
}

/// Reads the credential files on another thread, so that signals are handled while a pipe is read.
pub(crate) async fn load_credentials(
    files: &CredentialFiles,
    endpoint: &Endpoint,
) -> Result<Credentials, ClientError> {
    let (files, endpoint) = (files.clone(), endpoint.clone());
    match spawn_blocking(move || Credentials::load(&files, &endpoint)).await {
        Ok(loaded) => Ok(loaded?),
        // The task is never aborted, so it has panicked.
        Err(error) => resume_unwind(error.into_panic()),
    }
}

fn retry_pause() -> Duration {
    Duration::from_millis(RETRY_MS)
}

#[cfg(test)]
mod tests;
