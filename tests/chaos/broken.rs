//! Machines that compute wrongly, as real workers behind a proxy that changes their answers.

use osteon_common::job::JobKind;
use osteon_proto::v1::{JobFailureKind, JobStatus, ListBansRequest};

use crate::altering::AlteringProxy;
use crate::api::{Api, specification};
use crate::service::{Service, undisturbed, worker_on};
use crate::support::{Owned, Scratch, eventually, job, run as osteon};

/// Exit code of a worker whose machine is banned.
const BAD_MACHINE: i32 = 77;

/// Jobs on sound machines and on `processes` of a broken one.
struct Story {
    scratch: Scratch,
    service: Service,
    api: Api,
    proxy: AlteringProxy,
    _sound: Vec<Owned>,
    broken: Vec<Owned>,
}

impl Story {
    fn begin(sound: usize, processes: usize, right: usize) -> Self {
        let scratch = Scratch::new();
        let service = Service::start(&scratch, &["--lease", "2"]);
        let proxy = AlteringProxy::start(service.url(), right);
        let sound: Vec<Owned> = (0..sound).map(|_| service.worker(&scratch)).collect();
        let broken = (0..processes).map(|_| worker_on(&scratch, &proxy.url(), "broken")).collect();
        let mut api = Api::new(service.url());
        let all = processes + sound.len();
        eventually("all workers are attached", || {
            api.attached_processes().is_some_and(|attached| attached.len() == all)
        });
        Self { scratch, service, api, proxy, _sound: sound, broken }
    }

    /// Runs a job; returns its status, its digest and what it should be.
    fn run(&mut self, seed: u64) -> (JobStatus, String, String) {
        let text = job(400, 6).replace("seed = 7", &format!("seed = {seed}"));
        let file = self.scratch.write(&format!("{seed}.toml"), &text);
        let specification = specification(&file, JobKind::Identification);
        let id = self.api.submit(&specification, "").unwrap();
        let ended = self.api.end(&id);
        (ended.status(), ended.digest, undisturbed("identify", &file))
    }

    fn banned(&mut self) -> Vec<String> {
        let listed = self.api.call(async |client| client.list_bans(ListBansRequest {}).await);
        listed.unwrap().into_inner().workers.into_iter().map(|worker| worker.host).collect()
    }
}

#[test]
fn a_broken_machine_of_two_processes_is_banned_and_in_no_result() {
    for right in [0, 300] {
        let mut story = Story::begin(2, 2, right);
        for seed in 1..=4 {
            let (status, digest, expected) = story.run(seed);
            assert_ne!(status, JobStatus::Failed);
            assert_eq!(digest, expected, "seed {seed}");
        }
        assert_eq!(story.banned(), ["broken"]);
        for broken in &mut story.broken {
            assert_eq!(broken.code(), Some(BAD_MACHINE));
        }
        // Nor is it admitted again, over a restart of the coordinator, until an operator lifts the ban.
        let mut again = worker_on(&story.scratch, &story.proxy.url(), "broken");
        assert_eq!(again.code(), Some(BAD_MACHINE));
        story.service.kill();
        story.service.start_again();
        let url = story.service.url().to_owned();
        let mut again = worker_on(&story.scratch, &url, "broken");
        assert_eq!(again.code(), Some(BAD_MACHINE));
        let listed = osteon(&["workers", "--coordinator", &url]);
        assert!(listed.stdout.contains("broken (process "), "{listed:?}");
        let lifted = osteon(&["workers", "unban", "broken", "--coordinator", &url]);
        assert_eq!((lifted.code, lifted.stdout.as_str()), (Some(0), "broken\n"), "{lifted:?}");
        let _repaired = worker_on(&story.scratch, &url, "broken");
        eventually("the repaired machine is attached", || {
            let listed = osteon(&["workers", "--coordinator", &url]);
            listed.stdout.lines().any(|line| line.contains(" broken ") && line.contains(" ok"))
        });
    }
}

#[test]
fn of_two_machines_none_is_believed_and_none_is_banned() {
    let mut story = Story::begin(1, 2, 0);
    for seed in 1..=2 {
        let text = job(400, 6).replace("seed = 7", &format!("seed = {seed}"));
        let file = story.scratch.write(&format!("{seed}.toml"), &text);
        let specification = specification(&file, JobKind::Identification);
        let id = story.api.submit(&specification, "").unwrap();
        let ended = story.api.end(&id);
        assert_eq!(ended.failure(), JobFailureKind::IntegrityError, "{:?}", ended.reason);
        let reason = ended.reason.unwrap_or_default();
        assert!(reason.contains("broken") && reason.contains("machine-"), "{reason}");
    }
    assert!(story.banned().is_empty());
}
