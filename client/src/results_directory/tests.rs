use osteon_common::job::PosteriorSettings;
use osteon_common::results::{JobFailure, SetSamples};
use serde_json::json;

use super::*;
use crate::listener::Silent;
use crate::sample_result::{drawn_posterior, identification};

pub(crate) fn specification() -> JobSpecification {
    let values = [
        ("density", 1598.8),
        ("longitudinal_young_modulus", 17.717e9),
        ("longitudinal_poisson_ratio", 0.3816),
        ("longitudinal_shear_modulus", 4.795e9),
        ("transverse_young_modulus", 9.8254e9),
        ("transverse_poisson_ratio", 0.4495),
    ];
    let mut text = "[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n".to_owned();
    for (name, value) in values {
        text.push_str(&format!("[parameters.{name}]\nfixed = {value:?}\n"));
    }
    text.push_str("[parameters.dispersion]\nstart = 0.1\nbounds = [0.02, 0.3]\n");
    job_file::parse(&text, Format::Toml, Path::new(""), JobKind::Identification).unwrap()
}

/// The output of a job that ended so, without a best point.
pub(crate) fn sample_output(status: Status) -> Fetched {
    let failure = (status == Status::Failed).then_some(JobFailure::NoFeasiblePoint);
    let partial = json!({
        "status": status, "failure": failure, "reason": null, "dispersion": null, "posterior": null,
    });
    Fetched {
        specification: specification(),
        status,
        reason: None,
        result: identification(&partial.to_string()),
        history: Vec::new(),
        samples: vec![SetSamples::default()],
    }
}

#[test]
fn only_a_run_that_ended_by_itself_is_finished_and_needs_no_store() {
    for status in Status::ALL {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("out");
        let directory = ResultsDirectory::open(&path).unwrap();
        let request = directory.request().unwrap();
        fs::create_dir(directory.store()).unwrap();
        let written = sample_output(status).result;
        directory.write_results(&sample_output(status), &Silent).unwrap();

        let ended = status != Status::Cancelled;
        let finished = ResultsDirectory::finished(&path, &specification()).unwrap();
        assert_eq!(finished.as_ref(), ended.then_some(&written), "{status:?}");
        let stored = ResultsDirectory::stored(&path, &specification()).unwrap();
        assert_eq!(stored, Some(written), "{status:?}");
        assert_eq!(directory.store().exists(), !ended, "{status:?}");
        assert_eq!(directory.request().unwrap() == request, !ended, "{status:?}");
        directory.forget_request();
        assert_ne!(directory.request().unwrap(), request, "{status:?}");
    }
}

#[test]
fn a_directory_belongs_to_one_specification() {
    let scratch = tempfile::tempdir().unwrap();
    let directory = ResultsDirectory::open(scratch.path()).unwrap();
    let specification = specification();
    let written = sample_output(Status::Converged).result;
    directory.write_results(&sample_output(Status::Converged), &Silent).unwrap();
    let stored = |specification| ResultsDirectory::stored(scratch.path(), specification);
    assert_eq!(stored(&specification).unwrap(), Some(written));
    let mut other = specification.clone();
    other.monte_carlo.control_variate = true;
    let refusal = stored(&other).unwrap_err().to_string();
    assert!(refusal.contains("`control_variate = true` here"), "{refusal}");
}

#[test]
fn a_damaged_result_is_refused_with_the_key_and_what_to_do() {
    let scratch = tempfile::tempdir().unwrap();
    let directory = ResultsDirectory::open(scratch.path()).unwrap();
    directory.write_results(&sample_output(Status::Converged), &Silent).unwrap();
    let path = scratch.path().join(RESULT);
    let text = fs::read_to_string(&path).unwrap();
    let refused = |text: String| {
        fs::write(&path, text).unwrap();
        let failure = ResultsDirectory::stored(scratch.path(), &specification()).unwrap_err();
        assert!(matches!(failure, RunError::BadInput(_)));
        failure.to_string()
    };
    let refusal = refused(text.replace("\"seed\": ", "\"seed\": -"));
    for part in ["result.json", "`seed`: invalid value", "line", "remove the file", "directory"] {
        assert!(refusal.contains(part), "{refusal}");
    }
    let refusal = refused(text.replace("\"schema\": 1", "\"schema\": 2"));
    assert!(refusal.contains("`schema` is 2, and this program reads 1"), "{refusal}");
    let kind = text.replace("\"kind\": \"identification\"", "\"kind\": \"propagation\"");
    let refusal = refused(kind);
    let expected = "is the result of a propagation, not of a identification";
    assert!(refusal.contains(expected), "{refusal}");
}

