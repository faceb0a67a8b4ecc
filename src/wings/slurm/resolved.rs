//! The commands about Slurm, resolved.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use osteon_client::client::Remote;
use osteon_common::job::JobKind;
use osteon_slurm::follow::ScalingPlan;
use osteon_slurm::job_script::JobScript;
use osteon_slurm::scaling::ScalingPolicy;
use osteon_slurm::worker_script::{MARGIN, WorkerScript};
use osteon_transport::credentials::CredentialFiles;
use osteon_transport::endpoint::Endpoint;

use super::arguments::{AllocationArguments, JobScriptArguments, ScalingArguments};
use crate::exit_status::CommandFailure;
use crate::process_context::ProcessContext;

/// Returns what `worker slurm` follows, and how.
pub(super) fn scaling_plan(
    arguments: ScalingArguments,
    context: &ProcessContext,
) -> Result<ScalingPlan, CommandFailure> {
    let ScalingArguments { min, max, backlog, interval, .. } = arguments;
    let coordinator = context.remote(arguments.client)?;
    if min > max {
        return Err(CommandFailure::bad_input(anyhow!(
            "--min {min} must not be larger than --max {max}"
        )));
    }
    let script = worker_script(arguments.allocation, &coordinator)?;
    let policy = ScalingPolicy {
        min,
        max,
        backlog,
        threads_per_worker: script.cpus,
        idle_timeout: script.idle_timeout,
    };
    Ok(ScalingPlan {
        script,
        policy,
        realizations_per_thread: arguments.realizations_per_thread,
        interval: Duration::from_secs(interval.into()),
        coordinator,
    })
}

/// Returns the script of a job.
pub(super) fn job_script(arguments: JobScriptArguments) -> Result<JobScript, CommandFailure> {
    let JobScriptArguments { job, time_limit, stop_before, .. } = arguments;
    if let Some(limit) = time_limit
        && limit < Duration::from_secs(2 * u64::from(stop_before))
    {
        return Err(CommandFailure::bad_input(anyhow!(
            "--time-limit must be at least {} s, twice --stop-before; it is {} s",
            2 * stop_before,
            limit.as_secs_f64()
        )));
    }
    let stem = job.file_stem().and_then(|stem| stem.to_str()).unwrap_or("osteon").to_owned();
    let kind = if arguments.propagate { JobKind::Propagation } else { JobKind::Identification };
    Ok(JobScript {
        program: program(arguments.program)?,
        store: arguments.store.unwrap_or_else(|| PathBuf::from(format!("{stem}-store"))),
        out: arguments.out.unwrap_or_else(|| PathBuf::from(&stem)),
        name: arguments.name.unwrap_or(stem),
        job,
        kind,
        nodes: arguments.nodes,
        cpus_per_node: arguments.cpus_per_node,
        time_limit,
        partition: arguments.partition,
        max_requeues: arguments.max_requeues,
        stop_before_s: stop_before,
        further: arguments.further,
    })
}

/// Returns the script of a worker.
pub(super) fn worker_script(
    arguments: AllocationArguments,
    coordinator: &Remote,
) -> Result<WorkerScript, CommandFailure> {
    let AllocationArguments { cpus_per_worker, time_limit, stagger, idle_timeout, .. } = arguments;
    let stagger = stagger.unwrap_or(time_limit / 10);
    if stagger > time_limit / 2 {
        return Err(CommandFailure::bad_input(anyhow!(
            "--stagger must be at most half of --time-limit, {} s; it is {} s",
            time_limit.as_secs_f64() / 2.0,
            stagger.as_secs_f64()
        )));
    }
    Ok(WorkerScript {
        program: program(arguments.program)?,
        endpoint: coordinator.endpoint.clone(),
        files: files_of_workers(coordinator)?,
        cpus: cpus_per_worker,
        time_limit,
        // What is left for work is never negative.
        stagger: stagger.min(time_limit.saturating_sub(MARGIN) / 2),
        idle_timeout,
        partition: arguments.partition,
        further: arguments.further,
    })
}

/// Returns the files that workers need: certificates over TLS, otherwise the token. So the token of
/// a client does not become known to workers.
fn files_of_workers(coordinator: &Remote) -> Result<CredentialFiles, CommandFailure> {
    let CredentialFiles { ca, certificate, key, token } = coordinator.files.clone();
    let Endpoint::Https(_) = &coordinator.endpoint else {
        return Ok(CredentialFiles { token, ..CredentialFiles::default() });
    };
    if ca.is_none() || certificate.is_none() || key.is_none() {
        return Err(CommandFailure::bad_input(anyhow!(
            "workers of {} need a certificate: give --tls-ca FILE, --tls-cert FILE and --tls-key FILE \
             (or OSTEON_TLS_CA, OSTEON_TLS_CERT and OSTEON_TLS_KEY), for example ca.pem, worker.pem and \
             worker-key.pem of `osteon certs`",
            coordinator.endpoint
        )));
    }
    Ok(CredentialFiles { ca, certificate, key, token: None })
}

/// Returns the program for the nodes: the one given, or this one.
fn program(given: Option<PathBuf>) -> Result<PathBuf, CommandFailure> {
    match given {
        // A name without a directory is not searched for: the nodes may have another PATH.
        Some(program) if program.components().count() == 1 && !Path::new(&program).exists() => {
            Err(CommandFailure::bad_input(anyhow!(
                "--program {} does not exist here; give its path, as the nodes see it",
                program.display()
            )))
        }
        Some(program) => Ok(program),
        None => std::env::current_exe()
            .context("cannot find out where this program is; give --program FILE")
            .map_err(CommandFailure::Failed),
    }
}
