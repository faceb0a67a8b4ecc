//! Files that a user names: opened without blocking, refused unless they are regular files, and
//! read within a size limit.
//!
//! A named pipe would block the program until somebody writes to it, and a device may never end.
//! Where a pipe is useful, as for a secret that should not be on a disk, its reader must limit the
//! time.

use std::fs::{File, FileType, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};
use std::path::Path;

use rustix::fs::OFlags;
use thiserror::Error;

/// The path does not denote a regular file; used as the payload of an [`io::Error`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("it is {kind}, and must be a regular file")]
pub struct NotRegular {
    /// Kind of the file.
    pub kind: &'static str,
}

/// Opens the regular file at `path`, or the one that a link there leads to, for reading.
///
/// # Errors
/// The operating system's error, or [`NotRegular`].
pub fn open(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().read(true), path)
}

/// Creates an empty file at `path` for writing, or empties the regular file that exists there.
///
/// # Errors
/// Same as [`open`].
pub fn create(path: &Path) -> io::Result<File> {
    let file = open_with(OpenOptions::new().write(true).create(true).truncate(false), path)?;
    file.set_len(0)?;
    Ok(file)
}

/// Opens the regular file at `path` with `options`, which must not truncate, because the kind of
/// the file is known only after it is open.
///
/// # Errors
/// Same as [`open`].
pub fn open_with(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    let (kind, opened) = open_any(options, path)?;
    if kind.is_file() { opened } else { Err(not_regular(kind)) }
}

/// Opens the regular file or the pipe at `path` for reading. Reading from it never blocks; a pipe
/// that has not been opened for writing appears to be at its end.
///
/// # Errors
/// Same as [`open`].
pub fn open_or_pipe(path: &Path) -> io::Result<File> {
    let (kind, opened) = open_any(OpenOptions::new().read(true), path)?;
    if kind.is_file() || kind.is_fifo() { opened } else { Err(not_regular(kind)) }
}

/// Opens the file of any kind at `path`, if it can be opened, and returns its kind.
fn open_any(options: &mut OpenOptions, path: &Path) -> io::Result<(FileType, io::Result<File>)> {
    // Neither flag affects a regular file. A terminal must not become the controlling terminal of
    // this process.
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let opened = options.custom_flags(flags.bits().cast_signed()).open(path);
    match opened {
        Ok(file) => Ok((file.metadata()?.file_type(), Ok(file))),
        // Sockets cannot be opened, nor pipes for writing without a reader.
        Err(error) => match std::fs::metadata(path) {
            Ok(metadata) => Ok((metadata.file_type(), Err(error))),
            Err(_) => Err(error),
        },
    }
}

/// Returns the bytes of the file at `path`; `None` if there are more than `bytes_max`, in which
/// case none are read.
///
/// # Errors
/// Same as [`open`].
pub fn read(path: &Path, bytes_max: u64) -> io::Result<Option<Vec<u8>>> {
    read_opened(&open(path)?, bytes_max)
}

/// Same as [`read`], for an open file.
///
/// # Errors
/// The operating system's error.
pub fn read_opened(file: &File, bytes_max: u64) -> io::Result<Option<Vec<u8>>> {
    let length = file.metadata()?.len();
    if length > bytes_max {
        return Ok(None);
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0).saturating_add(1));
    // The file may grow while it is read.
    file.take(bytes_max + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= bytes_max).then_some(bytes))
}

fn not_regular(kind: FileType) -> io::Error {
    let kind = match kind {
        kind if kind.is_dir() => "a directory",
        kind if kind.is_fifo() => "a pipe",
        kind if kind.is_socket() => "a socket",
        kind if kind.is_char_device() || kind.is_block_device() => "a device",
        _ => "something else",
    };
    io::Error::new(io::ErrorKind::InvalidInput, NotRegular { kind })
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;

    use super::*;

    #[test]
    fn only_regular_files_are_opened_and_none_is_waited_for() {
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        let made = std::process::Command::new("mkfifo").arg(path("pipe")).status();
        assert!(made.unwrap().success());
        let _listener = UnixListener::bind(path("socket")).unwrap();
        symlink("/dev/zero", path("link to a device")).unwrap();
        std::fs::write(path("file"), "text").unwrap();
        symlink(path("file"), path("link")).unwrap();
        for (name, kind) in [
            (path("pipe"), "a pipe"),
            (path("socket"), "a socket"),
            (path("."), "a directory"),
            (path("link to a device"), "a device"),
            ("/dev/null".into(), "a device"),
        ] {
            for refused in [open(&name), create(&name)] {
                let refused = refused.unwrap_err();
                let expected = format!("it is {kind}, and must be a regular file");
                assert_eq!(refused.to_string(), expected, "{}", name.display());
            }
        }
        for name in ["file", "link"] {
            assert_eq!(read(&path(name), 4).unwrap().as_deref(), Some(&b"text"[..]));
            assert_eq!(read(&path(name), 3).unwrap(), None);
        }
        let absent = open(&path("absent")).unwrap_err();
        assert_eq!(absent.kind(), io::ErrorKind::NotFound);
        drop(create(&path("link")).unwrap());
        assert_eq!(std::fs::read(path("file")).unwrap(), b"");
    }

    /// A pipe with a reader can be opened for writing, but must be refused.
    #[test]
    fn a_pipe_with_a_reader_is_not_written() {
        let directory = tempfile::tempdir().unwrap();
        let pipe = directory.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let mut both = OpenOptions::new();
        let _reader = both.read(true).write(true).open(&pipe).unwrap();
        assert!(create(&pipe).unwrap_err().to_string().contains("a pipe"));
    }

    #[test]
    fn of_a_file_that_is_too_long_nothing_is_read() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("long");
        // A sparse file of a terabyte, which takes no space on the disk.
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(read(&path, 1 << 39).unwrap(), None);
    }
}
