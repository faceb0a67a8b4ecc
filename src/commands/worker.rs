//! `worker`: computes for a coordinator until it is told to leave.

use osteon_proto::credentials::{CredentialFiles, Credentials};
use osteon_worker::WorkerConfig;

use crate::ending::{Ending, Failure};
use crate::signals;

/// Serves until a signal, the time limit, or a reason to give up.
pub(super) async fn serve(
    config: WorkerConfig,
    files: &CredentialFiles,
) -> Result<Ending, Failure> {
    let credentials = Credentials::load(files, &config.endpoint).map_err(Failure::bad_input)?;
    let config = WorkerConfig { credentials, ..config };
    let interruption = signals::interruption()?;
    let interruption = async {
        interruption.await;
    };
    osteon_worker::run(config, interruption).await.map_err(Failure::failed)?;
    Ok(Ending::Done)
}
