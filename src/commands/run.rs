//! `identify` and `propagate`: a job from its file to its result.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::anyhow;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::job_file;
use osteon_proto::endpoint::Endpoint;
use osteon_proto::v1::JobSnapshot;
use serde_json::Value;

use crate::client::{Client, Fetched};
use crate::embedded::{Embedded, StorePlace};
use crate::ending::{Ending, Failure, stdout_failure};
use crate::output::{self, ShownResult};
use crate::progress::Progress;
use crate::resolved::{Place, Run};
use crate::results_directory::{self, ResultsDirectory};
use crate::signals;

/// Runs the job, or shows what an earlier run left.
pub(super) async fn run(run: Run) -> Result<Ending, Failure> {
    let specification = job_file::read(&run.job, run.kind).map_err(Failure::bad_input)?;
    let finished = match &run.out {
        Some(path) => ResultsDirectory::finished(path, &specification)?,
        None => None,
    };
    if let Some(json) = finished {
        return show(&run, &specification, &json, None);
    }
    let interruption = signals::interruption()?;
    let (fetched, directory) = match &run.place {
        Place::Here { workers, threads } => {
            let directory = open(&run)?;
            let fetched =
                here(*workers, *threads, &specification, directory.as_ref(), interruption).await?;
            (fetched, directory)
        }
        Place::There(endpoint) => {
            // An address that does not answer leaves no directory behind.
            let client = Client::connect(endpoint).await?;
            let directory = open(&run)?;
            let fetched =
                there(client, endpoint, &specification, directory.as_ref(), interruption).await?;
            (fetched, directory)
        }
    };
    let json = match &directory {
        Some(directory) => directory.write_results(run.kind, &fetched)?,
        None => results_directory::result_json(run.kind, &fetched),
    };
    show(&run, &specification, &json, fetched.result.reason.as_deref())
}

fn open(run: &Run) -> Result<Option<ResultsDirectory>, Failure> {
    run.out.as_deref().map(ResultsDirectory::open).transpose()
}

fn show(
    run: &Run,
    specification: &JobSpecification,
    json: &str,
    reason: Option<&str>,
) -> Result<Ending, Failure> {
    let shown =
        ShownResult { kind: run.kind, specification, json, reason, directory: run.out.as_deref() };
    output::stdout(run.format).result(&shown).map_err(stdout_failure)?;
    Ok(ending(run.kind, specification, json))
}

/// What a result means for the exit code; the same for a stored one and for a new one.
fn ending(kind: JobKind, specification: &JobSpecification, json: &str) -> Ending {
    let value: Value = serde_json::from_str(json).unwrap_or_default();
    let done = match kind {
        JobKind::Identification => {
            matches!(value["status"].as_str(), Some("converged" | "max_evaluations"))
        }
        JobKind::Propagation => {
            let counts = value["failures"].as_object();
            let failed: u64 = counts.into_iter().flatten().filter_map(|(_, n)| n.as_u64()).sum();
            let realizations = specification.monte_carlo.realizations;
            let fraction = failed as f64 / realizations as f64;
            value["velocity"]["mean"].is_number()
                && fraction <= specification.monte_carlo.max_failed_fraction
        }
    };
    if done { Ending::Done } else { Ending::RunFailed }
}

/// The job on worker processes of this one.
async fn here(
    workers: u32,
    threads: u32,
    specification: &JobSpecification,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = ()>,
) -> Result<Fetched, Failure> {
    let store =
        directory.map_or(StorePlace::Memory, |directory| StorePlace::Directory(directory.store()));
    let progress = Arc::new(AtomicU64::new(0));
    let mut embedded = Embedded::start(store, workers, threads, Arc::clone(&progress)).await?;
    let endpoint = embedded.endpoint().clone();
    let driven = async {
        let client = Client::connect(&endpoint).await?;
        let note = |snapshot: &JobSnapshot| {
            let done = snapshot.evaluations.wrapping_mul(snapshot.realizations);
            progress.store(done.wrapping_add(snapshot.realizations_done), Ordering::Relaxed);
        };
        drive(client, specification, directory, note).await
    };
    let result = tokio::select! {
        driven = driven => driven,
        failure = embedded.workers_failed() => Err(failure),
        () = interruption => Err(Failure::failed(anyhow!(match directory {
            Some(_) => "interrupted; the same command continues",
            None => "interrupted; nothing was kept (with --out DIR a run can be continued)",
        }))),
    };
    embedded.end().await;
    result
}

/// The job on a running coordinator.
async fn there(
    client: Client,
    endpoint: &Endpoint,
    specification: &JobSpecification,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = ()>,
) -> Result<Fetched, Failure> {
    tokio::select! {
        driven = drive(client, specification, directory, |_| {}) => driven,
        () = interruption => Err(Failure::failed(anyhow!(
            "interrupted; the job goes on at {endpoint} (see `osteon jobs`, `osteon cancel`)"
        ))),
    }
}

/// Submits, watches, fetches.
async fn drive(
    mut client: Client,
    specification: &JobSpecification,
    directory: Option<&ResultsDirectory>,
    note: impl Fn(&JobSnapshot),
) -> Result<Fetched, Failure> {
    let request_id = match directory {
        Some(directory) => directory.request_id()?,
        None => String::new(),
    };
    let job = client.submit(specification, &request_id).await?;
    if let Some(directory) = directory {
        directory.write_job(specification)?;
    }
    let mut progress = Progress::start();
    client
        .watch(&job, |snapshot| {
            note(snapshot);
            progress.show(snapshot);
            Ok::<(), Failure>(())
        })
        .await?;
    progress.finish();
    Ok(client.fetch(&job).await?)
}

#[cfg(test)]
mod tests;
