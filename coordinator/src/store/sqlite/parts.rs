//! Results of evaluations that are not complete, or that their search has not asked for yet.
//!
//! They are a help only: what is damaged, or of other numerics, is left out and computed again.

use std::collections::VecDeque;

use osteon_common::observables::PerObservable;
use osteon_common::outcome::{RealizationResult, decode, encode};
use osteon_common::version;
use rusqlite::{Connection, params};

use super::columns::{
    checksum, pack_point, pack_worker, unpack, unpack_worker, with_columns, without_columns,
};
use super::evaluation_rows::{delete_some_loose_pieces, has_loose_pieces};
use crate::core::ids::JobId;
use crate::store::{PartPiece, PartRecord};

/// The table.
pub(super) const TABLE: &str = "
    CREATE TABLE part (                  -- of evaluations that are not stored yet
        number INTEGER PRIMARY KEY,
        job INTEGER NOT NULL REFERENCES job(id),
        point BLOB NOT NULL,             -- as of an evaluation
        worker TEXT NOT NULL,            -- that gave the results: PROCESS/INSTANCE HOST
        first INTEGER NOT NULL,          -- index
        results BLOB NOT NULL,           -- per index: code byte, velocity, estimated error (f64); with observables as of an evaluation
        fingerprint TEXT NOT NULL,       -- of the numerics
        checksum BLOB NOT NULL
    );
    CREATE UNIQUE INDEX part_place ON part (job, point, first, worker);
";

/// Number of pieces that are deleted at once: a record may wait for it.
const DELETED_AT_ONCE: usize = 128;
/// Number of pieces of an evaluation that are deleted at once, fewer than parts because they are larger.
const LOOSE_AT_ONCE: usize = 8;
/// Size of a result in a blob, bytes: its code, its velocity and its estimated error.
const RESULT_BYTES: usize = 17;

/// Adds the pieces of a part, in one transaction with whatever is open. A piece that begins like one
/// of the same worker takes its place: it has been saved again.
pub(super) fn put(connection: &Connection, record: &PartRecord) -> rusqlite::Result<()> {
    let sql =
        "INSERT OR REPLACE INTO part (job, point, worker, first, results, fingerprint, checksum)
               VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let mut insert = connection.prepare(sql)?;
    let point = pack_point(record.point);
    let fingerprint = version::fingerprint();
    for piece in &record.pieces {
        let (worker, results) = (pack_worker(&piece.by), pack_results(&piece.results));
        let checksum =
            part_checksum(record.job, &point, &worker, piece.first, &results, &fingerprint);
        insert.execute(params![
            record.job.0,
            point,
            worker,
            piece.first,
            results,
            fingerprint,
            checksum
        ])?;
    }
    Ok(())
}

/// Returns the parts of a job whose evaluations are not stored, in the order in which they were added.
pub(super) fn of_job(connection: &Connection, job: JobId) -> rusqlite::Result<Vec<PartRecord>> {
    let sql = "SELECT point, worker, first, results, fingerprint, checksum FROM part
               WHERE job = ?1 AND point NOT IN (SELECT point FROM evaluation WHERE job = ?1)
               AND job NOT IN (SELECT job FROM ending) ORDER BY number";
    let mut select = connection.prepare(sql)?;
    let mut rows = select.query(params![job.0])?;
    let mut parts: Vec<PartRecord> = Vec::new();
    while let Some(row) = rows.next()? {
        let (point, results) = (row.get_ref(0)?.as_blob()?, row.get_ref(3)?.as_blob()?);
        let (worker, fingerprint) = (row.get_ref(1)?.as_str()?, row.get_ref(4)?.as_str()?);
        let (first, stored): (u64, Vec<u8>) = (row.get(2)?, row.get(5)?);
        let intact = stored == part_checksum(job, point, worker, first, results, fingerprint);
        if !intact || fingerprint != version::fingerprint() {
            tracing::warn!(%job, first, intact, "saved results are not usable; they are computed again");
            continue;
        }
        let unpacked = unpack(point).zip(unpack_worker(worker)).zip(unpack_results(results));
        let Some(((point, by), results)) = unpacked else {
            continue;
        };
        let piece = PartPiece { first, by, results };
        match parts.last_mut() {
            Some(last) if osteon_search::same_point(&last.point, &point) => last.pieces.push(piece),
            _ => parts.push(PartRecord { job, point, pieces: vec![piece] }),
        }
    }
    Ok(parts)
}

/// Deletes the parts of a job.
pub(super) fn delete_of(connection: &Connection, job: JobId) -> rusqlite::Result<()> {
    let mut delete = connection.prepare("DELETE FROM part WHERE job = ?1")?;
    delete.execute(params![job.0]).map(drop)
}

/// Deletes the parts of ended jobs.
pub(super) fn delete_of_ended(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch("DELETE FROM part WHERE job IN (SELECT job FROM ending)")
}

