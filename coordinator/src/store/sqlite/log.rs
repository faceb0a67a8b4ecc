//! When the write-ahead log is copied into the database.
//!
//! A record is durable in the log. SQLite would copy a log of 4 MB before it reports the record that made
//! it so long, and whoever waits for a large record would wait twice as long. So the copy is made
//! later, between records.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};

use rusqlite::Connection;

/// Length of the log from which on it is copied between records, bytes.
const DUE_BYTES: i64 = 4 << 20;
/// Length of the log from which on it is copied at once, bytes.
const FULL_BYTES: i64 = 800 << 20;
/// Size to which a file that was longer shrinks when the log starts again, bytes.
const FILE_BYTES: i64 = 64 << 20;

/// Length of the log.
#[derive(Debug)]
pub(super) struct Log {
    /// In pages, as of the last record.
    pages: Arc<AtomicI32>,
    /// Length from which on it is copied between records, in pages.
    due: i32,
    /// Size of a page, bytes.
    page_bytes: i64,
    /// Its length when it was last due and could not be copied, or not all of it, in pages.
    stuck: Cell<Option<i32>>,
}

impl Log {
    /// Takes over the copying from SQLite.
    pub(super) fn take_over(connection: &mut Connection) -> rusqlite::Result<Self> {
        Self::with_full(connection, FULL_BYTES)
    }

    fn with_full(connection: &mut Connection, full_bytes: i64) -> rusqlite::Result<Self> {
        let page: i64 = connection.pragma_query_value(None, "page_size", |row| row.get(0))?;
        let pages_of = |bytes: i64| i32::try_from(bytes / page.max(1)).unwrap_or(i32::MAX);
        let full = pages_of(full_bytes);
        connection.pragma_update(None, "journal_size_limit", FILE_BYTES)?;
        let pages = Arc::new(AtomicI32::new(0));
        let length = Arc::clone(&pages);
        connection.wal_hook(Some(move |log: &mut rusqlite::hooks::Wal, pages| {
            length.store(pages, Ordering::Relaxed);
            if pages < full { Ok(()) } else { log.checkpoint() }
        }))?;
        let (due, stuck) = (pages_of(DUE_BYTES), Cell::new(None));
        Ok(Self { pages, due, page_bytes: page, stuck })
    }

    /// Copies the log, if it is long.
    pub(super) fn copy(&self, connection: &Connection) -> rusqlite::Result<()> {
        let length = self.pages.load(Ordering::Relaxed);
        if length < self.due {
            return Ok(());
        }
        // The next record starts the log again, or says how long it is.
        self.pages.store(0, Ordering::Relaxed);
        self.stuck.set(Some(length));
        let sql = "PRAGMA wal_checkpoint(PASSIVE)";
        let (all, copied): (i32, i32) =
            connection.query_row(sql, [], |row| Ok((row.get(1)?, row.get(2)?)))?;
        // Whoever reads an older state of the database keeps the rest from being copied; where the database is
        // locked, as a running coordinator does, that is nobody.
        self.stuck.set(Some(all).filter(|all| copied < *all));
        Ok(())
    }

    /// Returns its length, bytes, if it could not be copied when that was last due.
    pub(super) fn stuck(&self) -> Option<u64> {
        u64::try_from(i64::from(self.stuck.get()?) * self.page_bytes).ok()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_long_log_is_copied_when_there_is_time_and_a_full_one_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("store.sqlite");
        let mut connection = Connection::open(&path).unwrap();
        connection.pragma_update(None, "journal_mode", "WAL").unwrap();
        connection.execute_batch("CREATE TABLE blobs (bytes BLOB)").unwrap();
        let full = 10 * DUE_BYTES;
        let log = Log::with_full(&mut connection, full).unwrap();
        let put = |bytes: i64| {
            let sql = "INSERT INTO blobs VALUES (zeroblob(?1))";
            connection.execute(sql, [bytes]).unwrap();
        };
        let copied = || i64::try_from(fs::metadata(&path).unwrap().len()).unwrap();
        log.copy(&connection).unwrap();
        let before = copied();
        put(DUE_BYTES / 2);
        log.copy(&connection).unwrap();
        assert_eq!(copied(), before, "a short log waits");
        put(2 * DUE_BYTES);
        assert_eq!(copied(), before, "the record is reported first");
        log.copy(&connection).unwrap();
        assert!(copied() > 2 * DUE_BYTES, "{} bytes", copied());
        put(full);
        assert!(copied() > full + 2 * DUE_BYTES, "{} bytes", copied());
    }

    /// A program that reads an old state keeps the log from being copied: that is noticed, and nothing is lost.
    #[test]
    fn a_log_that_somebody_reads_is_known_to_be_stuck() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("store.sqlite");
        let mut connection = Connection::open(&path).unwrap();
        connection.pragma_update(None, "journal_mode", "WAL").unwrap();
        connection.execute_batch("CREATE TABLE blobs (bytes BLOB)").unwrap();
        let log = Log::take_over(&mut connection).unwrap();
        let put = || {
            connection.execute("INSERT INTO blobs VALUES (zeroblob(?1))", [DUE_BYTES]).unwrap();
            log.copy(&connection).unwrap();
        };
        put();
        assert_eq!(log.stuck(), None);
        let reader = Connection::open(&path).unwrap();
        let count = |of: &Connection| -> i64 {
            of.query_row("SELECT count(*) FROM blobs", [], |row| row.get(0)).unwrap()
        };
        reader.execute_batch("BEGIN").unwrap();
        assert_eq!(count(&reader), 1);
        for records in 2..5 {
            put();
            let least = u64::try_from(DUE_BYTES).unwrap() * (records - 1);
            assert!(log.stuck().unwrap() >= least, "{records}: {:?}", log.stuck());
        }
        assert_eq!((count(&reader), count(&connection)), (1, 4));
        reader.execute_batch("COMMIT").unwrap();
        put();
        assert_eq!((log.stuck(), count(&reader)), (None, 5));
    }
}
