//! When the write-ahead log is copied into the database.
//!
//! A record is durable in the log. SQLite would copy a log of 4 MB before it reports the record that made
//! it so long, and whoever waits for a large record would wait twice as long. So the copy is made
//! later, between records.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};

use rusqlite::Connection;

/// Pages in the log from which on it is copied between records.
const DUE_PAGES: i32 = 1000;
/// Pages in the log from which on it is copied at once: 800 MB.
const FULL_PAGES: i32 = 200_000;
/// Size to which a file that was longer shrinks when the log starts again, bytes.
const FILE_BYTES: i64 = 64 << 20;

/// Length of the log.
#[derive(Debug)]
pub(super) struct Log {
    /// In pages, as of the last record.
    pages: Arc<AtomicI32>,
}

impl Log {
    /// Takes over the copying from SQLite.
    pub(super) fn of(connection: &mut Connection) -> rusqlite::Result<Self> {
        Self::with_full(connection, FULL_PAGES)
    }

    fn with_full(connection: &mut Connection, full_pages: i32) -> rusqlite::Result<Self> {
        connection.pragma_update(None, "journal_size_limit", FILE_BYTES)?;
        let pages = Arc::new(AtomicI32::new(0));
        let length = Arc::clone(&pages);
        connection.wal_hook(Some(move |log: &mut rusqlite::hooks::Wal, pages| {
            length.store(pages, Ordering::Relaxed);
            if pages < full_pages { Ok(()) } else { log.checkpoint() }
        }))?;
        Ok(Self { pages })
    }

    /// Copies the log, if it is long.
    pub(super) fn copy(&self, connection: &Connection) -> rusqlite::Result<()> {
        if self.pages.load(Ordering::Relaxed) < DUE_PAGES {
            return Ok(());
        }
        // The next record starts the log again.
        self.pages.store(0, Ordering::Relaxed);
        connection.query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |_| Ok(()))
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
        let full_pages = 10 * DUE_PAGES;
        let log = Log::with_full(&mut connection, full_pages).unwrap();
        let put = |pages: i32| {
            let sql = "INSERT INTO blobs VALUES (zeroblob(?1))";
            connection.execute(sql, [pages * 4096]).unwrap();
        };
        let copied = || fs::metadata(&path).unwrap().len() / 4096;
        log.copy(&connection).unwrap();
        let before = copied();
        put(DUE_PAGES / 2);
        log.copy(&connection).unwrap();
        assert_eq!(copied(), before, "a short log waits");
        put(2 * DUE_PAGES);
        assert_eq!(copied(), before, "the record is reported first");
        log.copy(&connection).unwrap();
        assert!(copied() > 2000, "{} pages", copied());
        put(full_pages);
        assert!(copied() > 12_000, "{} pages", copied());
    }
}
