//! A store in one SQLite file that any tool opens.
//!
//! Write-ahead log with an exclusive lock, set first: no shared memory is needed and a second
//! coordinator is refused. `synchronous = FULL`: a record that is reported is on the disk. Each
//! row has a BLAKE3 checksum of its other columns.

use std::cmp::Ordering;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use osteon_common::outcome::{Outcome, decode, encode};
use osteon_common::parameters::Point;
use osteon_common::results::{EstimatedError, Moments, Status};
use osteon_proto::{specification, v1};
use prost::Message as _;
use rusqlite::{Connection, ErrorCode, OptionalExtension as _, Row, params};

use super::{DamagedRecord, EndRecord, EvaluationRecord, JobRecord, Store, StoreError, StoredJob};
use crate::ids::JobId;
use crate::search::{Ending, Summary};

mod summary;

/// Format that this program writes.
const FORMAT: i64 = 3;
/// Oldest format that this program brings up to date.
const FORMAT_OLDEST: i64 = 2;
/// Name of the file in the store's directory.
const FILE: &str = "osteon.sqlite";
/// How long to wait for a coordinator that is just ending.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);
/// Bytes of an outcome in a blob: its code, its velocity as little-endian f64.
const OUTCOME_BYTES: usize = 9;

const SCHEMA: &str = "
    CREATE TABLE job (
        id INTEGER PRIMARY KEY,
        request_id TEXT NOT NULL,
        accepted_ns INTEGER NOT NULL,    -- since the Unix epoch
        specification BLOB NOT NULL,     -- osteon.v1.JobSpecification
        fingerprint TEXT NOT NULL,       -- of the numerics of its evaluations
        checksum BLOB NOT NULL
    );
    CREATE TABLE evaluation (
        job INTEGER NOT NULL REFERENCES job(id),
        number INTEGER NOT NULL,
        point BLOB NOT NULL,             -- seven little-endian f64
        outcomes BLOB NOT NULL,          -- per index: code byte, velocity as little-endian f64
        checksum BLOB NOT NULL,
        estimated_error BLOB,            -- of the successes: median, largest, as little-endian f64
        PRIMARY KEY (job, number)
    );
    CREATE TABLE ending (
        job INTEGER PRIMARY KEY REFERENCES job(id),
        status TEXT NOT NULL,
        reason TEXT,
        version TEXT NOT NULL,
        ended_ns INTEGER NOT NULL,
        evaluations INTEGER NOT NULL,
        best_cost REAL,
        best_mean REAL,
        best_coefficient_of_variation REAL,
        checksum BLOB NOT NULL
    );
    CREATE TABLE summary (               -- what an ended job's path came to
        job INTEGER PRIMARY KEY REFERENCES job(id),
        digest TEXT NOT NULL,
        best INTEGER,                    -- number of the best evaluation
        history BLOB NOT NULL,           -- osteon.v1.HistoryBlock
        checksum BLOB NOT NULL
    );
";

/// From format 2, which knew no estimated errors. The checksum of a row without one is the same.
const FROM_FORMAT_2: &str = "
    ALTER TABLE evaluation ADD COLUMN estimated_error BLOB;
    UPDATE format SET version = 3;
";

/// A store in a SQLite file.
#[derive(Debug)]
pub struct SqliteStore {
    connection: Connection,
    path: PathBuf,
}

