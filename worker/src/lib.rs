//! Attaches to an osteon coordinator, runs batches of realizations on its cores, answers.
//!
//! - `state`: what the worker knows, and what it does on each event; no clock, no socket, no await;
//! - `backend`: what computes a batch, as the two others see it;
//! - `compute`: the backend that there is, the cores; never on the async runtime;
//! - `run`: the one async file, which moves bytes between the two and the coordinator.
//!
//! A worker holds nothing that is worth keeping: when it dies its batches are computed elsewhere,
//! to the same bits.

mod backend;
mod backoff;
mod compute;
mod error;
mod run;
mod state;

pub use error::{PanickedCase, WorkerError};
pub use run::{WorkerConfig, run};
