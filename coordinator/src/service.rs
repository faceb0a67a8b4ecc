//! The asynchronous shell around the state machine: listeners, gRPC services, streams and tasks. It
//! only moves bytes between the network, the store and the state machine.

pub(crate) mod accept;
pub(crate) mod backing_up;
pub(crate) mod beside;
pub(crate) mod control_frames;
pub(crate) mod core_task;
pub(crate) mod failure_reporter;
pub(crate) mod fetching;
pub(crate) mod job_spans;
pub(crate) mod jobs;
pub mod listen;
pub(crate) mod meter;
pub mod metrics_listener;
pub(crate) mod no_answer;
pub(crate) mod observers;
pub mod open_files;
pub(crate) mod outbound;
pub(crate) mod shell;
pub(crate) mod workers;
