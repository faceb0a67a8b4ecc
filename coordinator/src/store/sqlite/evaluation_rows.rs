//! Evaluations as rows: the first outcomes are in a row of `evaluation`, and those of a large one that
//! follow are in rows of `piece`.
//!
//! Pieces may be stored before their evaluation. Its record need not agree with them: those that differ
//! are replaced.
//!
//! SQLite copies a row several times. Copies of a piece stay in the cache of the processor, and the next
//! piece uses their memory again; a row of 90 MB took twice as long as its pieces.

use osteon_common::observables::ObservedColumns;
use osteon_common::outcome::Outcome;
use osteon_common::outcomes::Outcomes;
use rusqlite::{Connection, OptionalExtension as _, Row, params};

use super::columns::{
    checksum, evaluation_checksum, pack_errors, pack_outcomes, pack_point, pack_workers, unpack,
    unpack_errors, unpack_outcomes, unpack_workers,
};
use crate::core::ids::JobId;
use crate::store::{EvaluationRecord, PIECE_OUTCOMES, PieceRecord};

/// The table of pieces.
pub(super) const TABLE: &str = "
    CREATE TABLE piece (                 -- of a large evaluation
        job INTEGER NOT NULL,
        evaluation INTEGER NOT NULL,     -- number
        first INTEGER NOT NULL,          -- index
        checksum BLOB NOT NULL,          -- before the outcomes, so that it is read without them
        outcomes BLOB NOT NULL,          -- from this index on, as of an evaluation
        PRIMARY KEY (job, evaluation, first)
    );
";

/// Adds an evaluation in place of the one with its number, in the open transaction. Returns its point
/// as stored.
pub(super) fn put(connection: &Connection, record: &EvaluationRecord) -> rusqlite::Result<Vec<u8>> {
    let (job, number) = (record.job, record.number);
    delete(connection, job, number)?;
    let pieces = put_pieces(connection, record)?;
    let point = pack_point(record.point);
    let outcomes = packed(record, 0);
    let errors = record.estimated_error.map(pack_errors);
    let workers = pack_workers(&record.workers);
    let checksum = evaluation_checksum(
        (job, number),
        &point,
        (&outcomes, &pieces),
        errors.as_deref(),
        &workers,
    );
    let sql = "INSERT INTO evaluation (job, number, point, outcomes, checksum, estimated_error,
               workers) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let values = params![job.0, number, &point, outcomes, checksum, errors, workers];
    connection.prepare(sql)?.execute(values)?;
    Ok(point)
}

/// Deletes an evaluation. Its pieces go with it, even if they have the same checksums as those to come: they
/// may be damaged.
fn delete(connection: &Connection, job: JobId, number: u64) -> rusqlite::Result<()> {
    let sql = "DELETE FROM evaluation WHERE job = ?1 AND number = ?2";
    if connection.prepare(sql)?.execute(params![job.0, number])? > 0 {
        let sql = "DELETE FROM piece WHERE job = ?1 AND evaluation = ?2";
        connection.prepare(sql)?.execute(params![job.0, number])?;
    }
    Ok(())
}

/// Adds the pieces of an evaluation that are not there. Returns their checksums. There can be none beyond its
/// last one, since all evaluations of a job have as many outcomes.
fn put_pieces(connection: &Connection, record: &EvaluationRecord) -> rusqlite::Result<Vec<u8>> {
    let (job, number, count) = (record.job, record.number, record.outcomes.len());
    let mut checksums = Vec::new();
    for first in (PIECE_OUTCOMES..count).step_by(PIECE_OUTCOMES) {
        let outcomes = packed(record, first);
        checksums.extend(put_packed(connection, (job, number, first as u64), &outcomes)?);
    }
    Ok(checksums)
}

/// Adds a piece of an evaluation, unless it is there.
pub(super) fn put_piece(connection: &Connection, record: &PieceRecord) -> rusqlite::Result<()> {
    let outcomes = pack_outcomes(&record.outcomes, record.outcomes.observables());
    put_packed(connection, (record.job, record.number, record.first), &outcomes).map(drop)
}

/// Adds a piece with these outcomes, unless it is there. Returns its checksum.
fn put_packed(
    connection: &Connection,
    (job, number, first): (JobId, u64, u64),
    outcomes: &[u8],
) -> rusqlite::Result<Vec<u8>> {
    let checksum = piece_checksum(job, number, first, outcomes);
    let sql = "SELECT 1 FROM piece WHERE job = ?1 AND evaluation = ?2 AND first = ?3
               AND checksum = ?4";
    let known = params![job.0, number, first, checksum];
    if !connection.prepare(sql)?.exists(known)? {
        let sql = "INSERT OR REPLACE INTO piece (job, evaluation, first, checksum, outcomes)
                   VALUES (?1, ?2, ?3, ?4, ?5)";
        let values = params![job.0, number, first, checksum, outcomes];
        connection.prepare(sql)?.execute(values)?;
    }
    Ok(checksum)
}

/// Deletes the evaluations of a job after this number.
pub(super) fn delete_after(
    connection: &Connection,
    job: JobId,
    number: u64,
) -> rusqlite::Result<()> {
    for (table, column) in [("evaluation", "number"), ("piece", "evaluation")] {
        let sql = format!("DELETE FROM {table} WHERE job = ?1 AND {column} > ?2");
        connection.execute(&sql, params![job.0, number])?;
    }
    Ok(())
}

/// Deletes the pieces that belong to no evaluation: a process that was killed may have left them. They would
/// be written again soon, and could be damaged by then.
pub(super) fn delete_loose_pieces(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch(
        "DELETE FROM piece WHERE NOT EXISTS (SELECT 1 FROM evaluation
         WHERE evaluation.job = piece.job AND evaluation.number = piece.evaluation)",
    )
}

