//! All effects of a coordinator on the outside world, as one closed list.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::results::{Evaluation, Integrity};
use osteon_proto::batch::Work;
use osteon_proto::v1::{ExplainResponse, JobSnapshot, ListWorkersResponse, WorkerSnapshot};
use osteon_search::Summary;
use thiserror::Error;

use crate::core::close_reason::CloseReason;
use crate::core::completion::Completion;
use crate::core::ids::{BatchId, JobId, LeaseId, ReplyId, WorkerId};
use crate::core::notice::Notice;
use crate::store::{BanRecord, EndRecord, EvaluationRecord, JobRecord, PartRecord, PieceRecord};

/// An action for the shell.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Confirm to a worker that it is attached.
    Welcome {
        /// The worker.
        worker: WorkerId,
        /// Its lease.
        lease: LeaseId,
    },
    /// Send a batch.
    Send {
        /// The worker.
        worker: WorkerId,
        /// Number of the batch.
        batch: BatchId,
        /// The work.
        work: Work,
    },
    /// Revoke a batch.
    Revoke {
        /// The worker.
        worker: WorkerId,
        /// The batch.
        batch: BatchId,
    },
    /// Send a heartbeat to a worker.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
    },
    /// Drain a worker: it leaves when it has answered the batches that it holds.
    Drain {
        /// The worker.
        worker: WorkerId,
    },
    /// End a worker's stream.
    Close {
        /// The worker.
        worker: WorkerId,
        /// The reason.
        reason: CloseReason,
    },
    /// Complete an evaluation, and report both steps with an event each.
    Complete(Completion),
    /// Make a record durable, then report it with an event.
    Store(Record),
    /// Read an evaluation of a job, then report it with an event.
    Read {
        /// The job.
        job: JobId,
        /// Number of the evaluation.
        number: u64,
    },
    /// Delete ended jobs, then report it with an event.
    Prune {
        /// The request, if a client sent one.
        reply_id: Option<ReplyId>,
        /// The jobs.
        jobs: Vec<JobId>,
    },
    /// Make an ended job an unfinished one again in the store, then report it with an event.
    Reopen {
        /// The request.
        reply_id: ReplyId,
        /// The job.
        job: JobId,
    },
    /// Answer a request.
    Answer {
        /// The request.
        reply_id: ReplyId,
        /// The answer.
        answer: Answer,
    },
    /// Send a snapshot of a job to those who watch it.
    Publish {
        /// The job.
        job: JobId,
        /// The snapshot.
        snapshot: JobSnapshot,
    },
    /// Write a notice for the operator into the log.
    Note(Notice),
    /// Report that the store has failed: it has refused a record for longer than configured.
    ReportStoreFailure {
        /// Its last error.
        error: String,
        /// Time for which it has refused a record.
        waited: Duration,
    },
    /// Stop: everything is stored and every stream is closed.
    Stop,
}

/// A record to store.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// An accepted job.
    Job(JobRecord),
    /// A complete evaluation.
    Evaluation {
        /// The evaluation.
        record: EvaluationRecord,
        /// See [`Store::put_evaluation`](crate::store::Store::put_evaluation).
        deletes_later: bool,
    },
    /// Complete evaluations of a job with consecutive numbers, at least one. Evaluations stored after
    /// them are deleted.
    Evaluations(Vec<EvaluationRecord>),
    /// Results of an evaluation that is not complete, or that the search has not asked for. They are
    /// only a help: nothing waits for them, and they are not part of any result.
    Part(PartRecord),
    /// A piece of an evaluation that is not complete. Nothing waits for it: the record of the evaluation
    /// contains it too.
    Piece {
        /// The piece.
        record: PieceRecord,
        /// The attempt at the evaluation.
        attempt: u64,
    },
    /// The end of a job.
    End {
        /// The end.
        end: EndRecord,
        /// Summary of the path of its search.
        summary: Arc<Summary>,
    },
    /// A worker is banned.
    Ban(BanRecord),
}

impl Record {
    /// Returns the record of evaluations with consecutive numbers, at least one.
    pub(crate) fn of_evaluations(mut records: Vec<EvaluationRecord>, deletes_later: bool) -> Self {
        match records.pop() {
            Some(record) if records.is_empty() => Self::Evaluation { record, deletes_later },
            last => {
                records.extend(last);
                Self::Evaluations(records)
            }
        }
    }

    /// Returns the job and the key of the record.
    pub fn key(&self) -> (JobId, RecordKey) {
        match self {
            Self::Job(record) => (record.job, RecordKey::Job),
            Self::Evaluation { record, .. } => (record.job, RecordKey::Evaluation(record.number)),
            Self::Evaluations(records) => {
                let last = records.last().map(|last| (last.job, last.number));
                // There is at least one.
                let (job, number) = last.unwrap_or((JobId(0), 0));
                (job, RecordKey::Evaluation(number))
            }
            Self::Part(record) => (record.job, RecordKey::Part),
            Self::Piece { record, attempt } => (record.job, RecordKey::Piece(*attempt)),
            Self::End { end, .. } => (end.job, RecordKey::End),
            Self::Ban(record) => (record.job, RecordKey::Ban(record.number)),
        }
    }
}

