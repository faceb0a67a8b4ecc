use axum::http::Request;
use osteon_proto::identity::host_name;

use super::*;
use crate::access::tokens::Tokens;

fn gate(policy: Policy, hosts: &[&str]) -> Gate {
    // The value stays when the sender has gone.
    let (_, policy) = watch::channel(Arc::new(policy));
    Gate::new(policy, hosts.iter().map(|&host| host.to_owned()).collect())
}

fn request(method: &str, path: &str, headers: &[(&str, &str)]) -> Request<()> {
    let mut request = Request::builder().method(method).uri(path);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    request.body(()).unwrap()
}

#[test]
fn without_tokens_the_host_must_not_be_anothers() {
    let gate = gate(Policy::Everybody, &["bones.example.org"]);
    let this = host_name().unwrap();
    for (host, known) in [
        ("127.0.0.1:7000", true),
        ("127.0.0.1", true),
        ("10.1.2.3:80", true),
        ("[::1]:7000", true),
        ("[::1]", true),
        ("localhost:1", true),
        ("LocalHost", true),
        (this.as_str(), true),
        ("bones.example.org:443", true),
        ("localhost.evil.example:7000", false),
        ("evil.example:7000", false),
        ("evil.example", false),
        ("127.0.0.1.evil.example", false),
        ("", false),
    ] {
        let admitted = gate.admit(&request("GET", "/", &[("host", host)]));
        let expected = Err(GateRefusal::UnknownHost { host: host.to_owned() });
        assert_eq!(admitted.map(|_| ()), if known { Ok(()) } else { expected }, "{host}");
    }
}

#[test]
fn with_tokens_any_host_may_be_named() {
    let gate = gate(Policy::Tokens(Tokens::default()), &[]);
    let host = [("host", "bones.example.org")];
    assert!(gate.admit(&request("GET", "/", &host)).is_ok());
    let denied = gate.admit(&request("GET", "/data/jobs", &host)).unwrap_err();
    assert_eq!(denied, GateRefusal::Denied(AccessDenied::NoToken));
}

#[test]
fn other_pages_are_refused() {
    let gate = gate(Policy::Everybody, &[]);
    let (host, cancel) = (("host", "127.0.0.1:7000"), "/data/jobs/1/cancel");
    for (method, path, header, admitted) in [
        ("POST", cancel, None, true),
        ("POST", cancel, Some(("sec-fetch-site", "same-origin")), true),
        ("POST", cancel, Some(("sec-fetch-site", "none")), false),
        ("POST", cancel, Some(("sec-fetch-site", "same-site")), false),
        ("POST", cancel, Some(("sec-fetch-site", "cross-site")), false),
        ("POST", cancel, Some(("origin", "http://127.0.0.1:7000")), true),
        ("POST", cancel, Some(("origin", "http://127.0.0.1:7001")), false),
        ("POST", cancel, Some(("origin", "https://evil.example")), false),
        ("POST", cancel, Some(("origin", "null")), false),
        ("GET", "/data/jobs", Some(("sec-fetch-site", "none")), true),
        ("GET", "/data/jobs", Some(("sec-fetch-site", "cross-site")), false),
        ("GET", "/events", Some(("origin", "https://evil.example")), false),
        // A link on another page.
        ("GET", "/", Some(("sec-fetch-site", "cross-site")), true),
    ] {
        let headers: Vec<_> = [Some(host), header].into_iter().flatten().collect();
        let found = gate.admit(&request(method, path, &headers));
        let expected = if admitted { Ok(()) } else { Err(GateRefusal::CrossSite) };
        assert_eq!(found.map(|_| ()), expected, "{method} {path} {header:?}");
    }
}
