//! Machines that compute wrongly, as real workers behind a proxy that changes their answers.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use osteon_common::job::JobKind;
use osteon_common::results::JobFailure;
use osteon_files::report::ResultFile;
use osteon_proto::v1::ListBansRequest;

use crate::altering::{AlteringProxy, Fault};
use crate::api::{Api, specification};
use crate::service::{Service, undisturbed, worker_on};
use crate::support::{Owned, Scratch, eventually, job, run as osteon};

/// Exit code of a worker whose machine is banned.
const BAD_MACHINE: i32 = 77;

/// Time after which a test that restarts a machine looks whether it is to end.
const POLL: Duration = Duration::from_millis(20);

/// Jobs on `sound` machines of one process each, and on broken ones of several.
struct Story {
    scratch: Scratch,
    service: Service,
    api: Api,
    proxy: AlteringProxy,
    _sound: Vec<Owned>,
    broken: Vec<Owned>,
}

impl Story {
    fn begin(sound: usize, broken: &[&str], fault: Fault) -> Self {
        let scratch = Scratch::new();
        let service = Service::start(&scratch, &["--lease", "2"]);
        let proxy = AlteringProxy::start(service.url(), fault);
        let sound: Vec<Owned> = (0..sound).map(|_| service.worker(&scratch)).collect();
        let broken = broken.iter().map(|host| worker_on(&scratch, &proxy.url(), host));
        let broken: Vec<Owned> = broken.collect();
        let mut api = Api::new(service.url());
        let all = broken.len() + sound.len();
        eventually("all workers are attached", || {
            api.attached_processes().is_some_and(|attached| attached.len() == all)
        });
        Self { scratch, service, api, proxy, _sound: sound, broken }
    }

    /// Runs a job; returns its result.
    fn run(&mut self, job: &Path) -> ResultFile {
        let id = self.api.submit(&specification(job, JobKind::Identification), "").unwrap();
        self.api.end(&id)
    }

    fn banned(&mut self) -> Vec<String> {
        let listed = self.api.call(async |client| client.list_bans(ListBansRequest {}).await);
        listed.unwrap().into_inner().workers.into_iter().map(|worker| worker.host).collect()
    }
}

/// Writes a job with this seed; returns its file.
fn job_with_seed(scratch: &Scratch, text: &str, seed: u64) -> PathBuf {
    let text = text.replace("seed = 7", &format!("seed = {seed}"));
    scratch.write(&format!("{seed}.toml"), &text)
}

#[test]
fn a_broken_machine_of_two_processes_is_banned_and_in_no_result() {
    for right in [0, 300] {
        let mut story = Story::begin(2, &["broken"; 2], Fault::After(right));
        for seed in 1..=4 {
            let job = job_with_seed(&story.scratch, &job(400, 6), seed);
            let found = story.run(&job);
            assert_eq!(found.failure(), None);
            assert_eq!(found.digest(), undisturbed("identify", &job), "seed {seed}");
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
        let listed = osteon(&["worker", "list", "--coordinator", &url]);
        assert!(listed.stdout.contains("broken (process "), "{listed:?}");
        let lifted = osteon(&["worker", "unban", "broken", "--coordinator", &url]);
        assert_eq!((lifted.code, lifted.stdout.as_str()), (Some(0), "broken\n"), "{lifted:?}");
        let _repaired = worker_on(&story.scratch, &url, "broken");
        eventually("the repaired machine is attached", || {
            let listed = osteon(&["worker", "list", "--coordinator", &url]);
            listed.stdout.lines().any(|line| line.contains(" broken ") && line.contains(" ok"))
        });
    }
}

#[test]
fn of_two_machines_none_is_believed_and_none_is_banned() {
    let mut story = Story::begin(1, &["broken"; 2], Fault::After(0));
    for seed in 1..=2 {
        let job = job_with_seed(&story.scratch, &job(400, 6), seed);
        let ended = story.run(&job);
        let (failure, reason) = ended.failure().unwrap();
        let reason = reason.unwrap_or_default();
        assert_eq!(failure, JobFailure::IntegrityError, "{reason}");
        assert!(reason.contains("broken") && reason.contains("machine-"), "{reason}");
    }
    assert!(story.banned().is_empty());
}

/// Broken machines beside `sound` ones, all wrong in the same way; `restart_s` is the time after which each of
/// their processes is killed and started again.
struct Row {
    sound: usize,
    broken: &'static [&'static str],
    fault: Fault,
    restart_s: Option<u64>,
}

/// Says that it is over when it is dropped, after a failed assertion, too.
struct Ended<'a>(&'a AtomicBool);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

const fn row(
    sound: usize,
    broken: &'static [&'static str],
    fault: Fault,
    restart_s: Option<u64>,
) -> Row {
    Row { sound, broken, fault, restart_s }
}

const MATRIX: [Row; 12] = [
    row(1, &["broken"; 2], Fault::After(300), Some(2)),
    row(1, &["broken"; 2], Fault::Every(5), None),
    row(2, &["broken"; 2], Fault::After(0), Some(1)),
    row(2, &["broken"; 2], Fault::Every(5), Some(2)),
    row(2, &["broken"; 4], Fault::After(1000), Some(1)),
    row(2, &["broken"; 4], Fault::Every(5), None),
    row(5, &["broken"; 2], Fault::After(0), Some(10)),
    row(5, &["broken"; 2], Fault::After(300), Some(1)),
    row(8, &["broken"; 8], Fault::After(0), Some(1)),
    row(8, &["broken"; 8], Fault::After(1000), Some(2)),
    row(3, &["broken", "liar"], Fault::After(0), Some(2)),
    row(3, &["broken", "liar"], Fault::After(1000), None),
];

#[test]
fn machines_that_are_restarted_and_wrong_in_part_are_in_no_result() {
    let files = Scratch::new();
    let jobs = [1, 2].map(|seed| job_with_seed(&files, &job(2747, 4), seed));
    let jobs = jobs.map(|job| (undisturbed("identify", &job), job));
    for Row { sound, broken, fault, restart_s } in MATRIX {
        println!("{sound} sound machines; {broken:?}, {fault:?}, restarts: {restart_s:?} s");
        let mut story = Story::begin(sound, broken, fault);
        let mut processes = std::mem::take(&mut story.broken);
        let (url, scratch) = (story.proxy.url(), Scratch::new());
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                while let Some(restart_s) = restart_s
                    && !is_over.load(Ordering::Relaxed)
                {
                    let begun = Instant::now();
                    while begun.elapsed().as_secs() < restart_s && !is_over.load(Ordering::Relaxed)
                    {
                        thread::sleep(POLL);
                    }
                    for (process, host) in processes.iter_mut().zip(broken) {
                        process.kill();
                        *process = worker_on(&scratch, &url, host);
                    }
                }
            });
            let _end = Ended(&is_over);
            for (expected, job) in &jobs {
                let found = story.run(job);
                if let Some((failure, reason)) = found.failure() {
                    // One host against one: nobody knows which is right.
                    assert_eq!(failure, JobFailure::IntegrityError, "{reason:?}");
                    assert!(sound <= 1, "{reason:?}");
                } else {
                    assert_eq!(found.digest(), expected, "{}", job.display());
                }
            }
        });
        let banned = story.banned();
        println!("banned: {banned:?}");
        assert!(banned.iter().all(|host| broken.contains(&host.as_str())), "{banned:?}");
    }
}
