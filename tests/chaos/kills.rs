//! A storm: coordinator and workers are killed and stopped at random moments while jobs run.
//!
//! `OSTEON_CHAOS_KILLS=50` sets the number of kills of the coordinator, and of workers;
//! `OSTEON_CHAOS_SEED` selects another storm.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::sync::mpsc;

use osteon_common::job::JobKind;
use osteon_proto::v1::{JobSnapshot, JobSpecification, JobState};

use crate::api::{self, Api};
use crate::random::Random;
use crate::service::{Service, undisturbed};
use crate::support::{Owned, Scratch, eventually, job};

/// Default number of kills of the coordinator, and of workers.
const KILLS: usize = 50;
/// Maximum number of realizations between two faults.
const PAUSE_MAX: usize = 70;
/// Number of workers, of one thread each.
const WORKERS: usize = 3;
/// Number of jobs that are active at any time.
const BUSY: usize = 2;
/// Number of submissions in progress when the coordinator is killed.
const SUBMITTERS: usize = 4;

#[test]
fn killed_and_stopped_again_and_again_every_job_ends_with_its_digest() {
    let number = |name: &str, default: u64| {
        std::env::var(name)
            .map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}")))
    };
    let seed = number("OSTEON_CHAOS_SEED", 1);
    let kills = number("OSTEON_CHAOS_KILLS", KILLS as u64) as usize;
    println!("seed {seed}, {kills} kills of the coordinator and of workers each");
    let mut random = Random::new(seed);
    let mut blows = vec![Blow::KillCoordinator; kills - kills / 4];
    blows.extend(vec![Blow::KillDuringSubmission; kills / 4]);
    blows.extend(vec![Blow::KillWorker; kills]);
    for rare in [Blow::StopWorker, Blow::EndWorker, Blow::EndCoordinator] {
        blows.extend(vec![rare; 1 + kills / 12]);
    }
    random.shuffle(&mut blows);

    let scratch = Scratch::new();
    let mut storm = Storm::begin(&scratch, random);
    for blow in &blows {
        storm.pause();
        storm.strike(*blow);
    }
    let survived = storm.end();
    println!("survived, with seed {seed}: {survived}");
    survived.check(kills);
}

#[derive(Debug, Clone, Copy)]
enum Blow {
    KillCoordinator,
    /// Kills the coordinator while clients wait for the acceptance of their jobs.
    KillDuringSubmission,
    KillWorker,
    /// Stops a worker until its lease has ended, then continues it.
    StopWorker,
    /// Ends a worker cleanly by SIGTERM.
    EndWorker,
    EndCoordinator,
}

/// The kinds of jobs, with their digests.
struct Kind {
    specification: JobSpecification,
    digest: String,
}

struct Storm<'a> {
    scratch: &'a Scratch,
    random: Random,
    service: Service,
    api: Api,
    workers: Vec<Owned>,
    kinds: Vec<Kind>,
    /// Kind of each request, and the id of its job once that was acknowledged.
    requests: Vec<(usize, Option<String>)>,
    /// The last observed state of every job.
    seen: BTreeMap<String, JobSnapshot>,
    survived: Survived,
}

impl<'a> Storm<'a> {
    fn begin(scratch: &'a Scratch, random: Random) -> Self {
        let kind = |command, text: &str, name| {
            let file = scratch.write(name, text);
            let kind = match command {
                "identify" => JobKind::Identification,
                _ => JobKind::Propagation,
            };
            let specification = api::specification(&file, kind);
            Kind { specification, digest: undisturbed(command, &file) }
        };
        let kinds = vec![
            kind("identify", &job(40, 12), "a.toml"),
            kind("identify", &job(25, 16), "b.toml"),
            kind("propagate", &job(90, 1), "c.toml"),
            kind("propagate", &job(15, 1), "d.toml"),
        ];
        let service = Service::start(scratch, &["--lease", "1", "--audit-fraction", "0.1"]);
        let api = Api::new(service.url());
        let workers = (0..WORKERS).map(|_| service.worker(scratch)).collect();
        let (requests, seen) = (Vec::new(), BTreeMap::new());
        let survived = Survived::default();
        Self { scratch, random, service, api, workers, kinds, requests, seen, survived }
    }

