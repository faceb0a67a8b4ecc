//! The live page: what a coordinator shows to people in a browser, and its data as JSON.
//!
//! Nothing here keeps a state of its own: every number is an answer of the core or of the store.
//! `gate` decides which requests are answered, `routes` answers them, and `events` is the stream
//! that keeps a page up to date.

pub(crate) mod assets;
pub(crate) mod course;
pub(crate) mod events;
pub(crate) mod gate;
pub(crate) mod json;
pub mod listener;
pub(crate) mod overview;
pub(crate) mod query;
pub(crate) mod routes;
pub(crate) mod source;
