//! `slurm script` and `slurm array`, which print batch scripts; `worker slurm`, which submits workers as
//! long as jobs wait for them.

mod arguments;
mod resolved;

use osteon_client::results_directory::ResultsDirectory;
use osteon_files::job_file;
use osteon_slurm::follow::{LookError, ScalingPlan};
use osteon_slurm::job_script::JobScript;
use osteon_slurm::worker_script::WorkerScript;
use osteon_transport::credentials::Credentials;
use osteon_transport::endpoint::Endpoint;

use self::arguments::{SlurmCommand, WorkerArrayArguments};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::ProcessContext;
use crate::progress::say;
use crate::resolved::OutputFormat;
use crate::user;

pub(super) use self::arguments::{ScalingArguments, SlurmArguments};

/// Name of array workers in Slurm's queue.
const ARRAY_NAME: &str = "osteon-worker";

/// Prepares the printing of a script.
///
/// # Errors
/// When the arguments contradict each other, or the environment does not say enough.
pub(super) fn prepare(
    arguments: SlurmArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    Ok(match arguments.command {
        SlurmCommand::Script(arguments) => {
            let script = resolved::job_script(arguments)?;
            PreparedCommand::brief(move || job(&script))
        }
        SlurmCommand::Array(WorkerArrayArguments { count, client, allocation }) => {
            let script = resolved::worker_script(allocation, &context.remote(client)?)?;
            PreparedCommand::brief(move || array(&script, count))
        }
    })
}

/// Prepares `worker slurm`.
///
/// # Errors
/// When the arguments contradict each other, or the environment does not say enough.
pub(super) fn prepare_scaling(
    arguments: ScalingArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let dry_run = arguments.dry_run;
    let plan = resolved::scaling_plan(arguments, context)?;
    let left = "workers that wait or run stay, and end when they have had no work for a while";
    Ok(PreparedCommand::interruptible(left, follow(plan, dry_run)).with_events())
}

/// `slurm script`: checks the job file, and prints the script.
fn job(script: &JobScript) -> Ended {
    // Errors are told here, and not by a job that has waited for its nodes.
    let specification =
        job_file::read(&script.job, script.kind).map_err(CommandFailure::bad_input)?;
    ResultsDirectory::stored(&script.out, &specification)?;
    print(&script.text().map_err(CommandFailure::bad_input)?)
}

/// `slurm array`: prints the script.
fn array(script: &WorkerScript, count: u32) -> Ended {
    check_workers(script)?;
    print(&script.text(ARRAY_NAME, count, false).map_err(CommandFailure::bad_input)?)
}

/// `worker slurm`: looks and acts until it is interrupted, or once with `--dry-run`.
async fn follow(plan: ScalingPlan, dry_run: bool) -> Ended {
    check_workers(&plan.script)?;
    if dry_run {
        let decision = plan.decide(&user::listener()).await.map_err(look_failure)?;
        return print(&plan.describe(&decision).map_err(CommandFailure::bad_input)?);
    }
    plan.follow(&user::listener()).await.map_err(look_failure)?;
    Ok(ExitStatus::Done)
}

fn look_failure(error: LookError) -> CommandFailure {
    match error {
        LookError::Slurm(error) => CommandFailure::failed(error),
        LookError::Coordinator(error) => error.into(),
    }
}

/// Checks what the workers will need: the files, and an address that other machines can reach.
fn check_workers(script: &WorkerScript) -> Result<(), CommandFailure> {
    Credentials::load(&script.files, &script.endpoint).map_err(CommandFailure::bad_input)?;
    if script.endpoint.is_local() || matches!(script.endpoint, Endpoint::Unix(_)) {
        say(&format!(
            "warning: workers on other machines cannot reach {}; start the coordinator on an address \
             of the network (docs/network.md)",
            script.endpoint
        ));
    }
    Ok(())
}

fn print(text: &str) -> Ended {
    output::stdout(OutputFormat::Text).verbatim(text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
