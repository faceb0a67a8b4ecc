//! The coordinator at the other end of a connection: waits for its answers within a time limit, and
//! interprets missing answers and errors.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use osteon_proto::status::{self, Resource};
use osteon_transport::connection::ConnectError;
use osteon_transport::endpoint::Endpoint;
use osteon_transport::patience::Patience;
use osteon_transport::tls_failure::TlsFailure;
use tonic::{Code, Response, Status};

use crate::environment::Unused;
use crate::error::ClientError;
use crate::listener::RunListener;
use crate::remote::{Remote, SILENCE_S_MAX, answer_limit};

/// The coordinator that a client is connected to.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) endpoint: Endpoint,
    /// Whether it has ever answered, which shows that client and coordinator use the same protocol.
    ever_answered: bool,
    /// Environment variables that were not used for it.
    unused: Unused,
    /// Receives a note while an answer is waited for.
    pub(crate) listener: Arc<dyn RunListener>,
}

impl Peer {
    /// Creates the peer for `remote`, which has not answered yet.
    pub(crate) fn new(remote: &Remote, listener: Arc<dyn RunListener>) -> Self {
        let Remote { endpoint, unused, .. } = remote.clone();
        Self { endpoint, ever_answered: false, unused, listener }
    }

    /// Waits for the answer to `call`, for at most the client's time limit.
    pub(crate) async fn wait_for_answer<T>(
        &mut self,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, ClientError> {
        self.wait_for_answer_within(&mut Patience::new(answer_limit()), call).await
    }

    /// Waits for the answer to `call`, for as long as there is patience.
    pub(crate) async fn wait_for_answer_within<T>(
        &mut self,
        patience: &mut Patience,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, ClientError> {
        let limit = patience.left();
        let notice = || {
            let left = limit.saturating_sub(Duration::from_secs(SILENCE_S_MAX)).as_secs_f64();
            format!("no answer from {} yet; waiting for {left:.0} more seconds", self.endpoint)
        };
        let answer = with_wait_notice(patience.wait_for(call), &*self.listener, notice).await;
        let error = match answer {
            Ok(Ok(response)) => {
                self.ever_answered = true;
                return Ok(response.into_inner());
            }
            Ok(Err(status)) => self.interpret_unanswered(&status),
            Err(_) => self.silent(),
        };
        // A refusal counts as an answer, too.
        self.ever_answered |= matches!(
            error,
            ClientError::Violations(_)
                | ClientError::Unavailable { .. }
                | ClientError::Refused { .. }
        );
        Err(error)
    }

    /// Returns the error of a coordinator that has not answered within the time limit.
    pub(crate) fn silent(&self) -> ClientError {
        ClientError::Unanswered { endpoint: self.endpoint.clone() }
    }

    /// Interprets the status of a call that ended before its first answer.
    fn interpret_unanswered(&self, status: &Status) -> ClientError {
        match self.interpret_refusal(status) {
            ClientError::Lost { endpoint, .. } => {
                let reason = endpoint.explained(status, self.ever_answered);
                ClientError::Lost { endpoint, reason }
            }
            error => error,
        }
    }

    /// Interprets the status of a failed call.
    pub(crate) fn interpret_refusal(&self, status: &Status) -> ClientError {
        if let Some(violations) = status::violations(status) {
            return ClientError::Violations(violations);
        }
        let endpoint = self.endpoint.clone();
        if let Some(failure) = TlsFailure::find_cause(status) {
            let error = ClientError::from(ConnectError::Tls { endpoint, failure });
            return error.with_unused_variables(&self.unused);
        }
        let reason = status.message().to_owned();
        // Statuses sent by the coordinator have no source; only errors of the transport have one.
        let answered = std::error::Error::source(status).is_none();
        match status.code() {
            Code::Unavailable if answered => ClientError::Unavailable { endpoint, reason },
            Code::Unavailable | Code::Unknown | Code::Cancelled | Code::DeadlineExceeded => {
                ClientError::Lost { endpoint, reason }
            }
            // tonic reports a broken HTTP/2 connection as this code.
            Code::Internal if !answered => ClientError::Lost { endpoint, reason },
            code => {
                let refused = ClientError::Refused { endpoint, code, reason, hint: hint(status) };
                refused.with_unused_variables(&self.unused)
            }
        }
    }
}

/// Returns advice about a refusal for users of the command line. The coordinator does not give it,
/// as its clients are programs.
fn hint(status: &Status) -> &'static str {
    match status::missing(status) {
        Some(Resource::Job) => "; `osteon job list` lists all jobs",
        Some(Resource::Worker) => "; `osteon worker list` lists all that are attached",
        // The refusal says it.
        Some(Resource::Host) => "",
        None => "",
    }
}

/// Waits for `call`; after a moment tells the user what is waited for.
pub(crate) async fn with_wait_notice<T>(
    call: impl Future<Output = T>,
    listener: &dyn RunListener,
    notice: impl Fn() -> String,
) -> T {
    let mut call = pin!(call);
    let silence = Duration::from_secs(SILENCE_S_MAX);
    match Patience::new(silence).wait_for(call.as_mut()).await {
        Ok(answer) => answer,
        Err(_) => {
            listener.note(&notice());
            call.await
        }
    }
}
