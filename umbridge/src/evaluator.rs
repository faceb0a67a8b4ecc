//! Evaluation of points by the workers of a coordinator: each is a propagation of its own, so that
//! concurrent requests are computed like concurrent jobs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use osteon_client::client::{Client, ClientError, Fetched, SubmitOptions};
use osteon_client::other_version;
use osteon_client::request_id::RequestId;
use osteon_common::job::JobSpecification;
use osteon_common::moments::Estimate;
use osteon_common::outcome::{FailureCounts, Outcome};
use osteon_common::version::Program;
use osteon_files::report::ResultFile;
use osteon_proto::v1::JobSnapshot;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

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
pub struct Evaluator {
    client: Client,
    /// This program, whose numbers results are compared with.
    program: Program,
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
    /// Creates an evaluator of this `program`; `evaluated` counts its points.
    pub fn new(client: Client, program: Program, evaluated: Arc<AtomicU64>) -> Self {
        let places = Arc::new(Semaphore::new(POINTS_MAX as usize));
        Self { client, program, places, evaluated }
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
        // If this future is dropped, the submission continues, and the job that it returns to nobody is
        // cancelled.
        let submission =
            tokio::spawn(RunningPoint::submit(self.client.clone(), job.clone(), place));
        let submitted =
            submission.await.map_err(|error| ProtocolError::output(error.to_string()))?;
        let mut running = submitted?;
        let mut client = self.client.clone();
        let followed = async {
            let ignore = |_: &JobSnapshot| Ok::<_, ClientError>(());
            client.watch(&running.id, ignore).await?;
            client.fetch(&running.id).await
        };
        let fetched = match timeout(Duration::from_secs(POINT_S_MAX), followed).await {
            Ok(fetched) => fetched.map_err(refused)?,
            Err(_) => return Err(ProtocolError::output("the evaluation took more than a day")),
        };
        running.has_ended();
        self.evaluated.fetch_add(1, Ordering::Relaxed);
        result_of(job, fetched, &self.program)
    }

    /// Waits a moment until jobs whose requests are gone have been cancelled; nothing is evaluated any
    /// more.
    pub async fn end(&self) {
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
    async fn submit(
        mut client: Client,
        job: JobSpecification,
        place: OwnedSemaphorePermit,
    ) -> Result<Self, ProtocolError> {
        let request = RequestId::new().map_err(|error| ProtocolError::output(error.to_string()))?;
        let options = SubmitOptions { name: JOB_NAME.to_owned(), ..SubmitOptions::default() };
        let id = client.submit(&job, &request, options).await.map_err(refused)?;
        Ok(Self { client, id, place: Some(place) })
    }

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
        ClientError::Violations(violations) => {
            ProtocolError::violations(&violations).without_value()
        }
        error => ProtocolError::output(error.to_string()),
    }
}

/// Returns what a job has computed.
fn result_of(
    job: &JobSpecification,
    fetched: Fetched,
    program: &Program,
) -> Result<PointResult, ProtocolError> {
    let Fetched { specification: computed, reason, result, samples, .. } = fetched;
    other_version::check(job, &computed, (program, &result.program()))
        .map_err(|error| ProtocolError::output(error.to_string()))?;
    let ResultFile::Propagation(found) = result else {
        return Err(ProtocolError::output(
            "the coordinator sent the result of another kind of job",
        ));
    };
    if found.parameters.point(found.dispersion).is_none() {
        let reason = reason.unwrap_or_else(|| "the job was cancelled".to_owned());
        return Err(ProtocolError::output(format!("the point was not evaluated: {reason}")));
    }
    let mut failures = FailureCounts::default();
    found.failures.iter().for_each(|(kind, count)| failures.add(*kind, *count));
    let most = job.monte_carlo.max_failed_fraction;
    let (failed, count) = (failures.total(), job.monte_carlo.realizations);
    match found.velocity.estimate() {
        Some(velocity) if failed as f64 / count as f64 <= most => {
            let outcomes = samples.into_iter().next().unwrap_or_default().outcomes;
            Ok(PointResult { velocity, digest: found.digest, failures, outcomes })
        }
        _ => Err(ProtocolError::output(format!(
            "{failed} of {count} realizations failed ({}); max_failed_fraction is {most:?}",
            counted(&failures)
        ))
        .without_value()),
    }
}

