//! A secret that is no longer used is nowhere in the memory of the process.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::{self, File, Permissions};
use std::os::unix::fs::{FileExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use osteon_transport::credential_file;
use osteon_transport::token::{PREFIX, Token};

/// Length of the end of a secret that is looked for: the allocator overwrites the beginning of freed memory by
/// itself.
const END: usize = 32;

/// Returns bytes in a form that is not theirs.
fn disguised(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|byte| byte ^ 0x55).collect()
}

/// Returns how often bytes are in the heap and in other writable memory of this process, given in disguise.
fn occurrences(disguised_bytes: &[u8]) -> usize {
    let memory = File::open("/proc/self/mem").unwrap();
    let mut found = 0;
    // Overwritten after each part, so that it holds none itself.
    let mut part = vec![0; 1 << 20];
    for line in fs::read_to_string("/proc/self/maps").unwrap().lines() {
        let mut words = line.split_whitespace();
        let (range, access) = (words.next().unwrap(), words.next().unwrap());
        let (begin, end) = range.split_once('-').unwrap();
        let [mut begin, end] = [begin, end].map(|it| u64::from_str_radix(it, 16).unwrap());
        if !access.starts_with("rw") {
            continue;
        }
        while begin < end {
            let length = usize::try_from((end - begin).min(1 << 20)).unwrap();
            let Ok(read) = memory.read_at(&mut part[..length], begin) else { break };
            part[..read].iter_mut().for_each(|byte| *byte ^= 0x55);
            let windows = part[..read].windows(disguised_bytes.len());
            found += windows.filter(|window| *window == disguised_bytes).count();
            part[..read].fill(0);
            begin += read.max(1) as u64;
        }
    }
    found
}

fn secret_file(directory: &Path, text: &str) -> PathBuf {
    let path = directory.join("secret");
    fs::write(&path, text).unwrap();
    fs::set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
    path
}

#[test]
fn tokens_are_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let made = Token::generate().unwrap();
    let path = secret_file(directory.path(), made.reveal());
    let looked_for = disguised(&made.reveal().as_bytes()[made.reveal().len() - END..]);
    assert!(made.reveal().starts_with(PREFIX));
    // It is found while it is there.
    assert!(occurrences(&looked_for) >= 1);
    drop(made);
    assert_eq!(occurrences(&looked_for), 0, "after it was made");
    let read = credential_file::token(&path).unwrap();
    assert!(occurrences(&looked_for) >= 1);
    drop(read);
    assert_eq!(occurrences(&looked_for), 0, "after it was read");
}
