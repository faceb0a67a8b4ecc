//! `submit`, `jobs`, `watch`, `cancel`, `fetch`: a client of a running coordinator.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use osteon_common::job::JobKind;
use osteon_common::job_file;
use osteon_common::results::Status;
use osteon_proto::endpoint::Endpoint;
use osteon_proto::v1::JobSnapshot;
use tonic::Code;

use crate::client::{self, Client, ClientError};
use crate::ending::{Ending, Failure, stdout_failure};
use crate::output;
use crate::resolved::Format;
use crate::results_directory::ResultsDirectory;

/// Shortest time between two lines of `watch`.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// `submit`: prints the job's id.
pub(super) async fn submit(
    job: &Path,
    kind: JobKind,
    request_id: &str,
    coordinator: &Endpoint,
    format: Format,
) -> Result<Ending, Failure> {
    let specification = job_file::read(job, kind).map_err(Failure::bad_input)?;
    let mut client = Client::connect(coordinator).await?;
    let id = client.submit(&specification, request_id).await?;
    output::stdout(format).submitted(&id).map_err(stdout_failure)?;
    Ok(Ending::Done)
}

/// `jobs`: prints all jobs.
pub(super) async fn list(coordinator: &Endpoint, format: Format) -> Result<Ending, Failure> {
    let jobs = Client::connect(coordinator).await?.list().await?;
    output::stdout(format).jobs(&jobs).map_err(stdout_failure)?;
    Ok(Ending::Done)
}

/// `watch`: prints a line when the job changes, at most one a second, until it has ended.
pub(super) async fn watch(job: &str, coordinator: &Endpoint) -> Result<Ending, Failure> {
    let mut client = Client::connect(coordinator).await?;
    let mut output = output::stdout(Format::Text);
    let mut last_line: Option<Instant> = None;
    let show = |snapshot: &JobSnapshot| {
        let due = last_line.is_none_or(|last| last.elapsed() >= LINE_INTERVAL);
        if !due && client::job_status(snapshot).is_none() {
            return Ok(());
        }
        last_line = Some(Instant::now());
        output.snapshot(snapshot).map_err(stdout_failure)
    };
    let last = client.watch(job, show).await?;
    Ok(ending(&last))
}

/// `cancel`: prints how the job is then.
pub(super) async fn cancel(job: &str, coordinator: &Endpoint) -> Result<Ending, Failure> {
    let snapshot = Client::connect(coordinator).await?.cancel(job).await?;
    output::stdout(Format::Text).snapshot(&snapshot).map_err(stdout_failure)?;
    Ok(Ending::Done)
}

/// `fetch`: writes what an ended job left. Nothing is written while it has not ended.
pub(super) async fn fetch(
    job: &str,
    coordinator: &Endpoint,
    out: &Path,
) -> Result<Ending, Failure> {
    let fetched =
        Client::connect(coordinator).await?.fetch(job).await.map_err(|error| match &error {
            ClientError::Refused { code: Code::FailedPrecondition, reason, .. } => {
                Failure::failed(anyhow!("{reason}"))
            }
            _ => Failure::from(error),
        })?;
    let specification = &fetched.specification;
    // The same specification has the same result: a finished directory is left as it is.
    if ResultsDirectory::finished(out, specification)?.is_none() {
        ResultsDirectory::open(out)?.write_results(specification.kind, &fetched)?;
    }
    let line = format!("{}\n", out.display());
    output::stdout(Format::Text).verbatim(&line).map_err(stdout_failure)?;
    Ok(Ending::Done)
}

fn ending(snapshot: &JobSnapshot) -> Ending {
    match client::job_status(snapshot) {
        Some(Status::Converged | Status::MaxEvaluations) => Ending::Done,
        _ => Ending::RunFailed,
    }
}
