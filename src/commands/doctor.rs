//! `doctor`: examines this machine, a directory for a store, and a coordinator.

use crate::arguments::DoctorArguments;
use crate::doctor::{self, Fitness, Patient};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::ProcessContext;
use crate::resolved::{OutputFormat, format};

/// Prepares the examination.
///
/// # Errors
/// When an environment variable has an invalid value.
pub(super) fn prepare(
    arguments: DoctorArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let DoctorArguments { store, client, json } = arguments;
    let named = client.coordinator.is_some() || context.environment.coordinator()?.is_some();
    let coordinator = named.then(|| context.remote(client)).transpose()?;
    let patient = Patient { store, coordinator, isa: ProcessContext::isa()? };
    Ok(PreparedCommand::harmless(examine(patient, format(json))))
}

/// Prints what was found; fails if there is a problem.
async fn examine(patient: Patient, format: OutputFormat) -> Ended {
    let diagnoses = doctor::examine(patient).await;
    output::stdout(format).diagnoses(&diagnoses).map_err(stdout_failure)?;
    Ok(match doctor::worst(&diagnoses) {
        Fitness::Good | Fitness::Warning => ExitStatus::Done,
        Fitness::Problem => ExitStatus::RunFailed,
    })
}
