//! What outlives a coordinator: jobs, their evaluations, how they ended.
//!
//! The interface is small and synchronous; one blocking thread calls it. Each `put` returns when
//! the record is durable, and putting the same record again is no error, so that a write whose
//! answer was lost can be repeated.

use std::collections::BTreeSet;
use std::fs::File;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::Outcome;
use osteon_common::parameters::Point;
use osteon_common::results::{EstimatedError, Evaluation, Moments};
use osteon_common::version::Program;
use osteon_search::{Ending, Summary};
use thiserror::Error;

use crate::ids::JobId;
use crate::worker_name::WorkerName;

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
    /// Who submitted it, as the client says; jobs of one client share what is its.
    pub client: String,
    /// Its rank among the jobs of its client: a higher one goes first.
    pub priority: u32,
    /// What people call it; may be empty.
    pub name: String,
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
    /// Estimated errors of the successes, unless there are none.
    pub estimated_error: Option<EstimatedError>,
    /// Everybody whose answers are in it.
    pub workers: BTreeSet<WorkerName>,
}

/// A worker that was found to compute wrongly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BanRecord {
    /// Number of the ban, from 1.
    pub number: u64,
    /// The worker.
    pub worker: WorkerName,
    /// The job in which it was found.
    pub job: JobId,
    /// What was found, in a sentence.
    pub reason: String,
    /// When, since the Unix epoch.
    pub at: Duration,
}

/// The end of a job, with what a snapshot of it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct EndRecord {
    /// The job.
    pub job: JobId,
    /// How it ended.
    pub ending: Ending,
    /// The program that computed it.
    pub program: Program,
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
        program: Program,
        ended: Duration,
        evaluations: u64,
        best: Option<&Evaluation>,
    ) -> Self {
        Self {
            job,
            ending,
            program,
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
    /// How many evaluations the store has of it.
    pub evaluations: u64,
}

/// Why the store did not do what it was asked.
///
/// A message is complete: it contains that of its cause, which is no source of it, so that nobody
/// who prints the chain says it twice.
#[derive(Debug, Error)]
pub enum StoreError {
    /// SQLite refused.
    #[error("{}: {error}", path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// What it said.
        error: rusqlite::Error,
    },
    /// The directory cannot be made.
    #[error("cannot create {}: {error}; choose another directory", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The file that says who has the store open cannot be written.
    #[error(
        "cannot write and lock {}: {error}; give the coordinator's user write permission to its \
         directory, or choose another one, on a disk that knows locks",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// There is no room for a new file.
    #[error("no room is left for {}: {error}; make room on its disk", path.display())]
    NoRoom {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The file cannot be made.
    #[error(
        "cannot make {}: {error}; give the coordinator's user write permission to its directory, or \
         choose another directory",
        path.display()
    )]
    Make {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// Another process has it open.
    #[error(
        "{} is in use by {holder}; stop that one, or choose another directory",
        path.display()
    )]
    InUse {
        /// The file.
        path: PathBuf,
        /// Who has it, for people.
        holder: String,
    },
    /// There is no room.
    #[error("no room is left for {}: {error}; make room on its disk", path.display())]
    Full {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        error: rusqlite::Error,
    },
    /// The system fails to read or write it.
    #[error(
        "{} cannot be read or written: {error}; check the disk and its quota",
        path.display()
    )]
    Io {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        error: rusqlite::Error,
    },
    /// It cannot be opened or written.
    #[error(
        "{} cannot be written: {error}; give the coordinator's user write permission to it and \
         its directory, or choose another directory",
        path.display()
    )]
    NotWritable {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        error: rusqlite::Error,
    },
    /// SQLite cannot make sense of it.
    #[error(
        "{} is damaged or not a database: {error}; restore the file from a copy, or choose another \
         directory",
        path.display()
    )]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        error: rusqlite::Error,
    },
    /// There is no file to copy.
    #[error("this coordinator keeps its jobs in memory; there is nothing to copy")]
    NoFile,
    /// A copy of it cannot be made.
    #[error("{} cannot be made or removed: {error}; look at its directory", path.display())]
    Copy {
        /// The file of the copy.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// Its pages do not fit together.
    #[error(
        "{} is damaged: {found}; restore the file from a copy, or choose another directory",
        path.display()
    )]
    Inconsistent {
        /// The file.
        path: PathBuf,
        /// What SQLite found first.
        found: String,
    },
    /// Another program's tables are in it.
    #[error(
        "{} is a database of another program and is left as it is; choose another directory",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// A version of osteon with another format wrote it.
    #[error(
        "{}: this store has format {found}; this version writes {known}: run the version that wrote \
         it, or choose another directory",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        found: i64,
        /// The only format known.
        known: i64,
    },
    /// The mark of acknowledged jobs cannot be read or written.
    #[error(
        "cannot read or write {}: {error}; give the coordinator's user write permission to it and \
         its directory, and see that its disk is sound",
        path.display()
    )]
    Mark {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The mark of acknowledged jobs makes no sense.
    #[error(
        "{} is damaged: whether acknowledged jobs are missing cannot be told; look at the disk, \
         restore the store from a copy, or start with --accept-lost-jobs",
        path.display()
    )]
    MarkDamaged {
        /// The file.
        path: PathBuf,
    },
    /// Jobs whose clients were told that they are accepted are not there.
    #[error(
        "{} has lost {}, which had been accepted: its write-ahead log was cut short or damaged, or \
         an older copy of it was put in place; look at the disk, restore the store from a copy, or \
         start with --accept-lost-jobs to go on without them",
        path.display(),
        if first == last { format!("job {first}") } else { format!("jobs {first} to {last}") }
    )]
    LostJobs {
        /// The file.
        path: PathBuf,
        /// The first that is missing.
        first: JobId,
        /// The last.
        last: JobId,
    },
    /// An evaluation is missing.
    #[error(
        "{} has {found} evaluations of job {job}, but the last has number {last}; restore the file \
         from a copy, or choose another directory",
        path.display()
    )]
    Gap {
        /// The file.
        path: PathBuf,
        /// The job.
        job: JobId,
        /// How many there are.
        found: u64,
        /// Number of the last, from 0.
        last: u64,
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
    /// A ban of a worker that was found in it.
    #[error("the expulsion of a worker, found in a realization")]
    Ban,
}

