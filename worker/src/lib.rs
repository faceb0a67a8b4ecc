//! Attaches to an osteon coordinator, runs batches of realizations on its cores, and returns the
//! outcomes.
//!
//! - `state`: state machine of the worker, with its reaction to each event; no clock, no socket, no
//!   await;
//! - `backend`: the interface of a computing device, as `state` and `run` see it;
//! - `compute`: the only backend, the processor cores; it never runs on the async runtime;
//! - `run`: the only async file, which moves bytes between state, backend and coordinator.
//!
//! - `self_test`: a small batch with a known digest, which a worker computes before it attaches.
//!
//! A worker holds nothing worth keeping: if it dies, its batches are computed elsewhere, to the
//! same bits.

#![forbid(unsafe_code)]

mod backend;
mod backoff;
mod batch_spans;
mod compute;
mod error;
mod run;
mod self_test;
mod state;

pub use error::{PanickedCase, WorkerError};
pub use run::{WorkerConfig, run};
pub use self_test::{KNOWN_DIGEST, known_batch_digest};
