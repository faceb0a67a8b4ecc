//! A store in one SQLite file that any SQLite tool can open.
//!
//! It uses a write-ahead log (on network file systems a rollback journal) with an exclusive lock,
//! which is set first: no shared memory is needed and a second coordinator is refused. With
//! `synchronous = FULL`, a record is on the disk before it is reported. Each row has a BLAKE3
//! checksum of its other columns.

use std::cell::{Cell, RefCell};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

use osteon_common::results::{JobFailure, Moments, Status};
use osteon_common::version::Program;
use osteon_proto::specification;
use osteon_search::{Ending, Summary};
use prost::Message as _;
use rusqlite::{Connection, OptionalExtension as _, Row, params};

use super::{
    BanRecord, BetweenPieces, Changes, DamagedRecord, DoubtRecord, EndRecord, EvaluationRecord,
    JobRecord, PartRecord, PieceRecord, Store, StoreError, StoredJob,
};
use crate::core::ids::JobId;

mod acknowledged;
mod backup;
mod ban_rows;
mod columns;
mod evaluation_rows;
mod group;
mod job_row;
mod log;
mod opening;
mod parts;
mod schema;
mod store_trait;
mod summary;

pub use acknowledged::LostJobs;
use acknowledged::{LAST_DELETED_JOB, Mark, last_known, never_again};
use columns::{JobColumns, end_checksum, job_checksum, nanoseconds};
use job_row::{damaged_end, job_columns, job_record};
use log::Log;
use parts::StaleParts;

/// A group whose records are being put.
#[derive(Debug, Clone, Copy, Default)]
struct OpenGroup {
    /// The highest job among them, which the mark names once the group is durable.
    highest_job: Option<JobId>,
}

/// A store in a SQLite file.
#[derive(Debug)]
pub struct SqliteStore {
    connection: Connection,
    path: PathBuf,
    /// Held until the store is closed; names the process that uses the store.
    lock: File,
    /// Mark of the acknowledged jobs.
    mark: RefCell<Mark>,
    /// The group that is being put, if one is.
    group: Cell<Option<OpenGroup>>,
    log: Log,
    stale: RefCell<StaleParts>,
}

impl Drop for SqliteStore {
    fn drop(&mut self) {
        // A name that remains in the file does no harm: only the lock counts.
        let _ = self.lock.set_len(0);
    }
}

