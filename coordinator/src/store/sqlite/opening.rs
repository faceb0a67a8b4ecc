//! Opens the file: takes the lock, finds out the kind of file system, and checks the format. A file
//! that is refused is not changed.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use osteon_files::user_file;
use osteon_proto::identity::host_name;
use rusqlite::config::DbConfig;
use rusqlite::{Connection, ErrorCode, TransactionBehavior};

use super::schema::SCHEMA;
use super::{ban_rows, evaluation_rows, parts};
use crate::store::StoreError;

/// The format that this program writes.
pub(super) const FORMAT: i64 = 1;
/// Name of the file in the store's directory.
pub(super) const FILE: &str = "osteon.sqlite";
/// Name of the lock file, which names the process that has the store open.
const LOCK: &str = "osteon.lock";
/// Size of the pages of a new file, bytes.
const PAGE_BYTES: i64 = 16 << 10;
/// Time to wait for another coordinator that is about to end.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum length of the text in a lock file that is shown, bytes.
const HOLDER_BYTES_MAX: u64 = 256;

/// Mode of a new directory and of a new file: measurements are private to their owner.
const DIRECTORY_MODE: u32 = 0o700;
pub(super) const FILE_MODE: u32 = 0o600;
/// The mode bits of users other than the owner.
const OTHERS: u32 = 0o077;

/// Method that protects changes against a crash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Journal {
    /// A write-ahead log beside the file: fast, for local disks.
    WriteAhead,
    /// A copy of the overwritten pages: for disks that are shared over a network.
    Rollback,
}

/// Opens the file in `directory`, creating both if necessary; the lock is held as long as the file
/// is open. Calls `accept` before anything in the file is changed, and returns its result.
pub(super) fn open<T>(
    directory: &Path,
    accept: impl FnOnce(&Connection, &Path) -> Result<T, StoreError>,
) -> Result<(Connection, File, PathBuf, T), StoreError> {
    make_directory(directory)
        .map_err(|error| StoreError::Directory { path: directory.to_owned(), error })?;
    let path = directory.join(FILE);
    let lock = lock(directory, &path)?;
    make_private(directory, &path)
        .map_err(|error| unmade(&path, error, |path, error| StoreError::Make { path, error }))?;
    let network = network_file_system(directory);
    let journal = if network.is_some() { Journal::Rollback } else { Journal::WriteAhead };
    if let Some(kind) = network {
        tracing::warn!(directory = %directory.display(), kind,
            "the store is on a network file system, where locks are not always reliable: make \
             sure that no coordinator on another machine uses it; a local disk is safer and faster");
    }
    let (connection, accepted) = open_file(&path, journal, accept)?;
    Ok((connection, lock, path, accepted))
}

/// Creates a directory that only this user can access, and its parents; an existing one is not
/// changed.
pub(super) fn make_directory(directory: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(DIRECTORY_MODE).create(directory)
}

/// Creates an empty file that only this user can read, in which SQLite makes its tables; SQLite
/// gives its mode to the files beside it. Warns if an existing file is accessible to other users.
fn make_private(directory: &Path, path: &Path) -> io::Result<()> {
    let made = OpenOptions::new().write(true).create_new(true).mode(FILE_MODE).open(path);
    match made {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        made => return made.map(drop),
    }
    let open = |path: &Path| Ok::<bool, io::Error>(mode(path)? & OTHERS != 0);
    if open(path)? && open(directory)? {
        tracing::warn!(path = %path.display(),
            "other users of this machine can read the store: to keep measurements and results from \
             them, run `chmod 700` on its directory");
    }
    Ok(())
}

/// Returns the error for a file that cannot be created: no space, or `otherwise`.
fn unmade(
    path: &Path,
    error: io::Error,
    otherwise: impl FnOnce(PathBuf, io::Error) -> StoreError,
) -> StoreError {
    let path = path.to_owned();
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            StoreError::NoRoom { path, error }
        }
        _ => otherwise(path, error),
    }
}

fn mode(path: &Path) -> io::Result<u32> {
    Ok(fs::metadata(path)?.permissions().mode())
}

