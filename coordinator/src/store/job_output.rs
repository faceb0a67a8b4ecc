//! Output of an ended job, read from the store. The path of the search is not computed again, so
//! neither its length nor the program version that computed it matters. The inference from the data
//! is computed here, from the stored evaluations.

use std::sync::Arc;

use osteon_common::job::JobSpecification;
use osteon_common::outcomes::Outcomes;
use osteon_common::results::{BestPoint, Evaluation, GroupResult, JobResult};
use osteon_search::Summary;
use thiserror::Error;
use tokio::sync::oneshot;

use crate::core::ids::JobId;
use crate::store::{EndRecord, JobRecord, Store, StoreError};

/// Output of an ended job.
#[derive(Debug, Clone, PartialEq)]
pub struct JobOutput {
    /// The specification.
    pub specification: JobSpecification,
    /// The result, with the outcomes of every best point.
    pub result: JobResult,
    /// Rows of the history, in order.
    pub history: Vec<Evaluation>,
}

/// Error when the output of a job cannot be read.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The job has been deleted meanwhile.
    #[error("no such job: {job}; it was deleted in the meantime")]
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

/// Reads the whole output of a job. Blocks.
///
/// # Errors
/// When the store cannot be read, or something is missing in it.
pub fn read(store: &mut dyn Store, end: &EndRecord) -> Result<JobOutput, OutputError> {
    let job = end.job;
    let JobRecord { specification, .. } = job_record(store, job)?;
    let left = StoredOutput { end: end.clone(), specification, summary: summary(store, job)? };
    let mut read =
        |number: Option<u64>| number.map(|number| outcomes(store, job, number)).transpose();
    let groups = (0..left.groups()).map(|set| Ok(left.group(set, read(left.best_of(set))?)));
    let groups: Vec<_> = groups.collect::<Result<_, OutputError>>()?;
    let mut result = left.result(read(left.best())?);
    result.groups = groups.into_iter().flatten().collect();
    let StoredOutput { specification, summary, .. } = left;
    let specification = Arc::unwrap_or_clone(specification);
    Ok(JobOutput { specification, result, history: summary.history })
}

/// Output of an ended job without its outcomes, which may need more memory than there is.
#[derive(Debug)]
pub(crate) struct StoredOutput {
    /// The end of the job.
    pub(crate) end: EndRecord,
    /// The specification.
    pub(crate) specification: Arc<JobSpecification>,
    /// Summary of the path of its search.
    pub(crate) summary: Summary,
}

impl StoredOutput {
    /// Returns the number of the best evaluation, if one was feasible; `None` where the data are
    /// groups.
    pub(crate) fn best(&self) -> Option<u64> {
        self.summary.best
    }

    /// Returns the number of groups of the data whose searches have ended.
    pub(crate) fn groups(&self) -> usize {
        match &self.specification.data {
            Some(data) if data.is_grouped() => data.sets().min(self.summary.groups.len()),
            _ => 0,
        }
    }

    /// Returns the number of the best evaluation of a group, if one was feasible.
    pub(crate) fn best_of(&self, set: usize) -> Option<u64> {
        self.summary.groups.get(set)?.best
    }

    /// Returns the result without its groups, given the outcomes of the best evaluation. Computes
    /// the inference from the data.
    pub(crate) fn result(&self, outcomes: Option<Outcomes>) -> JobResult {
        let best = self.best_point(self.best(), outcomes);
        let EndRecord { ending, program, .. } = &self.end;
        self.summary.result(&self.specification, ending, program, best, Vec::new())
    }

    /// Returns the result of a group, given the outcomes of its best evaluation. Computes the
    /// inference from its data.
    pub(crate) fn group(&self, set: usize, outcomes: Option<Outcomes>) -> Option<GroupResult> {
        let best = self.best_point(self.best_of(set), outcomes);
        self.summary.group(&self.specification, set, best)
    }

    fn best_point(&self, number: Option<u64>, outcomes: Option<Outcomes>) -> Option<BestPoint> {
        let (number, outcomes) = number.zip(outcomes)?;
        self.summary.best_point(&self.specification, number, &outcomes)
    }
}

/// A request to read one record of an ended job.
#[derive(Debug)]
pub(crate) enum ReadRequest {
    /// The job record.
    Job(JobId, Reply<JobRecord>),
    /// The summary of the path of its search.
    Summary(JobId, Reply<Summary>),
    /// The outcomes of the evaluation with this number.
    Outcomes(JobId, u64, Reply<Outcomes>),
}

/// Channel for a record that was read.
pub(crate) type Reply<T> = oneshot::Sender<Result<T, OutputError>>;

impl ReadRequest {
    /// Reads the record, unless the receiver has gone. Blocks meanwhile.
    pub(crate) fn serve(self, store: &mut dyn Store) {
        // The receiver may be dropped during the read.
        match self {
            Self::Job(job, reply) if !reply.is_closed() => {
                drop(reply.send(job_record(store, job)));
            }
            Self::Summary(job, reply) if !reply.is_closed() => {
                drop(reply.send(summary(store, job)));
            }
            Self::Outcomes(job, number, reply) if !reply.is_closed() => {
                drop(reply.send(outcomes(store, job, number)));
            }
            Self::Job(..) | Self::Summary(..) | Self::Outcomes(..) => {}
        }
    }
}

fn job_record(store: &mut dyn Store, job: JobId) -> Result<JobRecord, OutputError> {
    store.job(job)?.ok_or(OutputError::Pruned { job })
}

fn summary(store: &mut dyn Store, job: JobId) -> Result<Summary, OutputError> {
    let summary = store.summary(job)?;
    found(store, job, summary, OutputError::NoSummary { job })
}

fn outcomes(store: &mut dyn Store, job: JobId, number: u64) -> Result<Outcomes, OutputError> {
    let evaluation = store.evaluation(job, number)?;
    let evaluation = found(store, job, evaluation, OutputError::NoBest { job, number })?;
    Ok(evaluation.outcomes)
}

/// Returns the record that was read. If there is none, the error is `Pruned` where the job has been
/// deleted, otherwise `lost`.
fn found<T>(
    store: &mut dyn Store,
    job: JobId,
    read: Option<T>,
    lost: OutputError,
) -> Result<T, OutputError> {
    match read {
        Some(read) => Ok(read),
        None if store.job(job)?.is_none() => Err(OutputError::Pruned { job }),
        None => Err(lost),
    }
}

#[cfg(test)]
pub(crate) mod tests;
