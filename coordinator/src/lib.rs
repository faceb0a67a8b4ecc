//! Jobs, searches, dispatch, reduction and the public gRPC API of osteon.
//!
//! The coordinator consists of a state ([`state`]), synchronous reactions to events ([`event`],
//! [`reactor`]) that never read a clock, and effects ([`effect`]). An asynchronous shell around it
//! only moves bytes. An [`osteon_search::Search`] decides which points a job evaluates and does not
//! depend on workers; [`store`] holds everything that outlives the process. This crate never links
//! the solver: only workers solve.

mod accept;
pub mod access;
mod access_layer;
pub mod audit;
mod backing_up;
mod batch;
pub mod close_reason;
pub mod config;
mod core_task;
mod crashes;
pub mod dispute;
pub mod effect;
pub mod evaluation;
pub mod event;
mod failing;
pub mod failure;
mod fairness;
mod fetching;
pub mod ids;
pub mod indices;
mod job;
pub mod job_output;
mod limiter;
pub mod listen;
mod message_body;
pub mod notice;
mod observers;
pub mod open_files;
mod outbound;
mod probation;
mod rate;
pub mod reactor;
mod realization_time;
pub mod sanity;
mod service_jobs;
mod service_workers;
mod shell;
mod snapshot;
pub mod state;
pub mod store;
mod store_thread;
pub mod tls;
pub mod tokens;
mod worker_list;
pub mod worker_name;

pub use access::Policy;
pub use config::Config;
pub use failing::ComponentFailure;
pub use listen::{BindError, ListenAddress, Listener};
pub use shell::{Coordinator, StartError, start};
pub use tls::Tls;
pub use tokens::Tokens;
