//! Workers that answer twice, out of order, too late, never, or wrongly, or are of another version.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_common::results::JobFailure;
use osteon_common::version;
use osteon_proto::v1::{BannedWorker, JobState, JobStatus, ListBansRequest, WorkerHello};
use tonic::{Code, Status};

use crate::api::{Api, specification};
use crate::peer::{self, Peer, hello};
use crate::proxy::Proxy;
use crate::service::{Service, undisturbed};
use crate::support::{Scratch, eventually, job, run as osteon};

/// Time for which a peer waits for a second batch before it answers the first.
const MORE: Duration = Duration::from_millis(50);

/// A coordinator, its client, an accepted job, and its expected digest.
struct Story {
    scratch: Scratch,
    service: Service,
    api: Api,
    job: String,
    digest: String,
}

impl Story {
    fn begin(options: &[&str]) -> Self {
        let scratch = Scratch::new();
        let file = scratch.write("job.toml", &job(40, 8));
        let digest = undisturbed("identify", &file);
        let service = Service::start(&scratch, options);
        let mut api = Api::new(service.url());
        let specification = specification(&file, JobKind::Identification);
        let job = api.submit(&specification, "").unwrap();
        Self { scratch, service, api, job, digest }
    }

    fn check_end(&mut self) {
        assert_eq!(self.api.end(&self.job).digest(), self.digest);
    }

    fn banned(&mut self) -> Vec<BannedWorker> {
        let listed = self.api.call(async |client| client.list_bans(ListBansRequest {}).await);
        listed.unwrap().into_inner().workers
    }
}

/// Runs a peer on a thread of its own.
fn on_thread<T: Send + 'static, F: Future<Output = T>>(
    peer: impl FnOnce() -> F + Send + 'static,
) -> JoinHandle<T> {
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.unwrap().block_on(peer())
    })
}

/// Waits for the end of a peer and returns its result.
fn end<T>(peer: JoinHandle<T>) -> T {
    eventually("the peer's stay ends", || peer.is_finished());
    peer.join().unwrap()
}

/// Sends right answers, each twice and the later batch first, and one to a batch that was never
/// sent, until the attachment ends. Returns how often batches were answered out of order.
async fn shuffler(url: String) -> usize {
    let mut peer = Peer::attach(&url, hello(1)).await.unwrap();
    let mut held = Vec::new();
    let mut reordered = 0;
    loop {
        match tokio::time::timeout(MORE, peer.batch()).await {
            Ok(Ok((batch, work))) => held.push((batch, peer::solve(&work))),
            Ok(Err(_)) => return reordered,
            Err(_) => {
                reordered += usize::from(held.len() > 1);
                while let Some((batch, solved)) = held.pop() {
                    peer.answer(batch, &solved).await;
                    peer.answer(batch, &solved).await;
                }
                peer.answer(u64::MAX, &[]).await;
            }
        }
    }
}

#[test]
fn duplicated_and_reordered_answers_change_nothing() {
    let mut story = Story::begin(&[]);
    let url = story.service.url().to_owned();
    let peer = on_thread(|| shuffler(url));
    story.check_end();
    story.service.kill();
    assert!(end(peer) > 0, "nothing was answered out of turn");
}

