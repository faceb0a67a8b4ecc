//! `workers slurm`: submits workers as long as jobs wait for them.

use osteon_slurm::follow::{LookError, ScalingPlan};

use crate::exit_status::{CommandFailure, ExitStatus};
use crate::user;

use super::slurm::{check_workers, print};

/// Looks and acts until it is interrupted, or once with `--dry-run`.
pub(super) async fn follow(
    plan: &ScalingPlan,
    dry_run: bool,
) -> Result<ExitStatus, CommandFailure> {
    check_workers(&plan.script)?;
    if dry_run {
        let decision = plan.decide(&user::listener()).await.map_err(failure)?;
        return print(&plan.describe(&decision).map_err(CommandFailure::bad_input)?);
    }
    plan.follow(&user::listener()).await.map_err(failure)?;
    Ok(ExitStatus::Done)
}

fn failure(error: LookError) -> CommandFailure {
    match error {
        LookError::Slurm(error) => CommandFailure::failed(error),
        LookError::Coordinator(error) => error.into(),
    }
}
