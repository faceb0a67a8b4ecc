//! What an ended job left, out of the store: without computing its path again, so that neither its
//! length nor the version that went it matters.

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobResult};
use thiserror::Error;

use crate::ids::JobId;
use crate::store::{EndRecord, Store, StoreError};

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
    /// The job was forgotten meanwhile.
    #[error("there is no job {job} any more: it was pruned")]
    Pruned {
        /// The job.
        job: JobId,
    },
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
pub fn read(store: &mut dyn Store, end: &EndRecord) -> Result<Leftover, ReadError> {
    let job = end.job;
    let record = store.job(job)?.ok_or(ReadError::Pruned { job })?;
    let summary = store.summary(job)?.ok_or(ReadError::NoSummary { job })?;
    let outcomes = match summary.best {
        Some(number) => {
            let best = store.evaluation(job, number)?;
            Some(best.ok_or(ReadError::NoBest { job, number })?.outcomes)
        }
        None => None,
    };
    let specification = (*record.specification).clone();
    let result = summary.result(&specification, &end.ending, &end.version, outcomes.as_deref());
    Ok(Leftover { specification, result, history: summary.history })
}

#[cfg(test)]
mod tests;
