//! A batch that a worker holds, and why it is computed.

use std::time::Duration;

use crate::ids::{BatchId, JobId, WorkerId};
use crate::indices::Indices;

/// A batch that a worker holds.
#[derive(Debug)]
pub(crate) struct Batch {
    pub(crate) assignment: Assignment,
    pub(crate) purpose: Purpose,
    pub(crate) worker: WorkerId,
    pub(crate) sent: Duration,
    /// When its worker could begin it: when it was sent, or when the worker answered what it had
    /// been sent before.
    pub(crate) begun: Duration,
    /// Computing time that its client was charged for it.
    pub(crate) charged: Duration,
    /// The other batches with the same indices and purpose, held by other workers.
    pub(crate) duplicates: Vec<BatchId>,
    /// How many of them were sent before it because those before them were overdue.
    pub(crate) retries: u32,
}

impl Batch {
    /// Whether an idle worker may have a duplicate of it before it is overdue.
    pub(crate) fn may_be_duplicated(&self) -> bool {
        self.purpose == Purpose::Fill && self.duplicates.is_empty()
    }
}

/// Why a batch is computed. Its duplicates have the same purpose: which batch was first decides
/// nothing, so being a duplicate is a relation between batches and no purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It fills indices of the evaluation that the search asked for.
    Fill,
    /// It fills an index over which workers crashed. Its worker holds nothing else meanwhile.
    Exclusive,
    /// It fills indices of a point that the search has not asked for.
    Speculative,
    /// Its answer is compared with the answer of another worker.
    Audit {
        /// How many workers were lost over it.
        lost: u32,
    },
    /// Its answer decides between answers that differ.
    TieBreak,
}

impl Purpose {
    /// Whether the answer fills indices of an evaluation.
    pub(crate) fn fills(self) -> bool {
        matches!(self, Self::Fill | Self::Exclusive | Self::Speculative)
    }
}

/// What a batch is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Assignment {
    pub(crate) job: JobId,
    /// Attempt at an evaluation.
    pub(crate) attempt: u64,
    pub(crate) indices: Indices,
}