/// Key of a record of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordKey {
    /// The job itself.
    Job,
    /// The evaluation with this number.
    Evaluation(u64),
    /// Results of an evaluation.
    Part,
    /// A piece of an evaluation, in the attempt with this number.
    Piece(u64),
    /// The end of the job.
    End,
    /// The ban with this number, of a worker that was found in this job.
    Ban(u64),
}

/// Answer to a request.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// The job is accepted and durable.
    Submitted(JobId),
    /// Snapshot of a job.
    Snapshot(JobSnapshot),
    /// What decides how fast a job is.
    Explained(ExplainResponse),
    /// A page of jobs.
    Page {
        /// Oldest first.
        snapshots: Vec<JobSnapshot>,
        /// Last job of the page, if there are more.
        more_after: Option<JobId>,
    },
    /// The present warnings for the operator, as sentences.
    Concerns(Vec<String>),
    /// The search of a job that has not ended.
    Followed(SearchRows),
    /// The job has ended; its output is in the store.
    Ended {
        /// Its end.
        end: EndRecord,
        /// What was found out about its hosts since.
        integrity: Option<Integrity>,
    },
    /// These ended jobs were deleted.
    Pruned(Vec<JobId>),
    /// The banned workers, with the time since their bans.
    Banned(Vec<(BanRecord, Duration)>),
    /// The attached workers, and those that departed last.
    Workers(ListWorkersResponse),
    /// Snapshot of a worker.
    Worker(WorkerSnapshot),
    /// The ban that is lifted.
    Unbanned(BanRecord),
    /// The request is refused.
    Refused(Refusal),
}

/// A part of the history of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchRows {
    /// The specification of the job.
    pub specification: Arc<JobSpecification>,
    /// Rows with consecutive numbers.
    pub rows: Vec<Evaluation>,
}

/// Why a request is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Refusal {
    /// There is no such job.
    #[error("no such job: {job}")]
    NoJob {
        /// The job asked for.
        job: JobId,
    },
    /// There is no such worker.
    #[error("no worker with number {worker} is attached")]
    NoWorker {
        /// The worker asked for.
        worker: WorkerId,
    },
    /// No ban of this host is in force.
    #[error("host `{}` is not banned; `osteon worker list` lists those that are", host.escape_debug())]
    NotBanned {
        /// The host asked for.
        host: String,
    },
    /// The job has no answers of a host that was banned later.
    #[error(
        "no host that computed a part of job {job} has been banned since; there is nothing to compute again"
    )]
    NoDoubt {
        /// The job.
        job: JobId,
    },
    /// The store could not begin the job again.
    #[error("the store cannot begin job {job} again; its result is as before: {error}")]
    NotReopened {
        /// The job.
        job: JobId,
        /// Error of the store.
        error: String,
    },
    /// The request id belongs to a job with another specification.
    #[error(
        "request id `{request_id}` belongs to job {job}, which has another specification; \
         choose another request id"
    )]
    RequestIdTaken {
        /// The request id.
        request_id: String,
        /// The job it belongs to.
        job: JobId,
    },
    /// Too many jobs of all clients are waiting or running.
    #[error(
        "{limit} jobs of all clients wait or run already, the most allowed; submit again when some have \
         ended"
    )]
    TooManyJobs {
        /// Maximum number of jobs.
        limit: usize,
    },
    /// Too many jobs of one client are waiting or running.
    #[error(
        "{limit} jobs of the client {client:?} wait or run already, the most that one client may have of \
         the {all} of all; submit again when some have ended, or cancel some"
    )]
    ClientHasTooManyJobs {
        /// Name of the client.
        client: String,
        /// Maximum number of jobs of one client.
        limit: usize,
        /// Maximum number of jobs of all clients.
        all: usize,
    },
    /// The specifications of the jobs that are waiting or running are too large together.
    #[error(
        "the specifications of {whose} jobs that wait or run take {held} bytes, with this one's \
         {more} more than the {limit} allowed; submit again when some have ended, or with fewer \
         measured velocities"
    )]
    TooMuchQueued {
        /// `this client's` or `all`.
        whose: &'static str,
        /// Size of the specifications held already, bytes.
        held: u64,
        /// Size of the refused specification, bytes.
        more: u64,
        /// Maximum total size, bytes.
        limit: u64,
    },
    /// The job has not ended.
    #[error("job {job} has not ended")]
    NotEnded {
        /// The job.
        job: JobId,
    },
    /// The coordinator is stopping.
    #[error("the coordinator is shutting down; try again when it is back")]
    Draining,
    /// The store could not delete the jobs.
    #[error("the store cannot delete the ended jobs; none was deleted: {error}")]
    NotPruned {
        /// Error of the store.
        error: String,
    },
    /// The store refused the job.
    #[error("the job could not be stored and is not accepted: {error}")]
    Store {
        /// Error of the store.
        error: String,
    },
}
