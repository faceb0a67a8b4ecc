//! The gRPC service for clients: turns calls into requests, and answers into messages.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use futures::Stream;
use osteon_common::limits::{
    FETCHES_AT_ONCE_MAX, FETCHES_PER_CALLER_MAX, NAME_BYTES_MAX, PRIORITY_MAX,
};
use osteon_common::results::Integrity;
use osteon_proto::spans::{TRACEPARENT, TraceContext};
use osteon_proto::status::Resource;
use osteon_proto::v1::jobs_server::Jobs;
use osteon_proto::v1::{
    BackupRequest, BackupResponse, BannedWorker, CancelRequest, CancelResponse, DrainWorkerRequest,
    DrainWorkerResponse, ExplainRequest, ExplainResponse, FetchRequest, FetchResponse, GetRequest,
    GetResponse, JobSnapshot, LiftBanRequest, LiftBanResponse, ListBansRequest, ListBansResponse,
    ListRequest, ListResponse, ListWorkersRequest, ListWorkersResponse, PruneRequest,
    PruneResponse, RecheckRequest, RecheckResponse, SubmitRequest, SubmitResponse, WatchRequest,
    WatchResponse,
};
use osteon_proto::{specification, status};
use tokio::sync::mpsc::error::SendTimeoutError;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::timeout;
use tonic::{Request, Response, Status};

use crate::access::HolderName;
use crate::core::effect::{Answer, Refusal};
use crate::service::backing_up;
use crate::service::core_task::Message;

use crate::access::limiter::{Caller, Limiter};
use crate::core::event::{self, Retention};
use crate::core::ids::{JobId, WorkerId};
use crate::service::fetching;
use crate::service::no_answer::{stopped_status, unexpected_status};
use crate::service::observers;
use crate::store::thread::StoreCommand;
use crate::store::{BanRecord, EndRecord};

/// Maximum number of jobs in one page.
const PAGE_JOBS_MAX: u32 = 1000;
/// A request that finds the queue full for this long is refused.
const QUEUE_PATIENCE: Duration = Duration::from_secs(5);
/// A client that cancels a job that has not ended after this long receives the reason for the wait.
const END_PATIENCE: Duration = Duration::from_secs(5);
/// Time after which a call that was refused for lack of room may be repeated.
const RETRY: Duration = Duration::from_secs(10);

/// The gRPC service for clients.
pub(crate) struct JobsService {
    messages: mpsc::Sender<Message>,
    store: mpsc::Sender<StoreCommand>,
    /// Permits of fetches: the output of a job may be large, so that of only a few is held in
    /// memory at a time.
    fetches: Limiter,
    /// Permit of backups: a copy of the store takes space on its disk, so only one is made at a
    /// time.
    backups: Arc<Semaphore>,
}

type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

impl JobsService {
    pub(crate) fn new(messages: mpsc::Sender<Message>, store: mpsc::Sender<StoreCommand>) -> Self {
        let fetches = Limiter::new(FETCHES_AT_ONCE_MAX, FETCHES_PER_CALLER_MAX);
        Self { messages, store, fetches, backups: Arc::new(Semaphore::new(1)) }
    }

    /// Queues a message for the core task; refused when the task does not keep up.
    async fn send(&self, message: Message) -> Result<(), Status> {
        self.messages.send_timeout(message, QUEUE_PATIENCE).await.map_err(|error| match error {
            SendTimeoutError::Closed(_) => stopped_status(),
            SendTimeoutError::Timeout(_) => status::resource_exhausted(
                "the coordinator has more requests than it can answer; try again",
                RETRY,
            ),
        })
    }

