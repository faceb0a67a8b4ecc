//! The service of clients: calls into requests, answers into messages.

use std::pin::Pin;
use std::sync::Arc;

use futures::{Stream, StreamExt as _, stream};
use osteon_common::limits::{FETCHES_AT_ONCE_MAX, NAME_BYTES_MAX};
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::jobs_server::Jobs;
use osteon_proto::v1::{
    CancelRequest, CancelResponse, FetchRequest, FetchResponse, GetRequest, GetResponse,
    HistoryBlock, JobSnapshot, JobState, ListRequest, ListResponse, SubmitRequest, SubmitResponse,
    WatchRequest, WatchResponse,
};
use osteon_proto::{realizations, results, specification, status};
use tokio::sync::{Semaphore, mpsc, oneshot, watch};
use tonic::{Request, Response, Status};

use crate::core_task::Message;
use crate::effect::{Answer, Refusal};
use crate::event;
use crate::fetching;
use crate::ids::JobId;
use crate::leftover::Leftover;
use crate::store_thread::Command;

/// Most jobs of one page.
const PAGE_JOBS_MAX: u32 = 1000;
/// Rows of the history in one message.
const HISTORY_BLOCK_ROWS: usize = 4096;
/// Realizations in one message.
const REALIZATION_BLOCK: usize = 65_536;

/// The service of clients.
pub(crate) struct JobsService {
    messages: mpsc::Sender<Message>,
    store: mpsc::Sender<Command>,
    /// What jobs left may be large: a few at a time are held in memory.
    fetches: Arc<Semaphore>,
}

type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

impl JobsService {
    pub(crate) fn new(messages: mpsc::Sender<Message>, store: mpsc::Sender<Command>) -> Self {
        Self { messages, store, fetches: Arc::new(Semaphore::new(FETCHES_AT_ONCE_MAX)) }
    }

    async fn ask(&self, request: event::Request) -> Result<Answer, Status> {
        let (reply, answer) = oneshot::channel();
        self.messages.send(Message::Ask(request, reply)).await.map_err(|_| stopped())?;
        match answer.await.map_err(|_| stopped())? {
            Answer::Refused(refusal) => Err(refused(&refusal)),
            answer => Ok(answer),
        }
    }

    async fn snapshot(&self, request: event::Request) -> Result<Option<JobSnapshot>, Status> {
        match self.ask(request).await? {
            Answer::Snapshot(snapshot) => Ok(Some(snapshot)),
            _ => Err(unexpected()),
        }
    }

    async fn leftover(&self, job: JobId) -> Result<Leftover, Status> {
        let Answer::Ended { record, end } = self.ask(event::Request::Fetch(job)).await? else {
            return Err(unexpected());
        };
        let (reply, leftover) = oneshot::channel();
        let read = Command::Read { record, end, reply };
        self.store.send(read).await.map_err(|_| stopped())?;
        let leftover = leftover.await.map_err(|_| stopped())?;
        leftover.map_err(|error| Status::data_loss(error.to_string()))
    }
}

#[tonic::async_trait]
impl Jobs for JobsService {
    type WatchStream = BoxStream<WatchResponse>;
    type FetchStream = BoxStream<FetchResponse>;

    async fn submit(
        &self,
        request: Request<SubmitRequest>,
    ) -> Result<Response<SubmitResponse>, Status> {
        let SubmitRequest { specification: message, request_id } = request.into_inner();
        if request_id.len() > NAME_BYTES_MAX {
            return Err(too_long("request_id", &request_id));
        }
        let message = message.ok_or_else(|| status::bad_field("specification", "is missing"))?;
        let specification = specification::from_message(&message)
            .map_err(|violations| status::invalid_argument(&violations))?;
        let specification = Arc::new(specification);
        match self.ask(event::Request::Submit { specification, request_id }).await? {
            Answer::Submitted(job) => Ok(Response::new(SubmitResponse { job: job.to_string() })),
            _ => Err(unexpected()),
        }
    }

    async fn get(&self, request: Request<GetRequest>) -> Result<Response<GetResponse>, Status> {
        let job = job(&request.into_inner().job)?;
        let snapshot = self.snapshot(event::Request::Get(job)).await?;
        Ok(Response::new(GetResponse { snapshot }))
    }

    async fn list(&self, request: Request<ListRequest>) -> Result<Response<ListResponse>, Status> {
        let ListRequest { page_size, page_token } = request.into_inner();
        let after = match page_token.as_str() {
            "" => None,
            token => Some(JobId::parse(token).ok_or_else(|| {
                status::bad_field(
                    "page_token",
                    "is not one that List returned; leave it empty for the first page",
                )
            })?),
        };
        let limit = if page_size == 0 { PAGE_JOBS_MAX } else { page_size.min(PAGE_JOBS_MAX) };
        match self.ask(event::Request::List { after, limit: limit as usize }).await? {
            Answer::Page { snapshots, more_after } => Ok(Response::new(ListResponse {
                jobs: snapshots,
                next_page_token: more_after.map(|job| job.to_string()).unwrap_or_default(),
            })),
            _ => Err(unexpected()),
        }
    }

