//! Fuzzing of results directories with damaged files: what is read is shown, interpreted or refused,
//! without ever panicking.

use std::fs;
use std::path::Path;

use osteon_client::result_status;
use osteon_client::results_directory::{self, ResultsDirectory};
use osteon_client::run_error::RunError;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::document::Format as FileFormat;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_fuzz::{bounded, damaged_text, properties, texts};

use crate::exit_status::ExitStatus;
use crate::output::{self, Detail, ShownResult};
use crate::resolved::OutputFormat;
use crate::sample_result;

const KINDS: [JobKind; 2] = [JobKind::Identification, JobKind::Propagation];

fn specification(kind: JobKind) -> JobSpecification {
    let read = |text: &String| job_file::parse(text, FileFormat::Toml, Path::new(""), kind).ok();
    texts("jobs").iter().find_map(read).unwrap()
}

/// Uses `result.json` as the commands do.
fn check_result(json: &str) {
    let Ok(result) = bounded(json.len(), || ResultFile::from_json(json)) else { return };
    let specification = specification(result.kind());
    let specification = &specification;
    let ended = bounded(json.len(), || ExitStatus::of_result(specification, &result));
    let cancelled = result_status::is_cancelled(&result);
    assert!(!cancelled || ended == ExitStatus::RunFailed);
    let shown =
        ShownResult { specification, result: &result, directory: None, detail: Detail::Usual };
    for format in [OutputFormat::Text, OutputFormat::Json] {
        let mut bytes = Vec::new();
        let mut output = output::to_writer(format, Box::new(&mut bytes));
        bounded(json.len(), || output.result(&shown)).unwrap();
        drop(output);
        assert!(String::from_utf8(bytes).unwrap().len() < 64 * json.len() + 4096);
    }
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
        let parse = |kind| job_file::parse(job, FileFormat::Toml, Path::new(""), kind).ok();
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
fn every_seed_is_shown() {
    texts("results").iter().for_each(|json| check_result(json));
    for (job, json) in stored_jobs().iter().zip(texts("results")) {
        check_directory(job, &json);
    }
}

#[test]
fn large_results_take_no_more_than_their_share() {
    let counts: Vec<_> = (0..30_000).map(|i| format!("\"k{i}\": 1")).collect();
    check_result(&format!("{{\"failures\": {{{}}}}}", counts.join(",")));
    let reason = format!("{{\"reason\": \"{}\"}}", "x".repeat(400_000));
    check_result(&reason);
    check_result(&sample_result::identification(&reason).to_json());
    check_result(&"[".repeat(400_000));
    check_directory(&"\n".repeat(400_000), "");
}

properties! {
    fn damaged_results_are_shown_or_refused(json in damaged_text(texts("results"))) {
        check_result(&json);
    }

    fn damaged_directories_are_taken_or_refused(
        job in damaged_text(stored_jobs()),
        json in damaged_text(texts("results")),
    ) {
        check_directory(&job, &json);
    }
}
