//! `worker`: computes for a coordinator until it is asked to leave.

use anyhow::anyhow;
use osteon_client::environment::Unused;
use osteon_transport::credentials::{CredentialFiles, Credentials, CredentialsError};
use osteon_worker::{WorkerConfig, WorkerError};
use tonic::Code;

use crate::exit_status::{CommandFailure, ExitStatus};
use crate::signals;
use crate::telemetry;

/// Serves until a signal, the time limit, or an error.
pub(super) async fn serve(
    config: WorkerConfig,
    files: &CredentialFiles,
    unused: &Unused,
) -> Result<ExitStatus, CommandFailure> {
    let credentials = Credentials::load(files, &config.endpoint).map_err(|error| {
        let of_trust = matches!(error, CredentialsError::NoAuthority { .. });
        CommandFailure::BadInput(noted(error.into(), of_trust, unused))
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
        CommandFailure::Failed(noted(error.into(), of_trust, unused))
    })?;
    Ok(ExitStatus::Done)
}

/// Returns the error, with the unused environment variables if they may be its reason.
fn noted(error: anyhow::Error, of_trust: bool, unused: &Unused) -> anyhow::Error {
    if of_trust && !unused.is_empty() { anyhow!("{error}; {unused}") } else { error }
}
