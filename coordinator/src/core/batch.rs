//! A batch that a worker holds, and the purpose for which it is computed.

use std::time::Duration;

use crate::core::ids::{BatchId, JobId, WorkerId};
use crate::core::indices::Indices;

/// A batch that a worker holds.
#[derive(Debug)]
pub(crate) struct Batch {
    pub(crate) assignment: Assignment,
    pub(crate) purpose: Purpose,
    pub(crate) worker: WorkerId,
    pub(crate) sent: Duration,
    /// Time when its worker could begin it: when it was sent, or when the worker answered the batch
    /// sent to it before this one, whichever was later.
    pub(crate) begun: Duration,
    /// Computing time that was charged to its client.
    pub(crate) charged: Duration,
    /// The other batches with the same indices and purpose, held by other workers.
    pub(crate) duplicates: Vec<BatchId>,
    /// 0, or for a duplicate sent because a batch was overdue: one more than that batch's.
    pub(crate) retries: u32,
}

impl Batch {
    /// Returns a batch that a worker gets `now`.
    pub(crate) fn new(
        assignment: Assignment,
        purpose: Purpose,
        worker: WorkerId,
        now: Duration,
    ) -> Self {
        Self {
            assignment,
            purpose,
            worker,
            sent: now,
            begun: now,
            charged: Duration::ZERO,
            duplicates: Vec::new(),
            retries: 0,
        }
    }
}

/// Why a batch is computed. A duplicate has the purpose of the batch that it duplicates: of both answers
/// the first counts, whichever batch was sent first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It fills indices of the evaluation that the search asked for.
    Fill,
    /// It fills an index over which workers crashed. Its worker holds no other batch meanwhile.
    Exclusive,
    /// It fills indices of a point that the search has not asked for yet.
    Speculative,
    /// Its answer is compared with the answer of another worker.
    Audit {
        /// Number of workers that were lost over it.
        lost: u32,
    },
    /// Its answer decides between answers that differ.
    TieBreak,
    /// Its answer proves that its worker computes a setup as other hosts do.
    Proof,
}

impl Purpose {
    /// Returns its name in metrics and spans.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Fill => "fill",
            Self::Exclusive => "exclusive",
            Self::Speculative => "speculative",
            Self::Audit { .. } => "audit",
            Self::TieBreak => "tie_break",
            Self::Proof => "proof",
        }
    }

    /// Returns whether the answer fills indices of an evaluation.
    pub(crate) fn fills(self) -> bool {
        matches!(self, Self::Fill | Self::Exclusive | Self::Speculative)
    }
}

/// The indices that a batch computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Assignment {
    pub(crate) job: JobId,
    /// Number of the attempt at an evaluation.
    pub(crate) attempt: u64,
    pub(crate) indices: Indices,
}
