//! A store in one SQLite file that any tool opens.
//!
//! Write-ahead log with an exclusive lock, set first: no shared memory is needed and a second
//! coordinator is refused. `synchronous = FULL`: a record that is reported is on the disk. Each
//! specification and each evaluation is one blob with a BLAKE3 checksum.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use osteon_common::outcome::{Outcome, decode, encode};
use osteon_common::parameters::Point;
use osteon_common::results::{Moments, Status};
use osteon_proto::{specification, v1};
use prost::Message as _;
use rusqlite::{Connection, ErrorCode, OptionalExtension as _, Row, params};

use super::{DamagedRecord, EndRecord, EvaluationRecord, JobRecord, Store, StoreError, StoredJob};
use crate::ids::JobId;
use crate::search::Ending;

/// Format that this program writes.
const FORMAT: i64 = 1;
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
        checksum BLOB NOT NULL
    );
    CREATE TABLE evaluation (
        job INTEGER NOT NULL REFERENCES job(id),
        number INTEGER NOT NULL,
        point BLOB NOT NULL,             -- seven little-endian f64
        outcomes BLOB NOT NULL,          -- per index: code byte, velocity as little-endian f64
        checksum BLOB NOT NULL,
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
        best_coefficient_of_variation REAL
    );
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
    /// When the directory cannot be made, another coordinator has the store open, a newer version
    /// of osteon wrote it, or SQLite refuses.
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
        if found > FORMAT {
            return Err(StoreError::Newer { path, found, known: FORMAT });
        }
        Ok(Self { connection, path })
    }

    fn refused(&self, source: rusqlite::Error) -> StoreError {
        refusal(&self.path, source)
    }

    fn damaged(&self, job: JobId, record: DamagedRecord) -> StoreError {
        StoreError::Damaged { path: self.path.clone(), job, record }
    }

    fn end(&self, job: JobId) -> Result<Option<EndRecord>, StoreError> {
        let sql = "SELECT status, reason, version, ended_ns, evaluations, best_cost, best_mean,
                   best_coefficient_of_variation FROM ending WHERE job = ?1";
        let read = |row: &Row<'_>| {
            let status: String = row.get(0)?;
            let status = Status::ALL.into_iter().find(|known| known.name() == status);
            let (mean, variation): (Option<f64>, Option<f64>) = (row.get(6)?, row.get(7)?);
            let reason = row.get(1)?;
            Ok(match status {
                None => None,
                Some(status) => Some(EndRecord {
                    job,
                    ending: Ending { status, reason },
                    version: row.get(2)?,
                    ended: Duration::from_nanos(row.get(3)?),
                    evaluations: row.get(4)?,
                    best_cost: row.get(5)?,
                    best_moments: mean.zip(variation).map(|(mean, coefficient_of_variation)| {
                        Moments { mean, coefficient_of_variation }
                    }),
                }),
            })
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
            "SELECT id, request_id, accepted_ns, specification, checksum FROM job ORDER BY id";
        type JobRow = (u64, String, u64, Vec<u8>, Vec<u8>);
        let rows: Vec<JobRow> = self.rows(sql, [], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?))
        })?;
        rows.into_iter()
            .map(|(id, request_id, accepted_ns, encoded, checksum)| {
                let job = JobId(id);
                let intact = checksum == job_checksum(job, &encoded);
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
                };
                Ok(StoredJob { record, end: self.end(job)? })
            })
            .collect()
    }

    fn evaluations(&mut self, job: JobId) -> Result<Vec<EvaluationRecord>, StoreError> {
        let sql = "SELECT number, point, outcomes, checksum FROM evaluation
                   WHERE job = ?1 ORDER BY number";
        type EvaluationRow = (u64, Vec<u8>, Vec<u8>, Vec<u8>);
        let rows: Vec<EvaluationRow> = self.rows(sql, params![job.0], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
        })?;
        rows.into_iter()
            .map(|(number, point, outcomes, checksum)| {
                let intact = checksum == evaluation_checksum(job, number, &point, &outcomes);
                intact
                    .then(|| unpack(&point).zip(unpack_outcomes(&outcomes)))
                    .flatten()
                    .map(|(point, outcomes)| EvaluationRecord { job, number, point, outcomes })
                    .ok_or_else(|| self.damaged(job, DamagedRecord::Evaluation(number)))
            })
            .collect()
    }

    fn put_job(&mut self, record: &JobRecord) -> Result<(), StoreError> {
        let encoded = specification::to_message(&record.specification).encode_to_vec();
        let sql = "INSERT OR IGNORE INTO job VALUES (?1, ?2, ?3, ?4, ?5)";
        let values = params![
            record.job.0,
            record.request_id,
            nanoseconds(record.accepted),
            encoded,
            job_checksum(record.job, &encoded)
        ];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        Ok(())
    }

    fn put_evaluation(&mut self, record: &EvaluationRecord) -> Result<(), StoreError> {
        let point: Vec<u8> = record.point.0.iter().flat_map(|value| value.to_le_bytes()).collect();
        let outcomes = pack_outcomes(&record.outcomes);
        let checksum = evaluation_checksum(record.job, record.number, &point, &outcomes);
        let sql = "INSERT OR REPLACE INTO evaluation VALUES (?1, ?2, ?3, ?4, ?5)";
        let values = params![record.job.0, record.number, point, outcomes, checksum];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        Ok(())
    }

    fn finish_job(&mut self, record: &EndRecord) -> Result<(), StoreError> {
        let sql = "INSERT OR REPLACE INTO ending VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)";
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
        ];
        self.connection.execute(sql, values).map_err(|source| self.refused(source))?;
        Ok(())
    }
}

/// Sets the modes, takes the lock and makes the tables of a new file.
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
    transaction.commit()
}

fn refusal(path: &Path, source: rusqlite::Error) -> StoreError {
    let path = path.to_owned();
    match source.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => StoreError::InUse { path },
        _ => StoreError::Sqlite { path, source },
    }
}

fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

fn job_checksum(job: JobId, specification: &[u8]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&job.0.to_le_bytes()).update(specification);
    hasher.finalize().as_bytes().to_vec()
}

fn evaluation_checksum(job: JobId, number: u64, point: &[u8], outcomes: &[u8]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&job.0.to_le_bytes()).update(&number.to_le_bytes());
    hasher.update(point).update(outcomes);
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

fn unpack(point: &[u8]) -> Option<Point> {
    let (values, rest) = point.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    rest.is_empty().then(|| values.try_into().ok().map(Point)).flatten()
}

#[cfg(test)]
mod tests;
