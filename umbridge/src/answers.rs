//! Answers in JSON, and the bodies of requests.

use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::StatusCode;
use axum::http::header::{CONTENT_TYPE, HeaderName, HeaderValue, RETRY_AFTER};
use axum::response::Response;
use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use serde_json::{Value, json};
use tokio::time::timeout;

use super::protocol_error::ProtocolError;

/// Longest body of a request, bytes.
const BODY_BYTES_MAX: usize = 1 << 20;
/// Time limit for the arrival of a request's body, s.
pub(super) const BODY_S_MAX: u64 = 30;
/// Time limit for the arrival of the body of a request that is refused, s.
const REFUSED_BODY_S_MAX: u64 = 5;
/// Time after which refused clients are asked to come back, s: that of some evaluations.
const RETRY_AFTER_S: u64 = 10;

/// An answer: its JSON, and names and values of its own headers.
pub(super) type JsonAnswer = (Value, Vec<(&'static str, String)>);

/// Returns what answers every request while there is no place for its connection.
pub(super) fn busy(message: String) -> Router {
    let error = ProtocolError::output(message).with_status(StatusCode::SERVICE_UNAVAILABLE);
    Router::new().fallback(async move |request: Request| {
        let mut response = refused(request, error).await;
        response.headers_mut().insert(RETRY_AFTER, HeaderValue::from(RETRY_AFTER_S));
        response
    })
}

/// Answers a request with an error.
pub(super) async fn refused(request: Request, error: ProtocolError) -> Response {
    // Whoever is still sending would not read the answer.
    let _ = body(request.into_body(), REFUSED_BODY_S_MAX).await;
    response(Err(error))
}

/// Reads the body of a request, within bounds on size and time.
pub(super) async fn body(body: Body, seconds: u64) -> Result<Bytes, ProtocolError> {
    let collected = Limited::new(body, BODY_BYTES_MAX).collect();
    match timeout(Duration::from_secs(seconds), collected).await {
        Ok(Ok(collected)) => Ok(collected.to_bytes()),
        Ok(Err(error)) if error.downcast_ref::<LengthLimitError>().is_some() => {
            let message = format!("the body is longer than {BODY_BYTES_MAX} bytes");
            Err(ProtocolError::input(message).with_status(StatusCode::PAYLOAD_TOO_LARGE))
        }
        Ok(Err(error)) => Err(ProtocolError::input(format!("the body cannot be read: {error}"))),
        Err(_) => {
            let message = format!("the body did not arrive within {seconds} s");
            Err(ProtocolError::input(message).with_status(StatusCode::REQUEST_TIMEOUT))
        }
    }
}

/// Returns an answer, or the error of a request.
pub(super) fn response(answer: Result<JsonAnswer, ProtocolError>) -> Response {
    let (status, value, notes) = match answer {
        Ok((value, notes)) => (StatusCode::OK, value, notes),
        Err(ProtocolError { kind, status, message, .. }) => {
            let error = json!({"error": {"type": kind.name(), "message": message}});
            (status, error, Vec::new())
        }
    };
    let mut response = Response::new(Body::from(value.to_string()));
    *response.status_mut() = status;
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/json"));
    for (name, value) in notes {
        // The values are numbers and fixed words, all of them ASCII.
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(HeaderName::from_static(name), value);
        }
    }
    response
}

#[cfg(test)]
mod tests {
    use axum::body::HttpBody;
    use hyper::body::Frame;
    use tokio::time::Instant;

    use super::*;

    /// A body of which nothing arrives.
    struct Silent;

    impl HttpBody for Silent {
        type Data = Bytes;
        type Error = std::io::Error;

        fn poll_frame(
            self: std::pin::Pin<&mut Self>,
            _: &mut std::task::Context<'_>,
        ) -> std::task::Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
            std::task::Poll::Pending
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_body_that_does_not_arrive_is_given_up() {
        let began = Instant::now();
        let error = body(Body::new(Silent), BODY_S_MAX).await.unwrap_err();
        assert_eq!(error.status, StatusCode::REQUEST_TIMEOUT);
        assert_eq!(began.elapsed().as_secs(), BODY_S_MAX);
    }
}
