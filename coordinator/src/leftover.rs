//! What an ended job left, out of the store: without computing its path again, so that neither its
//! length nor the version that went it matters.

use std::ops::ControlFlow;

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobResult};
use thiserror::Error;

use crate::ids::JobId;
use crate::store::{EndRecord, JobRecord, Store, StoreError};

/// What an ended job left.
#[derive(Debug, Clone, PartialEq)]
pub struct Leftover {
    /// What was to be computed.
    pub specification: JobSpecification,
    /// The result.
    pub result: JobResult,
    /// Rows of the history, in order.
    pub history: Vec<Evaluation>,
}

/// Why what a job left cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The summary is missing.
    #[error("the store has the end of job {job} but no summary; restore a copy of the store")]
    NoSummary {
        /// The job.
        job: JobId,
    },
    /// The best evaluation is missing.
    #[error("the store has no evaluation {number} of job {job}, its best; restore a copy of it")]
    NoBest {
        /// The job.
        job: JobId,
        /// Number of the evaluation.
        number: u64,
    },
}

/// Reads what a job left. Blocks.
///
/// # Errors
/// When the store cannot be read, or something is missing in it.
pub fn read(
    store: &mut dyn Store,
    record: &JobRecord,
    end: &EndRecord,
) -> Result<Leftover, ReadError> {
    let job = record.job;
    let summary = store.summary(job)?.ok_or(ReadError::NoSummary { job })?;
    let mut outcomes = None;
    if let Some(number) = summary.best {
        store.evaluations(job, number, &mut |stored| {
            outcomes = (stored.number == number).then_some(stored.outcomes);
            ControlFlow::Break(())
        })?;
        if outcomes.is_none() {
            return Err(ReadError::NoBest { job, number });
        }
    }
    let specification = (*record.specification).clone();
    let result = summary.result(&specification, &end.ending, &end.version, outcomes.as_deref());
    Ok(Leftover { specification, result, history: summary.history })
}

#[cfg(test)]
mod tests;