impl SqliteStore {
    /// Opens the store in `directory`, making both if need be.
    ///
    /// # Errors
    /// When the directory cannot be made, another coordinator has the store open, a version of
    /// osteon with another format wrote it, or SQLite refuses.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(directory)
            .map_err(|source| StoreError::Directory { path: directory.to_owned(), source })?;
        let path = directory.join(FILE);
        let refused = |source| refusal(&path, source);
        let mut connection = Connection::open(&path).map_err(refused)?;
        prepare(&mut connection).map_err(refused)?;
        let found: i64 = connection
            .query_row("SELECT version FROM format", [], |row| row.get(0))
            .map_err(refused)?;
        match found.cmp(&FORMAT) {
            Ordering::Less => Err(StoreError::Older { path, found, known: FORMAT }),
            Ordering::Equal => Ok(Self { connection, path }),
            Ordering::Greater => Err(StoreError::Newer { path, found, known: FORMAT }),
        }
    }

    fn refused(&self, source: rusqlite::Error) -> StoreError {
        refusal(&self.path, source)
    }

    fn damaged(&self, job: JobId, record: DamagedRecord) -> StoreError {
        StoreError::Damaged { path: self.path.clone(), job, record }
    }

    fn end(&self, job: JobId) -> Result<Option<EndRecord>, StoreError> {
        let sql = "SELECT status, reason, version, ended_ns, evaluations, best_cost, best_mean,
                   best_coefficient_of_variation, checksum FROM ending WHERE job = ?1";
        let read = |row: &Row<'_>| {
            let status: String = row.get(0)?;
            let status = Status::ALL.into_iter().find(|known| known.name() == status);
            let (mean, variation): (Option<f64>, Option<f64>) = (row.get(6)?, row.get(7)?);
            let (reason, checksum): (_, Vec<u8>) = (row.get(1)?, row.get(8)?);
            let Some(status) = status else {
                return Ok(None);
            };
            let end = EndRecord {
                job,
                ending: Ending { status, reason },
                version: row.get(2)?,
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

    fn rows<T>(
        &self,
        sql: &str,
        parameters: impl rusqlite::Params,
        read: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, StoreError> {
        let run = || -> rusqlite::Result<Vec<T>> {
            self.connection.prepare(sql)?.query_map(parameters, read)?.collect()
        };
        run().map_err(|source| self.refused(source))
    }
}

impl Store for SqliteStore {
    fn jobs(&mut self) -> Result<Vec<StoredJob>, StoreError> {
        let sql =
            "SELECT id, request_id, accepted_ns, specification, fingerprint, checksum FROM job
             ORDER BY id";
        type JobRow = (u64, String, u64, Vec<u8>, String, Vec<u8>);
        let rows: Vec<JobRow> = self.rows(sql, [], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?, row.get(5)?))
        })?;
        rows.into_iter()
            .map(|(id, request_id, accepted_ns, encoded, fingerprint, checksum)| {
                let job = JobId(id);
                let intact =
                    checksum == job_checksum(job, &request_id, accepted_ns, &encoded, &fingerprint);
                let specification = intact
                    .then(|| v1::JobSpecification::decode(encoded.as_slice()).ok())
                    .flatten()
                    .and_then(|message| specification::from_message(&message).ok())
                    .ok_or_else(|| self.damaged(job, DamagedRecord::Specification))?;
                let record = JobRecord {
                    job,
                    request_id,
                    specification: Arc::new(specification),
                    accepted: Duration::from_nanos(accepted_ns),
                    fingerprint,
                };
                Ok(StoredJob { record, end: self.end(job)? })
            })
            .collect()
    }

    fn evaluations(
        &mut self,
        job: JobId,
        first: u64,
        visit: &mut dyn FnMut(EvaluationRecord) -> ControlFlow<()>,
    ) -> Result<(), StoreError> {
        let sql = "SELECT number, point, outcomes, checksum, estimated_error FROM evaluation
                   WHERE job = ?1 AND number >= ?2 ORDER BY number";
        let refused = |source| self.refused(source);
        let mut statement = self.connection.prepare(sql).map_err(refused)?;
        let mut rows = statement.query(params![job.0, first]).map_err(refused)?;
        while let Some(row) = rows.next().map_err(refused)? {
            let (number, record) = evaluation(job, row).map_err(refused)?;
            let damaged = || self.damaged(job, DamagedRecord::Evaluation(number));
            if visit(record.ok_or_else(damaged)?).is_break() {
                break;
            }
        }
        Ok(())
    }

    fn begin_again(&mut self, job: JobId, fingerprint: &str) -> Result<(), StoreError> {
        let begin_again = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            transaction.execute("DELETE FROM evaluation WHERE job = ?1", params![job.0])?;
            let checksum: Vec<u8> = transaction.query_row(
                "SELECT request_id, accepted_ns, specification FROM job WHERE id = ?1",
                params![job.0],
                |row| {
                    let (request_id, encoded): (String, Vec<u8>) = (row.get(0)?, row.get(2)?);
                    Ok(job_checksum(job, &request_id, row.get(1)?, &encoded, fingerprint))
                },
            )?;
            transaction.execute(
                "UPDATE job SET fingerprint = ?2, checksum = ?3 WHERE id = ?1",
                params![job.0, fingerprint, checksum],
            )?;
            transaction.commit()
        };
        begin_again().map_err(|source| self.refused(source))
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        let encoded = specification::to_message(&record.specification).encode_to_vec();
        let JobRecord { job, request_id, accepted, fingerprint, .. } = record;
        let accepted = nanoseconds(*accepted);
        let checksum = job_checksum(*job, request_id, accepted, &encoded, fingerprint);
        let sql = "INSERT OR IGNORE INTO job VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
        let values = params![job.0, request_id, accepted, encoded, fingerprint, checksum];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        Ok(())
    }

    fn put_evaluation(&mut self, record: &EvaluationRecord) -> Result<(), StoreError> {
        let point: Vec<u8> = record.point.0.iter().flat_map(|value| value.to_le_bytes()).collect();
        let outcomes = pack_outcomes(&record.outcomes);
        let errors = record.estimated_error.map(pack_errors);
        let checksum =
            evaluation_checksum(record.job, record.number, &point, &outcomes, errors.as_deref());
        let sql = "INSERT OR REPLACE INTO evaluation VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
        let values = params![record.job.0, record.number, point, outcomes, checksum, errors];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        Ok(())
    }

    fn finish_job(&mut self, record: &EndRecord, summary: &Summary) -> Result<(), StoreError> {
        let sql = "INSERT OR REPLACE INTO ending VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)";
        let values = params![
            record.job.0,
            record.ending.status.name(),
            record.ending.reason,
            record.version,
            nanoseconds(record.ended),
            record.evaluations,
            record.best_cost,
            record.best_moments.map(|moments| moments.mean),
            record.best_moments.map(|moments| moments.coefficient_of_variation),
            end_checksum(record),
        ];
        let finish = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            transaction.execute(sql, values)?;
            summary::put(&transaction, record.job, summary)?;
            transaction.commit()
        };
        finish().map_err(|source| self.refused(source))
    }

    fn summary(&mut self, job: JobId) -> Result<Option<Summary>, StoreError> {
        match summary::get(&self.connection, job).map_err(|source| self.refused(source))? {
            Some(None) => Err(self.damaged(job, DamagedRecord::Summary)),
            Some(summary) => Ok(summary),
            None => Ok(None),
        }
    }
}

