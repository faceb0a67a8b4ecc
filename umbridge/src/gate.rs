//! The gate: clients of UM-Bridge are answered, and requests that a page in the user's browser sends are not. Otherwise
//! any page could have points computed with the user's token on a cluster, and, if its own host name is made to resolve
//! to this machine (DNS rebinding), read the answers. The protocol's clients send any type of content or none (the one in C++ `text/plain`, curl that of
//! forms), so the type says nothing.

use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::middleware::Next;
use axum::response::Response;
use osteon_http::{OwnHosts, host_of, is_cross_site};

use super::answers;
use super::protocol_error::{ProtocolError, quoted};

/// Passes a request on, or refuses it by its headers alone.
pub(super) async fn guard(State(hosts): State<OwnHosts>, request: Request, next: Next) -> Response {
    match admit(&hosts, &request) {
        Ok(()) => next.run(request).await,
        Err(error) => answers::refused(request, error).await,
    }
}

fn admit<B>(hosts: &OwnHosts, request: &axum::http::Request<B>) -> Result<(), ProtocolError> {
    // Not from a browser: browsers always name the host.
    let Some(host) = host_of(request) else { return Ok(()) };
    if !hosts.contain(host) {
        let message = format!(
            "the host {} is not known: the server answers for IP addresses, localhost and the name of this \
             machine; start it with --http-host NAME for another",
            quoted(host)
        );
        return Err(ProtocolError::input(message).with_status(StatusCode::MISDIRECTED_REQUEST));
    }
    // Anybody may link to the front page, which only says what this server is.
    let is_front = request.uri().path() == "/";
    if !is_front && is_cross_site(request.headers(), request.method(), host) {
        let message = "the request comes from a page in a browser; this server is for programs";
        return Err(ProtocolError::input(message).with_status(StatusCode::FORBIDDEN));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the status of a refusal, or 200.
    fn status(method: &str, path: &str, headers: &[(&str, &str)]) -> u16 {
        let mut request = axum::http::Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let hosts = OwnHosts::new(None, vec!["model.example.org".to_owned()]);
        let admitted = admit(&hosts, &request.body(()).unwrap());
        admitted.err().map_or(200, |error| error.status.as_u16())
    }

    #[test]
    fn programs_are_answered_and_pages_are_not() {
        let host = ("host", "127.0.0.1:4242");
        for (method, path, headers, expected) in [
            // The clients in Python, C++ and Julia, and curl.
            ("POST", "/Evaluate", vec![host, ("content-type", "application/json")], 200),
            ("POST", "/Evaluate", vec![host, ("content-type", "text/plain")], 200),
            ("POST", "/Evaluate", vec![host], 200),
            (
                "POST",
                "/Evaluate",
                vec![host, ("content-type", "application/x-www-form-urlencoded")],
                200,
            ),
            ("POST", "/Evaluate", vec![], 200),
            ("POST", "/Evaluate", vec![("host", "localhost:4242")], 200),
            ("POST", "/Evaluate", vec![("host", "model.example.org:4242")], 200),
            ("GET", "/Info", vec![host, ("sec-fetch-site", "none")], 200),
            // Pages.
            ("POST", "/Evaluate", vec![host, ("sec-fetch-site", "cross-site")], 403),
            ("POST", "/Evaluate", vec![host, ("sec-fetch-site", "none")], 403),
            ("POST", "/Evaluate", vec![host, ("origin", "https://evil.example")], 403),
            ("POST", "/Evaluate", vec![host, ("origin", "null")], 403),
            ("POST", "/Evaluate", vec![host, ("origin", "http://127.0.0.1:8888")], 403),
            ("GET", "/Info", vec![host, ("sec-fetch-site", "cross-site")], 403),
            ("GET", "/", vec![host, ("sec-fetch-site", "cross-site")], 200),
            // A name that somebody else lets lead here.
            ("POST", "/Evaluate", vec![("host", "evil.example:4242")], 421),
            ("GET", "/", vec![("host", "evil.example")], 421),
        ] {
            assert_eq!(status(method, path, &headers), expected, "{method} {path} {headers:?}");
        }
    }
}
