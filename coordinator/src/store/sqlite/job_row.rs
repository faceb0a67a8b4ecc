//! A job as a row of the database.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::results::{JobFailure, Status};
use osteon_common::version::Program;
use osteon_proto::{specification, v1};
use osteon_search::Ending;
use prost::Message as _;
use rusqlite::Row;

use super::columns::{JobColumns, job_checksum, nanoseconds};
use crate::core::ids::JobId;
use crate::store::{EndRecord, JobRecord, StoreError};

/// Returns the job of a row, and its identifier; `None` if the row is damaged.
pub(super) fn job_record(row: &Row<'_>) -> rusqlite::Result<(JobId, Option<JobRecord>)> {
    let job = JobId(row.get(0)?);
    let (request_id, fingerprint, client, name): (String, String, String, String) =
        (row.get(1)?, row.get(4)?, row.get(6)?, row.get(8)?);
    let (encoded, checksum) = (row.get_ref(3)?.as_blob()?, row.get_ref(5)?.as_blob()?);
    let columns = JobColumns {
        job,
        request_id: &request_id,
        accepted_ns: row.get(2)?,
        specification: encoded,
        fingerprint: &fingerprint,
        client: &client,
        priority: row.get(7)?,
        name: &name,
    };
    let intact = checksum == job_checksum(&columns);
    let (accepted, priority) = (Duration::from_nanos(columns.accepted_ns), columns.priority);
    let message = intact.then(|| v1::JobSpecification::decode(encoded).ok()).flatten();
    let known = message.and_then(|message| specification::from_message(&message).ok());
    let record = known.map(|specification| JobRecord {
        job,
        request_id,
        specification: Arc::new(specification),
        accepted,
        fingerprint,
        client,
        priority,
        name,
    });
    Ok((job, record))
}

/// Returns the columns of a job.
pub(super) fn job_columns<'a>(record: &'a JobRecord, encoded: &'a [u8]) -> JobColumns<'a> {
    JobColumns {
        job: record.job,
        request_id: &record.request_id,
        accepted_ns: nanoseconds(record.accepted),
        specification: encoded,
        fingerprint: &record.fingerprint,
        client: &record.client,
        priority: record.priority,
        name: &record.name,
    }
}

/// Returns the end that is shown for a job whose end is damaged: one such row must not keep all
/// others from being served. Nothing is written, because a copy of the file may have the right end.
pub(super) fn damaged_end(record: &JobRecord, error: &StoreError) -> EndRecord {
    tracing::error!(%error, "a job is shown as failed; the others are served");
    let ending = Ending {
        status: Status::Failed,
        failure: Some(JobFailure::Store),
        reason: Some(error.to_string()),
    };
    let program = Program { version: "unknown".to_owned(), numerics: 0, commit: None };
    EndRecord::new(record.job, ending, program, record.accepted, 0, None)
}