impl SqliteStore {
    /// Opens the store in `directory`, creating both if necessary.
    ///
    /// # Errors
    /// When the directory cannot be created or written, another coordinator has the store open, a
    /// version of osteon with another format or another program wrote it, it is damaged,
    /// acknowledged jobs are missing, or SQLite reports an error.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        Self::open_with(directory, LostJobs::Refuse)
    }

    /// As [`open`](Self::open); `lost` decides what happens when acknowledged jobs are missing.
    ///
    /// # Errors
    /// As [`open`](Self::open), except that missing jobs may be accepted.
    pub fn open_with(directory: &Path, lost: LostJobs) -> Result<Self, StoreError> {
        let acknowledged = |connection: &Connection, path: &Path| {
            let known = last_known(connection).map_err(|source| opening::refusal(path, source))?;
            let found = Mark::find(directory)?;
            let last = acknowledged::checked(&found, known, path, lost)?;
            Ok((found, known, last))
        };
        let (mut connection, lock, path, (found, known, last)) =
            opening::open(directory, acknowledged)?;
        backup::remove_leftover(&path)?;
        if last > known {
            never_again(&connection, last).map_err(|source| opening::refusal(&path, source))?;
        }
        let mark = RefCell::new(Mark::open(directory, &found, last)?);
        let log =
            Log::take_over(&mut connection).map_err(|source| opening::refusal(&path, source))?;
        Ok(Self {
            connection,
            path,
            lock,
            mark,
            group: Cell::new(None),
            log,
            stale: RefCell::default(),
        })
    }

    /// Creates a directory for a store, if there is none; other users cannot access it.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn make_directory(directory: &Path) -> std::io::Result<()> {
        opening::make_directory(directory)
    }

    fn refused(&self, source: rusqlite::Error) -> StoreError {
        opening::refusal(&self.path, source)
    }

    fn damaged(&self, job: JobId, record: DamagedRecord) -> StoreError {
        StoreError::Damaged { path: self.path.clone(), job, record }
    }

    /// Returns records of bans, unless one is damaged.
    fn intact<T>(&self, rows: Vec<Result<T, JobId>>) -> Result<Vec<T>, StoreError> {
        let checked = rows.into_iter().collect::<Result<_, _>>();
        checked.map_err(|job| self.damaged(job, DamagedRecord::Ban))
    }

    /// Calls `visit` with the jobs that satisfy a condition.
    fn read_jobs(
        &self,
        condition: &str,
        parameters: impl rusqlite::Params,
        visit: &mut dyn FnMut(JobRecord) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let sql = format!(
            "SELECT id, request_id, accepted_ns, specification, fingerprint, checksum, client,
             priority, name FROM job WHERE {condition} ORDER BY id"
        );
        let refused = |source| self.refused(source);
        let mut statement = self.connection.prepare(&sql).map_err(refused)?;
        let mut rows = statement.query(parameters).map_err(refused)?;
        while let Some(row) = rows.next().map_err(refused)? {
            let (job, record) = job_record(row).map_err(refused)?;
            visit(record.ok_or_else(|| self.damaged(job, DamagedRecord::Specification))?)?;
        }
        Ok(())
    }

    /// Returns the number of evaluations of a job.
    fn evaluations(&self, job: JobId) -> Result<u64, StoreError> {
        let sql = "SELECT count(*), max(number) FROM evaluation WHERE job = ?1";
        let read = |row: &Row<'_>| Ok((row.get(0)?, row.get(1)?));
        let counted = self.connection.query_row(sql, params![job.0], read);
        let (found, last): (u64, Option<u64>) = counted.map_err(|source| self.refused(source))?;
        match last {
            Some(last) if last + 1 != found => {
                Err(StoreError::Gap { path: self.path.clone(), job, found, last })
            }
            _ => Ok(found),
        }
    }

    fn end(&self, job: JobId) -> Result<Option<EndRecord>, StoreError> {
        let sql = "SELECT status, reason, version, ended_ns, evaluations, best_cost, best_mean,
                   best_coefficient_of_variation, checksum, failure, numerics, commit_id
                   FROM ending WHERE job = ?1";
        let read = |row: &Row<'_>| {
            let status: String = row.get(0)?;
            let status = Status::ALL.into_iter().find(|known| known.name() == status);
            let (mean, variation): (Option<f64>, Option<f64>) = (row.get(6)?, row.get(7)?);
            let (reason, checksum): (_, Vec<u8>) = (row.get(1)?, row.get(8)?);
            let failure: Option<String> = row.get(9)?;
            let known =
                |name: &String| JobFailure::ALL.into_iter().find(|known| known.name() == name);
            let (Some(status), failed) = (status, failure.as_ref().and_then(known)) else {
                return Ok(None);
            };
            // A failed job has a kind of failure, and no other job has one.
            if failed.is_some() != failure.is_some()
                || failed.is_some() != (status == Status::Failed)
            {
                return Ok(None);
            }
            let end = EndRecord {
                job,
                ending: Ending { status, failure: failed, reason },
                program: Program {
                    version: row.get(2)?,
                    numerics: row.get(10)?,
                    commit: row.get(11)?,
                },
                ended: Duration::from_nanos(row.get(3)?),
                evaluations: row.get(4)?,
                best_cost: row.get(5)?,
                best_moments: mean.zip(variation).map(|(mean, coefficient_of_variation)| Moments {
                    mean,
                    coefficient_of_variation,
                }),
            };
            Ok((checksum == end_checksum(&end)).then_some(end))
        };
        let found = self.connection.query_row(sql, params![job.0], read).optional();
        match found.map_err(|source| self.refused(source))? {
            Some(None) => Err(self.damaged(job, DamagedRecord::End)),
            Some(end) => Ok(end),
            None => Ok(None),
        }
    }

    /// Returns the space of deleted records to the disk. If this fails, nothing is lost.
    fn give_back(&self) -> rusqlite::Result<()> {
        {
            let mut vacuum = self.connection.prepare("PRAGMA incremental_vacuum")?;
            let mut rows = vacuum.query([])?;
            while rows.next()?.is_some() {}
        }
        self.connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(()))
    }

    /// Deletes jobs and all their records; their identifiers are never assigned again.
    fn remove_jobs(&self, jobs: &[JobId]) -> rusqlite::Result<()> {
        let transaction = self.connection.unchecked_transaction()?;
        for table in ["summary", "ending", "evaluation", "piece", "part", "doubt"] {
            let sql = format!("DELETE FROM {table} WHERE job = ?1");
            let mut delete = transaction.prepare(&sql)?;
            for job in jobs {
                delete.execute(params![job.0])?;
            }
        }
        for job in jobs {
            transaction.execute("DELETE FROM job WHERE id = ?1", params![job.0])?;
        }
        let known: i32 =
            transaction.pragma_query_value(None, LAST_DELETED_JOB, |row| row.get(0))?;
        let highest = jobs.iter().map(|job| i32::try_from(job.0).unwrap_or(i32::MAX)).max();
        transaction.pragma_update(None, LAST_DELETED_JOB, known.max(highest.unwrap_or(0)))?;
        transaction.commit()
    }
}

