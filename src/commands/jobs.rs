//! `osteon job …`: requests to a running coordinator.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use osteon_client::client::{self, ClientError, Fetched, Remote, SubmitOptions};
use osteon_client::request_id::RequestId;
use osteon_client::result_status;
use osteon_client::results_directory::ResultsDirectory;
use osteon_common::job::JobKind;
use osteon_common::results::Status;
use osteon_common::visible;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_proto::v1::JobSnapshot;
use tonic::Code;

use crate::arguments::{
    ExplainArguments, FetchArguments, JobArguments, JobCommand, JobListArguments, PruneArguments,
    SubmitArguments, WatchArguments,
};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::ProcessContext;
use crate::progress::say;
use crate::resolved::{OutputFormat, format};
use crate::user;
use crate::{unsearched_groups, warnings};

/// Shortest time between two lines of `watch`.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// Prepares a command about jobs.
///
/// # Errors
/// When neither command line nor environment names a coordinator.
pub(super) fn prepare(
    command: JobCommand,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let remote = |client| context.remote(client);
    Ok(match command {
        JobCommand::Submit(arguments) => {
            let coordinator = remote(arguments.client.clone())?;
            let if_interrupted = "the job may have been accepted (see `osteon job list`)";
            PreparedCommand::interruptible(if_interrupted, submit(arguments, coordinator))
        }
        JobCommand::List(JobListArguments { client, json }) => {
            PreparedCommand::harmless(list(remote(client)?, format(json)))
        }
        JobCommand::Watch(WatchArguments { job: JobArguments { job, client }, json }) => {
            let if_interrupted = "the job continues (see `osteon job list`, `osteon job cancel`)";
            PreparedCommand::interruptible(
                if_interrupted,
                watch(job, remote(client)?, format(json)),
            )
        }
        JobCommand::Explain(ExplainArguments { job, client, json }) => {
            PreparedCommand::harmless(explain(job, remote(client)?, format(json)))
        }
        JobCommand::Cancel(JobArguments { job, client }) => {
            let if_interrupted = "the job may have been cancelled (see `osteon job list`)";
            PreparedCommand::interruptible(if_interrupted, cancel(job, remote(client)?))
        }
        JobCommand::Fetch(FetchArguments { job, client, out }) => {
            let if_interrupted = "run the same command again to fetch the results";
            PreparedCommand::interruptible(if_interrupted, fetch(job, remote(client)?, out))
        }
        JobCommand::Recheck(WatchArguments { job: JobArguments { job, client }, json }) => {
            let if_interrupted = "the job may be computed again (see `osteon job list`)";
            PreparedCommand::interruptible(
                if_interrupted,
                recheck(job, remote(client)?, format(json)),
            )
        }
        JobCommand::Prune(arguments) => {
            let coordinator = remote(arguments.client.clone())?;
            let if_interrupted = "jobs may have been deleted (see `osteon job list`)";
            PreparedCommand::interruptible(if_interrupted, prune(arguments, coordinator))
        }
    })
}

