//! Files of users, damaged: never a panic, a bound on the work, and what is accepted is accepted
//! again, to the bit, when it is written out.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fs;
use std::path::Path;

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::report::ResultFile;
use osteon_files::setting::Setting;
use osteon_files::{case_file, job_file};
use osteon_fuzz::{bounded, bytes, damaged, damaged_text, properties, texts};

const FORMATS: [Format; 2] = [Format::Toml, Format::Json];
const KINDS: [JobKind; 2] = [JobKind::Identification, JobKind::Propagation];
/// Longest refusal, bytes: somebody has to read it.
const REFUSAL_BYTES_MAX: usize = 16 << 10;

fn check_refusal(error: &impl ToString) {
    let length = error.to_string().len();
    assert!(length <= REFUSAL_BYTES_MAX, "a refusal of {length} bytes");
}

fn check_job(text: &str) {
    for (format, kind) in FORMATS.into_iter().flat_map(|format| KINDS.map(|kind| (format, kind))) {
        let nowhere = Path::new("/nonexistent");
        let job = match bounded(text.len(), || job_file::parse(text, format, nowhere, kind)) {
            Ok(job) => job,
            Err(error) => {
                check_refusal(&error);
                continue;
            }
        };
        assert!(job.check().is_empty(), "{}", job.check());
        let written = job_file::to_toml(&job);
        let read = job_file::parse(&written, Format::Toml, nowhere, kind).unwrap();
        assert_eq!(job_file::to_toml(&read), written);
        assert_eq!(read, job);
    }
}

fn check_case(text: &str) {
    for format in FORMATS {
        let case = match bounded(text.len(), || case_file::parse(text, format)) {
            Ok(case) => case,
            Err(error) => {
                check_refusal(&error);
                continue;
            }
        };
        let written = case_file::to_toml(&case);
        let read = case_file::parse(&written, Format::Toml).unwrap();
        assert_eq!(case_file::to_toml(&read), written);
        assert_eq!(read, case);
    }
}

/// The velocities go through a job whose file they are, also in groups of which quantities are known.
fn check_velocities(csv: &[u8]) {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("v.csv"), csv).unwrap();
    for more in
        ["", "\ngroup = \"bone\"", "\ngroup = \"bone\"\nknown = { bone_thickness = \"cortex\" }"]
    {
        let text = include_str!("files/job.toml").replace(
            "velocities = [3900.5, 4000, 3950.25]",
            &format!("velocities = \"v.csv\"{more}"),
        );
        let kind = JobKind::Identification;
        let read = || job_file::parse(&text, Format::Toml, directory.path(), kind);
        match bounded(csv.len(), read) {
            Ok(job) => {
                let written = job_file::to_toml(&job);
                let again = job_file::parse(&written, Format::Toml, Path::new(""), kind).unwrap();
                assert_eq!(again, job);
            }
            Err(error) => check_refusal(&error),
        }
    }
}

/// Of a file the lines are shown, too.
fn check_file(text: &str) {
    let directory = tempfile::tempdir().unwrap();
    for format in FORMATS {
        let path = directory.path().join(format!("job.{}", format.name().to_lowercase()));
        fs::write(&path, text).unwrap();
        if let Err(error) = bounded(text.len(), || job_file::read(&path, JobKind::Identification)) {
            check_refusal(&error);
        }
    }
}

fn check_setting(text: &str) {
    if let Err(error) = bounded(text.len(), || Setting::parse(text)) {
        check_refusal(&error);
    }
}

fn check_result(text: &str) {
    match bounded(text.len(), || ResultFile::from_json(text)) {
        Ok(result) => {
            let written = result.to_json();
            let again = ResultFile::from_json(&written).unwrap();
            assert_eq!(again.to_json(), written);
            assert_eq!(again, result);
            if let Ok(point) = result.best_point(None) {
                assert!(point.0.iter().all(|number| number.is_finite()), "{point:?}");
            }
        }
        Err(error) => check_refusal(&error),
    }
}

#[test]
fn every_seed_is_read_or_refused() {
    texts("jobs").iter().for_each(|text| check_job(text));
    texts("cases").iter().for_each(|text| check_case(text));
    bytes("velocities").iter().for_each(|csv| check_velocities(csv));
    texts("results").iter().for_each(|text| check_result(text));
}

#[test]
fn some_seeds_are_accepted() {
    let nowhere = Path::new("/nonexistent");
    let accepted = |text: &&String| {
        KINDS.iter().any(|&kind| job_file::parse(text, Format::Toml, nowhere, kind).is_ok())
    };
    assert!(texts("jobs").iter().filter(accepted).count() >= 3);
    let accepted = |text: &&String| case_file::parse(text, Format::Toml).is_ok();
    assert!(texts("cases").iter().filter(accepted).count() >= 3);
    let accepted = |text: &&String| ResultFile::from_json(text).is_ok();
    assert!(texts("results").iter().filter(accepted).count() >= 4);
}