/// Parts that nobody needs any more, because their evaluation is stored, or their job has ended; in the latter
/// case also pieces of an evaluation that is not stored. There may be much of them, so they are deleted a few
/// at a time, when no record waits.
#[derive(Debug, Default)]
pub(super) struct StaleParts(VecDeque<(JobId, Option<Vec<u8>>)>);

impl StaleParts {
    /// Notes the parts of an evaluation that is being stored, at this point.
    pub(super) fn add_at(
        &mut self,
        connection: &Connection,
        job: JobId,
        point: &[u8],
    ) -> rusqlite::Result<()> {
        let sql = "SELECT 1 FROM part WHERE job = ?1 AND point = ?2";
        if connection.prepare(sql)?.exists(params![job.0, point])? {
            self.0.push_back((job, Some(point.to_vec())));
        }
        Ok(())
    }

    /// Notes the parts of a job that is being ended, and its pieces that belong to no evaluation.
    pub(super) fn add_of(&mut self, connection: &Connection, job: JobId) -> rusqlite::Result<()> {
        let sql = "SELECT 1 FROM part WHERE job = ?1";
        let has_parts = connection.prepare(sql)?.exists(params![job.0])?;
        if has_parts || has_loose_pieces(connection, job)? {
            self.0.push_back((job, None));
        }
        Ok(())
    }

    /// Deletes some of them. Returns whether there may be more.
    pub(super) fn delete_some(&mut self, connection: &Connection) -> rusqlite::Result<bool> {
        let Some((job, point)) = self.0.front() else {
            return Ok(false);
        };
        // What was noted may not have been stored in the end.
        let left = match point {
            Some(point) => {
                let sql = "DELETE FROM part WHERE number IN (SELECT number FROM part
                           WHERE job = ?1 AND point = ?2 AND EXISTS (SELECT 1 FROM evaluation
                           WHERE evaluation.job = ?1 AND evaluation.point = ?2) LIMIT ?3)";
                connection.execute(sql, params![job.0, point, DELETED_AT_ONCE])? == DELETED_AT_ONCE
            }
            None => {
                let sql = "DELETE FROM part WHERE number IN (SELECT number FROM part WHERE job = ?1
                           AND EXISTS (SELECT 1 FROM ending WHERE ending.job = ?1) LIMIT ?2)";
                let parts = connection.execute(sql, params![job.0, DELETED_AT_ONCE])?;
                parts == DELETED_AT_ONCE || Self::delete_loose(connection, *job)?
            }
        };
        if !left {
            self.0.pop_front();
        }
        Ok(!self.0.is_empty())
    }
    /// Deletes some pieces of an ended job that belong to no evaluation. Returns whether there may be more.
    fn delete_loose(connection: &Connection, job: JobId) -> rusqlite::Result<bool> {
        let sql = "SELECT 1 FROM ending WHERE job = ?1";
        let has_ended = connection.prepare(sql)?.exists(params![job.0])?;
        Ok(has_ended && delete_some_loose_pieces(connection, job, LOOSE_AT_ONCE)? == LOOSE_AT_ONCE)
    }
}

fn part_checksum(
    job: JobId,
    point: &[u8],
    worker: &str,
    first: u64,
    results: &[u8],
    fingerprint: &str,
) -> Vec<u8> {
    let (job, first) = (job.0.to_le_bytes(), first.to_le_bytes());
    checksum(&[&job, point, worker.as_bytes(), &first, results, fingerprint.as_bytes()])
}

fn pack_results(results: &[RealizationResult]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(results.len() * RESULT_BYTES);
    for result in results {
        let (code, velocity) = encode(result.outcome);
        packed.push(code);
        packed.extend(velocity.to_le_bytes());
        packed.extend(result.estimated_error.to_le_bytes());
    }
    let columns = PerObservable::new(|one| {
        let has_values = results.iter().any(|result| result.observables[one].to_bits() != 0);
        has_values.then(|| results.iter().map(|result| result.observables[one]).collect::<Vec<_>>())
    });
    with_columns(packed, columns.as_ref().map(Option::as_deref))
}

fn unpack_results(packed: &[u8]) -> Option<Vec<RealizationResult>> {
    let (packed, columns) = without_columns::<RESULT_BYTES>(packed)?;
    let (records, rest) = packed.as_chunks::<RESULT_BYTES>();
    let number = |bytes: &[u8]| bytes.try_into().ok().map(f64::from_le_bytes);
    let result = |(index, [code, numbers @ ..]): (usize, &[u8; RESULT_BYTES])| {
        let (velocity, error) = numbers.split_at(8);
        let outcome = decode(*code, number(velocity)?)?;
        let estimated_error = number(error)?;
        let value = |column: &Option<Vec<f64>>| column.as_ref().map_or(0.0, |all| all[index]);
        let observables = columns.as_ref().map(value);
        let result = RealizationResult { outcome, estimated_error, observables };
        result.is_consistent().then_some(result)
    };
    rest.is_empty().then(|| records.iter().enumerate().map(result).collect()).flatten()
}
