//! Why the stream of a worker is closed.

use std::time::Duration;

use osteon_proto::malformed::Malformed;
use thiserror::Error;

use crate::ids::BatchId;

/// Why a worker's stream is closed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CloseReason {
    /// Its numerics differ from the coordinator's.
    #[error(
        "this worker's numerics are `{}`, the coordinator's are `{coordinator}`; \
         results would not be reproducible: run the same version of osteon on both",
        worker.escape_debug()
    )]
    FingerprintDiffers {
        /// Fingerprint of the worker.
        worker: String,
        /// Fingerprint of the coordinator.
        coordinator: String,
    },
    /// It was found to compute wrongly.
    #[error(
        "this worker is expelled: it {reason}; check its machine, and start it again when it is \
         repaired"
    )]
    Banned {
        /// What was found.
        reason: String,
    },
    /// An impossible number of slots.
    #[error("this worker announces {slots} threads; 1 to {max} are allowed")]
    Slots {
        /// What it announced.
        slots: u32,
        /// Most slots allowed.
        max: u32,
    },
    /// A name of its introduction is too long.
    #[error("a name in this worker's hello has {bytes} bytes; at most {max} are allowed")]
    NameTooLong {
        /// Its length.
        bytes: usize,
        /// Most bytes allowed.
        max: usize,
    },
    /// Too many workers are attached.
    #[error("{limit} workers are attached already, the most allowed; attach again later")]
    TooManyWorkers {
        /// Most workers allowed.
        limit: usize,
    },
    /// Nothing was heard of it.
    #[error("nothing was heard of this worker for {silent:?}; its lease has ended, attach again")]
    Expired {
        /// For how long.
        silent: Duration,
    },
    /// It lives, but does not answer.
    #[error(
        "this worker has not answered anything it holds for {waited:?}; its lease has ended, \
         attach again"
    )]
    Unanswering {
        /// For how long.
        waited: Duration,
    },
    /// It does not read what is sent to it.
    #[error("this worker does not read its stream; its lease has ended, attach again")]
    NotReading,
    /// A message that no worker of this version sends.
    #[error("a message of this worker is malformed: {0}")]
    Malformed(#[from] Malformed),
    /// An answer of the wrong length.
    #[error("the answer to batch {batch} has {found} realizations, expected {expected}")]
    WrongCount {
        /// The batch.
        batch: BatchId,
        /// How many it has.
        found: usize,
        /// How many it must have.
        expected: u64,
    },
    /// A second hello.
    #[error("this worker said hello twice on one stream")]
    SecondHello,
    /// It wanted to leave, and has answered everything.
    #[error("this worker has drained")]
    Drained,
    /// The coordinator is stopping.
    #[error("the coordinator is shutting down; attach again when it is back")]
    Draining,
}