    /// Asks the core.
    pub(crate) async fn ask(&self, request: event::Request) -> Result<Answer, Status> {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Ask(request, reply)).await?;
        wait_for_answer(answer).await
    }

    /// Returns what an operator should know, as sentences.
    pub(crate) async fn concerns(&self) -> Result<Vec<String>, Status> {
        match self.ask(event::Request::Concerns).await? {
            Answer::Concerns(concerns) => Ok(concerns),
            _ => Err(unexpected_status()),
        }
    }

    async fn submit_traced(
        &self,
        request: event::Request,
        client: Option<TraceContext>,
    ) -> Result<Answer, Status> {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Submit(request, client, reply)).await?;
        wait_for_answer(answer).await
    }

    async fn snapshot(&self, request: event::Request) -> Result<Option<JobSnapshot>, Status> {
        match self.ask(request).await? {
            Answer::Snapshot(snapshot) => Ok(Some(snapshot)),
            _ => Err(unexpected_status()),
        }
    }

    /// Returns the status that names what a cancelled job waits for, before its client has waited
    /// too long.
    async fn still_ending_status(&self, job: JobId) -> Result<Status, Status> {
        let snapshot = self.snapshot(event::Request::Get(job)).await?;
        let waiting_for = snapshot.unwrap_or_default().waiting_for;
        let waits = if waiting_for.is_empty() { String::new() } else { format!(": {waiting_for}") };
        Ok(Status::unavailable(format!("job {job} is cancelled, and has not ended yet{waits}")))
    }

    /// Returns the end of an ended job, and what was found out about its hosts since.
    async fn end(&self, job: JobId) -> Result<(EndRecord, Option<Integrity>), Status> {
        match self.ask(event::Request::Fetch(job)).await? {
            Answer::Ended { end, integrity } => Ok((end, integrity)),
            _ => Err(unexpected_status()),
        }
    }
}

#[tonic::async_trait]
impl Jobs for JobsService {
    type WatchStream = BoxStream<WatchResponse>;
    type FetchStream = BoxStream<FetchResponse>;
    type BackupStream = BoxStream<BackupResponse>;

    async fn submit(
        &self,
        request: Request<SubmitRequest>,
    ) -> Result<Response<SubmitResponse>, Status> {
        let client_span = request.metadata().get(TRACEPARENT);
        let client_span = client_span.and_then(|text| TraceContext::parse(text.to_str().ok()?));
        let holder = request.extensions().get::<HolderName>().map(|HolderName(name)| name.clone());
        let SubmitRequest { specification: message, request_id, client, priority, name } =
            request.into_inner();
        // A token determines the client's name, whatever the message says.
        let client = holder.unwrap_or(client);
        for (field, value) in [("request_id", &request_id), ("client", &client), ("name", &name)] {
            if value.len() > NAME_BYTES_MAX {
                return Err(too_long_status(field, value));
            }
        }
        if name.chars().any(char::is_control) {
            let message = format!("is {name:?}; control characters are not allowed");
            return Err(status::bad_field("name", &message));
        }
        if priority > PRIORITY_MAX {
            let message = format!("is {priority}; 0 to {PRIORITY_MAX} are allowed");
            return Err(status::bad_field("priority", &message));
        }
        let message = message.ok_or_else(|| status::bad_field("specification", "is missing"))?;
        let specification = specification::from_message(&message)
            .map_err(|violations| status::invalid_argument(&violations))?;
        let specification = Arc::new(specification);
        let submit = event::Request::Submit { specification, request_id, client, priority, name };
        match self.submit_traced(submit, client_span).await? {
            Answer::Submitted(job) => Ok(Response::new(SubmitResponse { job: job.to_string() })),
            _ => Err(unexpected_status()),
        }
    }

    async fn get(&self, request: Request<GetRequest>) -> Result<Response<GetResponse>, Status> {
        let job = job(&request.into_inner().job)?;
        let snapshot = self.snapshot(event::Request::Get(job)).await?;
        Ok(Response::new(GetResponse { snapshot }))
    }

    async fn explain(
        &self,
        request: Request<ExplainRequest>,
    ) -> Result<Response<ExplainResponse>, Status> {
        let job = job(&request.into_inner().job)?;
        match self.ask(event::Request::Explain(job)).await? {
            Answer::Explained(explained) => Ok(Response::new(explained)),
            _ => Err(unexpected_status()),
        }
    }

    async fn list(&self, request: Request<ListRequest>) -> Result<Response<ListResponse>, Status> {
        let ListRequest { page_size, page_token } = request.into_inner();
        let after = match page_token.as_str() {
            "" => None,
            token => Some(JobId::parse(token).ok_or_else(|| {
                status::bad_field(
                    "page_token",
                    "is not a page token that List returned; leave it empty for the first page",
                )
            })?),
        };
        let limit = if page_size == 0 { PAGE_JOBS_MAX } else { page_size.min(PAGE_JOBS_MAX) };
        let concerns = if after.is_none() { self.concerns().await? } else { Vec::new() };
        match self.ask(event::Request::List { after, limit: limit as usize }).await? {
            Answer::Page { snapshots, more_after } => Ok(Response::new(ListResponse {
                jobs: snapshots,
                next_page_token: more_after.map(|job| job.to_string()).unwrap_or_default(),
                concerns,
            })),
            _ => Err(unexpected_status()),
        }
    }

