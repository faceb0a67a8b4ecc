//! Sending what a job left: a few at a time, to those who read, and as it is read.

use std::sync::Arc;
use std::time::Duration;

use futures::{Stream, StreamExt as _, stream};
use osteon_common::limits::{FETCH_S_MAX, READER_PATIENCE_S};
use osteon_common::outcome::Outcome;
use osteon_common::results::BestPoint;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::{FetchResponse, HistoryBlock};
use osteon_proto::{realizations, results, specification};
use tokio::sync::{mpsc, oneshot};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

use crate::ids::JobId;
use crate::leftover::{Left, ReadError, Reading, Reply};
use crate::store::EndRecord;
use crate::store_thread::Command;

/// Messages that are made before they are read.
const AHEAD: usize = 2;
/// Rows of the history in one message.
const HISTORY_BLOCK_ROWS: usize = 4096;
/// Realizations in one message.
const REALIZATION_BLOCK: usize = 65_536;

/// What an ended job left, and the outcomes of its best evaluation; those of its groups are read one
/// after the other.
pub(crate) struct Opened {
    left: Arc<Left>,
    outcomes: Option<Arc<[Outcome]>>,
    /// Weak, so that who reads slowly does not keep a coordinator from stopping.
    store: mpsc::WeakSender<Command>,
}

/// Reads all that an ended job left but its groups.
///
/// # Errors
/// When the store cannot be read, something is missing in it, or the coordinator has stopped.
pub(crate) async fn open(store: &mpsc::Sender<Command>, end: EndRecord) -> Result<Opened, Status> {
    let job = end.job;
    let record = read(store, |reply| Reading::Job(job, reply)).await?;
    let summary = read(store, |reply| Reading::Summary(job, reply)).await?;
    let left = Left { end, specification: record.specification, summary };
    let outcomes = outcomes(store, job, left.best()).await?;
    Ok(Opened { left: Arc::new(left), outcomes, store: store.downgrade() })
}

async fn outcomes(
    store: &mpsc::Sender<Command>,
    job: JobId,
    number: Option<u64>,
) -> Result<Option<Arc<[Outcome]>>, Status> {
    let Some(number) = number else { return Ok(None) };
    read(store, |reply| Reading::Outcomes(job, number, reply)).await.map(Some)
}

async fn read<T>(
    store: &mpsc::Sender<Command>,
    what: impl FnOnce(Reply<T>) -> Reading,
) -> Result<T, Status> {
    let (reply, record) = oneshot::channel();
    store.send(Command::Fetch(what(reply))).await.map_err(|_| stopped())?;
    record.await.map_err(|_| stopped())?.map_err(|error| match error {
        ReadError::Pruned { .. } => Status::not_found(error.to_string()),
        _ => Status::data_loss(error.to_string()),
    })
}

fn stopped() -> Status {
    Status::unavailable("the coordinator has stopped; try again when it is back")
}

/// Sends one specification, one result, history blocks, realization blocks; where the data are groups
/// the result and the realization blocks of each. Made as they are sent, and what is computed for them
/// on a thread of its own.
pub(crate) async fn send_all(opened: Opened, reader: Reader) -> Result<(), Stop> {
    let Opened { left, outcomes: of_best, store } = opened;
    reader.send(Part::Specification(specification::to_message(&left.specification))).await?;
    let (message, of_best) = computed(&left, move |left| {
        let result = left.result(of_best);
        (results::to_message(&result), outcomes_of(result.best))
    })
    .await?;
    reader.send(Part::Result(message)).await?;
    for rows in left.summary.history.chunks(HISTORY_BLOCK_ROWS) {
        let rows = rows.iter().map(results::evaluation_to_message).collect();
        reader.send(Part::History(HistoryBlock { rows, groups: Vec::new() })).await?;
    }
    send_realizations(None, &of_best, &reader).await?;
    for set in 0..left.groups() {
        let read = {
            let store = store.upgrade().ok_or_else(stopped)?;
            outcomes(&store, left.end.job, left.best_of(set)).await?
        };
        let number = u32::try_from(set).unwrap_or(u32::MAX);
        let found = computed(&left, move |left| {
            let found = left.group(set, read)?;
            let message = results::group_to_message(number, &found);
            Some((message, outcomes_of(found.best)))
        });
        let Some((message, of_group)) = found.await? else { continue };
        reader.send(Part::Group(message)).await?;
        send_realizations(Some(number), &of_group, &reader).await?;
    }
    Ok(())
}

fn outcomes_of(best: Option<BestPoint>) -> Vec<Outcome> {
    best.map(|best| best.outcomes).unwrap_or_default()
}

/// What `compute` makes of what a job left, on a thread that may take its time.
async fn computed<T: Send + 'static>(
    left: &Arc<Left>,
    compute: impl FnOnce(&Left) -> T + Send + 'static,
) -> Result<T, Status> {
    let left = Arc::clone(left);
    let done = spawn_blocking(move || compute(&left)).await;
    done.map_err(|_| Status::internal("the result could not be computed; see the log"))
}