/// Returns the failures by kind, e.g. `no_arrival=2`, or `0`.
pub(super) fn counted(failures: &FailureCounts) -> String {
    let kinds: Vec<String> =
        failures.iter().map(|(kind, count)| format!("{}={count}", kind.name())).collect();
    if kinds.is_empty() { "0".to_owned() } else { kinds.join(", ") }
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use osteon_common::job::JobKind;
    use osteon_coordinator::store::memory::MemoryStore;
    use osteon_coordinator::{Config, Listener};
    use osteon_files::job_file;
    use osteon_transport::credentials::CredentialFiles;
    use osteon_transport::endpoint::Endpoint;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::{UnixListener, UnixStream};
    use tokio::sync::watch;
    use tokio::time::sleep;

    use super::*;
    use osteon_client::client::{self, Remote};
    use osteon_client::environment::Unused;
    use osteon_client::listener::Silent;

    /// Forwards one connection; while `held` is true, answers wait.
    async fn holds_answers(from: UnixListener, to: PathBuf, mut held: watch::Receiver<bool>) {
        let (client, _) = from.accept().await.unwrap();
        let server = UnixStream::connect(&to).await.unwrap();
        let ((mut requests, mut to_client), (mut answers, mut to_server)) =
            (client.into_split(), server.into_split());
        let up = async {
            let _ = tokio::io::copy(&mut requests, &mut to_server).await;
        };
        let down = async {
            let mut buffer = vec![0; 1 << 16];
            while let Ok(count @ 1..) = answers.read(&mut buffer).await {
                let _ = held.wait_for(|held| !held).await;
                if to_client.write_all(&buffer[..count]).await.is_err() {
                    break;
                }
            }
        };
        tokio::join!(up, down);
    }

    async fn connected(socket: &Path) -> Client {
        let (files, unused) = (CredentialFiles::default(), Unused::default());
        let endpoint = Endpoint::Unix(socket.to_owned());
        let remote = Remote { endpoint, files, from_environment: false, unused };
        Client::connect(&remote, Arc::new(Silent)).await.unwrap()
    }

    /// Polls until `witness` sees one job of which `wanted` is true.
    async fn one_job(witness: &mut Client, what: &str, wanted: impl Fn(&JobSnapshot) -> bool) {
        for _ in 0..4000 {
            let jobs = witness.list().await.unwrap();
            assert!(jobs.len() <= 1, "{jobs:?}");
            if jobs.iter().any(&wanted) {
                return;
            }
            sleep(Duration::from_millis(5)).await;
        }
        panic!("{what}");
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_request_that_ends_during_its_submission_leaves_no_job() {
        let directory = tempfile::tempdir().unwrap();
        let [there, between] = ["there", "between"].map(|name| directory.path().join(name));
        let address = format!("unix:{}", there.display()).parse().unwrap();
        let listener = Listener::bind(&address, false).await.unwrap();
        let store = Box::new(MemoryStore::new());
        let coordinator =
            osteon_coordinator::start(listener, store, Config::default()).await.unwrap();
        let (hold, held) = watch::channel(false);
        let listener = UnixListener::bind(&between).unwrap();
        let proxy = tokio::spawn(holds_answers(listener, there.clone(), held));
        let evaluator =
            Evaluator::new(connected(&between).await, Program::current(None), Arc::default());
        let mut witness = connected(&there).await;
        hold.send(true).unwrap();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/quick.toml");
        let job = job_file::read(&path, JobKind::Propagation).unwrap();
        tokio::select! {
            result = evaluator.evaluate(&job) => panic!("{result:?}"),
            () = one_job(&mut witness, "the job is accepted", |_| true) => {}
        }
        hold.send(false).unwrap();
        one_job(&mut witness, "the job is cancelled", |job| client::job_status(job).is_some())
            .await;
        proxy.abort();
        coordinator.shutdown().await;
    }
}