    /// Waits for a random number of realizations.
    fn pause(&mut self) {
        let pause = self.random.below(PAUSE_MAX) as u64;
        let mut begun = None;
        eventually("the jobs go on", || {
            let Some(now) = self.look() else { return false };
            now >= *begun.get_or_insert(now) + pause
        });
    }

    /// Lists all jobs, and keeps enough of them active; returns the number of realizations so far.
    fn look(&mut self) -> Option<u64> {
        let jobs = self.api.jobs()?;
        let busy = jobs.iter().filter(|job| job.state() != JobState::Ended).count();
        let progress = jobs.iter().map(api::progress).sum();
        self.seen.extend(jobs.into_iter().map(|job| (job.job.clone(), job)));
        for _ in busy..BUSY {
            let kind = self.random.below(self.kinds.len() - 1);
            let id = format!("request {}", self.requests.len());
            let job = self.api.submit(&self.kinds[kind].specification, &id).ok();
            self.requests.push((kind, job));
        }
        Some(progress)
    }

    fn strike(&mut self, blow: Blow) {
        match blow {
            Blow::KillCoordinator => {
                self.service.kill();
                self.survived.coordinator_kills += 1;
                self.rise();
            }
            Blow::EndCoordinator => {
                self.service.end();
                self.survived.orderly_ends += 1;
                self.rise();
            }
            Blow::KillDuringSubmission => self.kill_during_submission(),
            Blow::KillWorker => {
                let doomed = self.random.below(WORKERS);
                self.workers[doomed].kill();
                self.workers[doomed] = self.service.worker(self.scratch);
                self.survived.worker_kills += 1;
            }
            Blow::EndWorker => {
                let leaving = self.random.below(WORKERS);
                // Before that, it may not handle the signal yet.
                self.until_attached();
                self.workers[leaving].signal("TERM");
                assert_eq!(self.workers[leaving].code(), Some(0));
                self.workers[leaving] = self.service.worker(self.scratch);
                self.survived.orderly_ends += 1;
            }
            Blow::StopWorker => self.stop_worker(),
        }
    }

    /// Waits until the coordinator lists exactly these processes: right after a kill it may still
    /// count the worker that has gone instead of its replacement.
    fn until_attached(&mut self) {
        eventually("all workers are attached", || {
            let attached = self.api.attached_processes().unwrap_or_default();
            self.workers.iter().all(|worker| attached.contains(&worker.id()))
        });
    }

    fn stop_worker(&mut self) {
        let stopped = self.random.below(WORKERS);
        // It must have a lease that can end.
        self.until_attached();
        let expired = self.service.expirations();
        self.workers[stopped].signal("STOP");
        eventually("the lease ends", || self.service.expirations() > expired);
        self.workers[stopped].signal("CONT");
        self.survived.stops += 1;
    }

    /// Restarts the coordinator, and checks that nothing is lost.
    fn rise(&mut self) {
        self.service.start_again();
        self.survived.restarts += 1;
        let mut found = None;
        eventually("the coordinator answers", || {
            found = self.api.jobs();
            found.is_some()
        });
        let found = found.unwrap();
        for (id, before) in &self.seen {
            let after = found.iter().find(|job| job.job == *id);
            let after = after.unwrap_or_else(|| panic!("job {id} is lost"));
            assert!(after.evaluations >= before.evaluations, "{before:?}, then {after:?}");
            let ended = before.state() == JobState::Ended;
            assert!(!ended || after.state() == JobState::Ended, "{before:?}, then {after:?}");
        }
        for (_, acknowledged) in &self.requests {
            let kept = |id: &String| found.iter().any(|job| job.job == *id);
            assert!(acknowledged.as_ref().is_none_or(kept), "{acknowledged:?} is lost");
        }
    }

