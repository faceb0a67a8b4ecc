//! Fuzzing of directories of results with damaged files: they are taken or refused, without ever
//! panicking.

use std::fs;
use std::path::Path;

use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::document::Format;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_fuzz::{bounded, damaged_text, properties, texts};

use crate::results_directory::{self, ResultsDirectory};
use crate::run_error::RunError;

const KINDS: [JobKind; 2] = [JobKind::Identification, JobKind::Propagation];

fn specification(kind: JobKind) -> JobSpecification {
    let read = |text: &String| job_file::parse(text, Format::Toml, Path::new(""), kind).ok();
    texts("jobs").iter().find_map(read).unwrap()
}

/// Reads a directory with these files: its result is accepted only with the job that it belongs to.
fn check_directory(job: &str, json: &str) {
    for kind in KINDS {
        let specification = specification(kind);
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("job.toml"), job).unwrap();
        fs::write(directory.path().join("result.json"), json).unwrap();
        let stored = bounded(job.len() + json.len(), || {
            ResultsDirectory::stored(directory.path(), &specification)
        });
        // Only the job of an identification has data.
        let parse = |kind| job_file::parse(job, Format::Toml, Path::new(""), kind).ok();
        let read = KINDS.into_iter().find_map(parse);
        let same =
            read.is_some_and(|read| job_file::to_toml(&read) == job_file::to_toml(&specification));
        match stored {
            Ok(stored) => assert!(same && stored == ResultFile::from_json(json).ok()),
            Err(failure) => {
                let read = ResultFile::from_json(json);
                assert!(!same || read.is_err() || read.is_ok_and(|read| read.kind() != kind));
                assert!(
                    matches!(failure, RunError::BadInput(_)) && failure.to_string().len() < 4096
                );
            }
        }
        let _ = bounded(job.len(), || results_directory::job_of(directory.path(), kind));
    }
}

/// Returns jobs as a run writes them.
fn stored_jobs() -> Vec<String> {
    KINDS.map(|kind| job_file::to_toml(&specification(kind))).to_vec()
}

#[test]
fn every_seed_is_taken_or_refused() {
    for (job, json) in stored_jobs().iter().zip(texts("results")) {
        check_directory(job, &json);
    }
    check_directory(&"\n".repeat(400_000), "");
}

properties! {
    fn damaged_directories_are_taken_or_refused(
        job in damaged_text(stored_jobs()),
        json in damaged_text(texts("results")),
    ) {
        check_directory(&job, &json);
    }
}