/// Returns whether a job has pieces that belong to no evaluation.
pub(super) fn has_loose_pieces(connection: &Connection, job: JobId) -> rusqlite::Result<bool> {
    connection.prepare(&format!("SELECT 1 {LOOSE}"))?.exists(params![job.0])
}

/// Deletes at most so many of them; returns their number.
pub(super) fn delete_some_loose_pieces(
    connection: &Connection,
    job: JobId,
    most: usize,
) -> rusqlite::Result<usize> {
    let sql = format!("DELETE FROM piece WHERE rowid IN (SELECT rowid {LOOSE} LIMIT ?2)");
    connection.prepare(&sql)?.execute(params![job.0, most])
}

/// Selects the pieces of a job that belong to no evaluation.
const LOOSE: &str = "FROM piece WHERE job = ?1 AND NOT EXISTS (SELECT 1 FROM evaluation
                     WHERE evaluation.job = ?1 AND evaluation.number = piece.evaluation)";

/// Returns the outcomes of a row, from this index on.
fn packed(record: &EvaluationRecord, first: usize) -> Vec<u8> {
    let end = record.outcomes.len().min(first + PIECE_OUTCOMES);
    let observables =
        record.outcomes.observables().map(|values| values.map(|values| &values[first..end]));
    pack_outcomes(&record.outcomes[first..end], observables)
}

/// Returns an evaluation; `None` if there is none, and `None` inside if it is damaged.
pub(super) fn get(
    connection: &Connection,
    job: JobId,
    number: u64,
) -> rusqlite::Result<Option<Option<EvaluationRecord>>> {
    let Some(pieces) = pieces(connection, job, number)? else {
        return Ok(Some(None));
    };
    let sql = "SELECT point, outcomes, checksum, estimated_error, workers
               FROM evaluation WHERE job = ?1 AND number = ?2";
    let read = |row: &Row<'_>| evaluation((job, number), row, pieces);
    connection.query_row(sql, params![job.0, number], read).optional()
}

/// Outcomes with their observables.
type Unpacked = (Vec<Outcome>, ObservedColumns);

/// The pieces of an evaluation, in order.
#[derive(Default)]
struct Pieces {
    /// Each with the index of its first outcome.
    unpacked: Vec<(usize, Unpacked)>,
    /// Their checksums, one after the other.
    checksums: Vec<u8>,
}

/// Returns the pieces of an evaluation; `None` if one is damaged.
fn pieces(connection: &Connection, job: JobId, number: u64) -> rusqlite::Result<Option<Pieces>> {
    let sql = "SELECT first, outcomes, checksum FROM piece WHERE job = ?1 AND evaluation = ?2
               ORDER BY first";
    let mut select = connection.prepare(sql)?;
    let mut rows = select.query(params![job.0, number])?;
    let mut pieces = Pieces::default();
    while let Some(row) = rows.next()? {
        let (first, outcomes) = (row.get::<_, i64>(0)?, row.get_ref(1)?.as_blob()?);
        let checksum = row.get_ref(2)?.as_blob()?;
        let Some(first) = usize::try_from(first)
            .ok()
            .filter(|first| checksum == piece_checksum(job, number, *first as u64, outcomes))
        else {
            return Ok(None);
        };
        let Some(unpacked) = unpack_outcomes(outcomes) else {
            return Ok(None);
        };
        pieces.unpacked.push((first, unpacked));
        pieces.checksums.extend(checksum);
    }
    Ok(Some(pieces))
}

/// Returns the evaluation of a row; `None` if it is damaged.
fn evaluation(
    (job, number): (JobId, u64),
    row: &Row<'_>,
    Pieces { unpacked: pieces, checksums }: Pieces,
) -> rusqlite::Result<Option<EvaluationRecord>> {
    let (point, outcomes) = (row.get_ref(0)?.as_blob()?, row.get_ref(1)?.as_blob()?);
    let stored: Vec<u8> = row.get(2)?;
    let errors = row.get_ref(3)?.as_blob_or_null()?;
    let workers = row.get_ref(4)?.as_str()?;
    let found = evaluation_checksum((job, number), point, (outcomes, &checksums), errors, workers);
    let unpacked = || {
        let outcomes = joined(unpack_outcomes(outcomes)?, pieces)?;
        let estimated_error = match errors {
            Some(packed) => Some(unpack_errors(packed)?),
            None => None,
        };
        let (point, workers) = unpack(point).zip(unpack_workers(workers))?;
        Some(EvaluationRecord { job, number, point, outcomes, estimated_error, workers })
    };
    Ok((stored == found).then(unpacked).flatten())
}

/// Returns the outcomes of an evaluation from those of its row and of its pieces; `None` unless each
/// begins where the one before it ends.
fn joined(
    (mut outcomes, mut columns): Unpacked,
    pieces: Vec<(usize, Unpacked)>,
) -> Option<Outcomes> {
    for (first, (more, more_columns)) in pieces {
        if first != outcomes.len() || more_columns.which() != columns.which() {
            return None;
        }
        outcomes.extend(more);
        for (observable, values) in more_columns.present() {
            columns[observable].get_or_insert_default().extend(values);
        }
    }
    Some(Outcomes::from(outcomes).with_observables(columns))
}

fn piece_checksum(job: JobId, number: u64, first: u64, outcomes: &[u8]) -> Vec<u8> {
    let [job, number, first] = [job.0, number, first].map(u64::to_le_bytes);
    checksum(&[&job, &number, &first, outcomes])
}
