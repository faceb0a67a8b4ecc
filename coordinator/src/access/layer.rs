//! Access layer in front of every call: it passes the caller's credentials to [`crate::access`] and
//! enforces the decision.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use osteon_common::limits::{
    SMALL_SUBMISSION_BYTES_MAX, SUBMISSION_SECONDS_MAX, SUBMISSIONS_AT_ONCE_MAX,
    SUBMISSIONS_PER_CALLER_MAX,
};
use tokio::sync::watch;
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic::{Code, Status};
use tower::Layer;

use crate::access::limiter::{Caller, Limiter};
use crate::access::message_body::MessageBody;
use crate::access::tokens::Role;
use crate::access::{self, AccessDenied, Certificate, HolderName, Policy, Requirement};
use crate::service::accept::PeerInfo;

/// The only method whose message may be large.
const SUBMIT: &str = "/osteon.v1.Jobs/Submit";

/// Puts a [`AccessService`] in front of a service.
#[derive(Debug, Clone)]
pub(crate) struct AccessLayer {
    /// Read for each call, because it may be replaced while the coordinator runs.
    policy: watch::Receiver<Arc<Policy>>,
    submissions: Limiter,
}

/// A service behind the access check.
#[derive(Debug, Clone)]
pub(crate) struct AccessService<S> {
    inner: S,
    layer: AccessLayer,
}

impl AccessLayer {
    pub(crate) fn new(policy: watch::Receiver<Arc<Policy>>) -> Self {
        let submissions = Limiter::new(SUBMISSIONS_AT_ONCE_MAX, SUBMISSIONS_PER_CALLER_MAX);
        Self { policy, submissions }
    }

    /// Returns the holder of the call's token, if the policy requires tokens.
    fn decide<B>(&self, request: &http::Request<B>) -> Result<Option<HolderName>, Status> {
        let path = request.uri().path();
        let peer = request.extensions().get::<PeerInfo>();
        let certificate = peer.map_or(Certificate::Absent, |peer| peer.certificate);
        let header = request.headers().get(http::header::AUTHORIZATION);
        let presented = access::presented(header.map(http::HeaderValue::as_bytes));
        let need = access::requirement(path);
        let policy = Arc::clone(&self.policy.borrow());
        match access::decide(&policy, certificate, presented, need) {
            Ok(holder) => {
                // Calls that change something are logged with their holder; reads are not.
                if let (Some(holder), Requirement::Role(Role::Submit | Role::Admin)) =
                    (holder, need)
                {
                    tracing::info!(path, holder, "admitted");
                }
                Ok(holder.map(|name| HolderName(name.to_owned())))
            }
            Err(denied) => {
                tracing::debug!(path, %denied, "a call was refused");
                Err(denied.into())
            }
        }
    }
}

impl<S> Layer<S> for AccessLayer {
    type Service = AccessService<S>;

    fn layer(&self, inner: S) -> AccessService<S> {
        AccessService { inner, layer: self.clone() }
    }
}

impl<S> Service<http::Request<Body>> for AccessService<S>
where
    S: Service<http::Request<Body>, Response = http::Response<Body>> + Clone + Send + 'static,
    S::Future: Send,
    S::Error: Send,
{
    type Response = http::Response<Body>;
    type Error = S::Error;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Self::Error>> + Send>>;

    fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), S::Error>> {
        self.inner.poll_ready(cx)
    }

    fn call(&mut self, mut request: http::Request<Body>) -> Self::Future {
        match self.layer.decide(&request) {
            // Refused before a byte of the message is read.
            Err(status) => return Box::pin(async move { Ok(status.into_http()) }),
            Ok(Some(holder)) => {
                request.extensions_mut().insert(holder);
            }
            Ok(None) => {}
        }
        if request.uri().path() != SUBMIT {
            return Box::pin(self.inner.call(request));
        }
        // `self.inner` is the instance that was polled ready; its clone may not be.
        let fresh = self.inner.clone();
        let mut inner = std::mem::replace(&mut self.inner, fresh);
        let submissions = self.layer.submissions.clone();
        Box::pin(async move {
            let (head, body) = request.into_parts();
            let message = match MessageBody::begin(body).await {
                Ok(message) => message,
                Err(status) => return Ok(status.into_http()),
            };
            if message.length() <= SMALL_SUBMISSION_BYTES_MAX {
                return inner.call(http::Request::from_parts(head, Body::new(message))).await;
            }
            // Only a few large messages are held in memory at a time, and not for long.
            let _permit = match submissions.acquire(Caller::from_extensions(&head.extensions)).await
            {
                Ok(place) => place,
                Err(status) => return Ok(status.into_http()),
            };
            let message = message.collect_within(Duration::from_secs(SUBMISSION_SECONDS_MAX));
            inner.call(http::Request::from_parts(head, Body::new(message))).await
        })
    }
}

impl From<AccessDenied> for Status {
    fn from(denied: AccessDenied) -> Self {
        let code = match denied {
            AccessDenied::WeakRole { .. } | AccessDenied::NotAWorker => Code::PermissionDenied,
            AccessDenied::NoToken
            | AccessDenied::Unreadable
            | AccessDenied::UnknownToken
            | AccessDenied::Faulty(_)
            | AccessDenied::NoCertificate => Code::Unauthenticated,
        };
        Self::new(code, denied.to_string())
    }
}
