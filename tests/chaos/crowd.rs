//! Many clients, clients that do not read, and peers that do not speak gRPC.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::path::PathBuf;

use osteon_common::job::JobKind;
use osteon_common::limits::MESSAGE_BYTES_MAX;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{CancelRequest, JobSnapshot, SubmitRequest, WatchRequest};
use osteon_transport::connection::connect;
use tonic::Code;

use crate::api::{Api, client_of, progress, specification};
use crate::proxy::{Proxy, Way};
use crate::random::Random;
use crate::service::{Service, undisturbed};
use crate::support::{DEADLINE, Owned, Scratch, eventually, job, run};

const CLIENTS: usize = 200;
/// Number of realizations of the crowd over which the share is measured.
const MEASURED: u64 = 1200;
/// Minimum ratio of the other client's share to that of the crowd: less than 1, since batches
/// differ in size.
const SHARE: f64 = 0.6;
/// Realizations of an evaluation of the other client: so many that it does not end meanwhile. At the
/// end of an evaluation a client waits for the disk, and others may use the slots.
const LARGE: u32 = 20_000;
const SEED: u64 = 11;
const WATCHERS: usize = 20;

/// Submits `request` for each of this many clients, on separate connections and at the same time;
/// returns the jobs.
fn submit_at_once(url: &str, clients: usize, request: &SubmitRequest) -> BTreeSet<String> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut submitters = tokio::task::JoinSet::new();
        for _ in 0..clients {
            let (url, request) = (url.to_owned(), request.clone());
            submitters.spawn(async move {
                let mut client = client_of(&url).await?;
                client.submit(request).await.map(|submitted| submitted.into_inner().job)
            });
        }
        let submitted = submitters.join_all().await;
        submitted.into_iter().map(|job| job.unwrap()).collect()
    })
}

#[test]
fn two_hundred_submit_at_once_and_anothers_job_keeps_its_share() {
    let scratch = Scratch::new();
    let small = scratch.write("small.toml", &job(10, 1));
    let large = scratch.write("large.toml", &job(LARGE, 400));
    let digest = undisturbed("propagate", &small);
    let service = Service::start(&scratch, &[]);
    let _worker = service.worker(&scratch);
    let mut api = Api::new(service.url());
    let other = api.submit(&specification(&large, JobKind::Identification), "").unwrap();
    api.until("the other's job runs", &other, |seen| progress(seen) > 0);

    let request = SubmitRequest {
        specification: Some(specification(&small, JobKind::Propagation)),
        client: "the crowd".to_owned(),
        ..SubmitRequest::default()
    };
    let crowd = submit_at_once(service.url(), CLIENTS, &request);
    assert_eq!(crowd.len(), CLIENTS, "every submission is a job");
    let mut shares = || {
        let jobs = api.jobs().unwrap();
        let (one, many): (Vec<JobSnapshot>, _) = jobs.into_iter().partition(|it| it.job == other);
        [one, many].map(|jobs| jobs.iter().map(progress).sum::<u64>())
    };
    let begun = shares();
    let mut now = begun;
    eventually("the crowd gets its share", || {
        now = shares();
        now[1] >= begun[1] + MEASURED
    });
    let [one, many] = [now[0] - begun[0], now[1] - begun[1]];
    println!("{one} realizations for one client, {many} for the crowd");
    // The converse does not hold: a job of ten realizations waits for the disk longer than it
    // computes, and the slots that it leaves idle meanwhile go to the other client. The tests of
    // the reactor show in virtual time that both shares are equal if neither waits.
    assert!(one as f64 >= SHARE * many as f64, "{one} against {many}");

    let cancel = CancelRequest { job: other };
    api.call(async |client| client.cancel(cancel).await).unwrap();
    for job in crowd {
        assert_eq!(api.end(&job).digest(), digest);
    }
}

/// A job that runs on two workers.
struct Story {
    scratch: Scratch,
    service: Service,
    _workers: [Owned; 2],
    api: Api,
    job: String,
    file: PathBuf,
}

impl Story {
    fn begin() -> Self {
        let scratch = Scratch::new();
        let file = scratch.write("job.toml", &job(40, 12));
        let service = Service::start(&scratch, &[]);
        let workers = [(); 2].map(|()| service.worker(&scratch));
        let mut api = Api::new(service.url());
        let job = api.submit(&specification(&file, JobKind::Identification), "").unwrap();
        api.until("both workers compute", &job, |seen| seen.workers == 2 && progress(seen) > 0);
        Self { scratch, service, _workers: workers, api, job, file }
    }