/// A file that is large in one way, of about so many bytes.
type Large = fn(usize) -> String;

const LARGE: [(&str, Large); 22] = [
    ("unknown keys", |size| (0..size / 10).map(|i| format!("k{i} = 1\n")).collect()),
    ("unknown tables", |size| (0..size / 14).map(|i| format!("[layers.t{i}]\n")).collect()),
    ("one table twice", |size| "[layers]\n".repeat(size / 9)),
    ("tables in an array", |size| "[[data]]\n".repeat(size / 9)),
    ("a long key", |size| format!("{} = 1", "k".repeat(size))),
    ("a long quoted key", |size| format!("\"{}\" = 1", "é".repeat(size / 2))),
    ("a long name", |size| format!("[solver]\nmethod = \"{}\"", "m".repeat(size))),
    ("a long integer", |size| format!("[monte_carlo]\nseed = {}", "9".repeat(size))),
    ("a long number", |size| format!("[picking]\nthreshold = 0.{}", "3".repeat(size))),
    ("many velocities", |size| format!("[data]\nvelocities = [{}]", "1.5,".repeat(size / 4))),
    ("many bad velocities", |size| format!("[data]\nvelocities = [{}]", "{},".repeat(size / 3))),
    ("many lines", |size| format!("[data]\nvelocities = [{}]", "-1,\n".repeat(size / 4))),
    ("long bounds", |size| {
        format!("[parameters.density]\nstart = 1\nbounds = [{}]", "1,".repeat(size / 2))
    }),
    ("many rows", |size| format!("[bone]\ndensity = 1\nmandel = [{}]", "[1],".repeat(size / 4))),
    ("dots", |size| format!("a{} = 1", ".a".repeat(size / 2))),
    ("brackets", |size| format!("a = {}", "[".repeat(size))),
    ("braces", |size| format!("a = {}", "{a=".repeat(size / 3))),
    ("objects", |size| "{\"a\":".repeat(size / 5)),
    ("lists", |size| "[".repeat(size)),
    ("keys of an object", |size| {
        let keys: Vec<_> = (0..size / 12).map(|i| format!("\"k{i}\":1")).collect();
        format!("{{{}}}", keys.join(","))
    }),
    ("comments", |size| "# \n".repeat(size / 3)),
    ("a long line", |size| format!("#{}", " ".repeat(size))),
];

#[test]
fn large_files_take_no_more_than_their_share() {
    for (what, large) in LARGE {
        let text = large(400_000);
        assert!(text.len() > 300_000, "{what}");
        eprintln!("{what}");
        check_job(&text);
        check_case(&text);
        check_result(&text);
        check_file(&text);
    }
}

#[test]
fn large_velocities_take_no_more_than_their_share() {
    let large: [(&str, String); 7] = [
        ("columns", format!("velocity{}\n1\n2\n", ",x".repeat(200_000))),
        ("columns of the name", "velocity,".repeat(50_000)),
        ("rows", format!("velocity\n{}", "1.5\n2.5\n".repeat(50_000))),
        ("bad rows", format!("velocity\n{}", "x\n".repeat(200_000))),
        ("quotes", format!("velocity\n{}\n", "\"".repeat(400_000))),
        ("a long field", format!("velocity\n{}\n", "9".repeat(400_000))),
        ("empty lines", format!("velocity\n{}", "\n".repeat(400_000))),
    ];
    for (what, csv) in large {
        eprintln!("{what}");
        check_velocities(csv.as_bytes());
    }
}

properties! {
    fn damaged_jobs_are_read_or_refused(text in damaged_text(texts("jobs"))) {
        check_job(&text);
    }

    fn damaged_cases_are_read_or_refused(text in damaged_text(texts("cases"))) {
        check_case(&text);
    }

    fn damaged_files_are_read_or_refused(text in damaged_text(texts("jobs"))) {
        check_file(&text);
    }

    fn damaged_settings_are_read_or_refused(text in damaged_text(texts("jobs"))) {
        check_setting(&text);
        text.lines().take(20).for_each(check_setting);
    }

    fn damaged_velocities_are_read_or_refused(csv in damaged(bytes("velocities"))) {
        check_velocities(&csv);
    }

    fn damaged_results_are_read_or_refused(text in damaged_text(texts("results"))) {
        check_result(&text);
    }
}