async fn send_realizations(
    group: Option<u32>,
    outcomes: &[Outcome],
    reader: &Reader,
) -> Result<(), Stop> {
    for (block, outcomes) in outcomes.chunks(REALIZATION_BLOCK).enumerate() {
        let first = (block * REALIZATION_BLOCK) as u64;
        let block = realizations::to_message(group, first, outcomes);
        reader.send(Part::Realizations(block)).await?;
    }
    Ok(())
}

/// Who reads a fetch.
pub(crate) struct Reader {
    parts: mpsc::Sender<Result<FetchResponse, Status>>,
    until: Instant,
}

/// Why no more is sent.
pub(crate) enum Stop {
    /// The reader is gone.
    Gone,
    /// The reader is told so.
    Told(Status),
}

impl From<Status> for Stop {
    fn from(status: Status) -> Self {
        Self::Told(status)
    }
}

impl Reader {
    /// Hands over a part, as soon as those before it are read.
    pub(crate) async fn send(&self, part: Part) -> Result<(), Stop> {
        let patience = patience().min(self.until.saturating_duration_since(Instant::now()));
        let message = Ok(FetchResponse { part: Some(part) });
        match timeout(patience, self.parts.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(Stop::Gone),
            Err(_) => Err(Stop::Told(too_late())),
        }
    }
}

/// The parts that `produce` sends as a stream. Whoever takes nothing for a while, or takes too long for
/// all, gets nothing more, so that what the job left, and its `place` among the fetches, are not held for
/// ever.
pub(crate) fn paced<F>(
    place: impl Send + 'static,
    produce: impl FnOnce(Reader) -> F,
) -> impl Stream<Item = Result<FetchResponse, Status>> + Send
where
    F: Future<Output = Result<(), Stop>> + Send + 'static,
{
    let (parts, sent) = mpsc::channel(AHEAD);
    let (told, ending) = oneshot::channel();
    let until = Instant::now() + Duration::from_secs(FETCH_S_MAX);
    let producing = produce(Reader { parts, until });
    tokio::spawn(async move {
        let stopped = producing.await;
        drop(place);
        if let Err(Stop::Told(status)) = stopped {
            // The reader may be gone by now.
            drop(told.send(status));
        }
    });
    let ending = stream::once(ending).filter_map(|told| async move { told.ok().map(Err) });
    ReceiverStream::new(sent).chain(ending)
}

fn patience() -> Duration {
    Duration::from_secs(READER_PATIENCE_S)
}

fn too_late() -> Status {
    Status::deadline_exceeded(format!(
        "nothing of the results was read for {READER_PATIENCE_S} s, or not all within {FETCH_S_MAX} s; \
         fetch them again"
    ))
}

#[cfg(test)]
mod tests {
    use tokio::sync::{OwnedSemaphorePermit, Semaphore};
    use tokio::time::sleep;
    use tonic::Code;

    use super::*;

    /// A fetch of so many parts.
    fn parts(
        count: usize,
        place: OwnedSemaphorePermit,
    ) -> impl Stream<Item = Result<FetchResponse, Status>> + Send {
        paced(place, move |reader| async move {
            for _ in 0..count {
                reader.send(Part::History(HistoryBlock::default())).await?;
            }
            Ok(())
        })
    }

    async fn place(places: &Arc<Semaphore>) -> OwnedSemaphorePermit {
        Arc::clone(places).acquire_owned().await.unwrap()
    }

    #[tokio::test(start_paused = true)]
    async fn a_steady_reader_gets_everything() {
        let places = Arc::new(Semaphore::new(1));
        let mut stream = Box::pin(parts(10, place(&places).await));
        let mut count = 0;
        while let Some(part) = stream.next().await {
            part.unwrap();
            count += 1;
            sleep(patience() / 2).await;
        }
        assert_eq!(count, 10);
        drop(place(&places).await);
    }

    #[tokio::test(start_paused = true)]
    async fn who_does_not_read_gives_the_place_back_and_is_told() {
        let places = Arc::new(Semaphore::new(1));
        let stream = parts(10, place(&places).await);
        // Comes only when the first one has lost its place.
        drop(place(&places).await);
        let read: Vec<_> = stream.collect().await;
        assert_eq!(read.len(), AHEAD + 1);
        let last = read.last().unwrap().as_ref().unwrap_err();
        assert_eq!(last.code(), Code::DeadlineExceeded);
    }

    #[tokio::test(start_paused = true)]
    async fn who_reads_a_little_now_and_then_does_not_hold_the_place_for_ever() {
        let places = Arc::new(Semaphore::new(1));
        let mut stream = Box::pin(parts(100, place(&places).await));
        let begun = Instant::now();
        while let Some(Ok(_)) = stream.next().await {
            sleep(patience() * 9 / 10).await;
        }
        let held = begun.elapsed();
        assert!(held < Duration::from_secs(FETCH_S_MAX) + 4 * patience(), "{held:?}");
        drop(place(&places).await);
    }

    #[tokio::test(start_paused = true)]
    async fn who_goes_gives_the_place_back_at_once() {
        let places = Arc::new(Semaphore::new(1));
        drop(parts(10, place(&places).await));
        let back = timeout(patience() / 2, place(&places)).await;
        assert!(back.is_ok());
    }
}
