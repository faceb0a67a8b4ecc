//! `identify` and `propagate`: a job from its file to its result.

use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::anyhow;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::results::Status;
use osteon_coordinator::service::open_files;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_proto::credentials::CredentialFiles;
use osteon_proto::v1::JobSnapshot;
use osteon_solver::Isa;

use crate::arguments::VerbosityArguments;
use crate::client::{Client, Fetched, Remote, SubmitOptions};
use crate::embedded::{Embedded, EmbeddedSetup, StoreLocation};
use crate::environment::Unused;
use crate::exit_status::{CommandFailure, ExitStatus, Interruption, stdout_failure};
use crate::output::{self, Detail, ShownResult};
use crate::progress::{Progress, ShownProgress, say};
use crate::request_id::RequestId;
use crate::resolved::{Run, RunLocation};
use crate::results_directory::ResultsDirectory;
use crate::signals;
use crate::{cost, other_version, report_directory, result_status, unsearched_groups, warnings};

/// Runs the job, or shows the result of an earlier run.
pub(super) async fn run(run: Run, isa: Option<Isa>) -> Result<ExitStatus, CommandFailure> {
    let input = run.job.open().map_err(CommandFailure::bad_input)?;
    let noted = job_file::of_input(&input, run.kind).map_err(CommandFailure::bad_input)?;
    let specification = &noted.specification;
    if let Some(result) = finished(&run, specification)? {
        return show(&run, specification, &result);
    }
    if let Some(reason) = failed_before(&run, specification)? {
        say(&format!("the last run in this directory failed and is started again: {reason}"));
    }
    let is_quiet = run.verbosity.quiet;
    if let RunLocation::Coordinator(remote) = &run.location
        && !is_quiet
    {
        remote.announce();
    }
    unsearched_groups::warn(input.path(), &noted);
    warnings::say_of_job(specification, &noted.warnings).await;
    if let (RunLocation::Local { workers, threads }, Some(isa), false) =
        (&run.location, isa, is_quiet)
    {
        let threads = workers.saturating_mul(*threads);
        cost::say_if_remarkable(specification, isa, threads).await;
    }
    let mut interruption = pin!(signals::interruption()?);
    // Done first, so that an address that does not answer, or too low a limit, leaves no directory behind.
    let location = tokio::select! {
        biased;
        found = ConnectedLocation::connect(&run.location) => found?,
        interruption = interruption.as_mut() => {
            return Err(CommandFailure::Interrupted(interruption, "no job was submitted"));
        }
    };
    let directory = run.out.as_deref().map(ResultsDirectory::open).transpose()?;
    // Another run may have ended between the first check and the lock.
    if let Some(result) = finished(&run, specification)? {
        return show(&run, specification, &result);
    }
    let shown = ShownProgress { format: run.progress, verbosity: run.verbosity };
    let job = NamedJob { specification, name: &run.name, progress: shown };
    let fetched = match location {
        ConnectedLocation::Local { workers, threads } => {
            let store = directory.as_ref().map_or(StoreLocation::Memory, |directory| {
                StoreLocation::Directory(directory.store())
            });
            let setup = EmbeddedSetup { store, workers, threads, page: run.page, keep_ended: None };
            run_locally(setup, job, directory.as_ref(), interruption).await?
        }
        ConnectedLocation::Coordinator(client) => {
            run_on_coordinator(*client, job, directory.as_ref(), interruption).await?
        }
    };
    let result = keep(run.kind, &fetched, directory.as_ref())?;
    show(&run, specification, &result)
}

/// A job, its name for display, and the format of its progress.
#[derive(Clone, Copy)]
struct NamedJob<'a> {
    specification: &'a JobSpecification,
    name: &'a str,
    progress: ShownProgress,
}

/// Where a job is computed; a coordinator is already connected.
enum ConnectedLocation {
    Local { workers: u32, threads: u32 },
    Coordinator(Box<Client>),
}

impl ConnectedLocation {
    async fn connect(location: &RunLocation) -> Result<Self, CommandFailure> {
        Ok(match location {
            RunLocation::Local { workers, threads } => {
                open_files::require_for_run(*workers).map_err(CommandFailure::failed)?;
                Self::Local { workers: *workers, threads: *threads }
            }
            RunLocation::Coordinator(remote) => {
                let client = Client::connect(remote).await?;
                Self::Coordinator(Box::new(client))
            }
        })
    }
}

