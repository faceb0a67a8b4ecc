//! Follows the queue of a coordinator's jobs: submits workers as long as jobs wait for them.
//!
//! What to do is decided in [`crate::scaling`]; this file looks, and does it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use osteon_client::client::{Client, ClientError, Remote};
use osteon_client::listener::RunListener;
use osteon_proto::v1::JobState;
use thiserror::Error;
use tokio::time::sleep;
use tracing::{info, warn};

use crate::SlurmError;
use crate::programs;
use crate::queue::{LASTING, QueuedWorker};
use crate::scaling::{self, Decision, QueueObservation, Scaling, ScalingAction, ScalingPolicy};
use crate::worker_script::WorkerScript;

/// Which workers are submitted, for which coordinator, and how often that is decided.
#[derive(Debug)]
pub struct ScalingPlan {
    /// The script of the workers.
    pub script: WorkerScript,
    /// The limits.
    pub policy: ScalingPolicy,
    /// Number of realizations of an evaluation that make a thread worth while.
    pub realizations_per_thread: u32,
    /// Time between two decisions.
    pub interval: Duration,
    /// The coordinator.
    pub coordinator: Remote,
}

/// Error when a queue cannot be looked at.
#[derive(Debug, Error)]
pub enum LookError {
    /// Slurm does not tell its queue.
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    /// The coordinator does not tell its jobs.
    #[error(transparent)]
    Coordinator(#[from] ClientError),
}

impl ScalingPlan {
    /// Looks and acts until the future is dropped.
    ///
    /// # Errors
    /// If the first look fails: what cannot be reached at the start is a mistake, later it may come back.
    pub async fn follow(&self, listener: &Arc<dyn RunListener>) -> Result<(), LookError> {
        let names = Names::for_coordinator(&self.coordinator);
        let (mut scaling, begun) = (Scaling::default(), Instant::now());
        let mut told = String::new();
        let mut first = true;
        loop {
            match self.look(&names, begun, listener).await {
                Ok(seen) => {
                    let decision = scaling.decide(&self.policy, &seen);
                    // Repeated only when it is another.
                    if decision.reason != told {
                        info!("{}", decision.reason);
                        told = decision.reason;
                    }
                    for action in decision.actions {
                        if let Err(error) = self.act(&names, &action).await {
                            warn!(reason = %error, "Slurm refuses");
                            scaling.refused(begun.elapsed(), &error.to_string());
                        }
                    }
                }
                Err(failure) if first => return Err(failure),
                Err(failure) => {
                    let reason = failure.to_string();
                    if reason != told {
                        warn!(reason, "cannot look now; trying again");
                        told = reason;
                    }
                }
            }
            first = false;
            sleep(self.interval).await;
        }
    }

    /// Looks once, and returns what would be done now.
    ///
    /// # Errors
    /// If the queue cannot be looked at.
    pub async fn decide(&self, listener: &Arc<dyn RunListener>) -> Result<Decision, LookError> {
        let names = Names::for_coordinator(&self.coordinator);
        let seen = self.look(&names, Instant::now(), listener).await?;
        Ok(Scaling::default().decide(&self.policy, &seen))
    }

    /// Returns what would be done, in words and scripts.
    ///
    /// # Errors
    /// If an option cannot be part of a script.
    pub fn describe(&self, decision: &Decision) -> Result<String, SlurmError> {
        let names = Names::for_coordinator(&self.coordinator);
        let mut text = format!("{}\n", decision.reason);
        if decision.actions.is_empty() {
            text.push_str("nothing would be done\n");
        }
        for action in &decision.actions {
            match action {
                ScalingAction::Submit { count, lasting } => {
                    let script = self.script.text(names.name(*lasting), *count, *lasting)?;
                    text.push_str(&format!(
                        "{count} workers would be submitted by this script:\n\n{script}\n"
                    ));
                }
                ScalingAction::Cancel { ids } => {
                    text.push_str(&format!("these would be cancelled: {}\n", ids.join(", ")));
                }
            }
        }
        Ok(text)
    }

    /// Looks at Slurm's queue and at the coordinator's jobs.
    async fn look(
        &self,
        names: &Names,
        begun: Instant,
        listener: &Arc<dyn RunListener>,
    ) -> Result<QueueObservation, LookError> {
        // First what is wrong with this machine.
        let queue: Vec<QueuedWorker> =
            programs::queue(&[names.elastic.as_str(), names.lasting.as_str()]).await?;
        let mut client = Client::connect(&self.coordinator, Arc::clone(listener)).await?;
        let jobs = client.list().await?;
        let open = jobs.iter().filter(|job| job.state() != JobState::Ended);
        let wanted_threads =
            scaling::wanted_threads(open.map(|job| job.realizations), self.realizations_per_thread);
        Ok(QueueObservation { now: begun.elapsed(), wanted_threads, queue })
    }

    async fn act(&self, names: &Names, action: &ScalingAction) -> Result<(), SlurmError> {
        match action {
            ScalingAction::Submit { count, lasting } => {
                let script = self.script.text(names.name(*lasting), *count, *lasting)?;
                let job = programs::submit(&script).await?;
                info!(job, workers = count, lasting, "submitted");
            }
            ScalingAction::Cancel { ids } => {
                programs::cancel_waiting(ids).await?;
                info!(
                    jobs = ids.join(","),
                    "cancelled: they waited, and there is no work for them"
                );
            }
        }
        Ok(())
    }
}

/// Names of the workers of one coordinator in Slurm's queue. A program that is started again knows
/// its workers by them.
struct Names {
    elastic: String,
    lasting: String,
}

impl Names {
    fn for_coordinator(coordinator: &Remote) -> Self {
        let hash = blake3::hash(coordinator.endpoint.to_string().as_bytes()).to_hex();
        let elastic = format!("osteon-worker-{}", &hash[..8]);
        Self { lasting: format!("{elastic}{LASTING}"), elastic }
    }

    fn name(&self, lasting: bool) -> &str {
        if lasting { &self.lasting } else { &self.elastic }
    }
}