    fn kill_during_submission(&mut self) {
        let kind = self.kinds.len() - 1;
        let first = self.requests.len();
        let (sender, acknowledged) = mpsc::channel();
        std::thread::scope(|scope| {
            for request in first..first + SUBMITTERS {
                let (sender, url) = (sender.clone(), self.service.url().to_owned());
                let specification = &self.kinds[kind].specification;
                scope.spawn(move || {
                    let id = format!("request {request}");
                    let submitted = Api::new(&url).submit(specification, &id);
                    sender.send((request, submitted.ok())).unwrap();
                });
            }
            self.requests.extend(vec![(kind, None); SUBMITTERS]);
            // The first is acknowledged while the others are still in progress.
            let (request, job) = acknowledged.recv().unwrap();
            self.requests[request].1 = job;
            self.service.kill();
            for _ in 1..SUBMITTERS {
                let (request, job) = acknowledged.recv().unwrap();
                self.survived.unanswered += usize::from(job.is_none());
                self.requests[request].1 = job;
            }
        });
        self.survived.coordinator_kills += 1;
        self.rise();
    }

    /// Waits for every job, and compares its digest.
    fn end(mut self) -> Survived {
        for (number, (kind, acknowledged)) in self.requests.iter().enumerate() {
            let id = format!("request {number}");
            let again = self.api.submit(&self.kinds[*kind].specification, &id).unwrap();
            assert!(acknowledged.as_ref().is_none_or(|job| *job == again), "{id} is two jobs");
            let result = self.api.end(&again);
            assert_eq!(result.digest(), self.kinds[*kind].digest, "{id}, job {again}");
            self.survived.evaluations += self.api.job(&again).evaluations;
        }
        let jobs = self.api.jobs().unwrap();
        assert_eq!(jobs.len(), self.requests.len(), "a submission was accepted twice");
        self.survived.jobs = jobs.len();
        self.survived.expirations = self.service.expirations();
        self.survived.retries = self.service.retries();
        self.survived
    }
}

/// The faults that the jobs have survived.
#[derive(Debug, Default)]
struct Survived {
    coordinator_kills: usize,
    restarts: usize,
    worker_kills: usize,
    orderly_ends: usize,
    stops: usize,
    /// Number of submissions that were cut off.
    unanswered: usize,
    expirations: usize,
    retries: usize,
    jobs: usize,
    evaluations: u64,
}

impl Survived {
    fn check(&self, kills: usize) {
        assert_eq!((self.coordinator_kills, self.worker_kills), (kills, kills));
        assert!(self.restarts > kills && self.orderly_ends > 1, "{self}");
        assert!(self.stops > 0 && self.expirations >= self.stops && self.retries > 0, "{self}");
        assert!(self.jobs >= BUSY && self.evaluations > 0, "{self}");
    }
}

impl fmt::Display for Survived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} kills of the coordinator, {} kills of workers, {} orderly ends, {} restarts of the \
             coordinator, {} stopped workers, {} lease expirations, {} batches retried by others, \
             {} submissions cut off; {} jobs with {} evaluations, every digest as undisturbed",
            self.coordinator_kills,
            self.worker_kills,
            self.orderly_ends,
            self.restarts,
            self.stops,
            self.expirations,
            self.retries,
            self.unanswered,
            self.jobs,
            self.evaluations
        )
    }
}

/// A worker is back at once after each restart of its coordinator, however many there were.
#[test]
fn a_worker_comes_back_at_once_after_each_restart() {
    const RESTARTS: usize = 6;
    let scratch = Scratch::new();
    let mut service = Service::start(&scratch, &[]);
    let _worker = service.worker(&scratch);
    let log = || fs::read_to_string(scratch.path("workers.log")).unwrap_or_default();
    let attachments = |log: &str| log.matches(" attached").count();
    for restart in 1..=RESTARTS {
        eventually("it is attached", || attachments(&log()) == restart);
        if restart % 2 == 0 {
            service.kill()
        } else {
            service.end()
        }
        service.start_again();
    }
    eventually("it is back", || attachments(&log()) == RESTARTS + 1);
    // The first wait after a kill is the shortest: earlier restarts have not made it longer. A coordinator that
    // ends in order says when to come back.
    let log = log();
    for (restart, stay) in (1..).zip(log.split(" attached").skip(1).take(RESTARTS)) {
        let wait = stay.split("wait_ms=").nth(1).unwrap();
        let wait: u64 = wait.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap();
        let most = if restart % 2 == 0 { 100 } else { 2000 };
        assert!(wait <= most, "{wait} ms after restart {restart}: {stay}");
    }
}
