//! The server of all listeners that speak HTTP/1.1: the metrics and the live page of a coordinator, and
//! UM-Bridge. Each brings its router and its limit of connections. Common to all: clients are cut off that
//! hold a connection by silence, by a long header, or by not reading, and requests are recognized that
//! other sites' pages make a browser send.

#![forbid(unsafe_code)]

mod other_pages;
mod server;
mod stalled;

pub use self::other_pages::{OwnHosts, host_of, is_cross_site};
pub use self::server::{ConnectionBounds, Connections, accept};
