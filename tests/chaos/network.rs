//! Networks that delay, cut, half-close, and go silent in one direction, simulated by a proxy
//! between coordinator, workers and client.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_proto::v1::JobSnapshot;

use crate::api::{Api, progress, specification};
use crate::proxy::{Proxy, Way};
use crate::random::Random;
use crate::service::{Service, undisturbed, worker};
use crate::support::{Owned, Scratch, eventually, job, run, text};

const SEED: u64 = 3;

/// A coordinator with one proxy for each of two workers.
struct Network {
    scratch: Scratch,
    service: Service,
    proxies: [Proxy; 2],
    _workers: [Owned; 2],
    api: Api,
    file: PathBuf,
    digest: String,
}

impl Network {
    fn start(evaluations: u32) -> Self {
        let scratch = Scratch::new();
        let file = scratch.write("job.toml", &job(40, evaluations));
        let digest = undisturbed("identify", &file);
        let service = Service::start(&scratch, &["--lease", "1"]);
        let proxies = [(); 2].map(|()| Proxy::start(service.url()));
        let workers = [0, 1].map(|one| worker(&scratch, &proxies[one as usize].url()));
        let api = Api::new(service.url());
        Self { scratch, service, proxies, _workers: workers, api, file, digest }
    }

    fn submit(&mut self) -> String {
        let job = specification(&self.file, JobKind::Identification);
        let job = self.api.submit(&job, "").unwrap();
        let running = |seen: &JobSnapshot| seen.workers == 2 && progress(seen) > 0;
        self.api.until("both workers compute", &job, running);
        job
    }

    /// Returns how often workers have attached.
    fn attachments(&self) -> usize {
        let log = fs::read_to_string(self.scratch.path("workers.log")).unwrap();
        log.matches(" attached").count()
    }
}

#[test]
fn slow_and_cut_connections_change_nothing() {
    let mut network = Network::start(20);
    let front = Proxy::start(network.service.url());
    for proxy in network.proxies.iter().chain([&front]) {
        proxy.delay(Duration::from_millis(5));
    }
    let (arguments, url) = (["identify", text(&network.file), "--json"], front.url());
    let mut random = Random::new(SEED);
    let (mut cuts, mut turn) = (0, 0);
    let found = std::thread::scope(|scope| {
        let client = scope.spawn(|| run(&[&arguments[..], &["--coordinator", &url]].concat()));
        let mut last = 0;
        // Avoids the beginning, when the job is submitted, and the end, when it is fetched.
        while last < 16 * 40 {
            let next = last + 1 + random.below(60) as u64;
            eventually("the job goes on", || {
                let jobs = network.api.jobs().unwrap();
                last = jobs.first().map_or(0, progress);
                last >= next
            });
            let [one, other] = &network.proxies;
            cuts += [one, &front, other][turn % 3].cut();
            turn += 1;
        }
        client.join().unwrap()
    });
    assert_eq!(found.json()["digest"], *network.digest, "seed {SEED}");
    assert!(cuts > 2, "only {cuts} connections were cut");
    assert!(network.attachments() > 2, "no worker was cut off");
}

#[test]
fn half_closed_connections_are_given_up_and_made_anew() {
    let mut network = Network::start(12);
    let job = network.submit();
    for (fault, way) in [Way::Up, Way::Down, Way::Up, Way::Down].into_iter().enumerate() {
        let before = network.attachments();
        network.proxies[fault % 2].half_close(way);
        eventually("the worker attaches again", || network.attachments() > before);
    }
    assert_eq!(network.api.end(&job).digest(), network.digest);
}

#[test]
fn connections_that_are_silent_one_way_are_given_up_and_made_anew() {
    let mut network = Network::start(12);
    let job = network.submit();
    let stall = |proxy: usize, way| {
        let before = network.attachments();
        network.proxies[proxy].stall(way);
        eventually("the worker attaches again", || network.attachments() > before);
        // The delayed messages arrive after the lease has ended.
        network.proxies[proxy].release(way);
    };
    // On a loaded machine a worker may give up before the coordinator does, as both wait equally
    // long; then the fault is repeated.
    let expired = (0..5).any(|_| {
        stall(0, Way::Up);
        network.service.expirations() > 0
    });
    assert!(expired, "the coordinator ended no lease of a silent worker");
    stall(1, Way::Down);
    assert_eq!(network.api.end(&job).digest(), network.digest);
}