/// `submit`: prints the job's id.
async fn submit(arguments: SubmitArguments, coordinator: Remote) -> Ended {
    let SubmitArguments { job, propagate, request_id, name, priority, json, .. } = arguments;
    let request = match request_id {
        None => RequestId::new().map_err(CommandFailure::failed)?,
        Some(id) => RequestId::with_id(id),
    };
    let kind = if propagate { JobKind::Propagation } else { JobKind::Identification };
    let input = job.open().map_err(CommandFailure::bad_input)?;
    let noted = job_file::of_input(&input, kind).map_err(CommandFailure::bad_input)?;
    unsearched_groups::warn(input.path(), &noted);
    warnings::say_of_job(&noted.specification, &noted.warnings).await;
    let mut client = user::connect(&coordinator).await?;
    let options = SubmitOptions { priority, name: name.unwrap_or_default() };
    let id = client.submit(&noted.specification, &request, options).await?;
    output::stdout(format(json)).submitted(&id).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `list`: prints all jobs, and the workers that are banned.
async fn list(coordinator: Remote, format: OutputFormat) -> Ended {
    let mut client = user::connect(&coordinator).await?;
    let (jobs, concerns) = client.list_with_concerns().await?;
    let banned = client.banned().await?;
    output::stdout(format).jobs(&jobs, &banned).map_err(stdout_failure)?;
    for concern in concerns {
        say(&format!("the coordinator: {}", visible::line(&concern)));
    }
    Ok(ExitStatus::Done)
}

/// `prune`: prints the ids of the deleted jobs.
async fn prune(arguments: PruneArguments, coordinator: Remote) -> Ended {
    let PruneArguments { older_than, keep_last, json, .. } = arguments;
    let jobs = user::connect(&coordinator).await?.prune(older_than, keep_last).await?;
    output::stdout(format(json)).pruned(&jobs).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `watch`: prints a line when the job changes, at most one a second, until it has ended.
async fn watch(job: String, coordinator: Remote, format: OutputFormat) -> Ended {
    user::announce(&coordinator);
    let mut client = user::connect(&coordinator).await?;
    let mut output = output::stdout(format);
    let mut last_line: Option<Instant> = None;
    let show = |snapshot: &JobSnapshot| {
        let due = last_line.is_none_or(|last| last.elapsed() >= LINE_INTERVAL);
        if !due && client::job_status(snapshot).is_none() {
            return Ok(());
        }
        last_line = Some(Instant::now());
        output.snapshot(snapshot).map_err(stdout_failure)
    };
    let last = client.watch(&job, show).await?;
    Ok(exit_status(&last))
}

/// `recheck`: computes a job again that a banned host contributed to, and follows it to its end, which says
/// whether its result has changed.
async fn recheck(job: String, coordinator: Remote, format: OutputFormat) -> Ended {
    user::connect(&coordinator).await?.recheck(&job).await?;
    watch(job, coordinator, format).await
}

/// `explain`: prints what decides how fast a job is.
async fn explain(job: String, coordinator: Remote, format: OutputFormat) -> Ended {
    let explained = user::connect(&coordinator).await?.explain(&job).await?;
    output::stdout(format).explanation(&explained).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `cancel`: prints the job's state afterwards.
async fn cancel(job: String, coordinator: Remote) -> Ended {
    let snapshot = user::connect(&coordinator).await?.cancel(&job).await?;
    output::stdout(OutputFormat::Text).snapshot(&snapshot).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// `fetch`: writes the results of an ended job. Nothing is written while it has not ended.
async fn fetch(job: String, coordinator: Remote, out: PathBuf) -> Ended {
    let fetched =
        user::connect(&coordinator).await?.fetch(&job).await.map_err(|error| match &error {
            ClientError::Refused { code: Code::FailedPrecondition, reason, .. } => {
                CommandFailure::failed(anyhow!(
                    "{reason}; wait for it with `osteon job watch {job}`"
                ))
            }
            _ => CommandFailure::from(error),
        })?;
    if let Some(missing) = result_status::missing_result(&fetched) {
        return Err(CommandFailure::failed(anyhow!("job {job}: {missing}")));
    }
    let specification = &fetched.specification;
    // Checked before anything is created there, and again when the directory is locked.
    ResultsDirectory::stored(&out, specification)?;
    let directory = ResultsDirectory::open(&out)?;
    let stored = ResultsDirectory::stored(&out, specification)?;
    let wanted = match stored {
        Some(stored) => replaces(&fetched, &stored, &out)?,
        None => true,
    };
    if wanted {
        directory.write_results(&fetched, &*user::listener())?;
    }
    let line = format!("{}\n", visible::path(&out));
    output::stdout(OutputFormat::Text).verbatim(&line).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Returns whether the fetched result replaces the one stored in `out`: if only what is known of its
/// integrity differs, if it is the stored result computed again without a banned host, if the stored run was
/// cancelled, or if that failed and the fetched one was not cancelled.
///
/// # Errors
/// If `out` has another result that is not replaced.
fn replaces(fetched: &Fetched, stored: &ResultFile, out: &Path) -> Result<bool, CommandFailure> {
    let specification = &fetched.specification;
    let new = &fetched.result;
    // The digest covers everything that was computed; the program's version may differ.
    if (stored.status(), stored.digest()) == (new.status(), new.digest()) {
        return Ok(new.integrity() != stored.integrity());
    }
    // It was computed again without a host that was banned.
    let earlier = new.integrity().and_then(|it| it.earlier_digest.as_deref());
    if earlier == Some(stored.digest()) {
        return Ok(true);
    }
    let incomplete = !result_status::is_complete(specification, stored);
    if incomplete && !result_status::is_cancelled(new) || result_status::is_cancelled(stored) {
        return Ok(true);
    }
    let shown = |result: &ResultFile| {
        let status = result.status().map_or("", Status::name);
        format!("{status} digest {}", result.digest()).trim_start().to_owned()
    };
    Err(CommandFailure::bad_input(anyhow!(
        "{} holds another result of this job ({} there, {} fetched); choose another --out directory",
        out.display(),
        shown(stored),
        shown(new)
    )))
}

fn exit_status(snapshot: &JobSnapshot) -> ExitStatus {
    match client::job_status(snapshot) {
        Some(status) if status.is_complete() => ExitStatus::Done,
        _ => ExitStatus::RunFailed,
    }
}
