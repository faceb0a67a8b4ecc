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

use self::resolved::SlurmTask;
use super::{Performance, ResolvedWing, WingCommand};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::process_context::ProcessContext;
use crate::progress::say;
use crate::resolved::OutputFormat;
use crate::user;

pub(super) use self::arguments::{ScalingArguments, SlurmArguments};

/// Name of array workers in Slurm's queue.
const ARRAY_NAME: &str = "osteon-worker";

/// Resolves `slurm` and its subcommands.
pub(super) fn resolve(arguments: SlurmArguments, context: &ProcessContext) -> ResolvedWing {
    Ok(Box::new(resolved::scripts(arguments, context)?))
}

/// Resolves `worker slurm`.
pub(super) fn resolve_scaling(
    arguments: ScalingArguments,
    context: &ProcessContext,
) -> ResolvedWing {
    Ok(Box::new(resolved::scaling(arguments, context)?))
}

impl WingCommand for SlurmTask {
    fn default_log_level(&self) -> &'static str {
        match self {
            Self::Follow { .. } => "info",
            Self::Job(_) | Self::Array { .. } => "warn",
        }
    }

    fn left_by_interruption(&self) -> Option<&'static str> {
        match self {
            Self::Follow { .. } => Some(
                "workers that wait or run stay, and end when they have had no work for a while",
            ),
            Self::Job(_) | Self::Array { .. } => None,
        }
    }

    fn perform(self: Box<Self>) -> Performance {
        Box::pin(async move {
            match *self {
                Self::Job(script) => job(&script),
                Self::Array { script, count } => array(&script, count),
                Self::Follow { plan, dry_run } => follow(&plan, dry_run).await,
            }
        })
    }
}

/// `slurm script`: checks the job file, and prints the script.
fn job(script: &JobScript) -> Result<ExitStatus, CommandFailure> {
    // Errors are told here, and not by a job that has waited for its nodes.
    let specification =
        job_file::read(&script.job, script.kind).map_err(CommandFailure::bad_input)?;
    ResultsDirectory::stored(&script.out, &specification)?;
    print(&script.text().map_err(CommandFailure::bad_input)?)
}

/// `slurm array`: prints the script.
fn array(script: &WorkerScript, count: u32) -> Result<ExitStatus, CommandFailure> {
    check_workers(script)?;
    print(&script.text(ARRAY_NAME, count, false).map_err(CommandFailure::bad_input)?)
}

/// `worker slurm`: looks and acts until it is interrupted, or once with `--dry-run`.
async fn follow(plan: &ScalingPlan, dry_run: bool) -> Result<ExitStatus, CommandFailure> {
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

fn print(text: &str) -> Result<ExitStatus, CommandFailure> {
    output::stdout(OutputFormat::Text).verbatim(text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
