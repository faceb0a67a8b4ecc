//! Bans of hosts, whether they were lifted, and the ended jobs that are doubtful because of them.

use std::collections::BTreeSet;
use std::time::Duration;

use rusqlite::{Connection, OptionalExtension as _, Row, params};

use super::columns::{ban_checksum, checksum, nanoseconds, unpack_workers};
use crate::core::ids::JobId;
use crate::core::worker_name::WorkerName;
use crate::store::{BanRecord, DoubtRecord};

/// The tables beside that of the bans.
pub(super) const TABLES: &str = "
    CREATE TABLE lift (                  -- bans that an operator has lifted
        ban INTEGER PRIMARY KEY,
        at_ns INTEGER NOT NULL,          -- since the Unix epoch
        checksum BLOB NOT NULL
    );
    CREATE TABLE doubt (                 -- ended jobs with answers of a host that was banned later
        job INTEGER NOT NULL REFERENCES job(id),
        ban INTEGER NOT NULL,
        digest TEXT,                     -- of the result that was computed again since; NULL before
        checksum BLOB NOT NULL,
        PRIMARY KEY (job, ban)
    );
";

/// Puts a ban, and that it is lifted. With a new ban, the ended jobs with answers of its host are noted.
pub(super) fn put(connection: &Connection, record: &BanRecord) -> rusqlite::Result<()> {
    let BanRecord { number, worker, job, reason, at, lifted } = record;
    let sql = "INSERT OR IGNORE INTO ban (number, host, process, instance, job, reason, at_ns,
               checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
    let instance = worker.instance().cast_signed();
    let values = params![
        number,
        worker.host(),
        worker.process(),
        instance,
        job.0,
        reason,
        nanoseconds(*at),
        ban_checksum(record)
    ];
    if connection.execute(sql, values)? > 0 {
        for job in ended_jobs_of(connection, worker.host())? {
            put_doubt(connection, &DoubtRecord { job, ban: *number, digest: None })?;
        }
    }
    if let Some(lifted) = lifted {
        let sql = "INSERT OR REPLACE INTO lift (ban, at_ns, checksum) VALUES (?1, ?2, ?3)";
        let at = nanoseconds(*lifted);
        connection.execute(sql, params![number, at, lift_checksum(*number, at)])?;
    }
    Ok(())
}

/// Returns all bans in the order of their numbers; of a damaged one, the job in which it was found.
pub(super) fn all(connection: &Connection) -> rusqlite::Result<Vec<Result<BanRecord, JobId>>> {
    let sql = "SELECT number, host, process, job, reason, ban.at_ns, ban.checksum, instance,
               lift.at_ns, lift.checksum
               FROM ban LEFT JOIN lift ON lift.ban = ban.number ORDER BY number";
    let read = |row: &Row<'_>| {
        let (host, found): (String, Vec<u8>) = (row.get(1)?, row.get(6)?);
        let instance: i64 = row.get(7)?;
        let lifted: Option<u64> = row.get(8)?;
        let lift: Option<Vec<u8>> = row.get(9)?;
        let record = BanRecord {
            number: row.get(0)?,
            worker: WorkerName::new(&host, row.get(2)?, instance.cast_unsigned()),
            job: JobId(row.get(3)?),
            reason: row.get(4)?,
            at: Duration::from_nanos(row.get(5)?),
            lifted: lifted.map(Duration::from_nanos),
        };
        let expected = lifted.map(|at| lift_checksum(record.number, at));
        let is_intact = found == ban_checksum(&record) && lift == expected;
        Ok(if is_intact { Ok(record) } else { Err(record.job) })
    };
    connection.prepare(sql)?.query_map([], read)?.collect()
}

/// Returns the doubts about jobs, in the order of their identifiers; of a damaged one, the job.
pub(super) fn doubts(connection: &Connection) -> rusqlite::Result<Vec<Result<DoubtRecord, JobId>>> {
    let sql = "SELECT job, ban, digest, checksum FROM doubt ORDER BY job, ban";
    let read = |row: &Row<'_>| {
        let record = DoubtRecord { job: JobId(row.get(0)?), ban: row.get(1)?, digest: row.get(2)? };
        let found: Vec<u8> = row.get(3)?;
        Ok(if found == doubt_checksum(&record) { Ok(record) } else { Err(record.job) })
    };
    connection.prepare(sql)?.query_map([], read)?.collect()
}

/// Deletes the end of a job and the summary of its search's path, whose digest is kept with
/// the doubts about the result.
pub(super) fn reopen(connection: &Connection, job: JobId) -> rusqlite::Result<()> {
    let sql = "SELECT digest FROM summary WHERE job = ?1";
    let digest: Option<String> = connection.query_row(sql, [job.0], |row| row.get(0)).optional()?;
    let sql = "SELECT ban FROM doubt WHERE job = ?1 AND digest IS NULL";
    let bans: Vec<u64> =
        connection.prepare(sql)?.query_map([job.0], |row| row.get(0))?.collect::<Result<_, _>>()?;
    for ban in bans {
        put_doubt(
            connection,
            &DoubtRecord { job, ban, digest: Some(digest.clone().unwrap_or_default()) },
        )?;
    }
    for table in ["summary", "ending"] {
        connection.execute(&format!("DELETE FROM {table} WHERE job = ?1"), [job.0])?;
    }
    Ok(())
}

fn put_doubt(connection: &Connection, record: &DoubtRecord) -> rusqlite::Result<()> {
    let sql = "INSERT OR REPLACE INTO doubt (job, ban, digest, checksum) VALUES (?1, ?2, ?3, ?4)";
    let values = params![record.job.0, record.ban, record.digest, doubt_checksum(record)];
    connection.execute(sql, values).map(drop)
}

/// Returns the ended jobs with evaluations that a worker of a host contributed to.
fn ended_jobs_of(connection: &Connection, host: &str) -> rusqlite::Result<BTreeSet<JobId>> {
    // The line of a worker ends with its host.
    let sql = "SELECT evaluation.job, workers FROM evaluation
               JOIN ending ON ending.job = evaluation.job
               WHERE instr(workers || char(10), ' ' || ?1 || char(10)) > 0";
    let mut select = connection.prepare(sql)?;
    let mut rows = select.query([host])?;
    let mut jobs = BTreeSet::new();
    while let Some(row) = rows.next()? {
        let workers = unpack_workers(row.get_ref(1)?.as_str()?).unwrap_or_default();
        if WorkerName::any_of(&workers, host) {
            jobs.insert(JobId(row.get(0)?));
        }
    }
    Ok(jobs)
}

fn lift_checksum(ban: u64, at_ns: u64) -> Vec<u8> {
    checksum(&[&ban.to_le_bytes(), &at_ns.to_le_bytes()])
}

fn doubt_checksum(record: &DoubtRecord) -> Vec<u8> {
    let digest = record.digest.as_deref().unwrap_or_default();
    checksum(&[&record.job.0.to_le_bytes(), &record.ban.to_le_bytes(), digest.as_bytes()])
}
