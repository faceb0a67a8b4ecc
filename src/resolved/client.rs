//! The commands of clients of a coordinator, resolved.

use std::time::Duration;

use osteon_client::client::{Remote, SubmitOptions};
use osteon_client::request_id::RequestId;
use osteon_common::job::JobKind;

use super::{Resolved, format, slurm};
use crate::arguments::{
    BackupArguments, ClientArguments, ExplainArguments, FetchArguments, HealthArguments,
    JobArguments, JobCommand, JobListArguments, PruneArguments, SubmitArguments, WatchArguments,
    WorkersArguments, WorkersCommand,
};
use crate::exit_status::CommandFailure;

/// Finds the coordinator that the arguments or the environment name.
pub(super) trait FindCoordinator:
    Fn(ClientArguments) -> Result<Remote, CommandFailure>
{
}

impl<F: Fn(ClientArguments) -> Result<Remote, CommandFailure>> FindCoordinator for F {}

/// Resolves a command about jobs.
pub(super) fn job(
    command: JobCommand,
    remote: impl FindCoordinator,
) -> Result<Resolved, CommandFailure> {
    Ok(match command {
        JobCommand::Submit(arguments) => submit(arguments, remote)?,
        JobCommand::List(JobListArguments { client, json }) => {
            Resolved::Jobs { coordinator: remote(client)?, format: format(json) }
        }
        JobCommand::Watch(WatchArguments { job, json }) => {
            Resolved::Watch { job: job.job, coordinator: remote(job.client)?, format: format(json) }
        }
        JobCommand::Explain(ExplainArguments { job, client, json }) => {
            Resolved::Explain { job, coordinator: remote(client)?, format: format(json) }
        }
        JobCommand::Cancel(JobArguments { job, client }) => {
            Resolved::Cancel { job, coordinator: remote(client)? }
        }
        JobCommand::Fetch(FetchArguments { job, client, out }) => {
            Resolved::Fetch { job, coordinator: remote(client)?, out }
        }
        JobCommand::Recheck(WatchArguments { job, json }) => Resolved::Recheck {
            job: job.job,
            coordinator: remote(job.client)?,
            format: format(json),
        },
        JobCommand::Prune(PruneArguments { client, older_than, keep_last, json }) => {
            Resolved::Prune {
                older_than,
                keep_last,
                coordinator: remote(client)?,
                format: format(json),
            }
        }
    })
}

fn submit(
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
