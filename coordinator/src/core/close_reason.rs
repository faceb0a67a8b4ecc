//! Reasons for closing a worker's stream.

use std::time::Duration;

use osteon_proto::malformed::Malformed;
use thiserror::Error;

use crate::core::ids::BatchId;

/// Reason for closing a worker's stream.
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
    /// Its program has another version than the coordinator, although its numerics are the same.
    #[error(
        "this worker is osteon {}, the coordinator is osteon {coordinator}: run the same version on both",
        worker.escape_debug()
    )]
    VersionDiffers {
        /// Version of the worker.
        worker: String,
        /// Version of the coordinator.
        coordinator: &'static str,
    },
    /// Too many workers of its host attach in a short time.
    #[error("too many workers of host {host} attach in a short time; attach again later")]
    AttachesTooOften {
        /// The host.
        host: String,
    },
    /// A velocity in an answer is beyond what the layers can carry.
    #[error(
        "this worker answered a velocity of {velocity:e} m/s, which no bone can carry; its answer is refused: \
         run `osteon doctor` on its machine"
    )]
    ImpossibleVelocity {
        /// The velocity, m/s.
        velocity: f64,
    },
    /// A worker of its host was banned for wrong answers.
    #[error(
        "host {host} is banned: one of its workers {reason}; run `osteon doctor` on it, and when it is \
         repaired, lift the ban with `osteon worker unban {host}`"
    )]
    Banned {
        /// The host.
        host: String,
        /// The finding, which completes "it …".
        reason: String,
    },
    /// It announced an invalid number of slots.
    #[error("this worker announces {slots} slots; 1 to {max} are allowed")]
    Slots {
        /// Announced number of slots.
        slots: u32,
        /// Maximum number of slots.
        max: u32,
    },
    /// A text in its hello message is too long.
    #[error("a name in this worker's hello has {bytes} bytes; at most {max} are allowed")]
    NameTooLong {
        /// Length of the text, bytes.
        bytes: usize,
        /// Maximum length, bytes.
        max: usize,
    },
    /// Too many workers are attached.
    #[error("{limit} workers are attached already, the most allowed; attach again later")]
    TooManyWorkers {
        /// Maximum number of workers.
        limit: usize,
    },
    /// It sent nothing until its lease expired.
    #[error("no message came from this worker for {silent:?}; its lease has ended, attach again")]
    Expired {
        /// Time since its last message.
        silent: Duration,
    },
    /// It is alive, but does not answer its batches.
    #[error(
        "this worker has not answered any of its batches for {waited:?}; its lease has ended, \
         attach again"
    )]
    Unanswering {
        /// Time without an answer.
        waited: Duration,
    },
    /// It does not read the messages sent to it.
    #[error("this worker does not read its stream; its lease has ended, attach again")]
    NotReading,
    /// A message that no worker of this version sends.
    #[error("a message of this worker is malformed: {0}")]
    Malformed(#[from] Malformed),
    /// An answer has the wrong number of realizations.
    #[error("the answer to batch {batch} has {found} realizations, expected {expected}")]
    WrongCount {
        /// The batch.
        batch: BatchId,
        /// Number of realizations in the answer.
        found: usize,
        /// Number of realizations in the batch.
        expected: u64,
    },
    /// It sent a second hello message.
    #[error("this worker sent a second hello on one stream")]
    SecondHello,
    /// It was draining and has answered everything.
    #[error("this worker has drained")]
    Drained,
    /// The coordinator is shutting down. (Not a worker that drains.)
    #[error("the coordinator is shutting down; attach again when it is back")]
    Draining,
}
