//! Clients that die, and clients whose coordinator dies.

use std::fs;
use std::path::Path;

use osteon_proto::v1::{JobSnapshot, JobState};

use crate::api::Api;
use crate::service::{Service, undisturbed};
use crate::support::{Owned, Scratch, eventually, job, osteon, run, text};

/// Waits until the only job has this number of evaluations.
fn until_evaluations(api: &mut Api, least: u64) -> JobSnapshot {
    let mut found = None;
    eventually("the job goes on", || {
        let jobs = api.jobs().unwrap_or_default();
        assert!(jobs.len() < 2, "one command, several jobs: {jobs:?}");
        found = jobs.into_iter().find(|job| job.evaluations >= least);
        found.is_some()
    });
    found.unwrap()
}

fn identify(file: &Path, out: &Path, url: &str) -> Owned {
    let mut command = osteon();
    command.args(["identify", text(file), "--out", text(out), "--coordinator", url]);
    Owned::spawn(&mut command)
}

/// First the client is killed, then its coordinator, twice, while the same command follows the same
/// job.
#[test]
fn a_killed_client_goes_on_with_its_job_and_a_living_one_finds_its_coordinator_again() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(60, 30));
    let out = scratch.path("out");
    let digest = undisturbed("identify", &file);
    let mut service = Service::start(&scratch, &[]);
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());

    let mut client = identify(&file, &out, service.url());
    until_evaluations(&mut api, 2);
    client.kill();
    assert!(!out.join("result.json").exists());
    let mut client = identify(&file, &out, service.url());
    for least in [6, 10] {
        let seen = until_evaluations(&mut api, least);
        assert_ne!(seen.state(), JobState::Ended, "too few evaluations");
        service.kill();
        service.start_again();
    }
    assert_eq!(client.code(), Some(0));
    let written = fs::read_to_string(out.join("result.json")).unwrap();
    let written: serde_json::Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written["digest"], *digest);
    assert_eq!(api.jobs().unwrap().len(), 1);

    // The finished job is shown again without a coordinator.
    service.kill();
    let again = run(&["identify", text(&file), "--out", text(&out), "--json"]);
    assert_eq!(again.json()["digest"], *digest);
}