    /// Checks that the job ends with its digest, and that no worker was lost.
    fn check_end(&mut self) {
        let digest = undisturbed("identify", &self.file);
        assert_eq!(self.api.end(&self.job).digest(), digest);
        let log = std::fs::read_to_string(self.scratch.path("workers.log")).unwrap();
        assert_eq!(log.matches(" attached").count(), 2, "{log}");
    }
}

#[test]
fn who_watches_and_does_not_read_holds_nobody_up() {
    let mut story = Story::begin();
    let proxy = Proxy::start(story.service.url());
    let mut watchers = Vec::new();
    for _ in 0..WATCHERS {
        let mut watcher = Api::new(&proxy.url());
        let request = WatchRequest { job: story.job.clone(), after: 0 };
        let stream = watcher.call(async |client| {
            let mut stream = client.watch(request).await?.into_inner();
            stream.message().await?;
            Ok(stream)
        });
        watchers.push((watcher, stream.unwrap()));
    }
    proxy.stall(Way::Down);
    story.check_end();
}

#[test]
fn garbage_on_the_port_disturbs_nobody() {
    let mut story = Story::begin();
    let mut random = Random::new(SEED);
    let mut pieces: Vec<Vec<u8>> = vec![
        Vec::new(),
        b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n".to_vec(),
        // The beginning of a TLS handshake.
        [&[0x16, 3, 1, 0, 200, 1, 0, 0, 196, 3, 3][..], &[7; 190]].concat(),
        // The preface of HTTP/2 alone, then with a frame that announces 16 MB.
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(),
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\xff\xff\xff\x00\x00\x00\x00\x00\x01".to_vec(),
    ];
    for _ in 0..20 {
        let length = random.below(5000);
        let garbage: Vec<u8> = (0..length).map(|_| random.word() as u8).collect();
        pieces.push([b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", &garbage[..]].concat());
        pieces.push(garbage);
    }
    let address = story.service.url().trim_start_matches("http://").to_owned();
    for piece in pieces {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        // The coordinator may already have closed the connection.
        let _ = stream.write_all(&piece).and_then(|()| stream.shutdown(Shutdown::Write));
        let ended = stream.read_to_end(&mut Vec::new());
        let late = |error: &std::io::Error| {
            matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
        };
        assert!(!ended.as_ref().is_err_and(late), "it keeps the connection: seed {SEED}");
    }
    story.check_end();
}

#[test]
fn messages_beyond_the_limit_are_refused_with_the_limit() {
    let mut story = Story::begin();
    let url = story.service.url().to_owned();
    let submit = |bytes: usize| {
        let endpoint = url.parse().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            // A client without our client's limit.
            let mut client = JobsClient::new(connect(&endpoint, DEADLINE).await.unwrap());
            // Tag and length of the only field take 5 bytes.
            let request_id = "x".repeat(bytes - 5);
            let request = SubmitRequest { request_id, ..SubmitRequest::default() };
            client.submit(request).await.unwrap_err()
        })
    };
    let refused = submit(MESSAGE_BYTES_MAX + 1);
    assert_eq!(refused.code(), Code::OutOfRange, "{refused}");
    assert!(refused.message().contains(&MESSAGE_BYTES_MAX.to_string()), "{refused}");
    let read = submit(MESSAGE_BYTES_MAX);
    assert_eq!(read.code(), Code::InvalidArgument, "{read}");
    assert!(read.message().contains("at most 256 are allowed"), "{read}");
    story.check_end();
}

#[test]
fn more_connections_than_files_wait_without_a_flood_in_the_log() {
    let scratch = Scratch::new();
    let enter = ["prlimit", "--nofile=64:64"].map(str::to_owned);
    let service = Service::start_in(&scratch, &scratch.path("store"), &enter, &[]);
    assert!(service.log().contains("connections=32"), "{}", service.log());
    let address = service.url().trim_start_matches("http://");
    // Silent connections are closed after 10 s, which makes room.
    let crowd: Vec<_> = (0..50).map(|_| TcpStream::connect(address).unwrap()).collect();
    eventually("a client is served", || {
        run(&["jobs", "--coordinator", service.url()]).code == Some(0)
    });
    drop(crowd);
    let refused = service.log().matches("cannot accept").count();
    assert!(refused <= 1, "{refused} warnings");
}