/// A worker that sends heartbeats but never answers, until its attachment ends; counts its batches.
async fn silent(url: String, hello: WorkerHello, batches: Arc<AtomicUsize>) {
    let mut peer = Peer::attach(&url, hello).await.unwrap();
    while peer.batch().await.is_ok() {
        batches.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn what_a_worker_never_answers_is_computed_by_another() {
    // Every batch is computed twice, so the silent workers hold first answers and audits.
    let mut story = Story::begin(&["--audit-fraction", "1"]);
    let (url, batches) = (story.service.url().to_owned(), Arc::new(AtomicUsize::new(0)));
    let peers = [1, 2].map(|process| {
        let (url, batches) = (url.clone(), Arc::clone(&batches));
        on_thread(move || silent(url, hello(process), batches))
    });
    let says = |seen: &osteon_proto::v1::JobSnapshot| {
        seen.waiting_for.contains("the answer of peer (process ")
            && seen.waiting_for.ends_with("; nothing of this job is answered yet")
    };
    // Both hold as much as a worker may, and there is no other worker to replace them.
    story.api.until("the job says whom it waits for", &story.job, says);
    let before = batches.load(Ordering::Relaxed);
    assert!(before > 0, "they hold nothing");
    let _honest = story.service.worker(&story.scratch);
    story.check_end();
    assert!(batches.load(Ordering::Relaxed) > before, "they were tried no more");
    assert!(peers.iter().all(|peer| !peer.is_finished()), "a lease has ended");
    let log = story.service.log();
    assert!(log.contains("gives signs of life and does not answer"), "{log}");
    story.service.kill();
    for peer in peers {
        end(peer);
    }
}

/// A worker that answers every batch wrongly until its attachment ends; returns the final status.
async fn liar(url: String, hello: WorkerHello) -> Status {
    let mut peer = match Peer::attach(&url, hello).await {
        Ok(peer) => peer,
        Err(refusal) => return refusal,
    };
    loop {
        match peer.batch().await {
            Ok((batch, work)) => peer.answer(batch, &peer::lie(&work)).await,
            Err(end) => return end,
        }
    }
}

#[test]
fn one_liar_among_three_is_banned_and_leaves_no_trace() {
    let mut story = Story::begin(&["--audit-fraction", "0.5"]);
    let url = story.service.url().to_owned();
    let liar = on_thread(|| liar(url, hello(1)));
    let _honest = [(); 2].map(|()| story.service.worker(&story.scratch));
    story.check_end();
    let end = end(liar);
    assert_eq!(end.code(), Code::PermissionDenied, "{end}");
    assert!(end.message().contains("banned") && end.message().contains("agree on"), "{end}");
    let banned = story.banned();
    assert_eq!(banned.len(), 1, "{banned:?}");
    assert_eq!((banned[0].host.as_str(), banned[0].process), ("peer", 1));
}

#[test]
fn one_liar_among_two_is_an_integrity_error_that_names_both() {
    let mut story = Story::begin(&["--audit-fraction", "0.5", "--lease", "1"]);
    let url = story.service.url().to_owned();
    let honest = story.service.worker(&story.scratch);
    let _liar = on_thread(|| liar(url, hello(1)));
    let wanted = |seen: &osteon_proto::v1::JobSnapshot| seen.state() == JobState::Ended;
    let ended = story.api.until("the job fails", &story.job, wanted);
    assert_eq!(ended.status(), JobStatus::Failed, "{ended:?}");
    for part in ["peer (process 1)", &format!("(process {})", honest.id()), "realization "] {
        assert!(ended.reason.contains(part), "{part} in {}", ended.reason);
    }
    let watched = osteon(&["watch", &story.job, "--coordinator", story.service.url()]);
    assert_eq!(watched.code, Some(1), "{watched:?}");
    // Where the lines are broken depends on the numbers before.
    let words: Vec<_> = watched.stdout.split_whitespace().collect();
    assert!(words.join(" ").contains("peer (process 1)"), "{watched:?}");
    assert!(story.banned().is_empty(), "nobody can say who lied");
}

/// A worker receives a batch and is silent until its lease ends; then it returns and answers the
/// old batch wrongly.
#[test]
fn what_a_worker_answers_after_its_lease_changes_nothing() {
    let mut story = Story::begin(&["--lease", "1", "--audit-fraction", "1"]);
    let url = story.service.url().to_owned();
    let zombie = on_thread(async move || {
        let mut peer = Peer::attach(&url, hello(1)).await.unwrap();
        let (batch, work) = peer.batch().await.unwrap();
        let end = loop {
            if let Err(end) = peer.message().await {
                break end;
            }
        };
        assert_eq!(end.code(), Code::Aborted, "{end}");
        assert!(end.message().contains("no message came"), "{end}");
        let mut peer = Peer::attach(&url, hello(1)).await.unwrap();
        peer.answer(batch, &peer::lie(&work)).await;
        peer.batch().await.unwrap();
    });
    end(zombie);
    let _honest = [(); 2].map(|()| story.service.worker(&story.scratch));
    story.check_end();
    assert!(story.service.expirations() > 0);
    assert!(story.banned().is_empty());
}

/// Workers that compute correctly but die repeatedly of one realization.
async fn mortals(url: String, process: u32, deadly: (u64, u64)) {
    let mut attached = 0;
    // Repeats until the coordinator has gone.
    while let Ok(mut peer) = Peer::attach(&url, hello(process + attached)).await {
        attached += 1;
        while let Ok((batch, work)) = peer.batch().await {
            let (seed, index) = deadly;
            if work.evaluation.germs.seed == seed
                && (work.first..work.first + u64::from(work.count)).contains(&index)
            {
                break;
            }
            peer.answer(batch, &peer::solve(&work)).await;
        }
    }
}

#[test]
fn a_realization_that_kills_its_workers_fails_its_job_and_no_other() {
    let scratch = Scratch::new();
    let text = job(40, 4);
    let doomed = scratch.write("doomed.toml", &text);
    let sound = scratch.write("sound.toml", &text.replace("seed = 7", "seed = 8"));
    let mut service = Service::start(&scratch, &[]);
    let mut api = Api::new(service.url());
    let [doomed, other] = [doomed.as_path(), sound.as_path()].map(|file| {
        let job = specification(file, JobKind::Identification);
        api.submit(&job, "").unwrap()
    });
    let workers = [100, 200].map(|process| {
        let url = service.url().to_owned();
        on_thread(move || mortals(url, process, (7, 33)))
    });
    let failed = api.end(&doomed);
    let (failure, reason) = failed.failure().unwrap();
    assert_eq!(failure, JobFailure::PoisonRealization);
    let reason = reason.unwrap_or_default();
    for part in ["realization 33", "osteon simulate", "mandel = ["] {
        assert!(reason.contains(part), "{part} in {reason}");
    }
    assert_eq!(api.end(&other).digest(), undisturbed("identify", &sound));
    service.kill();
    for worker in workers {
        end(worker);
    }
}

/// Its hello is altered on the way to the coordinator.
#[test]
fn a_worker_of_another_version_reads_why_it_is_refused() {
    let scratch = Scratch::new();
    let service = Service::start(&scratch, &[]);
    let ours = version::fingerprint();
    let theirs = ours.replace("osteon ", "other* ");
    let proxy = Proxy::start(service.url());
    proxy.rewrite(ours.as_bytes(), theirs.as_bytes());
    let refused = osteon(&["worker", "--coordinator", &proxy.url(), "--threads", "1"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    for part in [&ours, &theirs, "run the same version of osteon on both"] {
        assert!(refused.stderr.contains(part), "{part} in {refused:?}");
    }
}
