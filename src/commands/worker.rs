//! `worker`: computes for a coordinator until it is told to leave.

use osteon_worker::WorkerConfig;

use crate::ending::{Ending, Failure};
use crate::signals;

/// Serves until a signal, the time limit, or a reason to give up.
pub(super) async fn serve(config: WorkerConfig) -> Result<Ending, Failure> {
    let interruption = signals::interruption()?;
    osteon_worker::run(config, interruption).await.map_err(Failure::failed)?;
    Ok(Ending::Done)
}
