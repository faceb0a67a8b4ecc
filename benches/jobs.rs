//! Jobs per second that a running coordinator accepts, has computed and ends: many clients submit small
//! jobs at the same time, each of them the next one when its last one has ended.
//! `cargo bench -p osteon --bench jobs`
//!
//! Coordinator and worker are processes of their own; the clients share one process and some
//! connections over a Unix socket. A job is a propagation with one realization, so the coordinator
//! makes three records durable for each: the job before its client is answered, its evaluation, and
//! its end before those who watch it are told. Where jobs are cancelled by their clients as soon as
//! they are accepted, there is no worker, and two records for each. Beside each row is the time of a
//! write with a sync on the same disk, measured in this run.
//!
//! `cargo bench -p osteon --bench jobs -- --seconds 3` measures each row for a shorter time. Without
//! `--bench`, as under `cargo test --benches`, it is a short run. `--store DIR` puts the stores on
//! another disk than that of the temporary files.

#![expect(clippy::print_stdout, reason = "the table")]

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use osteon_common::job::{JobKind, JobSpecification};
use osteon_files::job_file;
use osteon_proto::specification;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{CancelRequest, JobState, SubmitRequest, WatchRequest};
use osteon_transport::connection::{connect, jobs_client};
use osteon_transport::endpoint::Endpoint;
use tokio::task::JoinSet;
use tonic::transport::Channel;

#[expect(dead_code, reason = "each benchmark uses a part of it")]
mod service;

use service::Service;

/// The paper's optimum.
const JOB: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/optimum.toml");
/// Longest wait for the coordinator.
const START_LIMIT: Duration = Duration::from_secs(10);
/// Clients that share one connection.
const CLIENTS_PER_CONNECTION: usize = 32;
/// Jobs of each client before the measurement begins.
const WARM_UP: usize = 2;
/// Writes whose shortest and median times are measured.
const WRITES: usize = 200;
/// Size of such a write: a page of the database.
const WRITE_BYTES: usize = 4096;

/// How a job ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum JobWay {
    Computed,
    Cancelled,
}

const WAYS: [JobWay; 2] = [JobWay::Computed, JobWay::Cancelled];

#[tokio::main]
async fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let full = arguments.iter().any(|argument| argument == "--bench");
    let option = |name| {
        let at = arguments.iter().position(|argument| argument == name)?;
        Some(arguments.get(at + 1).with_context(|| format!("{name} needs a value")))
    };
    let seconds = match option("--seconds") {
        Some(seconds) => seconds?.parse().context("--seconds needs a number")?,
        None if full => 10.0,
        None => 0.2,
    };
    let clients: &[usize] = if full { &[1, 8, 64, 256] } else { &[1, 8] };
    let directory = match option("--store") {
        Some(directory) => tempfile::tempdir_in(directory?)?,
        None => tempfile::tempdir()?,
    };
    let mut job = job_file::read(Path::new(JOB), JobKind::Propagation)?;
    job.monte_carlo.realizations = 1;
    println!(
        "| jobs | clients | number | per second | median of a job | slowest of 100 | write and sync |"
    );
    println!("|:--|--:|--:|--:|--:|--:|--:|");
    let rows = WAYS.into_iter().flat_map(|way| clients.iter().map(move |clients| (way, *clients)));
    for (way, clients) in rows {
        let store = directory.path().join(format!("{way:?}-{clients}"));
        let sync = median(writes(&directory.path().join("writes"))?);
        let time = Duration::from_secs_f64(seconds);
        let mut times = measure(&store, &job, way, clients, time).await?;
        let jobs = times.len();
        times.sort_unstable();
        println!(
            "| {way:?} | {clients} | {jobs} | {:.0} | {:.1} ms | {:.1} ms | {:.1} ms |",
            jobs as f64 / seconds,
            milliseconds(times[jobs / 2]),
            milliseconds(times[jobs * 99 / 100]),
            milliseconds(sync),
        );
    }
    Ok(())
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

/// Times of writes to the end of a file, each with its sync.
fn writes(path: &Path) -> Result<Vec<Duration>> {
    let mut file = File::create(path)?;
    let page = [0x5a; WRITE_BYTES];
    let mut write = || -> Result<Duration> {
        let begun = Instant::now();
        file.write_all(&page)?;
        file.sync_data()?;
        Ok(begun.elapsed())
    };
    (0..WRITES).map(|_| write()).collect()
}

/// Runs jobs of so many clients; returns how long each took that ended in the measured time.
async fn measure(
    store: &Path,
    job: &JobSpecification,
    way: JobWay,
    clients: usize,
    time: Duration,
) -> Result<Vec<Duration>> {
    let folder = tempfile::tempdir()?;
    let url = format!("unix:{}", folder.path().join("socket").display());
    let more = ["--audit-fraction", "0"];
    let _coordinator = Service::coordinator(&url, store, &more)?;
    let _worker = match way {
        JobWay::Computed => {
            Some(Service::start(&["worker", "--coordinator", &url, "--threads", "1"])?)
        }
        JobWay::Cancelled => None,
    };
    let endpoint: Endpoint = url.parse()?;
    let mut running = JoinSet::new();
    let mut channel = connect(&endpoint, START_LIMIT).await?;
    // One job at least has gone through before the others are submitted.
    run(&mut jobs_client(channel.clone()), job, way, "first").await?;
    for client in 0..clients {
        if client > 0 && client % CLIENTS_PER_CONNECTION == 0 {
            channel = connect(&endpoint, START_LIMIT).await?;
        }
        let (mut connection, job) = (jobs_client(channel.clone()), job.clone());
        running.spawn(async move {
            let name = format!("client {client}");
            for _ in 0..WARM_UP {
                run(&mut connection, &job, way, &name).await?;
            }
            let begun = Instant::now();
            let mut times = Vec::new();
            while begun.elapsed() < time {
                times.push(run(&mut connection, &job, way, &name).await?);
            }
            Ok::<_, anyhow::Error>(times)
        });
    }
    let mut all = Vec::new();
    while let Some(times) = running.join_next().await {
        all.extend(times??);
    }
    Ok(all)
}

/// Runs a job; returns the time from its submission until its client knows that it has ended.
async fn run(
    client: &mut JobsClient<Channel>,
    job: &JobSpecification,
    way: JobWay,
    name: &str,
) -> Result<Duration> {
    let submission = SubmitRequest {
        specification: Some(specification::to_message(job)),
        client: name.to_owned(),
        ..SubmitRequest::default()
    };
    let begun = Instant::now();
    let job = client.submit(submission).await?.into_inner().job;
    if way == JobWay::Cancelled {
        // Answered when the end is durable.
        client.cancel(CancelRequest { job }).await?;
        return Ok(begun.elapsed());
    }
    let watch = WatchRequest { job: job.clone(), after: 0 };
    let mut snapshots = client.watch(watch).await?.into_inner();
    while let Some(message) = snapshots.message().await? {
        let snapshot = message.snapshot.context("a message without a snapshot")?;
        if snapshot.state() == JobState::Ended {
            return Ok(begun.elapsed());
        }
    }
    bail!("the coordinator does not watch job {job} to its end")
}
