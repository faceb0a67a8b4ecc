//! Reading from a pipe that a user names, such as `--token-file <(pass show osteon)`.

use std::fs::File;
use std::io::{self, Read as _};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use thiserror::Error;
use zeroize::Zeroizing;

/// Length of a piece that is read at once, bytes.
const PIECE_BYTES: usize = 4096;

/// A pipe was not closed by its writers in time; used as the payload of an [`io::Error`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("it is a pipe, and its writer did not close it within {seconds} s")]
pub(crate) struct Unfinished {
    /// Time waited, s.
    seconds: u64,
}

/// Reads a pipe until its writers have closed it; returns `None` if there are more than `bytes_max`
/// bytes. Blocks for at most `limit`.
///
/// # Errors
/// The operating system's error, or [`Unfinished`].
pub(crate) fn read(
    mut pipe: &File,
    bytes_max: u64,
    limit: Duration,
) -> io::Result<Option<Zeroizing<Vec<u8>>>> {
    let begun = Instant::now();
    let (mut bytes, mut piece) = (Zeroizing::new(Vec::new()), Zeroizing::new([0; PIECE_BYTES]));
    loop {
        let left = limit.saturating_sub(begun.elapsed());
        // Without polling, a pipe that has not been opened for writing yet would appear to be at
        // its end.
        let ready = match Timespec::try_from(left) {
            Ok(left) => poll(&mut [PollFd::new(&pipe, PollFlags::IN)], Some(&left)),
            Err(_) => return Err(io::ErrorKind::InvalidInput.into()),
        };
        match ready {
            Ok(0) => {
                let unfinished = Unfinished { seconds: limit.as_secs() };
                return Err(io::Error::new(io::ErrorKind::TimedOut, unfinished));
            }
            Ok(_) => {}
            Err(rustix::io::Errno::INTR) => continue,
            Err(error) => return Err(error.into()),
        }
        match pipe.read(&mut *piece) {
            Ok(0) => return Ok(Some(bytes)),
            Ok(count) => append(&mut bytes, &piece[..count]),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if bytes.len() as u64 > bytes_max {
            return Ok(None);
        }
    }
}

/// Appends bytes; what becomes too short for them is overwritten before it is freed.
fn append(bytes: &mut Zeroizing<Vec<u8>>, more: &[u8]) {
    let length = bytes.len() + more.len();
    if length > bytes.capacity() {
        let mut longer = Zeroizing::new(Vec::with_capacity(2 * length));
        longer.extend_from_slice(bytes);
        *bytes = longer;
    }
    bytes.extend_from_slice(more);
}

#[cfg(test)]
mod tests {
    use std::fs::OpenOptions;
    use std::io::Write as _;

    use osteon_files::user_file::open_or_pipe;

    use super::*;

    #[test]
    fn a_pipe_is_read_to_its_end_within_bounds_of_length_and_time() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let limit = Duration::from_secs(60);
        let written = |text: &'static [u8], bytes_max| {
            let pipe = open_or_pipe(&path).unwrap();
            let path = path.clone();
            // The reader opens the pipe before the writer, and the bytes arrive in parts.
            let writer = std::thread::spawn(move || {
                let mut pipe = OpenOptions::new().write(true).open(path).unwrap();
                for part in text.chunks(3) {
                    pipe.write_all(part).unwrap();
                    std::thread::sleep(Duration::from_millis(5));
                }
            });
            let bytes = read(&pipe, bytes_max, limit).unwrap();
            writer.join().unwrap();
            bytes
        };
        assert_eq!(written(b"a secret", 8).as_deref().map(Vec::as_slice), Some(&b"a secret"[..]));
        assert_eq!(written(b"a secret", 7), None);
        assert_eq!(written(b"", 7).as_deref().map(Vec::as_slice), Some(&b""[..]));
        // The wait is limited for a writer that never comes, and for one that never closes the
        // pipe.
        let pipe = open_or_pipe(&path).unwrap();
        let limit = Duration::from_millis(20);
        let check = || {
            let error = read(&pipe, 8, limit).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::TimedOut);
            assert!(error.to_string().contains("its writer did not close it"), "{error}");
        };
        check();
        let mut writer = OpenOptions::new().write(true).open(&path).unwrap();
        writer.write_all(b"a").unwrap();
        check();
    }
}
