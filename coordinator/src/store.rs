//! What outlives a coordinator: jobs, their evaluations, how they ended.
//!
//! The interface is small and synchronous; one blocking thread calls it. Each `put` returns when
//! the record is durable, and putting the same record again is no error, so that a write whose
//! answer was lost can be repeated.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::results::{EstimatedError, Evaluation, Moments};
use thiserror::Error;

use crate::ids::JobId;
use crate::search::{Ending, Summary};

pub mod memory;
pub mod sqlite;

/// An accepted job.
#[derive(Debug, Clone, PartialEq)]
pub struct JobRecord {
    /// Its identifier.
    pub job: JobId,
    /// Identifier of the request that submitted it; empty if it had none.
    pub request_id: String,
    /// What to compute.
    pub specification: Arc<JobSpecification>,
    /// When it was accepted, since the Unix epoch.
    pub accepted: Duration,
    /// Fingerprint of the numerics that its stored evaluations were computed with.
    pub fingerprint: String,
}

/// A complete evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    /// The job.
    pub job: JobId,
    /// Number of the evaluation, from 0.
    pub number: u64,
    /// The point.
    pub point: Point,
    /// Outcomes in index order.
    pub outcomes: Arc<[Outcome]>,
    /// Estimated errors of the successes, unless there are none, or an older version has stored it.
    pub estimated_error: Option<EstimatedError>,
}

/// The end of a job, with what a snapshot of it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct EndRecord {
    /// The job.
    pub job: JobId,
    /// How it ended.
    pub ending: Ending,
    /// Version of the program that computed it.
    pub version: String,
    /// When, since the Unix epoch.
    pub ended: Duration,
    /// Complete evaluations.
    pub evaluations: u64,
    /// Cost of the best feasible point.
    pub best_cost: Option<f64>,
    /// Moments at the best feasible point.
    pub best_moments: Option<Moments>,
}

impl EndRecord {
    /// The end of a job whose best feasible evaluation is `best`.
    pub fn new(
        job: JobId,
        ending: Ending,
        ended: Duration,
        evaluations: u64,
        best: Option<&Evaluation>,
    ) -> Self {
        Self {
            job,
            ending,
            version: osteon_common::version::VERSION.to_owned(),
            ended,
            evaluations,
            best_cost: best.and_then(|row| row.cost),
            best_moments: best.and_then(|row| row.moments),
        }
    }
}

/// A job as the store has it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredJob {
    /// The job.
    pub record: JobRecord,
    /// Its end, if it has ended.
    pub end: Option<EndRecord>,
}

/// Why the store did not do what it was asked.
#[derive(Debug, Error)]
pub enum StoreError {
    /// SQLite refused.
    #[error("{}: {source}", path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: rusqlite::Error,
    },
    /// The directory cannot be made.
    #[error("cannot create {}: {source}; choose another directory", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Another process has it open.
    #[error(
        "{} is in use by another coordinator; stop that one, or choose another directory",
        path.display()
    )]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// An older version wrote it.
    #[error(
        "{} has format {found} of an older version of osteon, this program writes format {known}; \
         finish its jobs with the version that wrote it, or choose another directory",
        path.display()
    )]
    Older {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        found: i64,
        /// Only format known.
        known: i64,
    },
    /// A newer version wrote it.
    #[error(
        "{} has format {found}, this program writes format {known}; use a newer version of osteon, \
         or another directory",
        path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        found: i64,
        /// Newest format known.
        known: i64,
    },
    /// A record's checksum or encoding is wrong.
    #[error(
        "{} is damaged: {record} of job {job}; restore the file from a copy, or choose another \
         directory",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The job.
        job: JobId,
        /// Which record.
        record: DamagedRecord,
    },
}

/// Which record cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum DamagedRecord {
    /// The specification.
    #[error("the specification")]
    Specification,
    /// An evaluation.
    #[error("evaluation {0}")]
    Evaluation(u64),
    /// The end.
    #[error("the end")]
    End,
    /// What its path came to.
    #[error("the summary")]
    Summary,
}

/// A durable place for jobs.
pub trait Store: Send {
    /// All jobs, in the order of their identifiers.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError>;

    /// Shows `visit` the evaluations of a job from number `first` on, in the order of their
    /// numbers, until it breaks. One is in memory at a time.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn evaluations(
        &mut self,
        job: JobId,
        first: u64,
        visit: &mut dyn FnMut(EvaluationRecord) -> ControlFlow<()>,
    ) -> Result<(), StoreError>;

    /// Forgets the evaluations of a job, which from now on is computed with the numerics of
    /// `fingerprint`: both or neither.
    ///
    /// # Errors
    /// When that is not durable.
    fn begin_again(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError>;

    /// Makes a job durable.
    ///
    /// # Errors
    /// When it is not durable.
    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError>;

    /// Makes an evaluation durable.
    ///
    /// # Errors
    /// When it is not durable.
    fn put_evaluation(&mut self, record: &EvaluationRecord) -> Result<(), StoreError>;

    /// Makes the end of a job and what its path came to durable: both or neither.
    ///
    /// # Errors
    /// When they are not durable.
    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError>;

    /// What the path of an ended job came to.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError>;
}
