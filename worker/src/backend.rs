//! What computes realizations for a worker: its cores, or another computing device.

use std::fmt;

use osteon_common::outcome::Solved;
use osteon_proto::batch::Work;

use crate::error::PanickedCase;

/// A computing device. Whatever it is, an outcome is a function of the work and the index alone, to
/// the bit.
pub(crate) trait Backend: fmt::Debug + Send {
    /// How many realizations it computes at the same time: the coordinator sizes batches by it.
    fn slots(&self) -> u32;

    /// Begins a batch without waiting for it, and calls `done` once with how it ended, on any
    /// thread. Batches begin in the order of the calls.
    fn start(&mut self, task: Task, work: Work, done: Done);

    /// Nobody waits for a batch any more, because it has ended or was taken back. One that has not
    /// ended ends soon, as [`Computed::Abandoned`].
    fn forget(&mut self, task: Task);
}

/// What a backend calls at the end of a batch.
pub(crate) type Done = Box<dyn FnOnce(Computed) + Send>;

/// One batch of one attachment. Batch numbers are unique for one life of a coordinator only, so
/// an answer is told from a late one by the number of the attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Task {
    /// Number of the attachment, grows with every one.
    pub(crate) attachment: u64,
    /// Number of the batch.
    pub(crate) batch: u64,
}

/// How the computation of a batch ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Computed {
    /// All realizations, in index order.
    Complete {
        /// The realizations.
        solved: Vec<Solved>,
        /// Wall time, s.
        elapsed_s: f64,
    },
    /// Given up before its end, as was asked for.
    Abandoned,
    /// The computation panicked.
    Panicked {
        /// On this realization.
        case: Box<PanickedCase>,
        /// With this message.
        message: String,
    },
}
