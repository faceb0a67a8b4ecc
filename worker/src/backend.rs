//! Interface of a computing device that computes realizations: the processor cores, or another one.

use std::fmt;

use osteon_common::outcome::RealizationResult;
use osteon_proto::batch::Work;

use crate::error::PanickedCase;

/// A computing device. On every device, an outcome must be a function of the work and the index
/// alone, to the bit.
pub(crate) trait Backend: fmt::Debug + Send {
    /// Returns how many realizations it computes at the same time, 1 to `WORKER_THREADS_MAX`; the
    /// coordinator sizes batches by it.
    fn slots(&self) -> u32;

    /// Starts a batch without waiting for it. Calls `done` once with the result, on a thread of the
    /// device: `done` may block, and panics on the caller's thread, which belongs to the async
    /// runtime. Batches start in the order of the calls.
    fn start(&mut self, task: Task, work: Work, done: Done);

    /// Releases a batch that is no longer needed, because it has ended or was revoked. One that has
    /// not ended is interrupted and soon ends as [`Computed::Abandoned`].
    fn forget(&mut self, task: Task);
}

/// Callback at the end of a batch.
pub(crate) type Done = Box<dyn FnOnce(Computed) + Send>;

/// One batch of one attachment. Batch numbers are unique only within one run of a coordinator, so
/// the number of the attachment distinguishes a current result from a late one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Task {
    /// Number of the attachment, which increases with each attachment.
    pub(crate) attachment: u64,
    /// Number of the batch.
    pub(crate) batch: u64,
}

/// Result of the computation of a batch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Computed {
    /// All realizations are computed, in index order.
    Complete {
        solved: Vec<RealizationResult>,
        /// Wall time of the computation, s.
        elapsed_s: f64,
    },
    /// The computation was interrupted because the batch was released.
    Abandoned,
    Panicked {
        /// The realization at which it panicked.
        case: Box<PanickedCase>,
        message: String,
    },
}
