//! Errors of the store.

use std::path::PathBuf;

use thiserror::Error;

use crate::core::ids::JobId;

/// Error of the store.
///
/// A message is complete: it contains the message of its cause, which is not returned as its
/// source, so that printing the chain does not repeat it.
#[derive(Debug, Error)]
pub enum StoreError {
    /// SQLite reported an error.
    #[error("{}: {error}", path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// The error of SQLite.
        error: rusqlite::Error,
    },
    /// The directory cannot be created.
    #[error("cannot create {}: {error}; choose another directory", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// The lock file, which names the process that has the store open, cannot be written.
    #[error(
        "cannot write and lock {}: {error}; give the coordinator's user write permission to its \
         directory, or choose another directory, on a disk that supports file locks",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// The disk has no space for a new file.
    #[error("no room is left for {}: {error}; make room on its disk", path.display())]
    NoRoom {
        /// The file.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// The file cannot be created.
    #[error(
        "cannot make {}: {error}; give the coordinator's user write permission to its directory, \
         or \
         choose another directory",
        path.display()
    )]
    Make {
        /// The file.
        path: PathBuf,
        /// The cause.
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
        /// The process that has it open, for people.
        holder: String,
    },
    /// The disk is full.
    #[error("no room is left for {}: {error}; make room on its disk", path.display())]
    Full {
        /// The file.
        path: PathBuf,
        /// The error of SQLite.
        error: rusqlite::Error,
    },
    /// The operating system fails to read or write it.
    #[error(
        "{} cannot be read or written: {error}; check the disk and its quota",
        path.display()
    )]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of SQLite.
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
        /// The error of SQLite.
        error: rusqlite::Error,
    },
    /// SQLite reports it as damaged or not a database.
    #[error(
        "{} is damaged or not a database: {error}; restore the file from a copy, or choose another \
         directory",
        path.display()
    )]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// The error of SQLite.
        error: rusqlite::Error,
    },
    /// The store is in memory, so there is no file to copy.
    #[error("this coordinator keeps its jobs in memory; there is nothing to copy")]
    NoFile,
    /// A copy of it cannot be made or removed.
    #[error("{} cannot be created or removed: {error}; check its directory", path.display())]
    Copy {
        /// The file of the copy.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// SQLite's integrity check found damage.
    #[error(
        "{} is damaged: {found}; restore the file from a copy, or choose another directory",
        path.display()
    )]
    Inconsistent {
        /// The file.
        path: PathBuf,
        /// The first finding of SQLite.
        found: String,
    },
    /// It holds tables of another program.
    #[error(
        "{} is a database of another program and is not changed; choose another directory",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// It was written by a version of osteon with another format.
    #[error(
        "{}: this store has format {found}; this version writes {known}: run the version that \
         wrote \
         it, or choose another directory",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        found: i64,
        /// The only supported format.
        known: i64,
    },
    /// The mark of acknowledged jobs cannot be read or written.
    #[error(
        "cannot read or write {}: {error}; give the coordinator's user write permission to it and \
         its directory, and check its disk",
        path.display()
    )]
    Mark {
        /// The file.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// The mark of acknowledged jobs is damaged.
    #[error(
        "{} is damaged: it cannot be determined whether acknowledged jobs are missing; check the \
         disk, restore the store from a copy, or start with --accept-lost-jobs",
        path.display()
    )]
    MarkDamaged {
        /// The file.
        path: PathBuf,
    },
    /// Jobs that clients had been told were accepted are missing.
    #[error(
        "{} has lost {}, which had been accepted: its write-ahead log was cut short or damaged, \
         or it was replaced by an older copy; check the disk, restore the store from a copy, or \
         start with --accept-lost-jobs to go on without them",
        path.display(),
        if first == last { format!("job {first}") } else { format!("jobs {first} to {last}") }
    )]
    LostJobs {
        /// The file.
        path: PathBuf,
        /// The first missing job.
        first: JobId,
        /// The last missing job.
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
        /// Number of evaluations found.
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
        /// The record.
        record: DamagedRecord,
    },
}

/// A record that cannot be read.
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
    /// The summary of the path of the search.
    #[error("the summary")]
    Summary,
    /// The ban of a worker that gave a wrong answer in the job.
    #[error("the ban of a worker, found in a realization")]
    Ban,
}
