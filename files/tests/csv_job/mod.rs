//! Jobs whose velocities are in a CSV file, and what a user reads of them.

use osteon_common::job::{Data, JobKind};
use osteon_common::warnings::Warning;
use osteon_files::document::Format;
use osteon_files::job_file;

/// Reads the job of `files/job.toml` with a CSV file of these bytes and with more keys in `[data]`;
/// returns its data, or the refusal.
pub(crate) fn read_as(bytes: &[u8], more: &str) -> Result<Option<Data>, String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("data")).unwrap();
    std::fs::write(directory.path().join("data/v.csv"), bytes).unwrap();
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let text = include_str!("../files/job.toml")
        .replace(given, &format!("velocities = \"data/v.csv\"\n{more}"));
    // Decays need χ².
    let text = match more.contains("decay") {
        true => text.replace("kind = \"moments\"", "kind = \"chi_square\""),
        false => text,
    };
    match job_file::parse(&text, Format::Toml, directory.path(), JobKind::Identification) {
        Ok(job) => Ok(job.data),
        Err(error) => Err(error.to_string().replace(&*directory.path().to_string_lossy(), "DIR")),
    }
}

/// The warnings about a job with these velocities.
pub(crate) fn warnings(text: &str, more: &str) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("v.csv"), text).unwrap();
    let given = "velocities = [3900.5, 4000, 3950.25]";
    let job = include_str!("../files/job.toml")
        .replace(given, &format!("velocities = \"v.csv\"\n{more}"));
    let path = directory.path().join("job.toml");
    std::fs::write(&path, job).unwrap();
    let warnings = job_file::read_with_warnings(&path, JobKind::Identification).unwrap().warnings;
    let shown = |warning: &Warning| {
        warning.to_string().replace(&*directory.path().to_string_lossy(), "DIR")
    };
    warnings.iter().map(shown).collect()
}
