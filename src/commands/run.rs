//! `identify` and `propagate`: a job from its file to its result.

use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::anyhow;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::job_file;
use osteon_common::report::ResultFile;
use osteon_common::results::Status;
use osteon_proto::credentials::CredentialFiles;
use osteon_proto::v1::JobSnapshot;

use crate::client::{Client, Fetched, Remote, SubmitOptions};
use crate::embedded::{Embedded, StoreLocation};
use crate::ending::{Ending, Failure, Interruption, stdout_failure};
use crate::environment::Unused;
use crate::output::{self, ShownResult};
use crate::progress::{Progress, say};
use crate::request::Request;
use crate::resolved::{Place, Run};
use crate::results_directory::ResultsDirectory;
use crate::signals;
use crate::{unsearched_groups, verdict, warnings};

/// Runs the job, or shows the result of an earlier run.
pub(super) async fn run(run: Run) -> Result<Ending, Failure> {
    let noted = job_file::read_with_warnings(&run.job, run.kind).map_err(Failure::bad_input)?;
    let specification = &noted.specification;
    if let Some(result) = finished(&run, specification)? {
        return show(&run, specification, &result);
    }
    if let Some(reason) = failed_before(&run, specification)? {
        say(&format!("the last run in this directory failed and is started again: {reason}"));
    }
    if let Place::There(remote) = &run.place {
        remote.tell();
    }
    unsearched_groups::warn(&run.job, &noted);
    warnings::say_of_job(specification, &noted.warnings).await;
    let mut interruption = pin!(signals::interruption()?);
    // Connected first, so that an address that does not answer leaves no directory behind.
    let computers = tokio::select! {
        biased;
        found = Computers::find(&run.place) => found?,
        interruption = interruption.as_mut() => {
            return Err(Failure::Interrupted(interruption, "no job was submitted"));
        }
    };
    let directory = run.out.as_deref().map(ResultsDirectory::open).transpose()?;
    // Another run may have ended between the first check and the lock.
    if let Some(result) = finished(&run, specification)? {
        return show(&run, specification, &result);
    }
    let fetched = match computers {
        Computers::Here { workers, threads } => {
            let job = Named { specification, name: &run.name };
            here(workers, threads, job, directory.as_ref(), interruption).await?
        }
        Computers::There(client) => {
            let job = Named { specification, name: &run.name };
            there(*client, job, directory.as_ref(), interruption).await?
        }
    };
    let result = keep(run.kind, &fetched, directory.as_ref())?;
    show(&run, specification, &result)
}

/// A job and its name for display.
#[derive(Clone, Copy)]
struct Named<'a> {
    specification: &'a JobSpecification,
    name: &'a str,
}

/// The computers of a run, started or connected.
enum Computers {
    Here { workers: u32, threads: u32 },
    There(Box<Client>),
}

impl Computers {
    async fn find(place: &Place) -> Result<Self, Failure> {
        Ok(match place {
            Place::Here { workers, threads } => Self::Here { workers: *workers, threads: *threads },
            Place::There(remote) => {
                let client = Client::connect(remote).await?;
                Self::There(Box::new(client))
            }
        })
    }
}

fn finished(run: &Run, specification: &JobSpecification) -> Result<Option<ResultFile>, Failure> {
    match &run.out {
        Some(path) => ResultsDirectory::finished(path, specification),
        None => Ok(None),
    }
}

/// Returns the reason why the last run in the same directory failed, if another run may succeed.
fn failed_before(run: &Run, specification: &JobSpecification) -> Result<Option<String>, Failure> {
    let stored = match &run.out {
        Some(path) => ResultsDirectory::stored(path, specification)?,
        None => None,
    };
    Ok(stored.as_ref().and_then(verdict::machine_failure).map(str::to_owned))
}

/// Writes the results of an ended job, if there is a directory for them, and returns the result.
fn keep(
    kind: JobKind,
    fetched: &Fetched,
    directory: Option<&ResultsDirectory>,
) -> Result<ResultFile, Failure> {
    let missing = verdict::missing_result(fetched);
    if let Some(directory) = directory
        && (missing.is_some() || fetched.result.status == Status::Cancelled)
    {
        // The same command must run the job again, not show the same ending.
        directory.forget_request();
    }
    if let Some(missing) = missing {
        return Err(Failure::failed(anyhow!(missing)));
    }
    match directory {
        Some(directory) => directory.write_results(kind, fetched),
        None => Ok(ResultFile::from_job(kind, &fetched.result)),
    }
}

fn show(
    run: &Run,
    specification: &JobSpecification,
    result: &ResultFile,
) -> Result<Ending, Failure> {
    let shown = ShownResult { specification, result, directory: run.out.as_deref() };
    output::stdout(run.format).result(&shown).map_err(stdout_failure)?;
    Ok(verdict::ending(specification, result))
}

/// Runs the job on worker processes of this process.
async fn here(
    workers: u32,
    threads: u32,
    job: Named<'_>,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, Failure> {
    let store = directory
        .map_or(StoreLocation::Memory, |directory| StoreLocation::Directory(directory.store()));
    let progress = Arc::new(AtomicU64::new(0));
    let mut embedded = Embedded::start(store, workers, threads, Arc::clone(&progress)).await?;
    let endpoint = embedded.endpoint().clone();
    let (files, unused) = (CredentialFiles::default(), Unused::default());
    let remote = Remote { endpoint, files, from_environment: false, unused };
    let driven = async {
        let client = Client::connect(&remote).await?;
        let note = |snapshot: &JobSnapshot| {
            let done = snapshot.evaluations.wrapping_mul(snapshot.realizations);
            progress.store(done.wrapping_add(snapshot.realizations_done), Ordering::Relaxed);
        };
        drive(client, job, directory, note).await
    };
    let result = tokio::select! {
        driven = driven => driven,
        failure = embedded.failed() => Err(failure),
        interruption = interruption => Err(Failure::Interrupted(interruption, match directory {
            Some(_) => "run the same command again to resume",
            None => "no results were saved (with --out DIR a run can be resumed)",
        })),
    };
    embedded.end().await;
    result
}

/// Runs the job on a running coordinator.
async fn there(
    client: Client,
    job: Named<'_>,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, Failure> {
    tokio::select! {
        driven = drive(client, job, directory, |_| {}) => driven,
        interruption = interruption => Err(Failure::Interrupted(
            interruption,
            "a job that was accepted goes on (see `osteon jobs`, `osteon cancel`)",
        )),
    }
}

/// Submits the job, follows it and fetches its results.
async fn drive(
    mut client: Client,
    Named { specification, name }: Named<'_>,
    directory: Option<&ResultsDirectory>,
    note: impl Fn(&JobSnapshot),
) -> Result<Fetched, Failure> {
    let request = match directory {
        Some(directory) => directory.request()?,
        None => Request::new().map_err(Failure::failed)?,
    };
    let options = SubmitOptions { name: name.to_owned(), ..SubmitOptions::default() };
    let job = client.submit(specification, &request, options).await?;
    if let Some(directory) = directory {
        directory.write_job(specification)?;
    }
    let mut progress = Progress::start(specification);
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
