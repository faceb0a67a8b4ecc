//! A client of the service of jobs: every wait has an end, every error names the coordinator.

pub(crate) mod operators;

use std::panic::resume_unwind;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobResult, Status as JobStatus};
use osteon_common::violations::Violations;
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::credentials::{CredentialFiles, Credentials, CredentialsError};
use osteon_proto::endpoint::{self, ConnectError, Connection, Endpoint};
use osteon_proto::malformed::Malformed;
use osteon_proto::specification;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{self, JobSnapshot};
use thiserror::Error;
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep, timeout};
use tonic::Code;

use crate::environment::{COORDINATOR, Unused};
use crate::progress::say;
use crate::request::Request;

use self::parts::Parts;
use self::peer::{Peer, unless_silent};

mod parts;
mod peer;

/// Longest wait for a coordinator, s.
const ANSWER_S_MAX: u64 = 10;
/// After this long without a coordinator the user is told that it is looked for, s.
const SILENCE_S_MAX: u64 = 1;
/// Wait between two attempts to find a coordinator again, ms.
const RETRY_MS: u64 = 250;
/// Most pages of jobs that a list may have: each holds up to 1000.
const PAGES_MAX: usize = 10_000;

/// Why a coordinator did not do what was asked.
#[derive(Debug, Error)]
pub(crate) enum ClientError {
    /// A file of certificates or a token cannot be used.
    #[error(transparent)]
    Credentials(#[from] CredentialsError),
    /// There is no coordinator.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// It is there, and says nothing.
    #[error("the coordinator at {endpoint} did not answer within {ANSWER_S_MAX} s")]
    Unanswered {
        /// Address of the coordinator.
        endpoint: Endpoint,
    },
    /// It went away.
    #[error("lost the coordinator at {endpoint}: {reason}")]
    Lost {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// What the transport says.
        reason: String,
    },
    /// It cannot do it now.
    #[error("the coordinator at {endpoint} is unavailable: {reason}")]
    Unavailable {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// Why it cannot.
        reason: String,
    },
    /// It refuses the specification.
    #[error("{}", counted(.0))]
    Violations(Violations),
    /// It refuses the request.
    #[error("{reason}{hint} (coordinator {endpoint})")]
    Refused {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The status.
        code: Code,
        /// What it says.
        reason: String,
        /// What can be done about it, or nothing.
        hint: &'static str,
    },
    /// Whether it has accepted a job is not known.
    #[error(
        "{cause}; the job may be accepted all the same: `osteon submit` of the same job with \
         --request-id {request_id} prints its id and makes no second one"
    )]
    Uncertain {
        /// What became of the last attempt.
        cause: Box<ClientError>,
        /// The request.
        request_id: String,
    },
    /// There is no trust, and it may be for want of what the environment holds for another coordinator.
    #[error("{cause}; {unused}")]
    Untrusted {
        /// What became of it.
        cause: Box<ClientError>,
        /// Variables that were not used.
        unused: Unused,
    },
    /// It sent what cannot be read.
    #[error("invalid answer of the coordinator at {endpoint}: {source}")]
    Malformed {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// What is wrong.
        source: Malformed,
    },
}

impl ClientError {
    /// Whether the user must give something else.
    pub(crate) fn is_bad_input(&self) -> bool {
        match self {
            Self::Violations(_) | Self::Credentials(_) => true,
            Self::Untrusted { cause, .. } => cause.is_bad_input(),
            Self::Refused { code, .. } => {
                matches!(code, Code::NotFound | Code::InvalidArgument | Code::AlreadyExists)
            }
            _ => false,
        }
    }

    /// With what was not used, where that may be the reason.
    fn without(self, unused: &Unused) -> Self {
        let of_trust = matches!(
            self,
            Self::Credentials(CredentialsError::NoAuthority { .. })
                | Self::Connect(ConnectError::Tls { .. })
                | Self::Refused { code: Code::Unauthenticated, .. }
        );
        match of_trust && !unused.is_empty() {
            true => Self::Untrusted { cause: Box::new(self), unused: unused.clone() },
            false => self,
        }
    }
}

fn counted(violations: &Violations) -> String {
    let lines: Vec<String> =
        violations.iter().map(|violation| format!("\n  {violation}")).collect();
    let errors = if lines.len() == 1 { "error" } else { "errors" };
    format!("the coordinator rejected the job: {} {errors}{}", lines.len(), lines.concat())
}

/// Everything that an ended job left.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fetched {
    /// The specification, defaults filled in.
    pub(crate) specification: JobSpecification,
    /// The result, with the outcomes of the best point; of groups with those of each, as long as all of
    /// them are no more than one evaluation may have.
    pub(crate) result: JobResult,
    /// The evaluations in order.
    pub(crate) history: Vec<Evaluation>,
}