#[test]
fn the_draws_have_a_file_if_the_job_asks_for_them() {
    let written = |change: &dyn Fn(&mut Fetched)| {
        let scratch = tempfile::tempdir().unwrap();
        let directory = ResultsDirectory::open(scratch.path()).unwrap();
        let mut fetched = sample_output(Status::Converged);
        change(&mut fetched);
        directory.write_results(&fetched, &Silent).unwrap();
        let provenance = fs::read_to_string(scratch.path().join("provenance.json")).unwrap();
        let text = fs::read_to_string(scratch.path().join(POSTERIOR)).ok();
        assert_eq!(provenance.contains(POSTERIOR), text.is_some(), "{provenance}");
        text.map(|text| text.lines().count())
    };
    let asks = |fetched: &mut Fetched| {
        fetched.specification.posterior = Some(PosteriorSettings::default());
    };
    assert_eq!(written(&|_| {}), None);
    assert_eq!(written(&asks), Some(1));
    let found = |fetched: &mut Fetched| {
        asks(fetched);
        fetched.samples[0].draws = drawn_posterior().draws;
    };
    assert_eq!(written(&found), Some(3));
}

#[test]
fn a_directory_is_held_until_everything_is_written() {
    let scratch = tempfile::tempdir().unwrap();
    let directory = ResultsDirectory::open(scratch.path()).unwrap();
    let refused = |what: &str| {
        let failure = ResultsDirectory::open(scratch.path()).unwrap_err();
        assert!(failure.to_string().contains("another osteon is running"), "{what}: {failure}");
    };
    refused("opened");
    directory.write_results(&sample_output(Status::Converged), &Silent).unwrap();
    refused("written");
    drop(directory);
    assert!(!scratch.path().join(LOCK).exists());
    drop(ResultsDirectory::open(scratch.path()).unwrap());
}

#[test]
fn a_lock_whose_file_was_removed_locks_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let path = scratch.path().join(LOCK);
    let removed = File::create(&path).unwrap();
    assert!(is_at(&removed, &path));
    fs::remove_file(&path).unwrap();
    assert!(!is_at(&removed, &path));
    let present = File::create(&path).unwrap();
    assert!(is_at(&present, &path) && !is_at(&removed, &path));
}

#[test]
fn a_run_that_failed_because_of_its_machines_is_run_again_from_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let path = scratch.path().join("out");
    let directory = ResultsDirectory::open(&path).unwrap();
    let request = directory.request().unwrap();
    let mut failed = sample_output(Status::Failed);
    failed.result = identification(
        r#"{"status": "failed", "failure": "integrity_error", "reason": "realization 3 is …"}"#,
    );
    directory.write_results(&failed, &Silent).unwrap();
    assert_eq!(ResultsDirectory::finished(&path, &specification()).unwrap(), None);
    assert!(!directory.store().exists());
    assert_ne!(directory.request().unwrap(), request);
}

#[test]
fn a_file_that_no_run_has_written_is_not_read_to_its_end() {
    let directory = tempfile::tempdir().unwrap();
    for name in [JOB, RESULT, REQUEST] {
        let path = directory.path().join(name);
        // A sparse file, which takes no space on the disk.
        File::create(&path).unwrap().set_len(FILE_BYTES_MAX + 1).unwrap();
        let refused = read_if_there(&path).unwrap_err().to_string();
        assert!(refused.contains(name) && refused.contains("67108864 bytes"), "{refused}");
        File::create(&path).unwrap().set_len(100).unwrap();
        assert_eq!(read_if_there(&path).unwrap(), Some("\0".repeat(100)));
    }
    let result = directory.path().join(RESULT);
    File::create(&result).unwrap().set_len(FILE_BYTES_MAX + 1).unwrap();
    let refused = result_of(directory.path()).unwrap_err().to_string();
    assert!(refused.contains("longer than"), "{refused}");
    std::fs::remove_file(result).unwrap();
    let missing = result_of(directory.path()).unwrap_err().to_string();
    assert!(missing.contains(RESULT) && missing.contains("no such file"), "{missing}");
}

#[test]
fn a_directory_is_the_same_request_on_every_host() {
    let scratch = tempfile::tempdir().unwrap();
    let directory = ResultsDirectory::open(scratch.path()).unwrap();
    let path = scratch.path().join(REQUEST);
    let request = directory.request().unwrap();
    assert_eq!(directory.request().unwrap(), request);
    fs::write(&path, "an id\nann@node-7\n").unwrap();
    let elsewhere = RequestId { id: "an id".to_owned(), client: "ann@node-7".to_owned() };
    assert_eq!(directory.request().unwrap(), elsewhere);
}