fn finished(
    run: &Run,
    specification: &JobSpecification,
) -> Result<Option<ResultFile>, CommandFailure> {
    match &run.out {
        Some(path) => ResultsDirectory::finished(path, specification),
        None => Ok(None),
    }
}

/// Returns the reason why the last run in the same directory failed, if another run may succeed.
fn failed_before(
    run: &Run,
    specification: &JobSpecification,
) -> Result<Option<String>, CommandFailure> {
    let stored = match &run.out {
        Some(path) => ResultsDirectory::stored(path, specification)?,
        None => None,
    };
    Ok(stored.as_ref().and_then(result_status::machine_failure).map(str::to_owned))
}

/// Writes the results of an ended job, if there is a directory for them, and returns the result.
fn keep(
    kind: JobKind,
    fetched: &Fetched,
    directory: Option<&ResultsDirectory>,
) -> Result<ResultFile, CommandFailure> {
    let missing = result_status::missing_result(fetched);
    if let Some(directory) = directory
        && (missing.is_some() || fetched.result.status == Status::Cancelled)
    {
        // The same command must run the job again, not show the same ending.
        directory.forget_request();
    }
    if let Some(missing) = missing {
        return Err(CommandFailure::failed(anyhow!(missing)));
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
) -> Result<ExitStatus, CommandFailure> {
    let detail = match run.verbosity {
        VerbosityArguments { quiet: true, .. } => Detail::Summary,
        VerbosityArguments { verbose: true, .. } => Detail::Full,
        VerbosityArguments { .. } => Detail::Usual,
    };
    let shown = ShownResult { specification, result, directory: run.out.as_deref(), detail };
    output::stdout(run.format).result(&shown).map_err(stdout_failure)?;
    if let Some(directory) = run.out.as_deref().filter(|_| run.report) {
        report_directory::write_beside(directory)?;
    }
    Ok(result_status::exit_status(specification, result))
}

/// Runs the job on worker processes of this process.
async fn run_locally(
    setup: EmbeddedSetup,
    job: NamedJob<'_>,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, CommandFailure> {
    let progress = Arc::new(AtomicU64::new(0));
    let mut embedded = Embedded::start(setup, Arc::clone(&progress)).await?;
    if let Some(url) = embedded.page_url() {
        say(&format!("live page: {url} (until the run ends)"));
    }
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
        interruption = interruption => Err(CommandFailure::Interrupted(interruption, match directory {
            Some(_) => "run the same command again to resume",
            None => "no results were saved (with --out DIR a run can be resumed)",
        })),
    };
    embedded.end().await;
    result
}

/// Runs the job on a running coordinator.
async fn run_on_coordinator(
    client: Client,
    job: NamedJob<'_>,
    directory: Option<&ResultsDirectory>,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, CommandFailure> {
    tokio::select! {
        driven = drive(client, job, directory, |_| {}) => driven,
        interruption = interruption => Err(CommandFailure::Interrupted(
            interruption,
            "a job that was accepted continues (see `osteon jobs`, `osteon cancel`)",
        )),
    }
}

/// Submits the job, follows it and fetches its results.
async fn drive(
    mut client: Client,
    NamedJob { specification, name, progress }: NamedJob<'_>,
    directory: Option<&ResultsDirectory>,
    note: impl Fn(&JobSnapshot),
) -> Result<Fetched, CommandFailure> {
    let request = match directory {
        Some(directory) => directory.request()?,
        None => RequestId::new().map_err(CommandFailure::failed)?,
    };
    let options = SubmitOptions { name: name.to_owned(), ..SubmitOptions::default() };
    let job = client.submit(specification, &request, options).await?;
    if let Some(directory) = directory {
        directory.write_job(specification)?;
    }
    let mut progress = Progress::start(specification, progress);
    client
        .watch(&job, |snapshot| {
            note(snapshot);
            // Whoever started this run has ended, and its result would be lost.
            progress.show(snapshot).map_err(|_| {
                let left = "the program that reads the progress has closed stderr";
                CommandFailure::Interrupted(Interruption::Terminated, left)
            })
        })
        .await?;
    progress.finish();
    let fetched = client.fetch(&job).await?;
    let Fetched { specification: computed, result, .. } = &fetched;
    let note = other_version::check(specification, computed, &result.program);
    if let Some(note) = note.map_err(CommandFailure::failed)? {
        say(&note);
    }
    Ok(fetched)
}