/// Where a coordinator is, and what is shown to it; the files are not read yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Remote {
    /// Its address.
    pub(crate) endpoint: Endpoint,
    /// Files of certificates and a token.
    pub(crate) files: CredentialFiles,
    /// Whether the environment names it, and not the command line.
    pub(crate) from_environment: bool,
    /// Variables of the environment that were not used for it.
    pub(crate) unused: Unused,
}

impl Remote {
    /// Says where the work is done, unless the command line says it.
    pub(crate) fn tell(&self) {
        if self.from_environment {
            say(&format!("running on {} ({COORDINATOR})", self.endpoint));
        }
    }
}

/// What is told of a job besides its specification.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SubmitOptions {
    /// Rank among the user's own jobs.
    pub(crate) priority: u32,
    /// What people call it; may be empty.
    pub(crate) name: String,
}

/// A connection to a coordinator.
#[derive(Debug, Clone)]
pub(crate) struct Client {
    peer: Peer,
    jobs: JobsClient<Connection>,
}

impl Client {
    /// Reads the credentials and connects to the coordinator; one that is not there may be about to
    /// come.
    pub(crate) async fn connect(remote: &Remote) -> Result<Self, ClientError> {
        let Remote { endpoint, files, unused, .. } = remote;
        let found = async {
            let credentials = loaded(files, endpoint).await?;
            let left = ANSWER_S_MAX - SILENCE_S_MAX;
            let notice = || format!("cannot reach {endpoint}; trying for {left} more seconds");
            unless_silent(Self::find(endpoint, &credentials), notice).await
        };
        let jobs = found.await.map_err(|error: ClientError| error.without(unused))?;
        Ok(Self { peer: Peer::new(remote), jobs })
    }

    /// The connection, as soon as there is one.
    async fn find(
        endpoint: &Endpoint,
        credentials: &Credentials,
    ) -> Result<JobsClient<Connection>, ClientError> {
        let begun = Instant::now();
        loop {
            let left = answer_limit().saturating_sub(begun.elapsed());
            let error = match endpoint::connect_with(endpoint, credentials, left).await {
                Ok(connection) => return Ok(endpoint::jobs_client(connection)),
                Err(error) => error,
            };
            let pause = Duration::from_millis(RETRY_MS);
            let again = matches!(error, ConnectError::Unreachable { .. });
            if !again || begun.elapsed() + pause >= answer_limit() {
                return Err(error.into());
            }
            sleep(pause).await;
        }
    }

    /// Submits a job; its id. While it is not known whether the coordinator has it, the same
    /// request is sent again, in all no longer than a client waits.
    pub(crate) async fn submit(
        &mut self,
        specification: &JobSpecification,
        request: &Request,
        options: SubmitOptions,
    ) -> Result<String, ClientError> {
        let message = v1::SubmitRequest {
            specification: Some(specification::to_message(specification)),
            request_id: request.id.clone(),
            client: request.client.clone(),
            priority: options.priority,
            name: options.name,
        };
        let (begun, mut uncertain) = (Instant::now(), false);
        loop {
            let left = answer_limit().saturating_sub(begun.elapsed());
            let call = self.jobs.submit(message.clone());
            let error = match self.peer.answered_within(left, call).await {
                Ok(response) => return Ok(response.job),
                Err(error) => error,
            };
            let lost = matches!(error, ClientError::Lost { .. });
            uncertain |= lost || matches!(error, ClientError::Unanswered { .. });
            if !uncertain {
                return Err(error);
            }
            let pause = Duration::from_millis(RETRY_MS);
            if !lost || begun.elapsed() + pause >= answer_limit() {
                let (cause, request_id) = (Box::new(error), request.id.clone());
                return Err(ClientError::Uncertain { cause, request_id });
            }
            sleep(pause).await;
        }
    }

    /// All jobs, oldest first.
    pub(crate) async fn list(&mut self) -> Result<Vec<JobSnapshot>, ClientError> {
        let mut jobs = Vec::new();
        let mut page_token = String::new();
        for _ in 0..PAGES_MAX {
            let call = self.jobs.list(v1::ListRequest { page_size: 0, page_token });
            let page = self.peer.answered(call).await?;
            jobs.extend(page.jobs);
            page_token = page.next_page_token;
            if page_token.is_empty() {
                break;
            }
        }
        Ok(jobs)
    }

    /// The workers that were found to compute wrongly.
    pub(crate) async fn expelled(&mut self) -> Result<Vec<v1::ExpelledWorker>, ClientError> {
        let call = self.jobs.list_expelled(v1::ListExpelledRequest {});
        Ok(self.peer.answered(call).await?.workers)
    }

