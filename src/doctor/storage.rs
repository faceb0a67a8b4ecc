//! Checks of directories: room, speed, and whether files can be written at all.

use std::io::{self, Write as _};
use std::path::Path;
use std::time::{Duration, Instant};

use osteon_common::visible;
use rustix::fs::statvfs;
use tempfile::NamedTempFile;

use super::Diagnosis;

/// Free bytes below which a store is in danger, and below which it will soon be.
const FREE_PROBLEM: u64 = 100 << 20;
const FREE_WARNING: u64 = 1 << 30;
/// Free bytes that a run on this machine needs for its socket and files in the making.
const FREE_TEMPORARY: u64 = 10 << 20;
/// Number of writes that are timed, and bytes of each.
const WRITES: usize = 9;
const WRITTEN_BYTES: usize = 4096;
/// A search waits for the disk once in each evaluation. A disk takes up to some 20 ms.
const SLOW: Duration = Duration::from_millis(50);

/// Examines the directory of a store, or, if it is yet to be created, the one in which it will be.
pub(super) fn examine(directory: &Path) -> Diagnosis {
    const CHECK: &str = "store";
    let Some(existing) = directory.ancestors().find(|path| is_there(path)) else {
        return Diagnosis::problem(CHECK, "there is no such directory", "create it");
    };
    let existing = if existing.as_os_str().is_empty() { Path::new(".") } else { existing };
    let shown = visible::path(existing);
    if !existing.is_dir() {
        return Diagnosis::problem(CHECK, format!("{shown} is no directory"), "choose another");
    }
    let (free, sync) = match (free(existing), sync_time(existing)) {
        (Ok(free), Ok(sync)) => (free, sync),
        (Err(error), _) | (_, Err(error)) => {
            let advice = "give the user of the coordinator the right to write there, or choose another \
                          directory";
            return Diagnosis::problem(CHECK, format!("{shown}: {error}"), advice);
        }
    };
    let milliseconds = 1e3 * sync.as_secs_f64();
    let found = format!("{shown}: {} free, {milliseconds:.1} ms for a durable write", bytes(free));
    if free < FREE_PROBLEM {
        return Diagnosis::problem(
            CHECK,
            found,
            "free space: a store on a full disk accepts no job",
        );
    }
    if let Some(kind) = unreliable(existing) {
        let advice = "choose a directory on a disk of this machine for the store of a coordinator";
        return Diagnosis::warning(CHECK, format!("{found}; it is {kind}"), advice);
    }
    if free < FREE_WARNING {
        return Diagnosis::warning(
            CHECK,
            found,
            "free space, or delete ended jobs (`osteon job prune`)",
        );
    }
    if sync > SLOW {
        let advice = "choose a faster disk: each evaluation of a search waits for one such write";
        return Diagnosis::warning(CHECK, found, advice);
    }
    Diagnosis::good(CHECK, found)
}

/// Examines the directory of temporary files, in which a run on this machine has its socket.
pub(super) fn temporary(directory: &Path) -> Diagnosis {
    const CHECK: &str = "temporary";
    const ADVICE: &str = "set TMPDIR to a directory in which you can write";
    let shown = visible::path(directory);
    let written = NamedTempFile::new_in(directory).and_then(|mut file| file.write_all(&[0]));
    match written.and_then(|()| free(directory)) {
        Ok(free) if free < FREE_TEMPORARY => {
            Diagnosis::warning(CHECK, format!("{shown}: {} free", bytes(free)), "free space there")
        }
        Ok(free) => Diagnosis::good(CHECK, format!("{shown}: {} free", bytes(free))),
        Err(error) => Diagnosis::problem(CHECK, format!("{shown}: {error}"), ADVICE),
    }
}

fn is_there(path: &Path) -> bool {
    // The parent of a relative path is empty, and means the current directory.
    path.as_os_str().is_empty() || path.symlink_metadata().is_ok()
}

/// Returns the bytes that this user may still write.
fn free(directory: &Path) -> io::Result<u64> {
    let found = statvfs(directory)?;
    Ok(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Returns the median time of a write that is on the disk when it returns.
fn sync_time(directory: &Path) -> io::Result<Duration> {
    let mut file = NamedTempFile::new_in(directory)?;
    let mut times = Vec::with_capacity(WRITES);
    for _ in 0..WRITES {
        let begun = Instant::now();
        file.write_all(&[0; WRITTEN_BYTES])?;
        file.as_file().sync_all()?;
        times.push(begun.elapsed());
    }
    times.sort();
    Ok(times[WRITES / 2])
}

/// Says what a file system is on which a store is not safe.
#[cfg(target_os = "linux")]
fn unreliable(directory: &Path) -> Option<&'static str> {
    // From linux/magic.h.
    const NFS: u32 = 0x6969;
    const SMB: [u32; 3] = [0x517b, 0xff53_4d42, 0xfe53_4d42];
    const TMPFS: u32 = 0x0102_1994;
    let found = rustix::fs::statfs(directory).ok()?;
    // Its type has 32 bits, whatever the width of the field.
    let kind = found.f_type as u32;
    match kind {
        NFS => Some("on NFS, where the locks of SQLite may fail"),
        kind if SMB.contains(&kind) => Some("on SMB, where the locks of SQLite may fail"),
        TMPFS => Some("in memory, and empty after a restart of the machine"),
        _ => None,
    }
}

#[cfg(not(target_os = "linux"))]
fn unreliable(_: &Path) -> Option<&'static str> {
    None
}

fn bytes(count: u64) -> String {
    let gigabytes = count as f64 / 1e9;
    if gigabytes >= 9.95 { format!("{gigabytes:.0} GB") } else { format!("{gigabytes:.1} GB") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Fitness;

    #[test]
    fn a_directory_is_written_and_left_empty() {
        let directory = tempfile::tempdir().unwrap();
        let found = examine(directory.path());
        assert_ne!(found.verdict, Fitness::Problem, "{found:?}");
        assert!(found.found.contains("ms for a durable write"), "{found:?}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
        // It is not created.
        let absent = directory.path().join("a/b");
        assert!(examine(&absent).found.starts_with(&visible::path(directory.path())));
        assert!(!directory.path().join("a").exists());
        assert_ne!(temporary(directory.path()).verdict, Fitness::Problem);
    }

    #[test]
    fn where_nobody_can_write_is_a_problem() {
        // Not even root can create files there.
        assert_eq!(examine(Path::new("/proc")).verdict, Fitness::Problem);
        assert_eq!(temporary(Path::new("/proc")).verdict, Fitness::Problem);
        let file = tempfile::NamedTempFile::new().unwrap();
        let found = examine(file.path());
        assert!(found.found.ends_with("is no directory"), "{found:?}");
    }
}
