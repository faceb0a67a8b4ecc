//! The coordinator at the other end of a connection: its answers, waited for within bounds, and what it
//! means when none comes.

use std::pin::pin;
use std::time::Duration;

use osteon_proto::endpoint::{ConnectError, Endpoint};
use osteon_proto::status::{self, Resource};
use osteon_proto::tls_failure::TlsFailure;
use tokio::time::timeout;
use tonic::{Code, Response, Status};

use crate::environment::Unused;
use crate::progress::say;

use super::{ClientError, Remote, SILENCE_S_MAX, answer_limit};

/// A coordinator that a client speaks to.
#[derive(Debug, Clone)]
pub(super) struct Peer {
    /// Its address.
    pub(super) endpoint: Endpoint,
    /// Whether it has ever answered: then it speaks what the client speaks.
    ever_answered: bool,
    /// Variables of the environment that were not used for it.
    unused: Unused,
}

impl Peer {
    /// The coordinator at `remote`, of which nothing was heard yet.
    pub(super) fn new(remote: &Remote) -> Self {
        let Remote { endpoint, unused, .. } = remote.clone();
        Self { endpoint, ever_answered: false, unused }
    }

    /// The answer to `call`, within the time that a client waits.
    pub(super) async fn answered<T>(
        &mut self,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, ClientError> {
        self.answered_within(answer_limit(), call).await
    }

    /// The answer to `call`, within `limit`.
    pub(super) async fn answered_within<T>(
        &mut self,
        limit: Duration,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, ClientError> {
        let notice = || {
            let left = limit.saturating_sub(Duration::from_secs(SILENCE_S_MAX)).as_secs_f64();
            format!("no answer from {} yet; waiting for {left:.0} more seconds", self.endpoint)
        };
        let answer = unless_silent(timeout(limit, call), notice).await;
        let error = match answer {
            Ok(Ok(response)) => {
                self.ever_answered = true;
                return Ok(response.into_inner());
            }
            Ok(Err(status)) => self.unanswered(&status),
            Err(_) => self.silent(),
        };
        // A refusal is an answer, too.
        self.ever_answered |= matches!(
            error,
            ClientError::Violations(_)
                | ClientError::Unavailable { .. }
                | ClientError::Refused { .. }
        );
        Err(error)
    }

    /// It says nothing for as long as a client waits.
    pub(super) fn silent(&self) -> ClientError {
        ClientError::Unanswered { endpoint: self.endpoint.clone() }
    }

    /// The meaning of the status that a call ended with before its answer came.
    fn unanswered(&self, status: &Status) -> ClientError {
        match self.refused(status) {
            ClientError::Lost { endpoint, .. } => {
                let reason = endpoint.explained(status, self.ever_answered);
                ClientError::Lost { endpoint, reason }
            }
            error => error,
        }
    }

    /// The meaning of the status that a call ended with.
    pub(super) fn refused(&self, status: &Status) -> ClientError {
        if let Some(violations) = status::violations(status) {
            return ClientError::Violations(violations);
        }
        let endpoint = self.endpoint.clone();
        if let Some(failure) = TlsFailure::of(status) {
            let error = ClientError::from(ConnectError::Tls { endpoint, failure });
            return error.without(&self.unused);
        }
        let reason = status.message().to_owned();
        // What the coordinator itself answers has no source: that is an error of the transport.
        let answered = std::error::Error::source(status).is_none();
        match status.code() {
            Code::Unavailable if answered => ClientError::Unavailable { endpoint, reason },
            Code::Unavailable | Code::Unknown | Code::Cancelled | Code::DeadlineExceeded => {
                ClientError::Lost { endpoint, reason }
            }
            // tonic reports a broken HTTP/2 connection so.
            Code::Internal if !answered => ClientError::Lost { endpoint, reason },
            code => {
                let refused = ClientError::Refused { endpoint, code, reason, hint: hint(status) };
                refused.without(&self.unused)
            }
        }
    }
}

/// Advice to a user of the command line about a refusal, which the coordinator, whose clients are
/// programs, does not give.
fn hint(status: &Status) -> &'static str {
    match status::missing(status) {
        Some(Resource::Job) => "; `osteon jobs` lists all jobs",
        Some(Resource::Worker) => "; `osteon workers` lists all that are attached",
        None => "",
    }
}

/// Waits for `call`; after a moment without an end the user is told what is waited for.
pub(super) async fn unless_silent<T>(
    call: impl Future<Output = T>,
    notice: impl Fn() -> String,
) -> T {
    let mut call = pin!(call);
    match timeout(Duration::from_secs(SILENCE_S_MAX), call.as_mut()).await {
        Ok(answer) => answer,
        Err(_) => {
            say(&notice());
            call.await
        }
    }
}
