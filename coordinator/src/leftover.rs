//! What an ended job left, out of the store: without computing its path again, so that neither its
//! length nor the version that went it matters.

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, JobResult};
use thiserror::Error;

use crate::ids::JobId;
use crate::search::Summary;
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
    let mut reading = Reading::new(end.clone());
    loop {
        if let Some(leftover) = reading.step(store)? {
            return Ok(leftover);
        }
    }
}

/// Reading what a job left record by record, so that others have the store in between: a record
/// may be as large as ten million realizations.
#[derive(Debug)]
pub(crate) struct Reading {
    end: EndRecord,
    record: Option<JobRecord>,
    summary: Option<Summary>,
}

impl Reading {
    /// Nothing is read yet.
    pub(crate) fn new(end: EndRecord) -> Self {
        Self { end, record: None, summary: None }
    }

    /// Reads the next record; what the job left, once that was the last. Blocks for that long.
    ///
    /// # Errors
    /// When the store cannot be read, or something is missing in it.
    pub(crate) fn step(&mut self, store: &mut dyn Store) -> Result<Option<Leftover>, ReadError> {
        let job = self.end.job;
        let Some(record) = &self.record else {
            self.record = Some(store.job(job)?.ok_or(ReadError::Pruned { job })?);
            return Ok(None);
        };
        let Some(summary) = self.summary.take() else {
            let summary = store.summary(job)?;
            self.summary = Some(found(store, job, summary, ReadError::NoSummary { job })?);
            return Ok(None);
        };
        let best = match summary.best {
            Some(number) => {
                let best = store.evaluation(job, number)?;
                Some(found(store, job, best, ReadError::NoBest { job, number })?.outcomes)
            }
            None => None,
        };
        let specification = (*record.specification).clone();
        let (ending, version) = (&self.end.ending, &self.end.version);
        let result = summary.result(&specification, ending, version, best.as_deref());
        Ok(Some(Leftover { specification, result, history: summary.history }))
    }
}

/// What is missing was forgotten with its job, or is `lost`.
fn found<T>(
    store: &mut dyn Store,
    job: JobId,
    read: Option<T>,
    lost: ReadError,
) -> Result<T, ReadError> {
    match read {
        Some(read) => Ok(read),
        None if store.job(job)?.is_none() => Err(ReadError::Pruned { job }),
        None => Err(lost),
    }
}

#[cfg(test)]
mod tests;
