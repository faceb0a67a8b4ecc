//! Processes that are stopped (a suspended machine, a swapping one) and continue.

use std::fs;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_proto::v1::JobSnapshot;

use crate::api::{Api, specification};
use crate::service::{Service, undisturbed};
use crate::support::{Owned, Scratch, children, eventually, job, osteon, signal, text};

/// Length of a fault that is longer than a client waits for an answer, 10 s.
const LONG: Duration = Duration::from_secs(12);

/// A coordinator with two workers in the middle of a job.
struct Story {
    scratch: Scratch,
    service: Service,
    workers: [Owned; 2],
    api: Api,
    job: String,
    digest: String,
}

impl Story {
    fn begin(lease_s: &str) -> Self {
        let scratch = Scratch::new();
        let file = scratch.write("job.toml", &job(50, 30));
        let digest = undisturbed("identify", &file);
        let service = Service::start(&scratch, &["--lease", lease_s]);
        let workers = [(); 2].map(|()| service.worker(&scratch));
        let mut api = Api::new(service.url());
        let job = api.submit(&specification(&file, JobKind::Identification), "").unwrap();
        let running = |seen: &JobSnapshot| seen.workers == 2 && seen.evaluations > 0;
        api.until("both workers compute", &job, running);
        Self { scratch, service, workers, api, job, digest }
    }

    /// Returns how often the workers have logged this message.
    fn logged(&self, what: &str) -> usize {
        fs::read_to_string(self.scratch.path("workers.log")).unwrap().matches(what).count()
    }

    fn check_end(&mut self) {
        assert_eq!(self.api.end(&self.job).digest(), self.digest);
        self.api.until("both workers are there", &self.job, |seen| seen.workers == 2);
    }
}

#[test]
fn a_worker_that_wakes_after_its_lease_changes_nothing() {
    let mut story = Story::begin("1");
    let expired = story.service.expirations();
    story.workers[0].signal("STOP");
    eventually("its lease ends", || story.service.expirations() > expired);
    story.workers[0].signal("CONT");
    story.check_end();
    assert!(story.logged(" attached") > 2, "it did not attach again");
}

#[test]
fn a_coordinator_that_stands_still_for_less_than_a_lease_loses_no_worker() {
    let mut story = Story::begin("6");
    story.service.process().signal("STOP");
    // This does not wait for a state: it is the length of the fault, a few missed heartbeats.
    std::thread::sleep(Duration::from_secs(2));
    story.service.process().signal("CONT");
    story.check_end();
    assert_eq!((story.service.expirations(), story.logged(" attached")), (0, 2));
}

#[test]
fn a_coordinator_that_stands_still_for_longer_is_found_again() {
    let mut story = Story::begin("1");
    let before = story.logged("silent for too long");
    story.service.process().signal("STOP");
    eventually("the workers give it up", || story.logged("silent for too long") >= before + 2);
    story.service.process().signal("CONT");
    story.check_end();
    assert!(story.logged(" attached") >= 4);
}

/// A client and its coordinator stop, as on a laptop whose lid is closed; the client wakes first.
#[test]
fn a_client_that_stands_still_goes_on_waiting() {
    let scratch = Scratch::new();
    let mut service = Service::start(&scratch, &[]);
    let log = scratch.path("client.log");
    let said = || fs::read_to_string(&log).unwrap();
    service.process().signal("STOP");
    let mut command = osteon();
    command.args(["jobs", "--coordinator", service.url(), "--json"]);
    let mut client = Owned::spawn_logging(&mut command, &log);
    eventually("it waits for an answer", || said().contains("no answer from"));
    client.signal("STOP");
    std::thread::sleep(LONG);
    client.signal("CONT");
    let waits = || fs::read_to_string(format!("/proc/{}/stat", client.id())).unwrap();
    eventually("it runs again", || !waits().contains(") T "));
    service.process().signal("CONT");
    assert_eq!(client.code(), Some(0), "{}", said());
    service.end();
}

/// A whole run stops, with its workers, in the middle of its job.
#[test]
fn a_run_that_stands_still_goes_on() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(200, 60));
    let digest = undisturbed("identify", &file);
    let (out, log) = (scratch.path("out"), scratch.path("run.log"));
    let said = || fs::read_to_string(&log).unwrap();
    let mut command = osteon();
    command.args(["identify", text(&file), "--out", text(&out), "--workers", "2", "-v"]);
    let mut run = Owned::spawn_logging(&mut command, &log);
    eventually("some points are evaluated", || said().matches("cost").count() > 3);
    let all = [vec![run.id()], children(run.id())].concat();
    assert_eq!(all.len(), 3);
    all.iter().for_each(|process| signal(*process, "STOP"));
    assert!(!out.join("result.json").exists());
    std::thread::sleep(LONG);
    all.iter().for_each(|process| signal(*process, "CONT"));
    assert_eq!(run.code(), Some(0), "{}", said());
    let written = fs::read_to_string(out.join("result.json")).unwrap();
    assert!(written.contains(&digest), "{written}");
    assert!(!said().contains("trying again"), "{}", said());
}
