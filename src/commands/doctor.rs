//! `doctor`: examines this machine, a directory for a store, and a coordinator.

use crate::doctor::{self, Fitness, Patient};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::resolved::OutputFormat;

/// Prints what was found; fails if there is a problem.
pub(super) async fn examine(
    patient: Patient,
    format: OutputFormat,
) -> Result<ExitStatus, CommandFailure> {
    let diagnoses = doctor::examine(patient).await;
    output::stdout(format).diagnoses(&diagnoses).map_err(stdout_failure)?;
    Ok(match doctor::worst(&diagnoses) {
        Fitness::Good | Fitness::Warning => ExitStatus::Done,
        Fitness::Problem => ExitStatus::RunFailed,
    })
}
