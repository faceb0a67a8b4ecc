//! The durable state of a coordinator: jobs, their evaluations and their ends.
//!
//! The interface is small and synchronous; one blocking thread calls it. Each `put` returns when
//! the record is durable, unless it is part of a group ([`Store::together`]). Putting the same
//! record again is not an error, so that a write whose answer was lost can be repeated.

mod error;
pub(crate) mod group;
pub mod job_output;
pub mod memory;
pub mod sqlite;
pub(crate) mod thread;

use std::collections::BTreeSet;
use std::fs::File;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::outcome::RealizationResult;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::results::{EstimatedError, Evaluation, Moments};
use osteon_common::version::Program;
use osteon_search::{Ending, Summary};

use crate::core::ids::JobId;
use crate::core::worker_name::WorkerName;

pub use self::error::{DamagedRecord, StoreError};

/// An accepted job.
#[derive(Debug, Clone, PartialEq)]
pub struct JobRecord {
    /// Its identifier.
    pub job: JobId,
    /// Identifier of the request that submitted it; empty if it had none.
    pub request_id: String,
    /// The specification.
    pub specification: Arc<JobSpecification>,
    /// Time of acceptance, since the Unix epoch.
    pub accepted: Duration,
    /// Fingerprint of the numerics that its stored evaluations were computed with.
    pub fingerprint: String,
    /// Name of the client, as it gave it. The jobs of a client share its computing time.
    pub client: String,
    /// Priority among the jobs of its client: higher values go first.
    pub priority: u32,
    /// Display name; may be empty.
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
    pub outcomes: Outcomes,
    /// Estimated errors of the successes, unless there are none.
    pub estimated_error: Option<EstimatedError>,
    /// All workers whose answers are in it.
    pub workers: BTreeSet<WorkerName>,
}

/// Number of outcomes in the row of an evaluation, and in each of its pieces but the last.
pub const PIECE_OUTCOMES: usize = 1 << 16;

/// A piece of an evaluation: so many of its outcomes, after the first ones.
#[derive(Debug, Clone, PartialEq)]
pub struct PieceRecord {
    /// The job.
    pub job: JobId,
    /// Number of the evaluation.
    pub number: u64,
    /// Index of the first outcome, a multiple of [`PIECE_OUTCOMES`], not 0.
    pub first: u64,
    /// The outcomes, in index order.
    pub outcomes: Outcomes,
}

/// Results that an evaluation has received so far.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRecord {
    /// The job.
    pub job: JobId,
    /// The point of the evaluation.
    pub point: Point,
    /// The results.
    pub pieces: Vec<PartPiece>,
}

/// Results of consecutive indices that one worker gave.
#[derive(Debug, Clone, PartialEq)]
pub struct PartPiece {
    /// The first index.
    pub first: u64,
    /// The worker.
    pub by: WorkerName,
    /// The results in index order.
    pub results: Vec<RealizationResult>,
}

/// A host that was banned for wrong answers of a worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BanRecord {
    /// Number of the ban, from 1.
    pub number: u64,
    /// The worker whose answer was found wrong.
    pub worker: WorkerName,
    /// The job in which a wrong answer was found.
    pub job: JobId,
    /// The finding, as a sentence.
    pub reason: String,
    /// Time of the ban, since the Unix epoch.
    pub at: Duration,
    /// Time when an operator lifted it, since the Unix epoch.
    pub lifted: Option<Duration>,
}

/// An ended job with answers of a host that was banned later.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DoubtRecord {
    /// The job.
    pub job: JobId,
    /// Number of the ban.
    pub ban: u64,
    /// Digest of the result that the job had, once it has been begun again.
    pub digest: Option<String>,
}

/// The end of a job, with the values that its snapshot shows.
#[derive(Debug, Clone, PartialEq)]
pub struct EndRecord {
    /// The job.
    pub job: JobId,
    /// Status and reason of the end.
    pub ending: Ending,
    /// The program that computed the job.
    pub program: Program,
    /// Time of the end, since the Unix epoch.
    pub ended: Duration,
    /// Number of complete evaluations.
    pub evaluations: u64,
    /// Cost of the best feasible point.
    pub best_cost: Option<f64>,
    /// Moments at the best feasible point.
    pub best_moments: Option<Moments>,
}

impl EndRecord {
    /// Returns the end of a job whose best feasible evaluation is `best`.
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

/// A job as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredJob {
    /// The job.
    pub record: JobRecord,
    /// Its end, if it has ended.
    pub end: Option<EndRecord>,
    /// Number of its evaluations in the store.
    pub evaluations: u64,
}

/// Changes of a store that become durable together.
pub type Changes<'a> = dyn FnMut(&mut dyn Store) -> Result<(), StoreError> + 'a;

/// Callback between two pieces of a copy; `Break` ends the copy.
pub type BetweenPieces<'a> = dyn FnMut(&mut dyn Store) -> ControlFlow<()> + 'a;

