//! Tells requests that other pages have a user's browser send from those of the page itself. A browser carries out the
//! requests of every page that it shows, to any address that it reaches, also on the user's own machine. Two things
//! tell: the host that a request names, and where the browser says that it comes from. Programs say nothing of the
//! kind.
//!
//! The type of the content does not tell: pages may send only some types without asking first, but programs send
//! those, too.

use std::net::IpAddr;
use std::sync::Arc;

use axum::http::header::{HOST, HeaderName, ORIGIN};
use axum::http::{HeaderMap, Method, Request};

/// Where a request comes from, as the browser says.
const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The hosts that a request may name.
#[derive(Debug, Clone)]
pub struct OwnHosts(Arc<Vec<String>>);

impl OwnHosts {
    /// Returns the hosts `further` together with those of this machine, which may have a name.
    pub fn new(machine: Option<String>, mut further: Vec<String>) -> Self {
        further.push("localhost".to_owned());
        further.extend(machine);
        Self(Arc::new(further))
    }

    /// Returns whether a host is an address, or a name that leads nowhere else. Any other name may belong
    /// to somebody who lets it lead to this machine, so that browsers take that page for this machine's.
    pub fn contain(&self, host: &str) -> bool {
        let name = without_port(host);
        let address =
            name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        address.parse::<IpAddr>().is_ok()
            || self.0.iter().any(|known| known.eq_ignore_ascii_case(name))
    }
}

/// Returns the host that a request names; browsers always name one.
pub fn host_of<B>(request: &Request<B>) -> Option<&str> {
    let header = request.headers().get(HOST).and_then(|value| value.to_str().ok());
    header.or_else(|| Some(request.uri().authority()?.as_str()))
}

/// Returns whether another page had the browser send a request to `host`. Programs send neither header.
pub fn is_cross_site(headers: &HeaderMap, method: &Method, host: &str) -> bool {
    match headers.get(SEC_FETCH_SITE).map(|value| value.as_bytes()) {
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

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        // The colons of an address are in brackets.
        Some((name, port)) if !port.contains(']') => name,
        _ => host,
    }
}
