//! Where the numbers of the page come from: the core task and the store, asked as the API asks them.

use std::sync::Arc;
use std::time::Duration;

use osteon_common::limits::FETCHES_AT_ONCE_MAX;
use osteon_proto::status;
use osteon_proto::v1::jobs_server::Jobs;
use osteon_proto::v1::{
    CancelRequest, ExplainRequest, ExplainResponse, JobSnapshot, ListWorkersRequest,
    ListWorkersResponse,
};
use tokio::sync::{Mutex, OwnedSemaphorePermit, Semaphore, mpsc, oneshot};
use tokio::time::{Instant, timeout};
use tonic::{Request, Status};

use crate::access::HolderName;
use crate::access::limiter::{Caller, Limiter};
use crate::core::effect::Answer;
use crate::core::event;
use crate::core::ids::JobId;
use crate::live::query::Shown;
use crate::metrics::write_times::WriteTimes;
use crate::service::core_task::Message;
use crate::service::jobs::JobsService;
use crate::service::meter::CoreReport;
use crate::service::no_answer::{stopped_status, unexpected_status};
use crate::store::thread::StoreCommand;

/// Maximum number of pages that are kept up to date at a time.
const STREAMS_MAX: usize = 64;
/// Time after which a page that was refused may ask again.
const RETRY: Duration = Duration::from_secs(5);
/// Time limit for an answer of the core task, except to a cancellation, which has its own.
const CORE_TIMEOUT: Duration = Duration::from_secs(10);

/// Where the numbers come from.
pub(crate) struct PageSource {
    jobs: JobsService,
    messages: mpsc::Sender<Message>,
    pub(crate) store: mpsc::WeakSender<StoreCommand>,
    pub(crate) write_times: WriteTimes,
    /// The newest overview, for all pages. Whoever needs a newer one makes it, while the others wait.
    pub(crate) newest: Mutex<Option<Overview>>,
    streams: Arc<Semaphore>,
    readings: Limiter,
}

/// An overview at one moment.
pub(crate) struct Overview {
    pub(crate) made: Instant,
    /// Its JSON.
    pub(crate) text: Arc<str>,
}

impl PageSource {
    pub(crate) fn new(
        messages: mpsc::Sender<Message>,
        store: &mpsc::Sender<StoreCommand>,
        write_times: WriteTimes,
    ) -> Self {
        Self {
            jobs: JobsService::new(messages.clone(), store.clone()),
            messages,
            store: store.downgrade(),
            write_times,
            newest: Mutex::new(None),
            streams: Arc::new(Semaphore::new(STREAMS_MAX)),
            readings: Limiter::new(FETCHES_AT_ONCE_MAX, 1),
        }
    }

    /// Returns the permit of a page that is kept up to date.
    ///
    /// # Errors
    /// `RESOURCE_EXHAUSTED` if there are as many as are allowed.
    pub(crate) fn stream(&self) -> Result<OwnedSemaphorePermit, Status> {
        Arc::clone(&self.streams).try_acquire_owned().map_err(|_| {
            let message =
                format!("{STREAMS_MAX} pages are open already, the most allowed; close one");
            status::resource_exhausted(message, RETRY)
        })
    }

    /// Waits for the permit to read the history of an ended job, which may be large.
    pub(crate) async fn permit_reading(
        &self,
        caller: Caller,
    ) -> Result<crate::access::limiter::Permit, Status> {
        self.readings.acquire(caller).await
    }

    /// Asks the core.
    pub(crate) async fn ask(&self, request: event::Request) -> Result<Answer, Status> {
        answer_in_time(self.jobs.ask(request)).await
    }

    /// Returns some rows of the list of jobs, and the last of them if others follow.
    pub(crate) async fn list(
        &self,
        shown: &Shown,
    ) -> Result<(Vec<JobSnapshot>, Option<JobId>), Status> {
        let Shown { which, before, rows, .. } = *shown;
        match self.ask(event::Request::Browse { which, before, limit: rows }).await? {
            Answer::Page { snapshots, more_after } => Ok((snapshots, more_after)),
            _ => Err(unexpected_status()),
        }
    }

    /// Returns one job, and what decides how fast it is.
    pub(crate) async fn job(&self, job: JobId) -> Result<(JobSnapshot, ExplainResponse), Status> {
        let Answer::Snapshot(snapshot) = self.ask(event::Request::Get(job)).await? else {
            return Err(unexpected_status());
        };
        let explained = self.jobs.explain(Request::new(ExplainRequest { job: job.to_string() }));
        Ok((snapshot, answer_in_time(explained).await?.into_inner()))
    }

    /// Returns what an operator should know.
    pub(crate) async fn concerns(&self) -> Result<Vec<String>, Status> {
        answer_in_time(self.jobs.concerns()).await
    }

    /// Cancels a job for the holder of a token.
    pub(crate) async fn cancel(
        &self,
        job: String,
        holder: Option<HolderName>,
    ) -> Result<Option<JobSnapshot>, Status> {
        let mut request = Request::new(CancelRequest { job });
        if let Some(holder) = holder {
            request.extensions_mut().insert(holder);
        }
        Ok(self.jobs.cancel(request).await?.into_inner().snapshot)
    }

    pub(crate) async fn workers(&self) -> Result<ListWorkersResponse, Status> {
        let listed = self.jobs.list_workers(Request::new(ListWorkersRequest {}));
        Ok(answer_in_time(listed).await?.into_inner())
    }

    /// Returns counts and measurements of the core, and the number of events that wait for it.
    pub(crate) async fn measure(&self) -> Result<(CoreReport, usize), Status> {
        let waiting = self.messages.max_capacity() - self.messages.capacity();
        let (reply, report) = oneshot::channel();
        let asked = async {
            self.messages.send(Message::Measure(reply)).await.map_err(|_| stopped_status())?;
            report.await.map_err(|_| stopped_status())
        };
        Ok((answer_in_time(asked).await?, waiting))
    }
}

async fn answer_in_time<T>(answer: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
    let late_status =
        || Status::unavailable("the coordinator does not answer; its log may say why");
    timeout(CORE_TIMEOUT, answer).await.map_err(|_| late_status())?
}
