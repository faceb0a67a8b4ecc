//! The table `summary`: of each ended job, the summary of the path of its search.

use osteon_common::results::{Evaluation, GroupEnding};
use osteon_proto::{history, v1};
use osteon_search::Summary;
use prost::Message as _;
use rusqlite::{Connection, OptionalExtension as _, params};

use super::columns::checksum;
use crate::core::ids::JobId;

/// Writes the summary of a job.
pub(super) fn put(connection: &Connection, job: JobId, summary: &Summary) -> rusqlite::Result<()> {
    let rows = summary.history.iter().map(history::evaluation_to_message).collect();
    let groups = summary.groups.iter().map(history::group_ending_to_message).collect();
    let history = v1::HistoryBlock { rows, groups }.encode_to_vec();
    let checksum = summary_checksum(job, &summary.digest, summary.best, &history);
    let sql = "INSERT OR REPLACE INTO summary VALUES (?1, ?2, ?3, ?4, ?5)";
    let values = params![job.0, summary.digest, summary.best, history, checksum];
    connection.execute(sql, values).map(drop)
}

/// Returns the summary of a job, if there is one; the inner `None` means that it is damaged.
pub(super) fn get(
    connection: &Connection,
    job: JobId,
) -> rusqlite::Result<Option<Option<Summary>>> {
    let sql = "SELECT digest, best, history, checksum FROM summary WHERE job = ?1";
    let read = |row: &rusqlite::Row<'_>| {
        let (digest, best): (String, Option<u64>) = (row.get(0)?, row.get(1)?);
        let (history, checksum) = (row.get_ref(2)?.as_blob()?, row.get_ref(3)?.as_blob()?);
        let intact = checksum == summary_checksum(job, &digest, best, history);
        let block = intact.then(|| block(history)).flatten();
        Ok(block.map(|(history, groups)| Summary { digest, best, history, groups }))
    };
    connection.query_row(sql, params![job.0], read).optional()
}

/// Returns the rows and the endings of groups in a `HistoryBlock`; `None` if it is none, or not a valid one.
fn block(encoded: &[u8]) -> Option<(Vec<Evaluation>, Vec<GroupEnding>)> {
    let block = v1::HistoryBlock::decode(encoded).ok()?;
    let rows = block.rows.iter().map(|row| history::evaluation_from_message(row).ok());
    let groups = block.groups.iter().map(|group| history::group_ending_from_message(group).ok());
    Some((rows.collect::<Option<_>>()?, groups.collect::<Option<_>>()?))
}

/// Returns the checksum of a row of the table.
pub(super) fn summary_checksum(
    job: JobId,
    digest: &str,
    best: Option<u64>,
    history: &[u8],
) -> Vec<u8> {
    let best = best.map(u64::to_le_bytes);
    let best = best.as_ref().map_or(&[] as &[u8], <[u8; 8]>::as_slice);
    checksum(&[&job.0.to_le_bytes(), digest.as_bytes(), best, history])
}
