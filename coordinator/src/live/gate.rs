//! The gate of the live page: which requests are answered. Callers are admitted by the rules of the API;
//! and since browsers also carry out the requests of other pages, a request must come from the page
//! itself, and name a host that cannot be another's.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::AUTHORIZATION;
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use osteon_http::{OwnHosts, host_of, is_cross_site};
use osteon_proto::identity::host_name;
use thiserror::Error;
use tokio::sync::watch;
use tonic::Status;

use crate::access::{
    self, AccessDenied, Certificate, HolderName, Policy, Presented, Requirement, page_requirement,
};
use crate::live::assets;
use crate::live::json;

/// Path of the requirement to cancel jobs.
const CANCEL: &str = "/data/jobs/0/cancel";

#[derive(Debug, Clone)]
pub(crate) struct Gate {
    /// Read for each request, because it may be replaced while the coordinator runs.
    policy: watch::Receiver<Arc<Policy>>,
    /// Names under which the page may be asked for where there are no tokens.
    hosts: OwnHosts,
}

/// Why a request is not answered.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum GateRefusal {
    /// The request names a host that may be somebody else's, although the name leads here.
    #[error(
        "the host {host:?} is not known: the page answers for addresses, localhost and the name of this \
         machine; other names need --http-host NAME, or a coordinator with tokens"
    )]
    UnknownHost { host: String },
    /// Another page sent the request.
    #[error("the request comes from another page; open the live page itself")]
    CrossSite,
    /// The caller may not do this.
    #[error(transparent)]
    Denied(#[from] AccessDenied),
}

/// The sender of a request: its credentials, with the gate that checks them again for each update.
#[derive(Debug, Clone)]
pub(crate) struct PageCaller {
    gate: Gate,
    authorization: Option<HeaderValue>,
}

impl PageCaller {
    /// Returns whether the caller may see what a path shows, by the tokens of this moment.
    pub(crate) fn may(&self, path: &str) -> Result<Option<HolderName>, AccessDenied> {
        self.gate.decide(self.authorization.as_ref(), page_requirement(path))
    }

    /// Returns whether the caller may cancel jobs.
    pub(crate) fn may_cancel(&self) -> bool {
        self.may(CANCEL).is_ok()
    }
}

impl Gate {
    pub(crate) fn new(policy: watch::Receiver<Arc<Policy>>, hosts: Vec<String>) -> Self {
        Self { policy, hosts: OwnHosts::new(host_name(), hosts) }
    }

    fn decide(
        &self,
        authorization: Option<&HeaderValue>,
        need: Requirement,
    ) -> Result<Option<HolderName>, AccessDenied> {
        let policy = Arc::clone(&self.policy.borrow());
        let presented = match authorization {
            None => Presented::Nothing,
            header => access::presented(header.map(HeaderValue::as_bytes)),
        };
        let holder = access::decide(&policy, Certificate::Absent, presented, need)?;
        Ok(holder.map(|name| HolderName(name.to_owned())))
    }

    /// Decides whether a request is answered; returns the holder of its token, if tokens are required.
    fn admit<B>(
        &self,
        request: &axum::http::Request<B>,
    ) -> Result<Option<HolderName>, GateRefusal> {
        let (headers, need) = (request.headers(), page_requirement(request.uri().path()));
        let host = host_of(request).unwrap_or("");
        // With tokens, a page under another name has none: browsers keep them by origin.
        let open = matches!(**self.policy.borrow(), Policy::Everybody);
        if open && !self.hosts.contain(host) {
            return Err(GateRefusal::UnknownHost { host: host.to_owned() });
        }
        // Anybody may link to the page itself.
        if need != Requirement::Nothing && is_cross_site(headers, request.method(), host) {
            return Err(GateRefusal::CrossSite);
        }
        Ok(self.decide(headers.get(AUTHORIZATION), need)?)
    }
}

/// Answers a request, or refuses it before it is looked at.
pub(crate) async fn guard(State(gate): State<Gate>, mut request: Request, next: Next) -> Response {
    let mut response = match gate.admit(&request) {
        Ok(holder) => {
            let authorization = request.headers().get(AUTHORIZATION).cloned();
            request.extensions_mut().insert(PageCaller { gate, authorization });
            if let Some(holder) = holder {
                request.extensions_mut().insert(holder);
            }
            next.run(request).await
        }
        Err(refusal) => {
            tracing::debug!(path = request.uri().path(), %refusal, "a request of a page was refused");
            refusal_response(&refusal)
        }
    };
    assets::protect(&mut response);
    response
}

fn refusal_response(refusal: &GateRefusal) -> Response {
    match refusal {
        GateRefusal::Denied(denied) => json::refusal_response(&Status::from(denied.clone())),
        GateRefusal::UnknownHost { .. } => {
            json::error(StatusCode::MISDIRECTED_REQUEST, &refusal.to_string())
        }
        GateRefusal::CrossSite => json::error(StatusCode::FORBIDDEN, &refusal.to_string()),
    }
}

#[cfg(test)]
mod tests;
