//! What an operator, or a test, may choose.

use std::time::Duration;

use osteon_common::limits::{ACTIVE_JOBS_MAX, ACTIVE_REALIZATIONS_MAX, CALL_S_MAX, JOBS_BYTES_MAX};

use crate::audit::AuditKey;

/// Fraction of the batches that a second worker computes too, unless an operator chooses otherwise.
pub const AUDIT_FRACTION: f64 = 0.01;

/// Settings of a coordinator. None of them changes a bit of any result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// The commit that the program was built from, which results name; `None` if nobody knows.
    pub commit: Option<&'static str>,
    /// How often both sides of a worker's stream give a sign of life.
    pub heartbeat: Duration,
    /// A lease ends after this long without a message.
    pub expiry: Duration,
    /// A worker that gives signs of life but answers nothing that it holds for this long has
    /// lost its lease too.
    pub answer_timeout: Duration,
    /// Computing time that a batch should take.
    pub batch_target: Duration,
    /// Fraction of the batches that a second worker computes too, 0 to 1.
    pub audit_fraction: f64,
    /// Decides which; a running coordinator draws its own.
    pub audit_key: AuditKey,
    /// Whether slots that nobody has work for compute points that a search may ask for next.
    pub speculation: bool,
    /// Ended jobs are forgotten after this long; `None`: when a client wants it.
    pub keep_ended: Option<Duration>,
    /// How often time is looked at; also the shortest interval between two snapshots.
    pub tick: Duration,
    /// Most jobs that are computed at a time; the others wait in the order of their acceptance.
    pub active_jobs_max: usize,
    /// Most realizations that the evaluations of these have together. A job finds room beyond it if
    /// nothing else is computed.
    pub active_realizations_max: u64,
    /// Most bytes that the specifications of jobs that have not ended take together; those of one
    /// client a quarter.
    pub jobs_bytes_max: u64,
    /// How long a failed write to the store waits before it is tried again.
    pub store_retry: Duration,
    /// When the store has refused a record for this long, [`crate::Coordinator::failed`] says so;
    /// `None`: never. In either case the record is tried again until it is taken.
    pub store_patience: Option<Duration>,
    /// Longest time from a call to the beginning of its answer.
    pub call_timeout: Duration,
    /// Longest time that a shutdown waits for streams to end and for the store.
    pub shutdown_timeout: Duration,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            commit: None,
            heartbeat: Duration::from_secs(2),
            expiry: Duration::from_secs(10),
            answer_timeout: Duration::from_secs(600),
            batch_target: Duration::from_millis(200),
            audit_fraction: AUDIT_FRACTION,
            audit_key: AuditKey::default(),
            speculation: true,
            keep_ended: None,
            tick: Duration::from_millis(100),
            active_jobs_max: ACTIVE_JOBS_MAX,
            active_realizations_max: ACTIVE_REALIZATIONS_MAX,
            jobs_bytes_max: JOBS_BYTES_MAX,
            store_retry: Duration::from_secs(2),
            store_patience: None,
            call_timeout: Duration::from_secs(CALL_S_MAX),
            shutdown_timeout: Duration::from_secs(5),
        }
    }
}
