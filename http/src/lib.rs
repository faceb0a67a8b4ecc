//! The server of all listeners that speak HTTP/1.1: the metrics and the live page of a coordinator, and
//! UM-Bridge. What they answer is a router of theirs, and how many connections they admit is theirs to
//! decide; that no client holds a connection by silence, by a long header, or by not reading, and that a
//! browser's other pages are told apart, is the same for all.

#![forbid(unsafe_code)]

mod other_pages;
mod server;
mod stalled;

pub use self::other_pages::{OwnHosts, host_of, is_cross_site};
pub use self::server::{ConnectionBounds, Connections, accept};