/// Opens the file and sets its pragmas.
pub(super) fn open_file<T>(
    path: &Path,
    journal: Journal,
    accept: impl FnOnce(&Connection, &Path) -> Result<T, StoreError>,
) -> Result<(Connection, T), StoreError> {
    let refused = |source| refusal(path, source);
    let mut connection = Connection::open(path).map_err(refused)?;
    connection.busy_timeout(BUSY_TIMEOUT).map_err(refused)?;
    // Must come first: then the write-ahead log needs no shared memory.
    connection.pragma_update(None, "locking_mode", "EXCLUSIVE").map_err(refused)?;
    check_format(&connection, path)?;
    check_pages(&connection, path)?;
    let accepted = match accept(&connection, path) {
        Ok(accepted) => accepted,
        Err(refusal) => {
            leave_log(&connection, path).map_err(refused)?;
            return Err(refusal);
        }
    };
    prepare(&mut connection, journal).map_err(refused)?;
    Ok((connection, accepted))
}

/// Keeps a non-empty log when the connection ends: an operator may want to examine the rest of a
/// truncated one.
fn leave_log(connection: &Connection, path: &Path) -> rusqlite::Result<()> {
    let log = path.with_extension("sqlite-wal");
    if fs::metadata(log).is_ok_and(|log| log.len() > 0) {
        connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    }
    Ok(())
}

/// Refuses a file that this program did not write.
fn check_format(connection: &Connection, path: &Path) -> Result<(), StoreError> {
    let refused = |source| refusal(path, source);
    let sql = "SELECT count(*), coalesce(sum(name = 'format'), 0) FROM sqlite_schema
               WHERE type = 'table'";
    let read = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
    let (tables, known): (i64, bool) = connection.query_row(sql, [], read).map_err(refused)?;
    if !known {
        return if tables == 0 {
            Ok(())
        } else {
            Err(StoreError::Foreign { path: path.to_owned() })
        };
    }
    let found: i64 = connection
        .query_row("SELECT version FROM format", [], |row| row.get(0))
        .map_err(refused)?;
    if found == FORMAT {
        Ok(())
    } else {
        Err(StoreError::Format { path: path.to_owned(), found, known: FORMAT })
    }
}

/// Refuses a file whose pages are inconsistent. Checksums protect only records that are read, and
/// some are read much later. This reads the whole file once.
fn check_pages(connection: &Connection, path: &Path) -> Result<(), StoreError> {
    let found: String = connection
        .query_row("PRAGMA quick_check(1)", [], |row| row.get(0))
        .map_err(|source| refusal(path, source))?;
    if found == "ok" {
        return Ok(());
    }
    // The findings may be preceded by a heading.
    let found = found.lines().last().unwrap_or_default().to_owned();
    Err(StoreError::Inconsistent { path: path.to_owned(), found })
}

/// Sets the pragmas, and creates the tables of a new file.
fn prepare(connection: &mut Connection, journal: Journal) -> rusqlite::Result<()> {
    // Both take effect only for a new file. Large evaluations are written in three quarters of the time
    // that they take in SQLite's pages of 4096 bytes, and small records as fast.
    connection.pragma_update(None, "page_size", PAGE_BYTES)?;
    // Deleted records return their space.
    connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    let journal = match journal {
        Journal::WriteAhead => "WAL",
        Journal::Rollback => "DELETE",
    };
    connection.pragma_update(None, "journal_mode", journal)?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Exclusive)?;
    let known: bool = transaction.query_row(
        "SELECT count(*) > 0 FROM sqlite_schema WHERE type = 'table' AND name = 'format'",
        [],
        |row| row.get(0),
    )?;
    if !known {
        transaction.execute_batch("CREATE TABLE format (version INTEGER NOT NULL)")?;
        transaction.execute("INSERT INTO format VALUES (?1)", [FORMAT])?;
        for tables in [SCHEMA, evaluation_rows::TABLE, ban_rows::TABLES, parts::TABLE] {
            transaction.execute_batch(tables)?;
        }
    }
    parts::delete_of_ended(&transaction)?;
    evaluation_rows::delete_loose_pieces(&transaction)?;
    transaction.commit()
}

/// Locks the store for this process, and writes the name of the process into the lock file.
fn lock(directory: &Path, store: &Path) -> Result<File, StoreError> {
    let path = directory.join(LOCK);
    let failed = |error| unmade(&path, error, |path, error| StoreError::Lock { path, error });
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    let mut file = user_file::open_with(&mut options, &path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            // The name of the holder is useful, but not necessary.
            let _ = (&file).take(HOLDER_BYTES_MAX).read_to_string(&mut holder);
            let holder = match holder.trim() {
                "" => "another coordinator".to_owned(),
                known => known.to_owned(),
            };
            return Err(StoreError::InUse { path: store.to_owned(), holder });
        }
        Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => {
            tracing::warn!(path = %path.display(), "this file system does not support file locks");
        }
        Err(TryLockError::Error(error)) => return Err(failed(error)),
    }
    file.set_len(0).map_err(failed)?;
    writeln!(file, "{}", holder()).map_err(failed)?;
    Ok(file)
}

