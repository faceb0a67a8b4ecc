//! The jobs service as an external client uses it, with blocking calls.

use std::path::Path;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_files::job_file;
use osteon_files::report::ResultFile;
use osteon_proto::specification;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{
    FetchRequest, GetRequest, JobSnapshot, JobSpecification, JobState, ListRequest,
    ListWorkersRequest, SubmitRequest,
};
use osteon_transport::connection::{connect, jobs_client};
use tokio::runtime::Runtime;
use tonic::transport::Channel;
use tonic::{Code, Status};

use crate::support::eventually;

/// Longest wait for one answer.
const TIMEOUT: Duration = Duration::from_secs(10);

/// A client of one coordinator, which survives its restarts.
pub(crate) struct Api {
    runtime: Runtime,
    url: String,
    client: Option<JobsClient<Channel>>,
}

impl Api {
    pub(crate) fn new(url: &str) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        Self { runtime, url: url.to_owned(), client: None }
    }

    /// Makes one call; `Unavailable` if there is no answer.
    pub(crate) fn call<T>(
        &mut self,
        call: impl AsyncFnOnce(&mut JobsClient<Channel>) -> Result<T, Status>,
    ) -> Result<T, Status> {
        let Self { runtime, url, client } = self;
        let answer = runtime.block_on(async {
            let attempt = async {
                if client.is_none() {
                    *client = Some(client_of(url).await?);
                }
                call(client.as_mut().unwrap()).await
            };
            let late = Status::unavailable("no answer in time");
            tokio::time::timeout(TIMEOUT, attempt).await.unwrap_or(Err(late))
        });
        if answer.is_err() {
            self.client = None;
        }
        answer
    }

    /// Returns all jobs; `None` if there is no answer.
    pub(crate) fn jobs(&mut self) -> Option<Vec<JobSnapshot>> {
        let listed = self.call(async |client| client.list(ListRequest::default()).await);
        listed.ok().map(|listed| listed.into_inner().jobs)
    }

    /// Returns the process ids of the attached workers; `None` if there is no answer.
    pub(crate) fn attached_processes(&mut self) -> Option<Vec<u32>> {
        let request = ListWorkersRequest::default();
        let listed = self.call(async |client| client.list_workers(request).await);
        let workers = listed.ok()?.into_inner().workers;
        Some(workers.into_iter().map(|worker| worker.process).collect())
    }

    /// Submits a job.
    pub(crate) fn submit(&mut self, job: &JobSpecification, id: &str) -> Result<String, Status> {
        let request = SubmitRequest {
            specification: Some(job.clone()),
            request_id: id.to_owned(),
            client: "the test".to_owned(),
            ..SubmitRequest::default()
        };
        self.call(async |client| Ok(client.submit(request).await?.into_inner().job))
    }

    /// Returns one job.
    pub(crate) fn job(&mut self, job: &str) -> JobSnapshot {
        let request = GetRequest { job: job.to_owned() };
        let got = self.call(async |client| client.get(request).await);
        got.unwrap().into_inner().snapshot.unwrap()
    }

    /// Polls until a job is as `wanted`.
    pub(crate) fn until(
        &mut self,
        what: &str,
        job: &str,
        wanted: impl Fn(&JobSnapshot) -> bool,
    ) -> JobSnapshot {
        let mut last = None;
        eventually(what, || {
            let seen = last.insert(self.job(job));
            wanted(seen)
        });
        last.unwrap()
    }

    /// Waits for the end of a job; returns its result.
    pub(crate) fn end(&mut self, job: &str) -> ResultFile {
        self.until("the job ends", job, |seen| seen.state() == JobState::Ended);
        self.result(job)
    }

    /// Returns the result of an ended job.
    pub(crate) fn result(&mut self, job: &str) -> ResultFile {
        let json = |part| match part {
            Part::Result(result) => Some(result.json),
            _ => None,
        };
        let json = self.parts(job).into_iter().find_map(json).unwrap();
        ResultFile::from_json(&json).unwrap()
    }

    /// Returns all parts of an ended job's results.
    pub(crate) fn parts(&mut self, job: &str) -> Vec<Part> {
        let request = FetchRequest { job: job.to_owned() };
        let parts = self.call(async |client| {
            let mut stream = client.fetch(request).await?.into_inner();
            let mut parts = Vec::new();
            while let Some(response) = stream.message().await? {
                parts.extend(response.part);
            }
            Ok(parts)
        });
        parts.unwrap()
    }
}

/// Returns a client with a separate connection.
pub(crate) async fn client_of(url: &str) -> Result<JobsClient<Channel>, Status> {
    let endpoint = url.parse().unwrap();
    let channel = connect(&endpoint, TIMEOUT).await;
    channel.map(jobs_client).map_err(|error| Status::new(Code::Unavailable, error.to_string()))
}

/// Returns the specification in a job file.
pub(crate) fn specification(file: &Path, kind: JobKind) -> JobSpecification {
    specification::to_message(&job_file::read(file, kind).unwrap())
}

/// Returns the number of realizations of a job's complete and current evaluations.
pub(crate) fn progress(job: &JobSnapshot) -> u64 {
    let current = if job.state() == JobState::Ended { 0 } else { job.realizations_done };
    job.evaluations * job.realizations + current
}
