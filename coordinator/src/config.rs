//! Settings of a coordinator, chosen by an operator or a test.

use std::time::Duration;

use osteon_common::limits::{
    ACTIVE_JOBS_MAX, ACTIVE_REALIZATIONS_MAX, CALL_SECONDS_MAX, JOBS_BYTES_MAX,
};

use crate::core::audit::AuditKey;

/// Default fraction of the realizations that another host computes too.
pub const AUDIT_FRACTION: f64 = 0.01;

/// Settings of a coordinator. None of them changes a bit of any result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// The commit that the program was built from, which results name; `None` if unknown.
    pub commit: Option<&'static str>,
    /// Interval of the heartbeats on both sides of a worker's stream.
    pub heartbeat: Duration,
    /// A lease expires after this long without a message.
    pub expiry: Duration,
    /// A lease also ends when a worker sends heartbeats but answers none of its batches for this
    /// long.
    pub answer_timeout: Duration,
    /// Computing time that a batch should take.
    pub batch_target: Duration,
    /// Fraction of the realizations that another host computes too, 0 to 1.
    pub audit_fraction: f64,
    /// Decides which batches are audited; a running coordinator draws its own key.
    pub audit_key: AuditKey,
    /// Whether each worker first computes what others computed, before its answers count.
    pub proofs: bool,
    /// Whether groups and starts that a search has not come to are computed at the same time as those
    /// before them.
    pub ahead: bool,
    /// Evaluations with at least this many realizations are completed beside the core.
    pub completed_aside_min: u64,
    /// Whether otherwise idle slots compute candidate points of searches speculatively.
    pub speculation: bool,
    /// Ended jobs are deleted after this long; `None`: only when a client requests it.
    pub keep_ended: Option<Duration>,
    /// Interval of the ticks, and the minimum interval between two snapshots.
    pub tick: Duration,
    /// Maximum number of active jobs. The others wait: jobs of the clients with the fewest active
    /// jobs begin first, of these the highest priority, then the oldest. A client without an active
    /// job may exceed the limit, up to twice its value.
    pub active_jobs_max: usize,
    /// Maximum number of realizations in the evaluations of the active jobs together. A job of a
    /// client without an active job may exceed it, up to twice its value, and any job if no other
    /// is active.
    pub active_realizations_max: u64,
    /// Maximum size of the specifications of all jobs that have not ended, bytes; those of one
    /// client may take a quarter of it.
    pub jobs_bytes_max: u64,
    /// Time after which a failed write to the store is repeated.
    pub store_retry: Duration,
    /// [`crate::Coordinator::failed`] completes when the store has refused a record for this long;
    /// `None`: never. In either case the write is repeated until it succeeds.
    pub store_give_up_after: Option<Duration>,
    /// Maximum time from a call to the beginning of its answer.
    pub call_timeout: Duration,
    /// Maximum time that a shutdown waits for streams to end and for the store.
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
            proofs: true,
            ahead: true,
            completed_aside_min: 20_000,
            speculation: true,
            keep_ended: None,
            tick: Duration::from_millis(100),
            active_jobs_max: ACTIVE_JOBS_MAX,
            active_realizations_max: ACTIVE_REALIZATIONS_MAX,
            jobs_bytes_max: JOBS_BYTES_MAX,
            store_retry: Duration::from_secs(2),
            store_give_up_after: None,
            call_timeout: Duration::from_secs(CALL_SECONDS_MAX),
            shutdown_timeout: Duration::from_secs(5),
        }
    }
}
