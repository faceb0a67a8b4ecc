//! Reading a file takes memory in proportion to what a job needs, whatever is in the file.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(unsafe_code, reason = "an allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use osteon_common::job::JobKind;
use osteon_common::limits::{DATA_VELOCITIES_MAX, FILE_BYTES_MAX, JOB_FILE_BYTES_MAX};
use osteon_files::job_file;

/// Bytes that are allocated, and the most that ever were since the last look.
static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn grown(by: usize) {
    let now = NOW.fetch_add(by, Ordering::Relaxed) + by;
    MOST.fetch_max(now, Ordering::Relaxed);
}

// SAFETY: every call is handed on as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both may be there for a moment.
        grown(size);
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// Reads `text` as the job file `name`; what it says, and the most bytes that it took.
fn read(directory: &Path, name: &str, text: &str) -> (Result<(), String>, usize) {
    let path = directory.join(name);
    std::fs::write(&path, text).unwrap();
    let before = NOW.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let read = job_file::read(&path, JobKind::Identification);
    let read = read.map(drop).map_err(|error| error.to_string());
    (read, MOST.load(Ordering::Relaxed) - before)
}

/// `unit` again and again, up to a length; with numbers for `#`.
fn repeated(begin: &str, unit: &str, length: usize) -> String {
    let mut text = begin.to_owned();
    if !unit.contains('#') {
        text.push_str(&unit.repeat((length - text.len()) / unit.len()));
        return text;
    }
    for number in 0.. {
        if text.len() + unit.len() + 16 > length {
            break;
        }
        text.push_str(&unit.replace('#', &format!("{number:x}")));
    }
    text
}

/// A job whose velocities are `data`.
fn job(data: &str) -> String {
    let given = "velocities = [3900.5, 4000, 3950.25]";
    include_str!("files/job.toml").replace(given, &format!("velocities = {data}"))
}

fn million() -> impl Iterator<Item = f64> {
    (0..DATA_VELOCITIES_MAX).map(|i| 4000.0 + (i as f64).sqrt() / 3.0)
}

/// One test: whatever runs beside it would be counted, too.
#[test]
fn reading_takes_no_more_memory_than_a_job_needs() {
    const MIB: usize = 1 << 20;
    let directory = tempfile::tempdir().unwrap();
    let longest = usize::try_from(JOB_FILE_BYTES_MAX).unwrap();
    // What is refused: the bytes of the file, and what was made of it by then.
    let more = "more than any job needs";
    for (name, text, expected, most) in [
        ("array.json", repeated("[", "1,", longest), more, 192 * MIB),
        ("keys.json", repeated("{", "\"#\":1,", 4 * MIB), more, 8 * MIB),
        ("array.toml", repeated("a=[", "1,", longest), more, 33 * MIB),
        ("tables.toml", repeated("", "[a#.b.c]\n", 4 * MIB), more, 5 * MIB),
        ("keys.toml", repeated("", "x#.y=1\n", 4 * MIB), more, 5 * MIB),
        ("words.toml", repeated("", "a ", longest), more, 33 * MIB),
        ("long.toml", repeated("a = 1", "\n", 2 * longest), "is longer than 33554432 bytes", MIB),
    ] {
        let (refused, taken) = read(directory.path(), name, &text);
        let message = refused.unwrap_err();
        assert!(message.contains(expected), "{name}: {message:.300}");
        assert!(taken < most, "{name}: {} MiB of memory", taken / MIB);
    }
    let list = format!(
        "[{}]",
        million().fold(String::new(), |mut text, velocity| {
            write!(text, "{velocity:?}, ").unwrap();
            text
        })
    );
    // A million velocities in a job file: the parser's words and marks, then two trees.
    let (accepted, taken) = read(directory.path(), "job.toml", &job(&list));
    assert_eq!(accepted, Ok(()));
    assert!(taken < 448 * MIB, "{} MiB of memory", taken / MIB);
    // In a CSV file: its text as a whole, as the table in it is looked for, and the numbers.
    let longest = usize::try_from(FILE_BYTES_MAX).unwrap();
    let column = "x".repeat(40);
    let rows = million().fold(format!("velocity,{column}\n"), |mut text, velocity| {
        writeln!(text, "{velocity:?},{column}").unwrap();
        text
    });
    for (rows, expected) in [
        (rows, Ok(())),
        (repeated("velocity\n", "x", longest), Err("line 2: is longer than 65536 bytes")),
        (repeated("velocity", ",", longest), Err("line 1: is longer than 65536 bytes")),
        (repeated("velocity\n", "\n", 8 * MIB), Err("has no rows")),
        (repeated("velocity\n", "1\n", longest), Err("more than 1000000 velocities")),
        (repeated("velocity\n", "a,b\n", longest), Err("more lines with errors")),
        (repeated("velocity\n", "1\n", 2 * longest), Err("is longer than 67108864 bytes")),
    ] {
        std::fs::write(directory.path().join("v.csv"), rows).unwrap();
        let (read, taken) = read(directory.path(), "csv.toml", &job("\"v.csv\""));
        match (read, expected) {
            (Ok(()), Ok(())) => {}
            (Err(message), Err(expected)) => assert!(message.contains(expected), "{message:.300}"),
            (read, expected) => panic!("{expected:?}: {read:?}"),
        }
        assert!(taken < longest + 40 * MIB, "{expected:?}: {} MiB of memory", taken / MIB);
    }
}