    async fn watch(
        &self,
        request: Request<WatchRequest>,
    ) -> Result<Response<Self::WatchStream>, Status> {
        let WatchRequest { job: text, after } = request.into_inner();
        let job = job(&text)?;
        let (reply, answer) = oneshot::channel();
        self.send(Message::Watch(job, reply)).await?;
        let snapshots =
            answer.await.map_err(|_| stopped_status())?.map_err(|error| refusal_status(&error))?;
        Ok(Response::new(Box::pin(observers::follow(snapshots, after))))
    }

    async fn cancel(
        &self,
        request: Request<CancelRequest>,
    ) -> Result<Response<CancelResponse>, Status> {
        let user = request.extensions().get::<HolderName>().map(|HolderName(name)| name.clone());
        let job = job(&request.into_inner().job)?;
        tracing::info!(%job, user, "job is to be cancelled");
        let cancelled = self.snapshot(event::Request::Cancel(job));
        let snapshot = match timeout(END_PATIENCE, cancelled).await {
            Ok(snapshot) => snapshot?,
            Err(_) => return Err(self.still_ending_status(job).await?),
        };
        Ok(Response::new(CancelResponse { snapshot }))
    }

    async fn fetch(
        &self,
        request: Request<FetchRequest>,
    ) -> Result<Response<Self::FetchStream>, Status> {
        let caller = Caller::from_extensions(request.extensions());
        let job = job(&request.into_inner().job)?;
        let permit = self.fetches.acquire(caller).await?;
        let ended = self.end(job).await?;
        let store = self.store.downgrade();
        let sent =
            fetching::stream_paced(permit, |reader| fetching::send_all(store, ended, reader));
        Ok(Response::new(Box::pin(sent)))
    }

    async fn prune(
        &self,
        request: Request<PruneRequest>,
    ) -> Result<Response<PruneResponse>, Status> {
        let PruneRequest { keep_for_s, keep_last } = request.into_inner();
        let keep_for = keep_for_s.map(Duration::try_from_secs_f64).transpose().map_err(|_| {
            let given = keep_for_s.unwrap_or_default();
            status::bad_field("keep_for_s", &format!("is {given}; 0 to 3.2e9 (s) are allowed"))
        })?;
        match self.ask(event::Request::Prune(Retention { keep_for, keep_last })).await? {
            Answer::Pruned(jobs) => {
                let jobs = jobs.iter().map(JobId::to_string).collect();
                Ok(Response::new(PruneResponse { jobs }))
            }
            _ => Err(unexpected_status()),
        }
    }

    async fn backup(
        &self,
        _: Request<BackupRequest>,
    ) -> Result<Response<Self::BackupStream>, Status> {
        let place = Arc::clone(&self.backups).try_acquire_owned().map_err(|_| {
            status::resource_exhausted(
                "another backup is in progress; try again when it has ended",
                RETRY,
            )
        })?;
        let (reply, copied) = oneshot::channel();
        self.store.send(StoreCommand::Copy { reply }).await.map_err(|_| stopped_status())?;
        Ok(Response::new(Box::pin(backing_up::stream_copy(copied, place))))
    }

    async fn list_workers(
        &self,
        _: Request<ListWorkersRequest>,
    ) -> Result<Response<ListWorkersResponse>, Status> {
        match self.ask(event::Request::Workers).await? {
            Answer::Workers(workers) => Ok(Response::new(workers)),
            _ => Err(unexpected_status()),
        }
    }

    async fn drain_worker(
        &self,
        request: Request<DrainWorkerRequest>,
    ) -> Result<Response<DrainWorkerResponse>, Status> {
        let worker = WorkerId(request.into_inner().worker);
        match self.ask(event::Request::DrainWorker(worker)).await? {
            Answer::Worker(worker) => {
                Ok(Response::new(DrainWorkerResponse { worker: Some(worker) }))
            }
            _ => Err(unexpected_status()),
        }
    }

    async fn lift_ban(
        &self,
        request: Request<LiftBanRequest>,
    ) -> Result<Response<LiftBanResponse>, Status> {
        let host = request.into_inner().host;
        if host.len() > NAME_BYTES_MAX {
            return Err(too_long_status("host", &host));
        }
        match self.ask(event::Request::Unban(host)).await? {
            Answer::Unbanned(record) => {
                let worker = Some(banned_worker(record, Duration::ZERO));
                Ok(Response::new(LiftBanResponse { worker }))
            }
            _ => Err(unexpected_status()),
        }
    }

