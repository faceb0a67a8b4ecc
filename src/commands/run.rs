//! `identify` and `propagate`: a job from its file to its result.

use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::anyhow;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::job_file;
use osteon_common::results::Status;
use osteon_proto::credentials::CredentialFiles;
use osteon_proto::v1::JobSnapshot;

use crate::client::{Client, Fetched, Remote, SubmitOptions};
use crate::embedded::{Embedded, StorePlace};
use crate::ending::{Ending, Failure, Interruption, stdout_failure};
use crate::environment::Unused;
use crate::output::{self, ShownResult};
use crate::progress::{Progress, say};
use crate::request::Request;
use crate::resolved::{Place, Run};
use crate::results_directory::{self, ResultsDirectory};
use crate::signals;
use crate::{unsearched_groups, verdict, warnings};

/// Runs the job, or shows what an earlier run left.
pub(super) async fn run(run: Run) -> Result<Ending, Failure> {
    let noted = job_file::read_noting(&run.job, run.kind).map_err(Failure::bad_input)?;
    let specification = &noted.specification;
    if let Some(json) = finished(&run, specification)? {
        return show(&run, specification, &json);
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
    // An address that does not answer leaves no directory behind.
    let computers = tokio::select! {
        biased;
        found = Computers::find(&run.place) => found?,
        interruption = interruption.as_mut() => {
            return Err(Failure::Interrupted(interruption, "no job was submitted"));
        }
    };
    let directory = run.out.as_deref().map(ResultsDirectory::open).transpose()?;
    // Another run may have ended between the look and the lock.
    if let Some(json) = finished(&run, specification)? {
        return show(&run, specification, &json);
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
    let json = keep(run.kind, &fetched, directory.as_ref())?;
    show(&run, specification, &json)
}

/// A job, and what people call it.
#[derive(Clone, Copy)]
struct Named<'a> {
    specification: &'a JobSpecification,
    name: &'a str,
}

/// Who computes, and is there.
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

fn finished(run: &Run, specification: &JobSpecification) -> Result<Option<String>, Failure> {
    match &run.out {
        Some(path) => ResultsDirectory::finished(path, specification),
        None => Ok(None),
    }
}

/// Why the last run in the same directory failed, if another may do better.
fn failed_before(run: &Run, specification: &JobSpecification) -> Result<Option<String>, Failure> {
    let stored = match &run.out {
        Some(path) => ResultsDirectory::stored(path, specification)?,
        None => None,
    };
    Ok(stored.and_then(|json| verdict::machine_failure(&json)))
}

/// Writes what an ended job left, if there is a directory for it; the text of the result.
fn keep(
    kind: JobKind,
    fetched: &Fetched,
    directory: Option<&ResultsDirectory>,
) -> Result<String, Failure> {
    let missing = verdict::missing_result(fetched);
    if let Some(directory) = directory
        && (missing.is_some() || fetched.result.status == Status::Cancelled)
    {
        // The same command shall run it again, not meet the same end again.
        directory.forget_request();
    }
    if let Some(missing) = missing {
        return Err(Failure::failed(anyhow!(missing)));
    }
    match directory {
        Some(directory) => directory.write_results(kind, fetched),
        None => Ok(results_directory::result_json(kind, fetched)),
    }
}

fn show(run: &Run, specification: &JobSpecification, json: &str) -> Result<Ending, Failure> {
    let shown = ShownResult { kind: run.kind, specification, json, directory: run.out.as_deref() };
    output::stdout(run.format).result(&shown).map_err(stdout_failure)?;
    Ok(verdict::ending(run.kind, specification, json))
}

/// The job on worker processes of this one.
async fn here(
    workers: u32,
    threads: u32,
    job: Named<'_>,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, Failure> {
    let store =
        directory.map_or(StorePlace::Memory, |directory| StorePlace::Directory(directory.store()));
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

/// The job on a running coordinator.
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

/// Submits, watches, fetches.
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