    /// Forgets ended jobs; those that are forgotten.
    pub(crate) async fn prune(
        &mut self,
        older_than: Option<Duration>,
        keep_last: Option<u64>,
    ) -> Result<Vec<String>, ClientError> {
        let keep_for_s = older_than.map(|age| age.as_secs_f64());
        let call = self.jobs.prune(v1::PruneRequest { keep_for_s, keep_last });
        Ok(self.peer.answered(call).await?.jobs)
    }

    /// Cancels a job; how it is then.
    pub(crate) async fn cancel(&mut self, job: &str) -> Result<JobSnapshot, ClientError> {
        let call = self.jobs.cancel(v1::CancelRequest { job: job.to_owned() });
        let snapshot = self.peer.answered(call).await?.snapshot;
        self.present(snapshot, "snapshot")
    }

    /// Follows a job until it has ended, and shows every snapshot to `show`. A coordinator that
    /// goes away and comes back within 10 s is found again.
    pub(crate) async fn watch<E: From<ClientError>>(
        &mut self,
        job: &str,
        mut show: impl FnMut(&JobSnapshot) -> Result<(), E>,
    ) -> Result<JobSnapshot, E> {
        let mut lost_since: Option<Instant> = None;
        loop {
            let error = match self.watch_stream(job, &mut show, &mut lost_since).await? {
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
            let since = *lost_since.get_or_insert_with(Instant::now);
            if !gone || since.elapsed() >= answer_limit() {
                return Err(error.into());
            }
            sleep(Duration::from_millis(RETRY_MS)).await;
        }
    }

    /// One stream of snapshots: the last one, or why there is none. The outer error is that of
    /// `show`.
    async fn watch_stream<E>(
        &mut self,
        job: &str,
        show: &mut impl FnMut(&JobSnapshot) -> Result<(), E>,
        lost_since: &mut Option<Instant>,
    ) -> Result<Result<JobSnapshot, ClientError>, E> {
        let call = self.jobs.watch(v1::WatchRequest { job: job.to_owned(), after: 0 });
        let mut stream = match self.peer.answered(call).await {
            Ok(stream) => stream,
            Err(error) => return Ok(Err(error)),
        };
        loop {
            // No limit here: a job may be long, and the connection is probed while it is silent.
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
                Err(status) => return Ok(Err(self.peer.refused(&status))),
            };
            *lost_since = None;
            show(&snapshot)?;
            if snapshot.state() == v1::JobState::Ended {
                return Ok(Ok(snapshot));
            }
        }
    }

    /// Everything that an ended job left.
    pub(crate) async fn fetch(&mut self, job: &str) -> Result<Fetched, ClientError> {
        let call = self.jobs.fetch(v1::FetchRequest { job: job.to_owned() });
        let mut stream = self.peer.answered(call).await?;
        let mut parts = Parts::default();
        loop {
            let Ok(message) = timeout(answer_limit(), stream.message()).await else {
                return Err(self.peer.silent());
            };
            match message {
                Ok(Some(message)) => {
                    let part = self.present(message.part, "part")?;
                    parts.add(part).map_err(|source| self.malformed(source))?;
                }
                Ok(None) => break,
                Err(status) => return Err(self.peer.refused(&status)),
            }
        }
        parts.whole().map_err(|source| self.malformed(source))
    }

    fn present<T>(&self, field: Option<T>, name: &'static str) -> Result<T, ClientError> {
        field.ok_or_else(|| self.malformed(Malformed::Missing { field: name }))
    }

    fn malformed(&self, source: Malformed) -> ClientError {
        ClientError::Malformed { endpoint: self.peer.endpoint.clone(), source }
    }
}

/// How a job ended; `None` while it has not.
pub(crate) fn job_status(snapshot: &JobSnapshot) -> Option<JobStatus> {
    JOB_STATUS.value(snapshot.status)
}

/// Reads the files. A pipe among them may take a while, in which signals are looked at.
async fn loaded(files: &CredentialFiles, endpoint: &Endpoint) -> Result<Credentials, ClientError> {
    let (files, endpoint) = (files.clone(), endpoint.clone());
    match spawn_blocking(move || Credentials::load(&files, &endpoint)).await {
        Ok(loaded) => Ok(loaded?),
        // It is never aborted, so it has panicked.
        Err(error) => resume_unwind(error.into_panic()),
    }
}

fn answer_limit() -> Duration {
    Duration::from_secs(ANSWER_S_MAX)
}

#[cfg(test)]
mod tests;