    async fn watch(
        &self,
        request: Request<WatchRequest>,
    ) -> Result<Response<Self::WatchStream>, Status> {
        let job = job(&request.into_inner().job)?;
        let (reply, answer) = oneshot::channel();
        self.messages.send(Message::Watch(job, reply)).await.map_err(|_| stopped())?;
        let snapshots = answer.await.map_err(|_| stopped())?.map_err(|error| refused(&error))?;
        Ok(Response::new(Box::pin(follow(snapshots))))
    }

    async fn cancel(
        &self,
        request: Request<CancelRequest>,
    ) -> Result<Response<CancelResponse>, Status> {
        let job = job(&request.into_inner().job)?;
        let snapshot = self.snapshot(event::Request::Cancel(job)).await?;
        Ok(Response::new(CancelResponse { snapshot }))
    }

    async fn fetch(
        &self,
        request: Request<FetchRequest>,
    ) -> Result<Response<Self::FetchStream>, Status> {
        let job = job(&request.into_inner().job)?;
        let place = Arc::clone(&self.fetches).acquire_owned().await.map_err(|_| stopped())?;
        let leftover = self.leftover(job).await?;
        Ok(Response::new(Box::pin(fetching::paced(parts(leftover), place))))
    }
}

/// The newest snapshot whenever there is a new one, the present one first, until the job has
/// ended. Who reads slowly misses those in between.
fn follow(
    snapshots: watch::Receiver<JobSnapshot>,
) -> impl Stream<Item = Result<WatchResponse, Status>> {
    enum Next {
        First,
        Changed,
        Over,
    }
    stream::unfold((snapshots, Next::First), |(mut snapshots, next)| async move {
        match next {
            Next::Over => return None,
            Next::First => {}
            Next::Changed => {
                if snapshots.changed().await.is_err() {
                    return Some((Err(stopped()), (snapshots, Next::Over)));
                }
            }
        }
        let snapshot = snapshots.borrow_and_update().clone();
        let ended = snapshot.state() == JobState::Ended;
        let next = if ended { Next::Over } else { Next::Changed };
        Some((Ok(WatchResponse { snapshot: Some(snapshot) }), (snapshots, next)))
    })
    .fuse()
}

/// One specification, one result, history blocks, realization blocks; made as they are sent.
fn parts(leftover: Leftover) -> impl Iterator<Item = Part> + Send {
    let Leftover { specification, result, history } = leftover;
    let head = [
        Part::Specification(specification::to_message(&specification)),
        Part::Result(results::to_message(&result)),
    ];
    let outcomes = result.best.map(|best| best.outcomes).unwrap_or_default();
    let rows = (0..history.len().div_ceil(HISTORY_BLOCK_ROWS)).map(move |block| {
        let rows = history.iter().skip(block * HISTORY_BLOCK_ROWS).take(HISTORY_BLOCK_ROWS);
        Part::History(HistoryBlock { rows: rows.map(results::evaluation_to_message).collect() })
    });
    let blocks = (0..outcomes.len().div_ceil(REALIZATION_BLOCK)).map(move |block| {
        let first = block * REALIZATION_BLOCK;
        let end = (first + REALIZATION_BLOCK).min(outcomes.len());
        Part::Realizations(realizations::to_message(first as u64, &outcomes[first..end]))
    });
    head.into_iter().chain(rows).chain(blocks)
}

fn job(text: &str) -> Result<JobId, Status> {
    if text.len() > NAME_BYTES_MAX {
        return Err(too_long("job", text));
    }
    JobId::parse(text).ok_or_else(|| {
        let message = format!("there is no job `{text}`; `osteon jobs` lists those there are");
        status::no_job(text, message)
    })
}

fn too_long(field: &str, value: &str) -> Status {
    let message = format!("has {} bytes; at most {NAME_BYTES_MAX} are allowed", value.len());
    status::bad_field(field, &message)
}

fn refused(refusal: &Refusal) -> Status {
    let message = refusal.to_string();
    match refusal {
        Refusal::NoJob { job } => status::no_job(job.to_string(), message),
        Refusal::RequestIdTaken { .. } => Status::already_exists(message),
        Refusal::TooManyJobs { .. } => Status::resource_exhausted(message),
        Refusal::NotEnded { .. } => Status::failed_precondition(message),
        Refusal::Draining | Refusal::Store { .. } => Status::unavailable(message),
    }
}

fn stopped() -> Status {
    Status::unavailable("the coordinator has stopped; try again when it is back")
}

fn unexpected() -> Status {
    Status::internal("the coordinator answered another question than was asked")
}
