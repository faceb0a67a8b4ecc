//! A mark beside the database: the highest job whose acceptance was reported to a client.
//!
//! To SQLite, a write-ahead log that is truncated or damaged at its end is just a shorter log: the
//! later records are lost without an error. The mark is outside the log. It is written after a job
//! is durable and before its client is answered, so it is never ahead of the database, wherever a
//! process dies; a database that has fewer jobs than the mark has lost some.
//!
//! The file has two slots in separate blocks, written in turn, each with a checksum: a torn write
//! leaves the other slot intact. The file has its full length from the beginning, so a write only
//! changes space that is already allocated.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{FileExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use osteon_files::user_file;
use rusqlite::Connection;

use super::opening::FILE_MODE;
use crate::core::ids::JobId;
use crate::store::StoreError;

/// Name of the file in the store's directory.
pub(super) const MARK: &str = "osteon.acknowledged";
/// Size of a slot, bytes: each slot is in blocks of its own on any disk or file system, so that a
/// write to one never touches the other.
const SLOT_BYTES: usize = 4096;
const SLOTS: u64 = 2;
const LENGTH: u64 = SLOTS * SLOT_BYTES as u64;

/// The header field of the file that holds the highest identifier of a deleted job. It is part of
/// the database, so it changes in one transaction with the tables.
pub(super) const LAST_DELETED_JOB: &str = "user_version";

/// Reaction to a database that has fewer jobs than were acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LostJobs {
    /// Refuse it.
    #[default]
    Refuse,
    /// Continue without them. Their identifiers are not assigned again.
    Accept,
}

/// The mark of an open store.
#[derive(Debug)]
pub(super) struct Mark {
    file: File,
    path: PathBuf,
    /// Highest acknowledged job; 0 if there is none.
    last: u64,
    /// The slot that holds it.
    slot: u64,
}

/// Contents of a mark file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum MarkFile {
    /// The file does not exist.
    Nothing,
    /// The file is not a valid mark.
    Damaged,
    /// The highest acknowledged job, and the slot that holds it.
    Job { last: u64, slot: u64 },
}

impl Mark {
    /// Reads the mark in `directory`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(super) fn find(directory: &Path) -> Result<MarkFile, StoreError> {
        let path = directory.join(MARK);
        match user_file::read(&path, LENGTH) {
            Ok(Some(bytes)) => Ok(found(&bytes)),
            Ok(None) => Ok(MarkFile::Damaged),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(MarkFile::Nothing),
            Err(error) => Err(StoreError::Mark { path, error }),
        }
    }

    /// Opens the mark in `directory`, whose contents are `found`. It is replaced by a new one with
    /// the job `last` if it is missing, is damaged, or names another job.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn open(directory: &Path, found: &MarkFile, last: u64) -> Result<Self, StoreError> {
        let path = directory.join(MARK);
        let open = || -> io::Result<(File, u64)> {
            let slot = match *found {
                MarkFile::Job { last: said, slot } if said == last => slot,
                _ => {
                    make(directory, &path, last)?;
                    0
                }
            };
            let file = user_file::open_with(OpenOptions::new().read(true).write(true), &path)?;
            Ok((file, slot))
        };
        match open() {
            Ok((file, slot)) => Ok(Self { file, path, last, slot }),
            Err(error) => Err(StoreError::Mark { path, error }),
        }
    }

    /// Returns the mark of `directory`, opened so that writes fail.
    #[cfg(test)]
    pub(super) fn unwritable(directory: &Path, last: u64) -> Self {
        let path = directory.join(MARK);
        let file = File::open(&path).unwrap();
        Self { file, path, last, slot: 0 }
    }

    /// Makes durable that `job` is acknowledged, unless a job at or above it is already.
    ///
    /// # Errors
    /// When it is not durable.
    pub(super) fn acknowledge(&mut self, job: JobId) -> Result<(), StoreError> {
        if job.0 <= self.last {
            return Ok(());
        }
        let slot = (self.slot + 1) % SLOTS;
        let write = || -> io::Result<()> {
            self.file.write_all_at(&text(job.0), slot * SLOT_BYTES as u64)?;
            self.file.sync_data()
        };
        write().map_err(|error| StoreError::Mark { path: self.path.clone(), error })?;
        (self.last, self.slot) = (job.0, slot);
        Ok(())
    }
}

/// Returns the highest acknowledged job of a database whose highest job is `known`.
///
/// # Errors
/// When the mark `found` shows that jobs are missing, or is damaged, unless that is accepted.
pub(super) fn checked(
    found: &MarkFile,
    known: u64,
    store: &Path,
    lost: LostJobs,
) -> Result<u64, StoreError> {
    let path = store.to_owned();
    let (refusal, last) = match *found {
        // A new store, or a copy of the database alone.
        MarkFile::Nothing => return Ok(known),
        MarkFile::Job { last, .. } if last <= known => return Ok(known),
        MarkFile::Job { last, .. } => {
            (StoreError::LostJobs { path, first: JobId(known + 1), last: JobId(last) }, last)
        }
        MarkFile::Damaged => (StoreError::MarkDamaged { path: store.with_file_name(MARK) }, known),
    };
    match lost {
        LostJobs::Refuse => Err(refusal),
        LostJobs::Accept => {
            tracing::error!(
                "{refusal}: accepted, because of --accept-lost-jobs; the coordinator \
                             continues"
            );
            Ok(last)
        }
    }
}