impl Store for &SqliteStore {
    fn together(&mut self, changes: &mut Changes<'_>) -> Result<(), StoreError> {
        self.change_together(changes)
    }

    fn visit_jobs(&mut self, visit: &mut dyn FnMut(StoredJob)) -> Result<(), StoreError> {
        self.read_jobs("true", [], &mut |record| {
            let end = match self.end(record.job) {
                Err(error @ StoreError::Damaged { .. }) => Some(damaged_end(&record, &error)),
                read => read?,
            };
            let evaluations = if end.is_some() { 0 } else { self.evaluations(record.job)? };
            visit(StoredJob { record, end, evaluations });
            Ok(())
        })
    }

    fn job(&mut self, job: JobId) -> Result<Option<JobRecord>, StoreError> {
        let mut found = None;
        self.read_jobs("id = ?1", params![job.0], &mut |record| {
            found = Some(record);
            Ok(())
        })?;
        Ok(found)
    }

    fn evaluation(
        &mut self,
        job: JobId,
        number: u64,
    ) -> Result<Option<EvaluationRecord>, StoreError> {
        let found = evaluation_rows::get(&self.connection, job, number);
        match found.map_err(|source| self.refused(source))? {
            Some(None) => Err(self.damaged(job, DamagedRecord::Evaluation(number))),
            Some(record) => Ok(record),
            None => Ok(None),
        }
    }