/// Sets the modes, takes the lock, makes the tables of a new file, and brings those of an old one
/// up to date.
fn prepare(connection: &mut Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    let transaction =
        connection.transaction_with_behavior(rusqlite::TransactionBehavior::Exclusive)?;
    let known: bool = transaction.query_row(
        "SELECT count(*) > 0 FROM sqlite_schema WHERE type = 'table' AND name = 'format'",
        [],
        |row| row.get(0),
    )?;
    if !known {
        transaction.execute_batch("CREATE TABLE format (version INTEGER NOT NULL)")?;
        transaction.execute("INSERT INTO format VALUES (?1)", [FORMAT])?;
        transaction.execute_batch(SCHEMA)?;
    }
    let found: i64 = transaction.query_row("SELECT version FROM format", [], |row| row.get(0))?;
    if found == FORMAT_OLDEST {
        transaction.execute_batch(FROM_FORMAT_2)?;
    }
    transaction.commit()
}

fn refusal(path: &Path, source: rusqlite::Error) -> StoreError {
    let path = path.to_owned();
    match source.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => StoreError::InUse { path },
        _ => StoreError::Sqlite { path, source },
    }
}

/// The evaluation of a row, and its number; `None` if it is damaged.
fn evaluation(job: JobId, row: &Row<'_>) -> rusqlite::Result<(u64, Option<EvaluationRecord>)> {
    let (number, checksum): (u64, Vec<u8>) = (row.get(0)?, row.get(3)?);
    let (point, outcomes) = (row.get_ref(1)?.as_blob()?, row.get_ref(2)?.as_blob()?);
    let errors = row.get_ref(4)?.as_blob_or_null()?;
    let intact = checksum == evaluation_checksum(job, number, point, outcomes, errors);
    let unpacked = || {
        let (point, outcomes) = unpack(point).zip(unpack_outcomes(outcomes))?;
        let estimated_error = match errors {
            Some(packed) => Some(unpack_errors(packed)?),
            None => None,
        };
        Some(EvaluationRecord { job, number, point, outcomes, estimated_error })
    };
    Ok((number, intact.then(unpacked).flatten()))
}

