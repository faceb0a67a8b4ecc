//! The gate of the live page: which requests are answered. Callers are admitted by the rules of the API;
//! and since browsers also carry out the requests of other pages, a request must come from the page
//! itself, and name a host that cannot be another's.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, HOST, HeaderName, ORIGIN};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use osteon_proto::identity::host_name;
use thiserror::Error;
use tokio::sync::watch;
use tonic::Status;

use crate::access::{
    self, AccessDenied, Certificate, HolderName, Policy, Presented, Requirement, page_need,
};
use crate::live::assets;
use crate::live::json;

/// Where a request comes from, as the browser says.
const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Path of the requirement to cancel jobs.
const CANCEL: &str = "/data/jobs/0/cancel";

/// The gate.
#[derive(Debug, Clone)]
pub(crate) struct Gate {
    /// Read for each request, because it may be replaced while the coordinator runs.
    policy: watch::Receiver<Arc<Policy>>,
    /// Names under which the page may be asked for where there are no tokens.
    hosts: Arc<Vec<String>>,
}

/// Why a request is not answered.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum GateRefusal {
    /// The host may be another's, whose name leads here.
    #[error(
        "the host {host:?} is not known: the page answers for addresses, localhost and the name of this \
         machine; other names need --http-host NAME, or a coordinator with tokens"
    )]
    UnknownHost {
        /// The host.
        host: String,
    },
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
        self.gate.decide(self.authorization.as_ref(), page_need(path))
    }

    /// Returns whether the caller may cancel jobs.
    pub(crate) fn may_cancel(&self) -> bool {
        self.may(CANCEL).is_ok()
    }
}

impl Gate {
    pub(crate) fn new(policy: watch::Receiver<Arc<Policy>>, mut hosts: Vec<String>) -> Self {
        hosts.push("localhost".to_owned());
        hosts.extend(host_name());
        Self { policy, hosts: Arc::new(hosts) }
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
        let (headers, need) = (request.headers(), page_need(request.uri().path()));
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).or_else(|| Some(request.uri().authority()?.as_str())).unwrap_or("");
        // With tokens, a page under another name has none: browsers keep them by origin.
        let open = matches!(**self.policy.borrow(), Policy::Everybody);
        if open && !self.is_own(host) {
            return Err(GateRefusal::UnknownHost { host: host.to_owned() });
        }
        // Anybody may link to the page itself.
        if need != Requirement::Nothing && is_cross_site(headers, request.method(), host) {
            return Err(GateRefusal::CrossSite);
        }
        Ok(self.decide(headers.get(AUTHORIZATION), need)?)
    }

    /// Returns whether a host is an address, or a name that leads nowhere else. Any other name may belong
    /// to somebody who lets it lead to this machine, so that browsers take his page for this one's.
    fn is_own(&self, host: &str) -> bool {
        let name = without_port(host);
        let address =
            name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        address.parse::<IpAddr>().is_ok()
            || self.hosts.iter().any(|known| known.eq_ignore_ascii_case(name))
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
            refused(&refusal)
        }
    };
    assets::protect(&mut response);
    response
}

fn refused(refusal: &GateRefusal) -> Response {
    match refusal {
        GateRefusal::Denied(denied) => json::failed(&Status::from(denied.clone())),
        GateRefusal::UnknownHost { .. } => {
            json::error(StatusCode::MISDIRECTED_REQUEST, &refusal.to_string())
        }
        GateRefusal::CrossSite => json::error(StatusCode::FORBIDDEN, &refusal.to_string()),
    }
}

/// Returns whether another page had the browser send a request. Programs send neither header.
fn is_cross_site(headers: &HeaderMap, method: &Method, host: &str) -> bool {
    match headers.get(SEC_FETCH_SITE).map(HeaderValue::as_bytes) {
        Some(b"same-origin") => false,
        // Typed by the user; only a page posts.
        Some(b"none") => ![Method::GET, Method::HEAD].contains(method),
        Some(_) => true,
        None => headers.get(ORIGIN).is_some_and(|origin| {
            let origin = origin.to_str().ok().and_then(|origin| origin.split_once("://"));
            origin.is_none_or(|(_, authority)| !authority.eq_ignore_ascii_case(host))
        }),
    }
}

/// Returns a host without its port.
fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        // The colons of an address are in brackets.
        Some((name, port)) if !port.contains(']') => name,
        _ => host,
    }
}

#[cfg(test)]
mod tests;