    fn reset_job(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        let Some(record) = self.job(job)? else {
            return Ok(());
        };
        let reset_job = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            for table in ["evaluation", "piece"] {
                let sql = format!("DELETE FROM {table} WHERE job = ?1");
                transaction.execute(&sql, params![job.0])?;
            }
            parts::delete_of(&transaction, job)?;
            let encoded: Vec<u8> = transaction.query_row(
                "SELECT specification FROM job WHERE id = ?1",
                params![job.0],
                |row| row.get(0),
            )?;
            let columns = JobColumns { fingerprint, ..job_columns(&record, &encoded) };
            transaction.execute(
                "UPDATE job SET fingerprint = ?2, checksum = ?3 WHERE id = ?1",
                params![job.0, fingerprint, job_checksum(&columns)],
            )?;
            transaction.commit()
        };
        reset_job().map_err(|source| self.refused(source))
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        let encoded = specification::to_message(&record.specification).encode_to_vec();
        let columns = job_columns(record, &encoded);
        let sql = "INSERT OR IGNORE INTO job (id, request_id, accepted_ns, specification,
                   fingerprint, checksum, client, priority, name)
                   VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)";
        let values = params![
            record.job.0,
            columns.request_id,
            columns.accepted_ns,
            columns.specification,
            columns.fingerprint,
            job_checksum(&columns),
            columns.client,
            columns.priority,
            columns.name,
        ];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        self.accept(record.job)
    }

    fn put_evaluation(
        &mut self,
        record: &EvaluationRecord,
        deletes_later: bool,
    ) -> Result<(), StoreError> {
        let (job, number) = (record.job, record.number);
        self.change(|connection| {
            let point = evaluation_rows::put(connection, record)?;
            self.stale.borrow_mut().add_at(connection, job, &point)?;
            if deletes_later {
                evaluation_rows::delete_after(connection, job, number)?;
            }
            Ok(())
        })
    }

    fn put_evaluations(&mut self, records: &[EvaluationRecord]) -> Result<(), StoreError> {
        let mut put = |store: &mut dyn Store| {
            records.iter().try_for_each(|record| store.put_evaluation(record, true))
        };
        if self.group.get().is_some() { put(self) } else { self.change_together(&mut put) }
    }

    fn put_part(&mut self, record: &PartRecord) -> Result<(), StoreError> {
        self.change(|connection| parts::put(connection, record))
    }

    fn put_piece(&mut self, record: &PieceRecord) -> Result<(), StoreError> {
        self.change(|connection| evaluation_rows::put_piece(connection, record))
    }

    fn parts(&mut self, job: JobId) -> Result<Vec<PartRecord>, StoreError> {
        parts::of_job(&self.connection, job).map_err(|source| self.refused(source))
    }

    fn finish_job(&mut self, record: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        let sql =
            "INSERT OR REPLACE INTO ending (job, status, reason, version, ended_ns, evaluations,
                   best_cost, best_mean, best_coefficient_of_variation, checksum, failure, numerics,
                   commit_id)
                   VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)";
        let values = params![
            record.job.0,
            record.ending.status.name(),
            record.ending.reason,
            record.program.version,
            nanoseconds(record.ended),
            record.evaluations,
            record.best_cost,
            record.best_moments.map(|moments| moments.mean),
            record.best_moments.map(|moments| moments.coefficient_of_variation),
            end_checksum(record),
            record.ending.failure.map(JobFailure::name),
            record.program.numerics,
            record.program.commit,
        ];
        self.change(|connection| {
            connection.execute(sql, values)?;
            summary::put(connection, record.job, summary)?;
            self.stale.borrow_mut().add_of(connection, record.job)
        })
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        match summary::get(&self.connection, job).map_err(|source| self.refused(source))? {
            Some(None) => Err(self.damaged(job, DamagedRecord::Summary)),
            Some(summary) => Ok(summary),
            None => Ok(None),
        }
    }

    fn delete_jobs(&mut self, jobs: &[JobId]) -> Result<(), StoreError> {
        self.remove_jobs(jobs).map_err(|source| self.refused(source))?;
        if let Err(error) = self.give_back() {
            tracing::warn!(%error, "the disk space of deleted jobs is not released yet");
        }
        Ok(())
    }

    fn last_deleted_job(&mut self) -> Result<Option<JobId>, StoreError> {
        let read = |row: &Row<'_>| row.get(0);
        let known: i32 = self
            .connection
            .pragma_query_value(None, LAST_DELETED_JOB, read)
            .map_err(|source| self.refused(source))?;
        Ok(u64::try_from(known).ok().filter(|known| *known > 0).map(JobId))
    }

    fn put_ban(&mut self, record: &BanRecord) -> Result<(), StoreError> {
        self.change(|connection| ban_rows::put(connection, record))
    }

    fn bans(&mut self) -> Result<Vec<BanRecord>, StoreError> {
        let rows = ban_rows::all(&self.connection).map_err(|source| self.refused(source))?;
        self.intact(rows)
    }

    fn doubts(&mut self) -> Result<Vec<DoubtRecord>, StoreError> {
        let rows = ban_rows::doubts(&self.connection).map_err(|source| self.refused(source))?;
        self.intact(rows)
    }

    fn reopen_job(&mut self, job: JobId) -> Result<Option<StoredJob>, StoreError> {
        let Some(record) = self.job(job)? else {
            return Ok(None);
        };
        let evaluations = self.evaluations(job)?;
        self.change(|connection| ban_rows::reopen(connection, job))?;
        Ok(Some(StoredJob { record, end: None, evaluations }))
    }

    fn settle(&mut self) -> bool {
        let deleted = self.stale.borrow_mut().delete_some(&self.connection);
        let left = match deleted {
            Ok(true) => Ok(true),
            Ok(false) => self.log.copy(&self.connection).map(|()| false),
            Err(error) => Err(error),
        };
        left.unwrap_or_else(|error| {
            tracing::warn!(%error, "the store is not tidied up yet; it is tried again");
            false
        })
    }

    fn stuck_log(&self) -> Option<u64> {
        self.log.stuck()
    }

    fn copy(&mut self, between: &mut BetweenPieces<'_>) -> Result<Option<File>, StoreError> {
        let mut store = *self;
        let mut lend = || between(&mut store as &mut dyn Store);
        backup::copy(&self.connection, &self.path, &mut lend)
    }
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod tests;