/// Describes this process, for people.
fn holder() -> String {
    let host = host_name().unwrap_or_else(|| "this host".to_owned());
    format!("the coordinator with process {} on {host}", std::process::id())
}

/// Returns the kind of network file system that `directory` lies on, if it does.
#[cfg(target_os = "linux")]
fn network_file_system(directory: &Path) -> Option<&'static str> {
    let found = rustix::fs::statfs(directory).ok()?;
    network_kind(u32::try_from(found.f_type & 0xffff_ffff).ok()?)
}

#[cfg(not(target_os = "linux"))]
fn network_file_system(_: &Path) -> Option<&'static str> {
    None
}

/// Returns the name of the network file system with this magic number (statfs(2) and the kernel's
/// `magic.h`; those of vendors as they publish them).
fn network_kind(magic: u32) -> Option<&'static str> {
    Some(match magic {
        0x6969 => "NFS",
        0x0BD0_0BD0 => "Lustre",
        0x517B | 0xFF53_4D42 | 0xFE53_4D42 => "SMB",
        0x1983_0326 => "BeeGFS",
        0x4750_4653 => "GPFS",
        0x00C3_6400 => "Ceph",
        0x5346_414F | 0x6B41_4653 => "AFS",
        0x7375_7245 => "Coda",
        0x0102_1997 => "9P",
        0x7461_636F => "OCFS2",
        0x0116_1970 => "GFS2",
        0xAAD7_AAEA => "PanFS",
        0x2003_0528 => "OrangeFS",
        0x6573_5546 => "FUSE",
        _ => return None,
    })
}

/// Returns the error of the store that an error of SQLite means for the operator.
pub(super) fn refusal(path: &Path, error: rusqlite::Error) -> StoreError {
    let path = path.to_owned();
    match error.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            StoreError::InUse { path, holder: "another process".to_owned() }
        }
        Some(ErrorCode::SystemIoFailure) => StoreError::Io { path, error },
        Some(ErrorCode::DiskFull) => StoreError::Full { path, error },
        Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => {
            StoreError::NotWritable { path, error }
        }
        Some(ErrorCode::NotADatabase | ErrorCode::DatabaseCorrupt) => {
            StoreError::Corrupt { path, error }
        }
        _ => StoreError::Sqlite { path, error },
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;

    use rusqlite::ffi;

    use super::*;

    #[test]
    fn a_refusal_tells_its_cause_once() {
        for code in [
            ffi::SQLITE_IOERR,
            ffi::SQLITE_FULL,
            ffi::SQLITE_READONLY,
            ffi::SQLITE_CORRUPT,
            ffi::SQLITE_MISUSE,
        ] {
            let cause = "what SQLite says".to_owned();
            let cause = rusqlite::Error::SqliteFailure(ffi::Error::new(code), Some(cause));
            let refusal = refusal(Path::new("osteon.db"), cause);
            assert_eq!(refusal.to_string().matches("what SQLite says").count(), 1, "{refusal}");
            // The error has no source, so printing the chain adds nothing.
            assert!(refusal.source().is_none(), "{refusal:?}");
        }
    }

    #[test]
    fn a_full_disk_is_no_matter_of_permissions() {
        let told = |kind: io::ErrorKind| {
            let path = Path::new("osteon.sqlite");
            unmade(path, io::Error::from(kind), |path, error| StoreError::Make { path, error })
        };
        for full in [io::ErrorKind::StorageFull, io::ErrorKind::QuotaExceeded] {
            let told = told(full).to_string();
            assert!(told.contains("make room") && !told.contains("permission"), "{told}");
        }
        let denied = told(io::ErrorKind::PermissionDenied).to_string();
        assert!(denied.contains("give the coordinator's user write permission"), "{denied}");
    }

    #[test]
    fn network_file_systems_are_known_by_their_numbers() {
        for (magic, expected) in [
            (0x6969, Some("NFS")),
            (0x0BD0_0BD0, Some("Lustre")),
            (0xEF53, None),      // ext4
            (0x5846_5342, None), // XFS
            (0x0102_1994, None), // tmpfs
            (0x9123_683E, None), // Btrfs
            (0x794C_7630, None), // overlayfs
        ] {
            assert_eq!(network_kind(magic), expected, "{magic:x}");
        }
        assert_eq!(network_file_system(Path::new("/proc")), None);
    }
}
