//! A job from its submission to its results, on a running coordinator or on one in this process.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use osteon_common::job::JobSpecification;
use osteon_common::version::Program;
use osteon_proto::v1::JobSnapshot;

use crate::client::{Client, SubmitOptions};
use crate::embedded::{Embedded, EmbeddedSetup};
use crate::error::ClientError;
use crate::fetched::Fetched;
use crate::listener::RunListener;
use crate::other_version;
use crate::remote::Remote;
use crate::request_id::RequestId;
use crate::results_directory::ResultsDirectory;
use crate::run_error::RunError;

/// A job to be run.
#[derive(Debug, Clone, Copy)]
pub struct JobRun<'a> {
    /// The job.
    pub specification: &'a JobSpecification,
    /// Its name for display; may be empty.
    pub name: &'a str,
    /// The directory of its results, which belongs to this job; without one, every run is a new job.
    pub directory: Option<&'a ResultsDirectory>,
    /// This program. Results of another version are noted, or refused where it has computed another job.
    pub program: &'a Program,
}

/// Runs a job on a coordinator in this process and on worker processes beside it, all of which end with the
/// run. `show` is passed every snapshot. If `stop` completes first, the run ends with its value.
///
/// # Errors
/// If coordinator, workers or the job cannot continue; the error of `show`; `stop`.
pub async fn run_locally<E: From<ClientError> + From<RunError>>(
    setup: EmbeddedSetup,
    job: JobRun<'_>,
    listener: Arc<dyn RunListener>,
    mut show: impl FnMut(&JobSnapshot) -> Result<(), E>,
    stop: impl Future<Output = E>,
) -> Result<Fetched, E> {
    let progress = Arc::new(AtomicU64::new(0));
    let mut embedded = Embedded::start(setup, Arc::clone(&progress), Arc::clone(&listener)).await?;
    if let Some(url) = embedded.page_url() {
        listener.note(&format!("live page: {url} (until the run ends)"));
    }
    let remote = Remote::at(embedded.endpoint().clone());
    let run = async {
        let mut client = Client::connect(&remote, listener).await?;
        let show = |snapshot: &JobSnapshot| {
            let done = snapshot.evaluations.wrapping_mul(snapshot.realizations);
            progress.store(done.wrapping_add(snapshot.realizations_done), Ordering::Relaxed);
            show(snapshot)
        };
        run(&mut client, job, show).await
    };
    let result = tokio::select! {
        result = run => result,
        failure = embedded.failed() => Err(failure.into()),
        stop = stop => Err(stop),
    };
    embedded.end().await;
    result
}

/// Submits a job, follows it and fetches its results. `show` is passed every snapshot.
///
/// # Errors
/// If the coordinator refuses the job, is lost, or has computed another job; the error of `show`.
pub async fn run<E: From<ClientError> + From<RunError>>(
    client: &mut Client,
    job: JobRun<'_>,
    show: impl FnMut(&JobSnapshot) -> Result<(), E>,
) -> Result<Fetched, E> {
    let JobRun { specification, name, directory, program } = job;
    let request = match directory {
        Some(directory) => directory.request()?,
        None => RequestId::new().map_err(RunError::failed)?,
    };
    let options = SubmitOptions { name: name.to_owned(), ..SubmitOptions::default() };
    let id = client.submit(specification, &request, options).await?;
    if let Some(directory) = directory {
        directory.write_job(specification)?;
    }
    client.watch(&id, show).await?;
    let fetched = client.fetch(&id).await?;
    let Fetched { specification: computed, result, .. } = &fetched;
    let note = other_version::check(specification, computed, (program, &result.program()));
    if let Some(note) = note.map_err(RunError::failed)? {
        client.listener().note(&note);
    }
    Ok(fetched)
}
