//! Evaluations as rows: the first outcomes are in a row of `evaluation`, and those of a large one that
//! follow are in rows of `piece`.
//!
//! SQLite copies a row several times. Copies of a piece stay in the cache of the processor, and the next
//! piece uses their memory again; a row of 90 MB took twice as long as its pieces.

use osteon_common::outcome::Outcome;
use osteon_common::outcomes::Outcomes;
use rusqlite::{Connection, OptionalExtension as _, Row, params};

use super::columns::{
    checksum, evaluation_checksum, pack_errors, pack_outcomes, pack_point, pack_workers, unpack,
    unpack_errors, unpack_outcomes, unpack_workers,
};
use crate::core::ids::JobId;
use crate::store::EvaluationRecord;

/// The table of pieces.
pub(super) const TABLE: &str = "
    CREATE TABLE IF NOT EXISTS piece (   -- of a large evaluation
        job INTEGER NOT NULL,
        evaluation INTEGER NOT NULL,     -- number
        first INTEGER NOT NULL,          -- index
        outcomes BLOB NOT NULL,          -- from this index on, as of an evaluation
        checksum BLOB NOT NULL,
        PRIMARY KEY (job, evaluation, first),
        FOREIGN KEY (job, evaluation) REFERENCES evaluation(job, number)
            ON DELETE CASCADE DEFERRABLE INITIALLY DEFERRED
    );
";

/// Number of outcomes in the row of an evaluation, and in each of its pieces but the last.
pub(super) const PIECE_OUTCOMES: usize = 1 << 16;

/// Adds an evaluation in place of the one with its number, in the open transaction. Returns its point
/// as stored.
pub(super) fn put(connection: &Connection, record: &EvaluationRecord) -> rusqlite::Result<Vec<u8>> {
    let (job, number) = (record.job, record.number);
    // Its pieces go with it.
    let mut delete = connection.prepare("DELETE FROM evaluation WHERE job = ?1 AND number = ?2")?;
    delete.execute(params![job.0, number])?;
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

/// Adds the pieces of an evaluation. Returns their checksums.
fn put_pieces(connection: &Connection, record: &EvaluationRecord) -> rusqlite::Result<Vec<u8>> {
    let mut checksums = Vec::new();
    if record.outcomes.len() <= PIECE_OUTCOMES {
        return Ok(checksums);
    }
    let sql = "INSERT INTO piece (job, evaluation, first, outcomes, checksum)
               VALUES (?1, ?2, ?3, ?4, ?5)";
    let mut insert = connection.prepare(sql)?;
    for first in (PIECE_OUTCOMES..record.outcomes.len()).step_by(PIECE_OUTCOMES) {
        let outcomes = packed(record, first);
        let checksum = piece_checksum(record.job, record.number, first as u64, &outcomes);
        insert.execute(params![record.job.0, record.number, first, outcomes, checksum])?;
        checksums.extend(checksum);
    }
    Ok(checksums)
}

/// Returns the outcomes of a row, from this index on.
fn packed(record: &EvaluationRecord, first: usize) -> Vec<u8> {
    let end = record.outcomes.len().min(first + PIECE_OUTCOMES);
    let decays = record.outcomes.decays().map(|decays| &decays[first..end]);
    pack_outcomes(&record.outcomes[first..end], decays)
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

/// Outcomes with their decays, if they have any.
type Unpacked = (Vec<Outcome>, Option<Vec<f64>>);

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
    (mut outcomes, mut decays): Unpacked,
    pieces: Vec<(usize, Unpacked)>,
) -> Option<Outcomes> {
    for (first, (more, more_decays)) in pieces {
        if first != outcomes.len() || more_decays.is_some() != decays.is_some() {
            return None;
        }
        outcomes.extend(more);
        if let Some(decays) = &mut decays {
            decays.extend(more_decays.into_iter().flatten());
        }
    }
    Some(Outcomes::from(outcomes).with_decays(decays))
}

fn piece_checksum(job: JobId, number: u64, first: u64, outcomes: &[u8]) -> Vec<u8> {
    let [job, number, first] = [job.0, number, first].map(u64::to_le_bytes);
    checksum(&[&job, &number, &first, outcomes])
}
