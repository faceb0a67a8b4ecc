//! What `init` makes of a file, and what the job then reads.

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::{init, job_file};

/// What `init` says of a file, with the job that it writes, and the velocities that this job has.
pub(crate) fn taken(bytes: &[u8]) -> Result<(String, Vec<f64>), String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("v.csv");
    std::fs::write(&path, bytes).unwrap();
    let plain = |text: String| text.replace(&*path.to_string_lossy(), "FILE");
    let first = init::of_csv(&path, "v.csv").map_err(|error| plain(error.to_string()))?;
    let job = job_file::parse(&first.text, Format::Toml, directory.path(), JobKind::Identification);
    let data = job.map_err(|error| plain(error.to_string()))?.data.unwrap();
    let sets = (0..data.sets()).flat_map(|set| data.set(set).unwrap().velocities.to_vec());
    Ok((first.understood.join("\n") + "\n" + &first.text, sets.collect()))
}

pub(crate) fn takes(text: &str, expected: &[f64], said: &str) {
    takes_bytes(text.as_bytes(), expected, said);
}

pub(crate) fn takes_bytes(bytes: &[u8], expected: &[f64], said: &str) {
    let shown = String::from_utf8_lossy(bytes);
    let found = taken(bytes);
    assert!(found.is_ok(), "{shown}: {found:?}");
    let (all, velocities) = found.unwrap();
    assert_eq!(velocities, expected, "{shown}: {all}");
    assert!(all.contains(said), "{said} is not in: {all}");
}

pub(crate) fn refuses(text: &str, expected: &str) {
    refuses_bytes(text.as_bytes(), expected);
}

pub(crate) fn refuses_bytes(bytes: &[u8], expected: &str) {
    let message = taken(bytes).map(|(said, _)| said).unwrap_err();
    assert!(message.contains(expected), "{}: {message}", String::from_utf8_lossy(bytes));
    assert!(message.lines().count() <= 3, "{message}");
    assert!(message.len() < 700, "{message}");
}
