//! The pure state machine of a coordinator: jobs, searches, batches and leases. It is given events
//! and the time, and returns effects; it knows no clock, no socket and no future.

pub(crate) mod ahead;
pub(crate) mod answer_delay;
pub mod audit;
pub(crate) mod batch;
pub mod close_reason;
pub mod completion;
pub(crate) mod crashes;
pub mod dispute;
pub(crate) mod distribution;
pub mod effect;
pub mod evaluation;
pub mod event;
pub(crate) mod explain;
pub mod failure;
pub(crate) mod fairness;
pub mod ids;
pub mod indices;
pub(crate) mod job;
pub(crate) mod job_pages;
pub(crate) mod measurements;
pub mod notice;
pub(crate) mod probation;
pub(crate) mod rate;
pub mod reactor;
pub(crate) mod realization_time;
pub mod sanity;
pub(crate) mod saved;
pub(crate) mod service_order;
pub(crate) mod snapshot;
pub mod state;
pub(crate) mod tally;
pub(crate) mod upkeep;
pub(crate) mod worker_list;
pub mod worker_name;
