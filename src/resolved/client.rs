//! The commands of clients of a coordinator, resolved.

use std::time::Duration;

use osteon_client::client::{Remote, SubmitOptions};
use osteon_client::request_id::RequestId;
use osteon_common::job::JobKind;

use super::{Resolved, format, slurm};
use crate::arguments::{
    BackupArguments, ClientArguments, ExplainArguments, FetchArguments, HealthArguments,
    JobArguments, JobsArguments, JobsCommand, SubmitArguments, WatchArguments, WorkersArguments,
    WorkersCommand,
};
use crate::exit_status::CommandFailure;

/// Finds the coordinator that the arguments or the environment name.
pub(super) trait FindCoordinator:
    Fn(ClientArguments) -> Result<Remote, CommandFailure>
{
}

impl<F: Fn(ClientArguments) -> Result<Remote, CommandFailure>> FindCoordinator for F {}

/// Resolves `submit`.
pub(super) fn submit(
    arguments: SubmitArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    let SubmitArguments { job, client, propagate, request_id, name, priority, json } = arguments;
    Ok(Resolved::Submit {
        job,
        kind: if propagate { JobKind::Propagation } else { JobKind::Identification },
        request: request_id
            .map_or_else(RequestId::new, |id| Ok(RequestId::with_id(id)))
            .map_err(CommandFailure::failed)?,
        options: SubmitOptions { priority, name: name.unwrap_or_default() },
        coordinator: remote(client)?,
        format: format(json),
    })
}

/// Resolves `jobs` and its subcommands.
pub(super) fn jobs(
    arguments: JobsArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    let JobsArguments { command, client, json } = arguments;
    Ok(match command {
        None => Resolved::Jobs { coordinator: remote(client)?, format: format(json) },
        Some(JobsCommand::Prune(prune)) => Resolved::Prune {
            older_than: prune.older_than,
            keep_last: prune.keep_last,
            coordinator: remote(prune.client.or(client))?,
            format: format(json || prune.json),
        },
    })
}

/// Resolves `workers` and its subcommands.
pub(super) fn workers(
    arguments: WorkersArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    let WorkersArguments { command, client, json } = arguments;
    Ok(match command {
        None => Resolved::Workers { coordinator: remote(client)?, format: format(json) },
        Some(WorkersCommand::Drain(drain)) => Resolved::DrainWorker {
            worker: drain.worker,
            coordinator: remote(drain.client.or(client))?,
            format: format(json || drain.json),
        },
        Some(WorkersCommand::Unban(unban)) => {
            Resolved::Unban { host: unban.host, coordinator: remote(unban.client.or(client))? }
        }
        Some(WorkersCommand::Slurm(scaling)) => {
            let coordinator = remote(scaling.client.clone().or(client))?;
            slurm::scaling(*scaling, coordinator)?
        }
    })
}

/// Resolves `health`.
pub(super) fn health(
    arguments: HealthArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Health {
        coordinator: remote(arguments.client)?,
        limit: Duration::from_secs_f64(arguments.timeout),
        format: format(arguments.json),
    })
}

/// Resolves `backup`.
pub(super) fn backup(
    arguments: BackupArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Backup {
        directory: arguments.directory,
        coordinator: remote(arguments.client)?,
        format: format(arguments.json),
    })
}

/// Resolves `watch`.
pub(super) fn watch(
    arguments: WatchArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    let WatchArguments { job, json } = arguments;
    Ok(Resolved::Watch { job: job.job, coordinator: remote(job.client)?, format: format(json) })
}

/// Resolves `explain`.
pub(super) fn explain(
    arguments: ExplainArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Explain {
        job: arguments.job,
        coordinator: remote(arguments.client)?,
        format: format(arguments.json),
    })
}

/// Resolves `recheck`.
pub(super) fn recheck(
    arguments: WatchArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Recheck {
        job: arguments.job.job,
        coordinator: remote(arguments.job.client)?,
        format: format(arguments.json),
    })
}

/// Resolves `cancel`.
pub(super) fn cancel(
    arguments: JobArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Cancel { job: arguments.job, coordinator: remote(arguments.client)? })
}

/// Resolves `fetch`.
pub(super) fn fetch(
    arguments: FetchArguments,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(Resolved::Fetch {
        job: arguments.job,
        coordinator: remote(arguments.client)?,
        out: arguments.out,
    })
}
