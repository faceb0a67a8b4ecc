//! Cost of distribution: jobs of a running coordinator with two workers of one thread each,
//! against the same realizations in a bare loop on two threads of one process.
//! `cargo bench -p osteon --bench dispatch`
//!
//! A job's time is what its client sees: from the call that submits it to the message that says
//! that it has ended, over a Unix socket, with the durable store. Connecting, and fetching the
//! result, are not in it. The bare loop takes its indices one by one from a counter, so that both
//! threads end together. Both sides have their tables and workspaces before the first turn; they
//! take turns, and the shortest time of each is kept, because a processor's clock and its neighbours
//! only ever add. Every velocity of every job is compared with the loop's, to the bit.
//!
//! `cargo bench -p osteon --bench dispatch -- --turns 3` takes fewer turns. Without `--bench`, as
//! under `cargo test --benches`, it is a short run.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "the table, and how far it is")]

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail, ensure};
use osteon_common::digest::PathDigest;
use osteon_common::job::{Data, JobKind, JobSpecification, Range};
use osteon_common::outcome::{FailureKind, Outcome};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::realization::Ensemble;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{FetchRequest, JobState, SubmitRequest, WatchRequest};
use osteon_proto::{history, specification};
use osteon_solver::{Solver, Workspace};
use osteon_transport::connection::{connect, jobs_client};
use osteon_transport::endpoint::Endpoint;
use tonic::transport::Channel;

#[expect(dead_code, reason = "each benchmark uses a part of it")]
mod service;

use service::Service;

/// The paper's optimum, N = 2747.
const JOB: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/optimum.toml");
/// Thickness of the plate, m, with which a realization takes about 1 ms of a core with AVX-512: the
/// thinner a plate, the wider its band.
const THICKNESS: f64 = 1.2e-3;
/// Workers, and threads of the bare loop.
const CORES: usize = 2;
/// Evaluations of the identification.
const EVALUATIONS: u64 = 10;
/// Longest wait for the coordinator.
const START_LIMIT: Duration = Duration::from_secs(10);

/// How much is measured.
struct Effort {
    realizations: Option<u64>,
    thickness: f64,
    /// Turns of the propagation, and of the identification.
    turns: [u32; 2],
}

const FULL: Effort = Effort { realizations: None, thickness: THICKNESS, turns: [20, 4] };
const SHORT: Effort = Effort { realizations: Some(20), thickness: 4e-3, turns: [1, 1] };

#[tokio::main]
async fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let full = arguments.iter().any(|argument| argument == "--bench");
    let mut effort = if full { FULL } else { SHORT };
    if let Some(at) = arguments.iter().position(|argument| argument == "--turns") {
        let turns = arguments.get(at + 1).context("--turns needs a number")?;
        effort.turns = [turns.parse().context("--turns needs a number")?; 2];
    }
    let mut propagation = job_file::read(Path::new(JOB), JobKind::Propagation)?;
    propagation.setup.layers.bone_thickness = effort.thickness;
    if let Some(realizations) = effort.realizations {
        propagation.monte_carlo.realizations = realizations;
    }
    let folder = tempfile::tempdir()?;
    let url = format!("unix:{}", folder.path().join("socket").display());
    let store = folder.path().join("store");
    let _coordinator = Service::coordinator(&url, &store, &["--audit-fraction", "0"])?;
    let worker = ["worker", "--coordinator", &url, "--threads", "1"];
    let _workers: Vec<Service> =
        (0..CORES).map(|_| Service::start(&worker)).collect::<Result<_>>()?;
    let endpoint: Endpoint = url.parse()?;
    let mut client = jobs_client(connect(&endpoint, START_LIMIT).await?);
    let mut bare = Bare::new(&propagation);

    println!("| job | evaluations | bare loop | each realization, one core | job | ratio |");
    println!("|:--|--:|--:|--:|--:|--:|");
    let identification = identification(&propagation);
    let jobs = [("propagation", &propagation), ("identification", &identification)];
    for ((name, job), turns) in jobs.into_iter().zip(effort.turns) {
        let row = measure(&mut client, &mut bare, job, turns).await?;
        println!("| {name} {row}");
    }
    Ok(())
}