    async fn recheck(
        &self,
        request: Request<RecheckRequest>,
    ) -> Result<Response<RecheckResponse>, Status> {
        let job = job(&request.into_inner().job)?;
        let snapshot = self.snapshot(event::Request::Recheck(job)).await?;
        Ok(Response::new(RecheckResponse { snapshot }))
    }

    async fn list_bans(
        &self,
        _: Request<ListBansRequest>,
    ) -> Result<Response<ListBansResponse>, Status> {
        let Answer::Banned(banned) = self.ask(event::Request::Banned).await? else {
            return Err(unexpected_status());
        };
        let workers = banned.into_iter().map(|(record, elapsed)| banned_worker(record, elapsed));
        Ok(Response::new(ListBansResponse { workers: workers.collect() }))
    }
}

fn banned_worker(record: BanRecord, elapsed: Duration) -> BannedWorker {
    BannedWorker {
        host: record.worker.host().to_owned(),
        process: record.worker.process(),
        job: record.job.to_string(),
        reason: record.reason,
        elapsed_s: elapsed.as_secs_f64(),
    }
}

async fn wait_for_answer(answer: oneshot::Receiver<Answer>) -> Result<Answer, Status> {
    match answer.await.map_err(|_| stopped_status())? {
        Answer::Refused(refusal) => Err(refusal_status(&refusal)),
        answer => Ok(answer),
    }
}

fn job(text: &str) -> Result<JobId, Status> {
    if text.len() > NAME_BYTES_MAX {
        return Err(too_long_status("job", text));
    }
    JobId::parse(text)
        .ok_or_else(|| status::not_found(Resource::Job, text, format!("no such job: `{text}`")))
}

fn too_long_status(field: &str, value: &str) -> Status {
    let message = format!("has {} bytes; at most {NAME_BYTES_MAX} are allowed", value.len());
    status::bad_field(field, &message)
}

fn refusal_status(refusal: &Refusal) -> Status {
    let message = refusal.to_string();
    match refusal {
        Refusal::NoJob { job } => status::not_found(Resource::Job, job.to_string(), message),
        Refusal::NoWorker { worker } => {
            status::not_found(Resource::Worker, worker.to_string(), message)
        }
        Refusal::NotBanned { host } => status::not_found(Resource::Host, host.clone(), message),
        Refusal::RequestIdTaken { .. } => Status::already_exists(message),
        Refusal::TooManyJobs { .. }
        | Refusal::ClientHasTooManyJobs { .. }
        | Refusal::TooMuchQueued { .. } => status::resource_exhausted(message, RETRY),
        Refusal::NotEnded { .. } | Refusal::NoDoubt { .. } => Status::failed_precondition(message),
        Refusal::Draining
        | Refusal::Store { .. }
        | Refusal::NotPruned { .. }
        | Refusal::NotReopened { .. } => Status::unavailable(message),
    }
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    #[test]
    fn refusals_have_codes_and_say_when_to_come_back() {
        let (job, error) = (JobId(1), "full".to_owned());
        let taken = Refusal::RequestIdTaken { request_id: "a".to_owned(), job };
        for (refusal, code, retry) in [
            (Refusal::TooManyJobs { limit: 5 }, Code::ResourceExhausted, Some(RETRY)),
            (
                Refusal::ClientHasTooManyJobs { client: "a".to_owned(), limit: 5, all: 20 },
                Code::ResourceExhausted,
                Some(RETRY),
            ),
            (
                Refusal::TooMuchQueued { whose: "all", held: 5, more: 2, limit: 6 },
                Code::ResourceExhausted,
                Some(RETRY),
            ),
            (Refusal::NoJob { job }, Code::NotFound, None),
            (taken, Code::AlreadyExists, None),
            (Refusal::NotEnded { job }, Code::FailedPrecondition, None),
            (Refusal::Draining, Code::Unavailable, None),
            (Refusal::Store { error: error.clone() }, Code::Unavailable, None),
            (Refusal::NotPruned { error }, Code::Unavailable, None),
        ] {
            let status = refusal_status(&refusal);
            assert_eq!((status.code(), status::retry_after(&status)), (code, retry), "{refusal}");
            assert_eq!(status.message(), refusal.to_string());
        }
    }
}
