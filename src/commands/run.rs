//! `identify` and `propagate`: a job from its file to its result.

use std::net::SocketAddr;
use std::pin::pin;

use anyhow::anyhow;
use osteon_client::client::{Client, Fetched};
use osteon_client::embedded::{EmbeddedSetup, StoreLocation};
use osteon_client::result_status;
use osteon_client::results_directory::ResultsDirectory;
use osteon_client::run::{self, JobRun};
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::results::Status;
use osteon_coordinator::service::open_files;
use osteon_files::job_file;
use osteon_files::report::{Identification, ResultFile};
use osteon_proto::v1::JobSnapshot;
use osteon_solver::Isa;

use crate::arguments::{RunArguments, VerbosityArguments};
use crate::exit_status::{CommandFailure, ExitStatus, Interruption, stdout_failure};
use crate::output::{self, Detail, ShownResult};
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::{ProcessContext, RunLocation};
use crate::progress::{Progress, ShownProgress, say};
use crate::resolved::Run;
use crate::signals;
use crate::user;
use crate::usual_shifts::{UsualShift, usual_shifts};
use crate::{cost, program, unsearched_groups, warnings};

/// Prepares an identification.
///
/// # Errors
/// When command line and environment do not say where.
pub(super) fn prepare_identification(
    arguments: RunArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    prepare(Run::resolve(JobKind::Identification, arguments, context)?)
}

/// Prepares a propagation.
///
/// # Errors
/// When command line and environment do not say where.
pub(super) fn prepare_propagation(
    arguments: RunArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    prepare(Run::resolve(JobKind::Propagation, arguments, context)?)
}

fn prepare(resolved: Run) -> Result<PreparedCommand, CommandFailure> {
    // Workers read the variable again, but an invalid value is reported here, at once.
    let isa = match resolved.location {
        RunLocation::Local { .. } => Some(ProcessContext::isa()?),
        RunLocation::Coordinator(_) => None,
    };
    Ok(PreparedCommand::new(run(resolved, isa)))
}

/// Runs the job, or shows the result of an earlier run.
async fn run(run: Run, isa: Option<Isa>) -> Ended {
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
        user::announce(remote);
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
    let program = program::current();
    let job =
        JobRun { specification, name: &run.name, directory: directory.as_ref(), program: &program };
    let fetched = run_at(location, run.page, job, shown, interruption).await?;
    let result = keep(fetched, directory.as_ref())?;
    show(&run, specification, &result)
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
                let client = user::connect(remote).await?;
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
        Some(path) => Ok(ResultsDirectory::finished(path, specification)?),
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
    fetched: Fetched,
    directory: Option<&ResultsDirectory>,
) -> Result<ResultFile, CommandFailure> {
    let missing = result_status::missing_result(&fetched);
    if let Some(directory) = directory
        && (missing.is_some() || fetched.status == Status::Cancelled)
    {
        // The same command must run the job again, not show the same ending.
        directory.forget_request();
    }
    if let Some(missing) = missing {
        return Err(CommandFailure::failed(anyhow!(missing)));
    }
    if let Some(directory) = directory {
        directory.write_results(&fetched, &*user::listener())?;
    }
    Ok(fetched.result)
}

fn show(run: &Run, specification: &JobSpecification, result: &ResultFile) -> Ended {
    let detail = match run.verbosity {
        VerbosityArguments { quiet: true, .. } => Detail::Summary,
        VerbosityArguments { verbose: true, .. } => Detail::Full,
        VerbosityArguments { .. } => Detail::Usual,
    };
    let usual_shifts = match result {
        ResultFile::Identification(found) if run.budget => shifts(specification, found)?,
        _ => Vec::new(),
    };
    let directory = run.out.as_deref();
    let shown =
        ShownResult { specification, result, usual_shifts: &usual_shifts, directory, detail };
    output::stdout(run.format).result(&shown).map_err(stdout_failure)?;
    run.report.write(run.out.as_deref())?;
    Ok(ExitStatus::of_result(specification, result))
}

/// Returns what usual errors of the setup would move at the best point; nothing if the job says how well the
/// setup is known, or has groups, whose table has no room for it.
fn shifts(
    specification: &JobSpecification,
    found: &Identification,
) -> Result<Vec<UsualShift>, CommandFailure> {
    let point = found.cost.and_then(|_| found.parameters.point(found.dispersion));
    let is_said = !specification.systematic.is_empty() || found.groups.is_some();
    match point.filter(|_| !is_said) {
        Some(point) => Ok(usual_shifts(specification, &point, ProcessContext::isa()?)),
        None => Ok(Vec::new()),
    }
}

/// Runs the job at a place until it has ended or the user interrupts it.
async fn run_at(
    location: ConnectedLocation,
    page: Option<SocketAddr>,
    job: JobRun<'_>,
    shown: ShownProgress,
    interruption: impl Future<Output = Interruption>,
) -> Result<Fetched, CommandFailure> {
    // Its time counts from the job's acceptance, not from the start of coordinator and workers.
    let mut progress: Option<Progress> = None;
    // Whoever started this run has ended, and its result would be lost.
    let show = |snapshot: &JobSnapshot| {
        let progress = progress.get_or_insert_with(|| Progress::start(job.specification, shown));
        progress.show(snapshot).map_err(|_| {
            let left = "the program that reads the progress has closed stderr";
            CommandFailure::Interrupted(Interruption::Terminated, left)
        })
    };
    match location {
        ConnectedLocation::Local { workers, threads } => {
            let left = match job.directory {
                Some(_) => "run the same command again to resume",
                None => "no results were saved (with --out DIR a run can be resumed)",
            };
            let stop = async { CommandFailure::Interrupted(interruption.await, left) };
            let setup = EmbeddedSetup {
                executable: program::executable()?,
                commit: program::COMMIT,
                store: job.directory.map_or(StoreLocation::Memory, |directory| {
                    StoreLocation::Directory(directory.store())
                }),
                workers,
                threads,
                page,
                keep_ended: None,
            };
            run::run_locally(setup, job, user::listener(), show, stop).await
        }
        ConnectedLocation::Coordinator(mut client) => tokio::select! {
            fetched = run::run(&mut client, job, show) => fetched,
            interruption = interruption => Err(CommandFailure::Interrupted(
                interruption,
                "a job that was accepted continues (see `osteon job list`, `osteon job cancel`)",
            )),
        },
    }
}