/// Durable storage for jobs.
pub trait Store {
    /// Makes several records durable at once: calls `changes`, which puts them and stops at the first
    /// that is refused. None is durable before this returns.
    ///
    /// # Errors
    /// When a record is refused, or not all are durable. Some may be durable all the same, so put
    /// each of them again to learn which.
    fn together(&mut self, changes: &mut Changes<'_>) -> Result<(), StoreError>;

    /// Does some of the work that no record has to wait for: what is durable is so already. Returns
    /// whether there is more.
    fn settle(&mut self) -> bool {
        false
    }

    /// Returns the length of a log, bytes, that could not be emptied the last time that this was due; `None` if it
    /// could, or if there is no log.
    fn stuck_log(&self) -> Option<u64> {
        None
    }

    /// Returns all jobs, in the order of their identifiers.
    ///
    /// # Errors
    /// As [`visit_jobs`](Self::visit_jobs).
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError> {
        let mut jobs = Vec::new();
        self.visit_jobs(&mut |job| jobs.push(job))?;
        Ok(jobs)
    }

    /// Returns a copy of the whole store as of the return of this call: a SQLite file that is open
    /// for reading and has no name in the file system. `None` if `between` ended it. The copy is
    /// made in pieces; after each of them `between` may use the store, and its changes are included
    /// in the copy.
    ///
    /// # Errors
    /// When the store is not a file or cannot be read, or the copy cannot be written beside it.
    fn copy(&mut self, between: &mut BetweenPieces<'_>) -> Result<Option<File>, StoreError> {
        // A store that copies nothing never calls it.
        let _ = between;
        Err(StoreError::NoFile)
    }

    /// Calls `visit` with each job, in the order of their identifiers. One is in memory at a time.
    ///
    /// # Errors
    /// When the store cannot be read, or an evaluation is missing before one that is there.
    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError>;

    /// Returns one job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError>;

    /// Returns one evaluation of a job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError>;

    /// Deletes the evaluations of a job and records `fingerprint` as the numerics it is computed
    /// with from now on, both in one transaction.
    ///
    /// # Errors
    /// When that is not durable.
    fn reset_job(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError>;

    /// Makes a job durable.
    ///
    /// # Errors
    /// When it is not durable.
    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError>;

    /// Makes an evaluation durable, replacing the one with the same number. With `deletes_later`, all
    /// evaluations after it are deleted in the same transaction: they belong to another path of the search.
    ///
    /// # Errors
    /// When that is not durable.
    fn put_evaluation(
        &mut self,
        record: &EvaluationRecord,
        deletes_later: bool,
    ) -> Result<(), StoreError>;

    /// Keeps results of an evaluation until the evaluation at the same point is stored, or its job ends
    /// or begins again. They only save time, so a store may do without.
    ///
    /// # Errors
    /// When they are not durable.
    fn put_part(&mut self, record: &PartRecord) -> Result<(), StoreError> {
        let _ = record;
        Ok(())
    }

    /// Keeps a piece of an evaluation that is not stored yet, so that less is left to be written when it is. If
    /// the evaluation then has other outcomes, the piece is replaced. A store may do nothing here.
    ///
    /// # Errors
    /// When it is not durable.
    fn put_piece(&mut self, record: &PieceRecord) -> Result<(), StoreError> {
        let _ = record;
        Ok(())
    }

    /// Returns the results that are kept for a job, without damaged ones.
    ///
    /// # Errors
    /// When they cannot be read.
    fn parts(&mut self, job: JobId) -> Result<Vec<PartRecord>, StoreError> {
        let _ = job;
        Ok(Vec::new())
    }

    /// Makes evaluations of a job with consecutive numbers durable, and deletes all evaluations after
    /// them.
    ///
    /// # Errors
    /// When that is not durable; some of them may be.
    fn put_evaluations(&mut self, records: &[EvaluationRecord]) -> Result<(), StoreError> {
        records.iter().try_for_each(|record| self.put_evaluation(record, true))
    }

    /// Makes the end of a job and the summary of its search durable, both in one transaction.
    ///
    /// # Errors
    /// When they are not durable.
    fn finish_job(&mut self, end: &EndRecord, summary: &Summary) -> Result<(), StoreError>;

    /// Returns the summary of an ended job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError>;

    /// Deletes ended jobs and all their records in one transaction. Their disk space is released as
    /// far as the store can.
    ///
    /// # Errors
    /// When that is not durable.
    fn delete_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError>;

    /// Returns the highest identifier of a deleted job. It is never assigned again, since a client
    /// may still ask for that job.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn last_deleted_job(&mut self) -> Result<Option<JobId>, StoreError>;

    /// Makes the ban of a host, or that it is lifted, durable. With a new ban, the ended jobs that the host
    /// contributed to become doubtful.
    ///
    /// # Errors
    /// When that is not durable.
    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError>;

    /// Returns all bans, in the order of their numbers.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError>;

    /// Returns the jobs that were or are doubtful, in the order of their identifiers.
    ///
    /// # Errors
    /// When the store cannot be read.
    fn doubts(&mut self) -> Result<Vec<DoubtRecord>, StoreError>;

    /// Makes an ended job an unfinished one again, in one transaction. Its evaluations stay, and the digest of
    /// its result is kept with the doubts about it. Returns the job; `None` if there is none.
    ///
    /// # Errors
    /// When that is not durable.
    fn reopen_job(&mut self, job: JobId) -> Result<Option<StoredJob>, StoreError>;
}