/// Creates the file atomically: it is never seen partly written.
fn make(directory: &Path, path: &Path, last: u64) -> io::Result<()> {
    let part = path.with_extension("acknowledged.part");
    let mut options = OpenOptions::new();
    let options = options.write(true).create(true).truncate(false).mode(FILE_MODE);
    let mut file = user_file::open_with(options, &part)?;
    file.set_len(0)?;
    // Both slots are written, because the contents of an older file are obsolete.
    file.write_all(&text(last))?;
    file.write_all(&text(last))?;
    file.sync_all()?;
    fs::rename(&part, path)?;
    File::open(directory)?.sync_all()
}

/// Returns the contents of a slot: a readable line with its checksum, padded with spaces.
fn text(last: u64) -> Vec<u8> {
    let line = format!("last acknowledged job {last}");
    let checksum = blake3::hash(line.as_bytes());
    let mut bytes = format!("{line} blake3 {checksum}\n").into_bytes();
    bytes.resize(SLOT_BYTES - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// Returns the highest job of the intact slots.
fn found(bytes: &[u8]) -> MarkFile {
    let slots = bytes.chunks(SLOT_BYTES).zip(0_u64..);
    let whole = slots.filter_map(|(bytes, slot)| {
        let line = str::from_utf8(bytes).ok()?.lines().next()?;
        let (line, _) = line.split_once(" blake3 ")?;
        let last: u64 = line.strip_prefix("last acknowledged job ")?.parse().ok()?;
        (text(last) == bytes).then_some((last, slot))
    });
    match whole.max() {
        Some((last, slot)) if bytes.len() as u64 == LENGTH => MarkFile::Job { last, slot },
        _ => MarkFile::Damaged,
    }
}

/// Returns the highest identifier in the database, including those of deleted jobs; 0 if there is
/// none.
pub(super) fn last_known(connection: &Connection) -> rusqlite::Result<u64> {
    let stored: Option<u64> = if connection.table_exists(None, "job")? {
        connection.query_row("SELECT max(id) FROM job", [], |row| row.get(0))?
    } else {
        None
    };
    let deleted: i32 = connection.pragma_query_value(None, LAST_DELETED_JOB, |row| row.get(0))?;
    Ok(stored.unwrap_or(0).max(u64::try_from(deleted).unwrap_or(0)))
}

/// Makes durable that no job gets an identifier up to `last`.
pub(super) fn never_again(connection: &Connection, last: u64) -> rusqlite::Result<()> {
    let last = i32::try_from(last).unwrap_or(i32::MAX);
    connection.pragma_update(None, LAST_DELETED_JOB, last)?;
    connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_mark(directory: &Path) -> MarkFile {
        Mark::find(directory).unwrap()
    }

    #[test]
    fn a_mark_says_the_last_job_whatever_a_torn_write_leaves() {
        let directory = tempfile::tempdir().unwrap();
        let directory = directory.path();
        assert_eq!(read_mark(directory), MarkFile::Nothing);
        let mut mark = Mark::open(directory, &MarkFile::Nothing, 0).unwrap();
        assert_eq!(read_mark(directory), MarkFile::Job { last: 0, slot: 1 });
        let path = directory.join(MARK);
        for job in 1..5 {
            let before = fs::read(&path).unwrap();
            mark.acknowledge(JobId(job)).unwrap();
            let MarkFile::Job { last, slot } = read_mark(directory) else { panic!("damaged") };
            assert_eq!(last, job);
            let after = fs::read(&path).unwrap();
            // Any part of the slot may have reached the disk.
            for cut in (0..SLOT_BYTES).step_by(7) {
                let torn = usize::try_from(slot).unwrap() * SLOT_BYTES + cut;
                let mut bytes = before.clone();
                let begin = usize::try_from(slot).unwrap() * SLOT_BYTES;
                bytes[begin..torn].copy_from_slice(&after[begin..torn]);
                let MarkFile::Job { last, .. } = found(&bytes) else { panic!("{cut}") };
                assert!(last == job || last == job - 1, "{cut}: {last}");
            }
        }
        drop(mark);
        // The next run continues in the other slot.
        let found = read_mark(directory);
        let mut mark = Mark::open(directory, &found, 4).unwrap();
        mark.acknowledge(JobId(3)).unwrap();
        assert_eq!(read_mark(directory), found);
        mark.acknowledge(JobId(5)).unwrap();
        assert!(matches!(read_mark(directory), MarkFile::Job { last: 5, .. }));
    }

    #[test]
    fn what_is_no_mark_is_damaged() {
        let whole = [text(7), text(8)].concat();
        assert_eq!(found(&whole), MarkFile::Job { last: 8, slot: 1 });
        let mut other = whole.clone();
        other[23] = b'9';
        assert_eq!(found(&other), MarkFile::Job { last: 8, slot: 1 });
        let mut neither = other.clone();
        neither[SLOT_BYTES + 23] = b'9';
        for bytes in [&neither[..], b"", &whole[..SLOT_BYTES], &[b'\0'; 2 * SLOT_BYTES]] {
            assert_eq!(found(bytes), MarkFile::Damaged);
        }
    }
}
