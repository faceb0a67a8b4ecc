//! Jobs, and how a client runs them.

use std::collections::BTreeSet;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use osteon_common::job::JobSpecification;
use osteon_files::report::ResultFile;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_client::JobsClient;
use osteon_proto::v1::{FetchRequest, JobState, JobStatus, SubmitRequest, WatchRequest};
use osteon_proto::{history, specification};
use osteon_transport::connection::{connect, jobs_client};
use osteon_transport::endpoint::Endpoint;
use tokio::time::sleep;
use tonic::transport::Channel;

use crate::fake;
use crate::grouped::{OF_GROUP, grouped};

/// Longest wait for a connection.
const CONNECT_LIMIT: Duration = Duration::from_secs(10);
/// Wait before a coordinator is asked again.
const RETRY: Duration = Duration::from_millis(20);
/// Usual number of evaluations of the search for a group.
const EVALUATIONS_OF_GROUP: u64 = 12;

/// A job to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Job {
    /// A propagation of so many realizations.
    Propagation(u64),
    /// An identification of so many groups.
    Groups(usize),
    /// An identification by a simplex: one evaluation after the other.
    Search {
        /// Their number, at most.
        evaluations: u64,
        /// Realizations of each.
        realizations: u64,
    },
}

impl Job {
    pub(crate) fn specification(self) -> JobSpecification {
        match self {
            Self::Propagation(realizations) => fake::propagation(realizations, 2),
            Self::Groups(groups) => grouped(groups),
            Self::Search { evaluations, realizations } => {
                fake::identification(realizations, evaluations, 2)
            }
        }
    }

    /// Returns the job before it, which is not measured.
    pub(crate) fn warm_up(self) -> JobSpecification {
        fake::propagation((self.expected_realizations() / 10).clamp(1, 100_000), 1)
    }

    /// Returns the number of realizations that it takes; of an identification, about.
    pub(crate) fn expected_realizations(self) -> u64 {
        match self {
            Self::Propagation(realizations) => realizations,
            Self::Groups(groups) => groups as u64 * EVALUATIONS_OF_GROUP * OF_GROUP,
            Self::Search { evaluations, realizations } => evaluations * realizations,
        }
    }

    /// Returns the maximum number of points that it evaluates one after the other.
    pub(crate) fn chain_max(self) -> u64 {
        match self {
            Self::Propagation(_) | Self::Groups(_) => 1,
            Self::Search { evaluations, .. } => evaluations,
        }
    }

    /// Returns the number of points of which each must be complete before the next is known, if it
    /// evaluates `points`.
    pub(crate) fn in_a_chain(self, points: u64) -> u64 {
        points.clamp(1, self.chain_max())
    }
}

/// The fetched result of an ended job, as far as the table needs it.
#[derive(Debug)]
pub(crate) struct Left {
    pub(crate) digest: String,
    /// Different points that it evaluated.
    pub(crate) points: u64,
    /// Realizations at all these points.
    pub(crate) realizations: u64,
}

/// A client of the coordinator.
pub(crate) struct Client {
    endpoint: Endpoint,
    jobs: JobsClient<Channel>,
}

impl Client {
    pub(crate) async fn new(url: &str) -> Result<Self> {
        let endpoint: Endpoint = url.parse()?;
        let jobs = jobs_client(connect(&endpoint, CONNECT_LIMIT).await?);
        Ok(Self { endpoint, jobs })
    }

    /// Submits a job; returns its identifier.
    pub(crate) async fn submit(&mut self, job: &JobSpecification) -> Result<String> {
        let submission = SubmitRequest {
            specification: Some(specification::to_message(job)),
            ..SubmitRequest::default()
        };
        Ok(self.jobs.submit(submission).await?.into_inner().job)
    }

    /// Returns when the job has ended. If `again`, the coordinator may go and come back meanwhile; the
    /// caller bounds the time.
    pub(crate) async fn watch(&mut self, job: &str, again: bool) -> Result<()> {
        loop {
            match self.watch_once(job).await {
                Ok(()) => return Ok(()),
                Err(error) if !again => return Err(error),
                Err(_) => sleep(RETRY).await,
            }
            // A channel that waits before it connects again would be late.
            if let Ok(channel) = connect(&self.endpoint, CONNECT_LIMIT).await {
                self.jobs = jobs_client(channel);
            }
        }
    }

    async fn watch_once(&mut self, job: &str) -> Result<()> {
        let watch = WatchRequest { job: job.to_owned(), after: 0 };
        let mut snapshots = self.jobs.watch(watch).await?.into_inner();
        while let Some(message) = snapshots.message().await? {
            let snapshot = message.snapshot.context("a message without a snapshot")?;
            if snapshot.state() == JobState::Ended {
                return Ok(());
            }
        }
        bail!("the coordinator does not watch job {job} to its end")
    }

    /// Fetches the result of an ended job.
    pub(crate) async fn fetch(&mut self, job: &str) -> Result<Left> {
        let request = FetchRequest { job: job.to_owned() };
        let mut parts = self.jobs.fetch(request).await?.into_inner();
        let (mut result, mut points) = (None, BTreeSet::new());
        while let Some(message) = parts.message().await? {
            match message.part {
                Some(Part::Result(part)) => result = Some(part),
                Some(Part::History(block)) => {
                    for row in &block.rows {
                        let point = history::evaluation_from_message(row)?.point;
                        points.insert(point.bits());
                    }
                }
                _ => {}
            }
        }
        let result = result.with_context(|| format!("job {job} has no result"))?;
        if result.status() == JobStatus::Failed {
            bail!("job {job} failed: {}", result.reason.unwrap_or_default());
        }
        let (result, points) = (ResultFile::from_json(&result.json)?, points.len() as u64);
        let (digest, realizations) = (result.digest().to_owned(), points * result.realizations());
        Ok(Left { digest, points, realizations })
    }
}