/// What is done between two pieces of a copy; `Break` ends it.
pub type Between<'a> = dyn FnMut(&mut dyn Store) -> ControlFlow<()> + 'a;

/// A durable place for jobs.
pub trait Store {
    /// All jobs, in the order of their identifiers.
    ///
    /// # Errors
    /// As [`visit_jobs`](Self::visit_jobs).
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError> {
        let mut jobs = Vec::new();
        self.visit_jobs(&mut |job| jobs.push(job))?;
        Ok(jobs)
    }

    /// A copy of the whole store, as it is when this returns: a SQLite file that is open for
    /// reading and that nobody else can find. `None` if `between` ended it. The copy is made in
    /// pieces; after each of them `between` may use the store, and what it changes is in the copy.
    ///
    /// # Errors
    /// When the store is no file, cannot be read, or the copy cannot be written beside it.
    fn copy(&mut self, between: &mut Between<'_>) -> Result<Option<File>, StoreError> {
        // Where nothing is copied there is nothing between.
        let _ = between;
        Err(StoreError::NoFile)
    }

    /// Shows `visit` all jobs, in the order of their identifiers. One is in memory at a time.
    ///
    /// # Errors
    /// When the store cannot be read, or an evaluation is missing before one that is there.
    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError>;

    /// One job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError>;

    /// One evaluation of a job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError>;

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

    /// Makes an evaluation durable, in the place of the one with the same number; with
    /// `is_last`, forgets all after it: both or neither.
    ///
    /// # Errors
    /// When that is not durable.
    fn put_evaluation(
        &mut self,
        record: &EvaluationRecord,
        is_last: bool,
    ) -> Result<(), StoreError>;

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

    /// Forgets ended jobs and all that belongs to them: all of them or none. The room they took
    /// is given back as far as the store can.
    ///
    /// # Errors
    /// When that is not durable.
    fn forget_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError>;

    /// The highest identifier of a job that was forgotten: no other job gets it, since somebody
    /// may still ask for it.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn last_forgotten(&mut self) -> Result<Option<JobId>, StoreError>;

    /// Makes durable that a worker is banned.
    ///
    /// # Errors
    /// When that is not durable.
    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError>;

    /// All banned workers, in the order of their numbers.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError>;

    /// Ended jobs with evaluations that a worker contributed to.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn ended_with(&mut self, worker: &WorkerName) -> Result<Vec<JobId>, StoreError>;

    /// Forgets all banned workers.
    ///
    /// # Errors
    /// When that is not durable.
    fn forget_bans(&mut self) -> Result<(), StoreError>;
}
