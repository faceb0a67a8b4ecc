//! Copies the file while it is in use, by SQLite's online backup: piece by piece on the connection
//! that also writes, so that the copy includes the writes between two pieces.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::ops::ControlFlow;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rusqlite::Connection;
use rusqlite::backup::{Backup, StepResult};

use super::opening;
use crate::store::StoreError;

/// Name of the copy in the store's directory, while it is being made.
const COPY: &str = "osteon.backup";
/// Number of pages in one piece: with pages of 16 KiB a piece is 1 MiB, which takes milliseconds.
const PIECE_PAGES: i32 = 64;
/// Measurements are private to their owner.
const COPY_MODE: u32 = 0o600;

/// Copies the database of `connection`, which is the file `store`, and calls `between` after each
/// piece; see [`crate::store::Store::copy`].
pub(super) fn copy(
    connection: &Connection,
    store: &Path,
    between: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<File>, StoreError> {
    let path = store.with_file_name(COPY);
    remove(&path)?;
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true).mode(COPY_MODE);
    let file = options.open(&path).map_err(|error| failed(&path, error))?;
    let whole = copy_pages(connection, &path, between);
    // Removed in any case; a complete copy remains readable through `file`.
    remove(&path)?;
    let whole = whole.map_err(|source| opening::refusal(&path, source))?;
    Ok(whole.then_some(file))
}

/// Removes the copy that a killed coordinator left in the directory of `store`.
pub(super) fn remove_leftover(store: &Path) -> Result<(), StoreError> {
    remove(&store.with_file_name(COPY))
}

/// Copies all pages; returns whether the copy is complete.
fn copy_pages(
    connection: &Connection,
    path: &Path,
    between: &mut dyn FnMut() -> ControlFlow<()>,
) -> rusqlite::Result<bool> {
    let mut copy = Connection::open(path)?;
    // A partial copy after a crash is useless, so the copy needs neither journal nor sync.
    copy.pragma_update(None, "journal_mode", "OFF")?;
    copy.pragma_update(None, "synchronous", "OFF")?;
    let backup = Backup::new(connection, &mut copy)?;
    loop {
        if backup.step(PIECE_PAGES)? == StepResult::Done {
            return Ok(true);
        }
        if between().is_break() {
            return Ok(false);
        }
    }
}

fn remove(path: &Path) -> Result<(), StoreError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(failed(path, error)),
        _ => Ok(()),
    }
}

fn failed(path: &Path, error: io::Error) -> StoreError {
    StoreError::Copy { path: path.to_owned(), error }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Seek as _};

    use super::*;
    use crate::store::sqlite::SqliteStore;
    use crate::store::sqlite::tests::{evaluation, job};
    use crate::store::{Store as _, StoredJob};

    /// Returns a store with evaluations of about 4 MB in all.
    fn filled(directory: &Path) -> SqliteStore {
        let mut store = SqliteStore::open(directory).unwrap();
        store.put_job(&job(1)).unwrap();
        for number in 0..100 {
            let outcomes = vec![Ok(3900.1); 5000].into();
            let record = crate::store::EvaluationRecord { outcomes, ..evaluation(1, number) };
            store.put_evaluation(&record, false).unwrap();
        }
        store
    }

    /// Returns the contents that a coordinator finds when it starts on the copy.
    fn restored(mut copy: File) -> (Vec<StoredJob>, Option<crate::core::ids::JobId>) {
        let directory = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        copy.rewind().unwrap();
        copy.read_to_end(&mut bytes).unwrap();
        fs::write(directory.path().join(opening::FILE), bytes).unwrap();
        let mut store = SqliteStore::open(directory.path()).unwrap();
        (store.jobs().unwrap(), store.last_deleted_job().unwrap())
    }

    #[test]
    fn a_copy_has_everything_with_what_is_written_while_it_is_made() {
        let directory = tempfile::tempdir().unwrap();
        let mut store = filled(directory.path());
        store.put_job(&job(7)).unwrap();
        let mut pieces = 0;
        let copy = store
            .copy(&mut |store| {
                pieces += 1;
                if pieces == 1 {
                    // Into pages that have been copied already, and after the last one.
                    store.delete_jobs(&[crate::core::ids::JobId(7)]).unwrap();
                    store.put_job(&job(2)).unwrap();
                    store.put_evaluation(&evaluation(1, 0), false).unwrap();
                    store.put_evaluation(&evaluation(1, 100), false).unwrap();
                }
                ControlFlow::Continue(())
            })
            .unwrap();
        assert!(pieces > 2, "{pieces} pieces");
        assert!(!directory.path().join(COPY).exists());
        let (jobs, last_deleted_job) = restored(copy.unwrap());
        assert_eq!(jobs, store.jobs().unwrap());
        assert_eq!(jobs.len(), 2);
        assert_eq!((jobs[0].evaluations, &jobs[1].record), (101, &job(2)));
        assert_eq!(last_deleted_job, Some(crate::core::ids::JobId(7)));
    }

    #[test]
    fn a_copy_that_nobody_wants_any_more_leaves_nothing_behind() {
        let directory = tempfile::tempdir().unwrap();
        let mut store = filled(directory.path());
        let copy = store.copy(&mut |_| ControlFlow::Break(())).unwrap();
        assert!(copy.is_none());
        assert!(!directory.path().join(COPY).exists());
        // The copy of a killed coordinator is removed by the next copy and by the next start.
        fs::write(directory.path().join(COPY), "half a copy").unwrap();
        assert!(store.copy(&mut |_| ControlFlow::Continue(())).unwrap().is_some());
        fs::write(directory.path().join(COPY), "half a copy").unwrap();
        drop(store);
        drop(SqliteStore::open(directory.path()).unwrap());
        assert!(!directory.path().join(COPY).exists());
    }

    #[test]
    fn others_cannot_read_a_copy() {
        use std::os::unix::fs::PermissionsExt as _;
        let directory = tempfile::tempdir().unwrap();
        let mut store = filled(directory.path());
        let copy = store.copy(&mut |_| ControlFlow::Continue(())).unwrap().unwrap();
        assert_eq!(copy.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    }
}