/// Takes turns with a job and its realizations in the bare loop, and puts both into a row.
async fn measure(
    client: &mut JobsClient<Channel>,
    bare: &mut Bare,
    job: &JobSpecification,
    turns: u32,
) -> Result<String> {
    // One of each before the first turn.
    let (_, id) = run(client, job).await?;
    let (points, digest) = read_output(client, &id).await?;
    let [mut service_s, mut loop_s, mut realization_s] = [f64::INFINITY; 3];
    for turn in 0..=turns {
        let begun = Instant::now();
        let evaluations =
            points.iter().map(|point| bare.evaluate(point)).collect::<Result<Vec<_>>>()?;
        let seconds = begun.elapsed().as_secs_f64();
        let mut found = PathDigest::new();
        for (point, outcomes) in points.iter().zip(&evaluations) {
            found.add_evaluation(point, outcomes);
        }
        ensure!(found.finish() == digest, "the bare loop has other velocities than job {id}");
        let (job_s, id) = run(client, job).await?;
        ensure!(read_output(client, &id).await?.1 == digest, "job {id} has other velocities");
        if turn > 0 {
            let count = points.len() as f64 * bare.count as f64;
            loop_s = loop_s.min(seconds);
            realization_s = realization_s.min(seconds * CORES as f64 / count);
            service_s = service_s.min(job_s);
            eprintln!("turn {turn} of {turns}: loop {seconds:.4} s, job {job_s:.4} s");
        }
    }
    Ok(format!(
        "| {} | {:.4} s | {:.3} ms | {:.4} s | {:.4} |",
        points.len(),
        loop_s,
        realization_s * 1e3,
        service_s,
        service_s / loop_s
    ))
}

/// The same realizations without any service.
struct Bare {
    solver: Solver,
    workspaces: Vec<Workspace>,
    seed: u64,
    count: u64,
}

impl Bare {
    fn new(job: &JobSpecification) -> Self {
        Self {
            solver: Solver::new(&job.setup),
            workspaces: (0..CORES).map(|_| Workspace::default()).collect(),
            seed: job.monte_carlo.seed,
            count: job.monte_carlo.realizations,
        }
    }

    /// All realizations of a point, in index order.
    fn evaluate(&mut self, point: &Point) -> Result<Vec<Outcome>> {
        let ensemble = Ensemble::new(point, self.seed)?;
        let (solver, count) = (&self.solver, self.count);
        let next = AtomicU64::new(0);
        let mut solved: Vec<(u64, Outcome)> = thread::scope(|scope| {
            let threads: Vec<_> = self
                .workspaces
                .iter_mut()
                .map(|workspace| {
                    scope.spawn(|| {
                        let next = || next.fetch_add(1, Ordering::Relaxed);
                        let indices = std::iter::repeat_with(next).take_while(|i| *i < count);
                        let solve = |index| match ensemble.bone(index) {
                            Ok(bone) => (index, solver.outcome(&bone, workspace)),
                            Err(_) => (index, Err(FailureKind::NotFinite)),
                        };
                        indices.map(solve).collect::<Vec<_>>()
                    })
                })
                .collect();
            let joined = threads.into_iter().map(|thread| thread.join());
            joined.flatten().flatten().collect()
        });
        solved.sort_unstable_by_key(|(index, _)| *index);
        Ok(solved.into_iter().map(|(_, outcome)| outcome).collect())
    }
}

/// Runs a job; how long it took from its submission to its end, s, and its identifier.
async fn run(client: &mut JobsClient<Channel>, job: &JobSpecification) -> Result<(f64, String)> {
    let submission = SubmitRequest {
        specification: Some(specification::to_message(job)),
        ..SubmitRequest::default()
    };
    let begun = Instant::now();
    let job = client.submit(submission).await?.into_inner().job;
    let watch = WatchRequest { job: job.clone(), after: 0 };
    let mut snapshots = client.watch(watch).await?.into_inner();
    while let Some(message) = snapshots.message().await? {
        let snapshot = message.snapshot.context("a message without a snapshot")?;
        if snapshot.state() == JobState::Ended {
            return Ok((begun.elapsed().as_secs_f64(), job));
        }
    }
    bail!("the coordinator does not watch job {job} to its end")
}

/// The points that an ended job evaluated, and the digest of all that came out.
async fn read_output(client: &mut JobsClient<Channel>, job: &str) -> Result<(Vec<Point>, String)> {
    let mut parts = client.fetch(FetchRequest { job: job.to_owned() }).await?.into_inner();
    let (mut points, mut digest) = (Vec::new(), None);
    while let Some(message) = parts.message().await? {
        match message.part {
            Some(Part::Result(result)) => {
                digest = Some(ResultFile::from_json(&result.json)?.digest().to_owned());
            }
            Some(Part::History(block)) => {
                for row in &block.rows {
                    points.push(history::evaluation_from_message(row)?.point);
                }
            }
            _ => {}
        }
    }
    Ok((points, digest.context("no result")?))
}

/// A search for two parameters around the point of a propagation.
fn identification(propagation: &JobSpecification) -> JobSpecification {
    let mut job = propagation.clone();
    job.kind = JobKind::Identification;
    job.data = Some(Data::from_moments(3906.0, 0.0271));
    for (parameter, lower, upper) in
        [(Parameter::LongitudinalYoungModulus, 12e9, 25e9), (Parameter::Dispersion, 0.02, 0.3)]
    {
        let range = &mut job.parameters[parameter as usize];
        *range = Range::Free { start: range.start(), lower, upper };
    }
    job.search.max_evaluations = EVALUATIONS;
    // Their evaluations are beside the path of the search, and the digest is of the path alone.
    job.search.sensitivities = false;
    job
}
