//! Processes that are stopped (a suspended machine, a swapping one) and continue.

use std::fs;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_proto::v1::JobSnapshot;

use crate::api::{Api, specification};
use crate::service::{Service, undisturbed};
use crate::support::{Owned, Scratch, eventually, job};

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
        assert_eq!(self.api.end(&self.job).digest, self.digest);
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
