use std::path::Path;

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::job_file;

use super::*;

const JOB: &str =
    "[parameters]\nmaterial = \"human-tibia-rho-1996\"\ndispersion = { fixed = 0.1 }\n";

fn job(more: &str) -> JobSpecification {
    let directory = Path::new("");
    job_file::parse(&(JOB.to_owned() + more), Format::Toml, directory, JobKind::Propagation)
        .unwrap()
}

fn record(
    job: &JobSpecification,
    series: u64,
    recorder: &Recorder,
    threads: usize,
) -> SyntheticStudy {
    let given = (job, &job.start());
    SyntheticStudy::record(given, series, recorder, (Isa::fastest(), threads), || {}).unwrap()
}

#[test]
fn a_study_has_the_same_bits_on_every_number_of_threads() {
    let job =
        job("[probe]\nbidirectional = true\n[random.probe_tilt]\nstandard_deviation = 0.01\n");
    let recorder = Recorder { noise_db: Some(30.0), gain_db: 1.0, ..Recorder::default() };
    let one = record(&job, 3, &recorder, 1);
    assert_eq!(one, record(&job, 3, &recorder, 4));
    assert_eq!(&one.shape[..3], [3, 2, 14]);
    // The first series of fewer are the same.
    let fewer = record(&job, 2, &recorder, 2);
    assert_eq!(fewer.samples, one.samples[..fewer.samples.len()]);
}

#[test]
fn what_a_recorder_spoils_is_spoilt() {
    let job = job("");
    let clean = record(&job, 1, &Recorder::default(), 1);
    let largest = |study: &SyntheticStudy| study.samples.iter().map(|one| one.unsigned_abs()).max();
    assert!(largest(&clean).unwrap() < 32_767);
    let clipped = record(&job, 1, &Recorder { full_scale: Some(2.0), ..Recorder::default() }, 1);
    assert_eq!(largest(&clipped), Some(32_767));
    let dead = record(&job, 1, &Recorder { dropouts: 0.5, ..Recorder::default() }, 1);
    let length = dead.shape[2];
    let silent = |study: &SyntheticStudy| {
        study.samples.chunks(length).filter(|one| one.iter().all(|&sample| sample == 0)).count()
    };
    assert!((1..14).contains(&silent(&dead)) && silent(&clean) == 0);
}

#[test]
fn too_many_samples_are_refused_before_any_is_computed() {
    let job = job("");
    let given = (&job, &job.start());
    let refused =
        SyntheticStudy::record(given, u64::MAX, &Recorder::default(), (Isa::fastest(), 1), || {
            panic!("a series is computed")
        });
    assert!(refused.unwrap_err().to_string().contains("ask for fewer series"));
}
