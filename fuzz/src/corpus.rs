//! Seed inputs: valid ones, refused ones, and those that once failed.

use std::fs;
use std::path::Path;

/// Returns the seeds of a kind, which is a folder of `fuzz/corpus`, in the order of their names.
///
/// # Panics
/// If there are none, or one cannot be read.
#[expect(clippy::expect_used, reason = "a test without its seeds fails")]
pub fn bytes(kind: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(kind);
    let entries = fs::read_dir(folder).expect("a folder of fuzz/corpus");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable folder").path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "there are no seeds of {kind}");
    paths.iter().map(|path| fs::read(path).expect("a readable seed")).collect()
}

/// Same as [`bytes`], for texts.
///
/// # Panics
/// If there are none, or one is not a text.
#[expect(clippy::expect_used, reason = "a test without its seeds fails")]
pub fn texts(kind: &str) -> Vec<String> {
    let text = |bytes| String::from_utf8(bytes).expect("a seed in UTF-8");
    bytes(kind).into_iter().map(text).collect()
}
