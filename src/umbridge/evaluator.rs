//! Evaluation of points by the workers of a coordinator: each is a propagation of its own, so that
//! concurrent requests are computed like concurrent jobs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use osteon_common::job::JobSpecification;
use osteon_common::moments::Estimate;
use osteon_common::outcome::{FailureCounts, Outcome};
use osteon_proto::v1::JobSnapshot;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::client::{Client, ClientError, Fetched, SubmitOptions};
use crate::request_id::RequestId;

use super::protocol_error::ProtocolError;

/// Maximum number of points that are evaluated at a time; others wait. More than a coordinator works
/// on at a time, so that it always has a next one.
const POINTS_MAX: u32 = 32;
/// Maximum time of the evaluation of one point, s, once it is submitted.
const POINT_S_MAX: u64 = 24 * 3600;
/// Maximum time that the end of the server waits until abandoned jobs are cancelled, s.
const CANCEL_S_MAX: u64 = 2;
/// Name of the jobs.
const JOB_NAME: &str = "umbridge";

/// Submits points to a coordinator and waits for their results.
#[derive(Debug, Clone)]
pub(crate) struct Evaluator {
    client: Client,
    places: Arc<Semaphore>,
    /// Number of points evaluated so far.
    evaluated: Arc<AtomicU64>,
}

/// The result of one point.
#[derive(Debug, Clone)]
pub(super) struct PointResult {
    /// The moments, with their standard errors.
    pub(super) velocity: Estimate,
    /// Digest of the evaluation, as that of `propagate`.
    pub(super) digest: String,
    /// Failed realizations by kind.
    pub(super) failures: FailureCounts,
    /// The outcomes in index order.
    pub(super) outcomes: Vec<Outcome>,
}

impl Evaluator {
    /// Creates an evaluator; `evaluated` counts its points.
    pub(crate) fn new(client: Client, evaluated: Arc<AtomicU64>) -> Self {
        Self { client, places: Arc::new(Semaphore::new(POINTS_MAX as usize)), evaluated }
    }

    /// Evaluates the point of a propagation. If the future is dropped, the job is cancelled.
    ///
    /// # Errors
    /// If there is no result: the coordinator's or the model's reason.
    pub(super) async fn evaluate(
        &self,
        job: &JobSpecification,
    ) -> Result<PointResult, ProtocolError> {
        let place = Arc::clone(&self.places).acquire_owned().await;
        let place = place.map_err(|_| ProtocolError::output("the server is ending"))?;
        let mut client = self.client.clone();
        let request = RequestId::new().map_err(|error| ProtocolError::output(error.to_string()))?;
        let options = SubmitOptions { name: JOB_NAME.to_owned(), ..SubmitOptions::default() };
        let id = client.submit(job, &request, options).await.map_err(refused)?;
        let mut running =
            RunningPoint { client: client.clone(), id: id.clone(), place: Some(place) };
        let followed = async {
            let ignore = |_: &JobSnapshot| Ok::<_, ClientError>(());
            client.watch(&id, ignore).await?;
            client.fetch(&id).await
        };
        let fetched = match timeout(Duration::from_secs(POINT_S_MAX), followed).await {
            Ok(fetched) => fetched.map_err(refused)?,
            Err(_) => return Err(ProtocolError::output("the evaluation took more than a day")),
        };
        running.has_ended();
        self.evaluated.fetch_add(1, Ordering::Relaxed);
        result_of(job, fetched)
    }

    /// Waits a moment until jobs whose requests are gone have been cancelled; nothing is evaluated any
    /// more.
    pub(crate) async fn end(&self) {
        let all = self.places.acquire_many(POINTS_MAX);
        // If the coordinator does not answer, its jobs end by themselves.
        let _ = timeout(Duration::from_secs(CANCEL_S_MAX), all).await;
        self.places.close();
    }
}

/// A job that is cancelled when its request is dropped.
struct RunningPoint {
    client: Client,
    id: String,
    /// Kept until the job has ended or is cancelled.
    place: Option<OwnedSemaphorePermit>,
}

impl RunningPoint {
    /// The job needs no cancellation any more.
    fn has_ended(&mut self) {
        self.place = None;
    }
}

impl Drop for RunningPoint {
    fn drop(&mut self) {
        let Some(place) = self.place.take() else { return };
        let (mut client, id) = (self.client.clone(), std::mem::take(&mut self.id));
        if let Ok(runtime) = Handle::try_current() {
            runtime.spawn(async move {
                // A job that has ended meanwhile is not an error, nor is a coordinator that is gone.
                let _ = client.cancel(&id).await;
                drop(place);
            });
        }
    }
}

fn refused(error: ClientError) -> ProtocolError {
    match error {
        ClientError::Violations(violations) => ProtocolError::outside(&violations),
        error => ProtocolError::output(error.to_string()),
    }
}

/// Returns what a job has computed.
fn result_of(job: &JobSpecification, fetched: Fetched) -> Result<PointResult, ProtocolError> {
    let result = fetched.result;
    let Some(best) = result.best else {
        let reason = result.reason.unwrap_or_else(|| "the job was cancelled".to_owned());
        return Err(ProtocolError::output(format!("the point was not evaluated: {reason}")));
    };
    let most = job.monte_carlo.max_failed_fraction;
    let (failed, count) = (best.failures.total(), job.monte_carlo.realizations);
    match best.velocity {
        Some(velocity) if failed as f64 / count as f64 <= most => {
            let (failures, outcomes) = (best.failures, best.outcomes);
            Ok(PointResult { velocity, digest: result.digest, failures, outcomes })
        }
        _ => Err(ProtocolError::infeasible(format!(
            "{failed} of {count} realizations failed ({}); max_failed_fraction is {most:?}",
            counted(&best.failures)
        ))),
    }
}

/// Returns the failures by kind, e.g. `no_arrival=2`, or `0`.
pub(super) fn counted(failures: &FailureCounts) -> String {
    let kinds: Vec<String> =
        failures.iter().map(|(kind, count)| format!("{}={count}", kind.name())).collect();
    if kinds.is_empty() { "0".to_owned() } else { kinds.join(", ") }
}