/// Nanoseconds as the file holds them: SQLite knows signed integers only.
fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).map_or(i64::MAX as u64, |ns| ns.min(i64::MAX as u64))
}

fn job_checksum(
    job: JobId,
    request_id: &str,
    accepted_ns: u64,
    specification: &[u8],
    fingerprint: &str,
) -> Vec<u8> {
    let (job, accepted) = (job.0.to_le_bytes(), accepted_ns.to_le_bytes());
    checksum(&[&job, request_id.as_bytes(), &accepted, specification, fingerprint.as_bytes()])
}

/// What is absent has no field.
fn evaluation_checksum(
    job: JobId,
    number: u64,
    point: &[u8],
    outcomes: &[u8],
    errors: Option<&[u8]>,
) -> Vec<u8> {
    let (job, number) = (job.0.to_le_bytes(), number.to_le_bytes());
    let mut fields: Vec<&[u8]> = vec![&job, &number, point, outcomes];
    fields.extend(errors);
    checksum(&fields)
}

fn end_checksum(end: &EndRecord) -> Vec<u8> {
    let EndRecord { job, ending, version, ended, evaluations, best_cost, best_moments } = end;
    let optional = |value: Option<f64>| value.map(|value| value.to_le_bytes().to_vec());
    let (mean, variation) = (
        best_moments.map(|moments| moments.mean),
        best_moments.map(|moments| moments.coefficient_of_variation),
    );
    let reason = ending.reason.as_ref().map(|reason| reason.as_bytes().to_vec());
    let numbers = [job.0, nanoseconds(*ended), *evaluations].map(u64::to_le_bytes);
    let mut fields: Vec<&[u8]> = numbers.iter().map(<[u8; 8]>::as_slice).collect();
    fields.extend([ending.status.name().as_bytes(), version.as_bytes()]);
    // What is absent has no field, and a field of one byte says that it is present.
    let optional = [reason, optional(*best_cost), optional(mean), optional(variation)];
    for value in &optional {
        fields.push(if value.is_some() { &[1] } else { &[0] });
        fields.extend(value.as_deref());
    }
    checksum(&fields)
}

/// BLAKE3 over fields, each after its length.
fn checksum(fields: &[&[u8]]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    for field in fields {
        hasher.update(&(field.len() as u64).to_le_bytes()).update(field);
    }
    hasher.finalize().as_bytes().to_vec()
}

fn pack_outcomes(outcomes: &[Outcome]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(outcomes.len() * OUTCOME_BYTES);
    for &outcome in outcomes {
        let (code, velocity) = encode(outcome);
        packed.push(code);
        packed.extend(velocity.to_le_bytes());
    }
    packed
}

fn unpack_outcomes(packed: &[u8]) -> Option<Arc<[Outcome]>> {
    let (records, rest) = packed.as_chunks::<OUTCOME_BYTES>();
    let outcome =
        |[code, velocity @ ..]: &[u8; OUTCOME_BYTES]| decode(*code, f64::from_le_bytes(*velocity));
    rest.is_empty().then(|| records.iter().map(outcome).collect()).flatten()
}

fn pack_errors(errors: EstimatedError) -> Vec<u8> {
    [errors.median, errors.largest].into_iter().flat_map(f64::to_le_bytes).collect()
}

fn unpack_errors(packed: &[u8]) -> Option<EstimatedError> {
    let (values, rest) = packed.as_chunks::<8>();
    let &[median, largest] = values else { return None };
    let (median, largest) = (f64::from_le_bytes(median), f64::from_le_bytes(largest));
    rest.is_empty().then_some(EstimatedError { median, largest })
}

fn unpack(point: &[u8]) -> Option<Point> {
    let (values, rest) = point.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    rest.is_empty().then(|| values.try_into().ok().map(Point)).flatten()
}

#[cfg(test)]
mod tests;
