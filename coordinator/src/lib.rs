//! Jobs, searches, dispatch, reduction and the public gRPC API of osteon.
//!
//! The coordinator consists of a pure state machine ([`core`]) and an asynchronous shell around it
//! ([`service`]) that only moves bytes. [`access`] decides who may call what; [`store`] holds
//! everything that outlives the process; `metrics` is what is exported for monitoring, and [`live`] the
//! page that shows jobs to people. An [`osteon_search::Search`] decides which points a job evaluates and does not depend on
//! workers. This crate never links the solver: only workers solve.

#![forbid(unsafe_code)]

pub mod access;
pub mod config;
pub mod core;
#[cfg(feature = "live")]
pub mod live;
pub(crate) mod metrics;
pub mod service;
pub mod store;

pub use access::Policy;
pub use access::tls::Tls;
pub use access::tokens::Tokens;
pub use config::Config;
#[cfg(feature = "live")]
pub use live::listener::PageBindError;
pub use service::failure_reporter::ComponentFailure;
pub use service::listen::{BindError, ListenAddress, Listener};
pub use service::metrics_listener::{MetricsBindError, MetricsListener};
pub use service::shell::{Coordinator, StartError, start};
