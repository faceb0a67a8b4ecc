//! What an ended job left, out of the store: without computing its path again, so that neither its
//! length nor the version that went it matters. What the data say is computed here, from what is read.

use std::sync::Arc;

use osteon_common::job::{Data, JobSpecification};
use osteon_common::outcome::Outcome;
use osteon_common::results::{BestPoint, Evaluation, GroupResult, JobResult};
use osteon_search::Summary;
use thiserror::Error;
use tokio::sync::oneshot;

use crate::ids::JobId;
use crate::store::{EndRecord, JobRecord, Store, StoreError};

/// What an ended job left.
#[derive(Debug, Clone, PartialEq)]
pub struct Leftover {
    /// What was to be computed.
    pub specification: JobSpecification,
    /// The result, with the outcomes of every best point.
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
    #[error("no such job: {job}; it was pruned meanwhile")]
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

/// Reads what a job left, all at once. Blocks.
///
/// # Errors
/// When the store cannot be read, or something is missing in it.
pub fn read(store: &mut dyn Store, end: &EndRecord) -> Result<Leftover, ReadError> {
    let job = end.job;
    let JobRecord { specification, .. } = job_record(store, job)?;
    let left = Left { end: end.clone(), specification, summary: summary(store, job)? };
    let mut read =
        |number: Option<u64>| number.map(|number| outcomes(store, job, number)).transpose();
    let groups = (0..left.groups()).map(|set| Ok(left.group(set, read(left.best_of(set))?)));
    let groups: Vec<_> = groups.collect::<Result<_, ReadError>>()?;
    let mut result = left.result(read(left.best())?);
    result.groups = groups.into_iter().flatten().collect();
    let Left { specification, summary, .. } = left;
    let specification = Arc::unwrap_or_clone(specification);
    Ok(Leftover { specification, result, history: summary.history })
}

/// What an ended job left but its outcomes, of which there may be more than memory holds.
#[derive(Debug)]
pub(crate) struct Left {
    /// How it ended.
    pub(crate) end: EndRecord,
    /// What was to be computed.
    pub(crate) specification: Arc<JobSpecification>,
    /// What its path came to.
    pub(crate) summary: Summary,
}

impl Left {
    /// Number of the best evaluation, if one was feasible; `None` where the data are groups.
    pub(crate) fn best(&self) -> Option<u64> {
        self.summary.best
    }

    /// Groups of the data whose searches have ended.
    pub(crate) fn groups(&self) -> usize {
        match &self.specification.data {
            Some(Data::Groups(groups)) => groups.len().min(self.summary.groups.len()),
            _ => 0,
        }
    }

    /// Number of the best evaluation of a group, if one was feasible.
    pub(crate) fn best_of(&self, set: usize) -> Option<u64> {
        self.summary.groups.get(set)?.best
    }

    /// The result without its groups, given the outcomes of the best evaluation. Computes what the data
    /// say.
    pub(crate) fn result(&self, outcomes: Option<Arc<[Outcome]>>) -> JobResult {
        let best = self.best_point(self.best(), outcomes);
        let EndRecord { ending, program, .. } = &self.end;
        self.summary.result(&self.specification, ending, program, best, Vec::new())
    }

    /// What was found for a group, given the outcomes of its best evaluation. Computes what its data say.
    pub(crate) fn group(
        &self,
        set: usize,
        outcomes: Option<Arc<[Outcome]>>,
    ) -> Option<GroupResult> {
        let best = self.best_point(self.best_of(set), outcomes);
        self.summary.group(&self.specification, set, best)
    }

    fn best_point(
        &self,
        number: Option<u64>,
        outcomes: Option<Arc<[Outcome]>>,
    ) -> Option<BestPoint> {
        let (number, outcomes) = number.zip(outcomes)?;
        self.summary.best_point(&self.specification, number, &outcomes)
    }
}

/// One record of what an ended job left, to be read for somebody.
#[derive(Debug)]
pub(crate) enum Reading {
    /// The job.
    Job(JobId, Reply<JobRecord>),
    /// What its path came to.
    Summary(JobId, Reply<Summary>),
    /// The outcomes of the evaluation with this number.
    Outcomes(JobId, u64, Reply<Arc<[Outcome]>>),
}

/// Where a record that was read goes.
pub(crate) type Reply<T> = oneshot::Sender<Result<T, ReadError>>;

impl Reading {
    /// Reads it, unless nobody waits for it any more. Blocks for that long.
    pub(crate) fn serve(self, store: &mut dyn Store) {
        // Who asked may go while it is read.
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

fn job_record(store: &mut dyn Store, job: JobId) -> Result<JobRecord, ReadError> {
    store.job(job)?.ok_or(ReadError::Pruned { job })
}

fn summary(store: &mut dyn Store, job: JobId) -> Result<Summary, ReadError> {
    let summary = store.summary(job)?;
    found(store, job, summary, ReadError::NoSummary { job })
}

fn outcomes(store: &mut dyn Store, job: JobId, number: u64) -> Result<Arc<[Outcome]>, ReadError> {
    let evaluation = store.evaluation(job, number)?;
    let evaluation = found(store, job, evaluation, ReadError::NoBest { job, number })?;
    Ok(evaluation.outcomes)
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
pub(crate) mod tests;
