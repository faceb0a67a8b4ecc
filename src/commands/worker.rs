//! `worker`: computes for a coordinator until it is asked to leave.

use std::time::Duration;

use anyhow::anyhow;
use osteon_client::environment::Unused;
use osteon_transport::credentials::{CredentialFiles, Credentials, CredentialsError};
use osteon_worker::{WorkerConfig, WorkerError};
use tonic::Code;

use crate::arguments::WorkerArguments;
use crate::exit_status::{CommandFailure, ExitStatus};
use crate::prepared_command::{Ended, PreparedCommand};
use crate::process_context::ProcessContext;
use crate::signals;
use crate::telemetry;

/// Prepares a worker.
///
/// # Errors
/// When neither command line nor environment names a coordinator.
pub(super) fn prepare(
    arguments: WorkerArguments,
    context: &ProcessContext,
) -> Result<PreparedCommand, CommandFailure> {
    let environment = &context.environment;
    let isa = ProcessContext::isa()?;
    let endpoint = environment.required_coordinator(arguments.coordinator)?;
    let (files, unused) = environment.files(arguments.credentials.into(), &endpoint);
    let config = WorkerConfig {
        spans: None,
        endpoint,
        credentials: Credentials::default(),
        host: arguments.host.or_else(|| environment.host()),
        threads: arguments.threads.unwrap_or(context.cores),
        isa,
        give_up_after: arguments.give_up_after.map(Duration::from_secs_f64),
        time_limit: arguments.time_limit.map(Duration::from_secs_f64),
        idle_timeout: arguments.idle_timeout.map(Duration::from_secs_f64),
    };
    Ok(PreparedCommand::service(
        "osteon-worker",
        arguments.log_format,
        serve(config, files, unused),
    ))
}

/// Serves until a signal, the time limit, or an error.
async fn serve(config: WorkerConfig, files: CredentialFiles, unused: Unused) -> Ended {
    let credentials = Credentials::load(&files, &config.endpoint).map_err(|error| {
        let of_trust = matches!(error, CredentialsError::NoAuthority { .. });
        CommandFailure::BadInput(noted(error.into(), of_trust, &unused))
    })?;
    let config = WorkerConfig { credentials, spans: telemetry::recorder(), ..config };
    let interruption = signals::interruption()?;
    let interruption = async {
        interruption.await;
    };
    osteon_worker::run(config, interruption).await.map_err(|error| {
        let of_trust = matches!(
            error,
            WorkerError::Distrust { .. } | WorkerError::Refused { code: Code::Unauthenticated, .. }
        );
        if error.is_about_the_machine() {
            return CommandFailure::BadMachine(error.into());
        }
        CommandFailure::Failed(noted(error.into(), of_trust, &unused))
    })?;
    Ok(ExitStatus::Done)
}

/// Returns the error, with the unused environment variables if they may be its reason.
fn noted(error: anyhow::Error, of_trust: bool, unused: &Unused) -> anyhow::Error {
    if of_trust && !unused.is_empty() { anyhow!("{error}; {unused}") } else { error }
}
