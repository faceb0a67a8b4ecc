//! `workers slurm`: submits workers as long as jobs wait for them.
//!
//! What to do is decided in [`crate::slurm::scaling`]; this file looks, and does it.

use std::time::Instant;

use osteon_client::client::{ClientError, Remote};
use osteon_proto::v1::JobState;
use tokio::time::sleep;
use tracing::{info, warn};

use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::resolved::{OutputFormat, ScalingPlan};
use crate::slurm::queue::{LASTING, QueuedWorker};
use crate::slurm::scaling::{self, QueueObservation, Scaling, ScalingAction};
use crate::slurm::{SlurmError, programs};
use crate::user;

use super::slurm::check_workers;

/// Looks and acts until it is interrupted, or once with `--dry-run`.
pub(super) async fn follow(plan: ScalingPlan) -> Result<ExitStatus, CommandFailure> {
    check_workers(&plan.script)?;
    let names = Names::for_coordinator(&plan.coordinator);
    let (mut scaling, begun) = (Scaling::default(), Instant::now());
    let mut told = String::new();
    let mut first = true;
    loop {
        let (threads, queue) = match look(&plan, &names).await {
            Ok(seen) => seen,
            // What cannot be reached at the start is a mistake; later it may come back.
            Err(failure) if first => return Err(failure),
            Err(failure) => {
                let reason = failure.to_string();
                if reason != told {
                    warn!(reason, "cannot look now; trying again");
                    told = reason;
                }
                sleep(plan.interval).await;
                continue;
            }
        };
        first = false;
        let seen = QueueObservation { now: begun.elapsed(), wanted_threads: threads, queue };
        let decision = scaling.decide(&plan.policy, &seen);
        if plan.dry_run {
            return show(&plan, &names, &decision.actions, &decision.reason);
        }
        // Repeated only when it is another.
        if decision.reason != told {
            info!("{}", decision.reason);
            told = decision.reason;
        }
        for action in decision.actions {
            if let Err(error) = act(&plan, &names, &action).await {
                warn!(reason = %error, "Slurm refuses");
                scaling.refused(begun.elapsed(), &error.to_string());
            }
        }
        sleep(plan.interval).await;
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

/// Returns the number of threads that jobs can use, and the workers in Slurm's queue.
async fn look(
    plan: &ScalingPlan,
    names: &Names,
) -> Result<(u64, Vec<QueuedWorker>), CommandFailure> {
    // First what is wrong with this machine.
    let names = [names.elastic.as_str(), names.lasting.as_str()];
    let queue = programs::queue(&names).await.map_err(CommandFailure::failed)?;
    let jobs = async {
        let mut client = user::connect(&plan.coordinator).await?;
        client.list().await
    };
    let jobs = jobs.await.map_err(|error: ClientError| CommandFailure::from(error))?;
    let open = jobs.iter().filter(|job| job.state() != JobState::Ended);
    let wanted =
        scaling::wanted_threads(open.map(|job| job.realizations), plan.realizations_per_thread);
    Ok((wanted, queue))
}

async fn act(plan: &ScalingPlan, names: &Names, action: &ScalingAction) -> Result<(), SlurmError> {
    match action {
        ScalingAction::Submit { count, lasting } => {
            let script = plan.script.text(names.name(*lasting), *count, *lasting)?;
            let job = programs::submit(&script).await?;
            info!(job, workers = count, lasting, "submitted");
        }
        ScalingAction::Cancel { ids } => {
            programs::cancel_waiting(ids).await?;
            info!(jobs = ids.join(","), "cancelled: they waited, and there is no work for them");
        }
    }
    Ok(())
}

/// Prints what would be done.
fn show(
    plan: &ScalingPlan,
    names: &Names,
    actions: &[ScalingAction],
    reason: &str,
) -> Result<ExitStatus, CommandFailure> {
    let mut text = format!("{reason}\n");
    if actions.is_empty() {
        text.push_str("nothing would be done\n");
    }
    for action in actions {
        match action {
            ScalingAction::Submit { count, lasting } => {
                let script = plan.script.text(names.name(*lasting), *count, *lasting);
                let script = script.map_err(CommandFailure::bad_input)?;
                text.push_str(&format!(
                    "{count} workers would be submitted by this script:\n\n{script}\n"
                ));
            }
            ScalingAction::Cancel { ids } => {
                text.push_str(&format!("these would be cancelled: {}\n", ids.join(", ")));
            }
        }
    }
    let printed = output::stdout(OutputFormat::Text).verbatim(&text);
    printed.map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}
