//! What an ended job left, out of the store: without computing its path again, so that neither its
//! length nor the version that went it matters.

use osteon_common::job::JobSpecification;
use osteon_common::results::{BestPoint, Evaluation, JobResult};
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
    /// Best points of the groups so far.
    of_groups: Vec<Option<BestPoint>>,
}

impl Reading {
    /// Nothing is read yet.
    pub(crate) fn new(end: EndRecord) -> Self {
        Self { end, record: None, summary: None, of_groups: Vec::new() }
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
        let Some(summary) = &self.summary else {
            let summary = store.summary(job)?;
            self.summary = Some(found(store, job, summary, ReadError::NoSummary { job })?);
            return Ok(None);
        };
        let specification = &record.specification;
        if let Some(group) = summary.groups.get(self.of_groups.len()) {
            let best = best(store, job, specification, summary, group.best)?;
            // The outcomes of all groups together may be very many.
            self.of_groups.push(best.map(|best| BestPoint { outcomes: Vec::new(), ..best }));
            return Ok(None);
        }
        let best = best(store, job, specification, summary, summary.best)?;
        let (ending, program) = (&self.end.ending, &self.end.program);
        let of_groups = std::mem::take(&mut self.of_groups);
        let result = summary.result(specification, ending, program, best, of_groups);
        let specification = (**specification).clone();
        let history = self.summary.take().map(|summary| summary.history).unwrap_or_default();
        Ok(Some(Leftover { specification, result, history }))
    }
}

/// The best point of a job or a group, whose evaluation has this number, if there is one.
fn best(
    store: &mut dyn Store,
    job: JobId,
    specification: &JobSpecification,
    summary: &Summary,
    number: Option<u64>,
) -> Result<Option<BestPoint>, ReadError> {
    let Some(number) = number else { return Ok(None) };
    let evaluation = store.evaluation(job, number)?;
    let evaluation = found(store, job, evaluation, ReadError::NoBest { job, number })?;
    Ok(summary.best_point(specification, number, &evaluation.outcomes))
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
