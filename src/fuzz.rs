//! Fuzzing of damaged results: what is read is shown, interpreted or refused, without ever panicking.

use std::path::Path;

use osteon_client::result_status;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::document::Format as FileFormat;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_fuzz::{bounded, damaged_text, properties, texts};

use crate::exit_status::ExitStatus;
use crate::output::{self, Detail, ShownResult};
use crate::resolved::OutputFormat;
use crate::sample_result;

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
    let shown = ShownResult {
        specification,
        usual_shifts: &[],
        result: &result,
        directory: None,
        detail: Detail::Usual,
    };
    for format in [OutputFormat::Text, OutputFormat::Json] {
        let mut bytes = Vec::new();
        let mut output = output::to_writer(format, Box::new(&mut bytes));
        bounded(json.len(), || output.result(&shown)).unwrap();
        drop(output);
        assert!(String::from_utf8(bytes).unwrap().len() < 64 * json.len() + 4096);
    }
}

#[test]
fn every_seed_is_shown() {
    texts("results").iter().for_each(|json| check_result(json));
}

#[test]
fn large_results_take_no_more_than_their_share() {
    let complete = sample_result::identification("{}").to_json();
    let with_first = |entry: String| complete.replacen('{', &format!("{{{entry},"), 1);
    let counts: Vec<_> = (0..30_000).map(|i| format!("\"k{i}\": 1")).collect();
    // The first is read, since unknown keys are ignored. The next two are refused: for the names of the
    // failures, and for the depth.
    check_result(&with_first(format!("\"unknown\": {{{}}}", counts.join(","))));
    check_result(&with_first(format!("\"failures\": {{{}}}", counts.join(","))));
    check_result(&with_first(format!("\"unknown\": {}", "[".repeat(400_000))));
    let reason = format!("{{\"reason\": \"{}\"}}", "x".repeat(400_000));
    check_result(&sample_result::identification(&reason).to_json());
}

properties! {
    fn damaged_results_are_shown_or_refused(json in damaged_text(texts("results"))) {
        check_result(&json);
    }
}
