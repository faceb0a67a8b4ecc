//! Sends the output of an ended job to a few clients at a time: only as fast as they read it, and while
//! it is still being read from the store.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use futures::{Stream, StreamExt as _, stream};
use osteon_common::limits::{FETCH_SECONDS_MAX, READER_STALL_SECONDS_MAX};
use osteon_common::outcomes::Outcomes;
use osteon_common::results::{Integrity, JobResult, SetSamples};
use osteon_files::report::{Group, ResultFile};
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::{self, FetchResponse, HistoryBlock};
use osteon_proto::{draws, history, realizations, specification};
use tokio::sync::{mpsc, oneshot};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

use crate::core::ids::JobId;
use crate::service::no_answer::stopped_status;
use crate::store::EndRecord;
use crate::store::job_output::{OutputError, ReadRequest, Reply, StoredOutput};
use crate::store::thread::StoreCommand;

/// Number of messages that are prepared before they are read.
const AHEAD: usize = 2;
/// Maximum number of history rows in one message.
const HISTORY_BLOCK_ROWS: usize = 4096;
/// Maximum number of draws from a posterior in one message.
const DRAW_BLOCK: usize = 4096;
/// Interval of empty history blocks, sent as heartbeats while a part is read or computed.
const SIGN_OF_LIFE: Duration = Duration::from_secs(2);
/// Maximum number of realizations in one message.
const REALIZATION_BLOCK: usize = 65_536;

/// Requests one record from the store. The channel to the store is released at once, so that a
/// pending read does not keep a coordinator from stopping.
pub(crate) async fn read<T>(
    store: &mpsc::WeakSender<StoreCommand>,
    what: impl FnOnce(Reply<T>) -> ReadRequest,
) -> Result<T, Status> {
    let (reply, record) = oneshot::channel();
    let sender = store.upgrade().ok_or_else(stopped_status)?;
    sender.send(StoreCommand::Fetch(what(reply))).await.map_err(|_| stopped_status())?;
    drop(sender);
    record.await.map_err(|_| stopped_status())?.map_err(|error| match error {
        OutputError::Pruned { .. } => Status::not_found(error.to_string()),
        _ => Status::data_loss(error.to_string()),
    })
}

async fn outcomes(
    store: &mpsc::WeakSender<StoreCommand>,
    job: JobId,
    number: Option<u64>,
) -> Result<Option<Outcomes>, Status> {
    let Some(number) = number else { return Ok(None) };
    read(store, |reply| ReadRequest::Outcomes(job, number, reply)).await.map(Some)
}

/// Reads the output of an ended job except its outcomes.
async fn read_output(
    store: &mpsc::WeakSender<StoreCommand>,
    end: EndRecord,
) -> Result<StoredOutput, Status> {
    let job = end.job;
    let record = read(store, |reply| ReadRequest::Job(job, reply)).await?;
    let summary = read(store, |reply| ReadRequest::Summary(job, reply)).await?;
    Ok(StoredOutput { end, specification: record.specification, summary })
}

/// Sends one specification, one result, then blocks of history, realizations and draws; if the data are
/// groups, also the result of each with its blocks of realizations and draws. Parts are read and made
/// while those before them are sent; computations run on a thread of their own.
pub(crate) async fn send_all(
    store: mpsc::WeakSender<StoreCommand>,
    (end, integrity): (EndRecord, Option<Integrity>),
    reader: FetchStream,
) -> Result<(), StreamEnd> {
    let job = end.job;
    let output = Arc::new(reader.wait_with_heartbeats(read_output(&store, end)).await?);
    reader.send(Part::Specification(specification::to_message(&output.specification))).await?;
    let best_outcomes = reader.wait_with_heartbeats(outcomes(&store, job, output.best())).await?;
    let (message, samples) = compute_on_thread(&output, &reader, move |output| {
        let result = JobResult { integrity, ..output.result(best_outcomes) };
        let message = v1::JobResult {
            status: JOB_STATUS.number(result.status),
            reason: result.reason.clone(),
            json: ResultFile::from_job(output.specification.kind, &result).to_json(),
        };
        (message, SetSamples::new(result.best, result.conclusions))
    })
    .await?;
    reader.send(Part::Result(message)).await?;
    for rows in output.summary.history.chunks(HISTORY_BLOCK_ROWS) {
        let rows = rows.iter().map(history::evaluation_to_message).collect();
        reader.send(Part::History(HistoryBlock { rows, groups: Vec::new() })).await?;
    }
    send_samples(None, &samples, &reader).await?;
    for set in 0..output.groups() {
        let read = reader.wait_with_heartbeats(outcomes(&store, job, output.best_of(set))).await?;
        let number = u32::try_from(set).unwrap_or(u32::MAX);
        let found = compute_on_thread(&output, &reader, move |output| {
            let found = output.group(set, read)?;
            let json = Group::new(output.specification.objective, &found).to_json();
            let message = v1::GroupResult { group: number, json };
            Some((message, SetSamples::new(found.best, found.conclusions)))
        });
        let Some((message, samples)) = found.await? else { continue };
        reader.send(Part::Group(message)).await?;
        send_samples(Some(number), &samples, &reader).await?;
    }
    Ok(())
}

/// Runs `compute` on the output of a job, on a thread that may block. The thread cannot be stopped,
/// so it holds the permit of its fetch until it ends: clients that disconnect and come back cannot
/// start more of these threads than there are permits.
async fn compute_on_thread<T: Send + 'static>(
    output: &Arc<StoredOutput>,
    reader: &FetchStream,
    compute: impl FnOnce(&StoredOutput) -> T + Send + 'static,
) -> Result<T, StreamEnd> {
    let (output, permit) = (Arc::clone(output), Arc::clone(&reader.permit));
    let computing = spawn_blocking(move || {
        let _place = permit;
        compute(&output)
    });
    let failed = |_| Status::internal("the result could not be computed; see the log");
    reader.wait_with_heartbeats(async { computing.await.map_err(failed) }).await
}

/// Sends the realizations at the best point of a set of data, then the draws from its posterior.
async fn send_samples(
    group: Option<u32>,
    samples: &SetSamples,
    reader: &FetchStream,
) -> Result<(), StreamEnd> {
    for (block, outcomes) in samples.outcomes.chunks(REALIZATION_BLOCK).enumerate() {
        let first = (block * REALIZATION_BLOCK) as u64;
        let block = realizations::to_message(group, first, outcomes);
        reader.send(Part::Realizations(block)).await?;
    }
    for (block, draws) in samples.draws.chunks(DRAW_BLOCK).enumerate() {
        let first = (block * DRAW_BLOCK) as u64;
        reader.send(Part::Draws(draws::draws_to_message(group, first, draws))).await?;
    }
    Ok(())
}

/// The stream of a fetch to its reader.
pub(crate) struct FetchStream {
    parts: mpsc::Sender<Result<FetchResponse, Status>>,
    until: Instant,
    /// Counts as one of the fetches that are allowed at a time.
    permit: Arc<dyn Send + Sync>,
}

/// Reason for ending the stream.
pub(crate) enum StreamEnd {
    /// The reader is gone.
    Gone,
    /// The reader receives this status.
    Told(Status),
}

impl From<Status> for StreamEnd {
    fn from(status: Status) -> Self {
        Self::Told(status)
    }
}

impl FetchStream {
    /// Sends a part as soon as the parts before it have been read.
    pub(crate) async fn send(&self, part: Part) -> Result<(), StreamEnd> {
        let patience = patience().min(self.until.saturating_duration_since(Instant::now()));
        let message = Ok(FetchResponse { part: Some(part) });
        match timeout(patience, self.parts.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(StreamEnd::Gone),
            Err(_) => Err(StreamEnd::Told(too_late_status())),
        }
    }

    /// Waits for `work`, until the fetch has taken too long or the reader has gone. Heartbeats are
    /// sent meanwhile, because the reader gives up on a silent coordinator.
    async fn wait_with_heartbeats<T>(
        &self,
        work: impl Future<Output = Result<T, Status>>,
    ) -> Result<T, StreamEnd> {
        let mut work = pin!(work);
        loop {
            let left = self.until.saturating_duration_since(Instant::now());
            tokio::select! {
                biased;
                done = &mut work => return done.map_err(StreamEnd::Told),
                () = self.parts.closed() => return Err(StreamEnd::Gone),
                () = sleep(SIGN_OF_LIFE.min(left)) => {}
            }
            if Instant::now() >= self.until {
                return Err(StreamEnd::Told(too_slow_status()));
            }
            let sign = Part::History(HistoryBlock::default());
            // A reader that still has parts to read needs no heartbeat.
            drop(self.parts.try_send(Ok(FetchResponse { part: Some(sign) })));
        }
    }
}

/// Returns the parts that `produce` sends as a stream. A reader that reads nothing for a while, or
/// takes too long in all, receives no more parts, so that the output of the job and the permit
/// `permit` are not held indefinitely.
pub(crate) fn stream_paced<F>(
    permit: impl Send + Sync + 'static,
    produce: impl FnOnce(FetchStream) -> F,
) -> impl Stream<Item = Result<FetchResponse, Status>> + Send
where
    F: Future<Output = Result<(), StreamEnd>> + Send + 'static,
{
    let (parts, sent) = mpsc::channel(AHEAD);
    let (told, ending) = oneshot::channel();
    let until = Instant::now() + Duration::from_secs(FETCH_SECONDS_MAX);
    let producing = produce(FetchStream { parts, until, permit: Arc::new(permit) });
    tokio::spawn(async move {
        // The permit is released when this ends.
        let stopped = producing.await;
        if let Err(StreamEnd::Told(status)) = stopped {
            // The reader may have gone by now.
            drop(told.send(status));
        }
    });
    let ending = stream::once(ending).filter_map(|told| async move { told.ok().map(Err) });
    ReceiverStream::new(sent).chain(ending)
}

fn patience() -> Duration {
    Duration::from_secs(READER_STALL_SECONDS_MAX)
}

fn too_late_status() -> Status {
    Status::deadline_exceeded(format!(
        "the client read nothing of the results for {READER_STALL_SECONDS_MAX} s, or not all of them \
         within {FETCH_SECONDS_MAX} s; fetch them again"
    ))
}

fn too_slow_status() -> Status {
    Status::deadline_exceeded(format!(
        "the results were not read and computed within {FETCH_SECONDS_MAX} s; fetch them again when the \
         coordinator has less to do"
    ))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc as blocking;

    use futures::FutureExt as _;
    use osteon_common::parameters::Point;
    use osteon_common::posterior::PosteriorDraw;
    use prost::Message as _;
    use tokio::sync::{OwnedSemaphorePermit, Semaphore};
    use tokio::time::advance;
    use tonic::Code;

    use super::*;
    use crate::store::job_output::tests::ended;

    /// Returns a fetch of `count` parts.
    fn parts(
        count: usize,
        permit: OwnedSemaphorePermit,
    ) -> impl Stream<Item = Result<FetchResponse, Status>> + Send {
        stream_paced(permit, move |reader| async move {
            for _ in 0..count {
                reader.send(Part::History(HistoryBlock::default())).await?;
            }
            Ok(())
        })
    }

    async fn permit(semaphore: &Arc<Semaphore>) -> OwnedSemaphorePermit {
        Arc::clone(semaphore).acquire_owned().await.unwrap()
    }

    #[tokio::test(start_paused = true)]
    async fn a_steady_reader_gets_everything() {
        let semaphore = Arc::new(Semaphore::new(1));
        let mut stream = Box::pin(parts(10, permit(&semaphore).await));
        let mut count = 0;
        while let Some(part) = stream.next().await {
            part.unwrap();
            count += 1;
            sleep(patience() / 2).await;
        }
        assert_eq!(count, 10);
        drop(permit(&semaphore).await);
    }

    #[tokio::test(start_paused = true)]
    async fn who_does_not_read_gives_the_place_back_and_is_told() {
        let semaphore = Arc::new(Semaphore::new(1));
        let stream = parts(10, permit(&semaphore).await);
        // A permit is available only when the first fetch has lost its own.
        drop(permit(&semaphore).await);
        let read: Vec<_> = stream.collect().await;
        assert_eq!(read.len(), AHEAD + 1);
        let last = read.last().unwrap().as_ref().unwrap_err();
        assert_eq!(last.code(), Code::DeadlineExceeded);
    }

    #[tokio::test(start_paused = true)]
    async fn who_reads_a_little_now_and_then_does_not_hold_the_place_for_ever() {
        let semaphore = Arc::new(Semaphore::new(1));
        let mut stream = Box::pin(parts(100, permit(&semaphore).await));
        let begun = Instant::now();
        while let Some(Ok(_)) = stream.next().await {
            sleep(patience() * 9 / 10).await;
        }
        let held = begun.elapsed();
        assert!(held < Duration::from_secs(FETCH_SECONDS_MAX) + 4 * patience(), "{held:?}");
        drop(permit(&semaphore).await);
    }

    #[tokio::test(start_paused = true)]
    async fn who_goes_gives_the_place_back_at_once() {
        let semaphore = Arc::new(Semaphore::new(1));
        drop(parts(10, permit(&semaphore).await));
        let back = timeout(patience() / 2, permit(&semaphore)).await;
        assert!(back.is_ok());
    }

    fn is_sign(part: &Part) -> bool {
        *part == Part::History(HistoryBlock::default())
    }

    #[tokio::test(start_paused = true)]
    async fn signs_of_life_come_while_the_store_is_read() {
        let (job, search, end, best) = ended();
        let (store, mut commands) = mpsc::channel(1);
        let weak = store.downgrade();
        let slow = tokio::spawn(async move {
            while let Some(StoreCommand::Fetch(reading)) = commands.recv().await {
                sleep(patience()).await;
                let answered = match reading {
                    ReadRequest::Job(_, reply) => reply.send(Ok(job.clone())).is_ok(),
                    ReadRequest::Summary(_, reply) => reply.send(Ok(search.summary())).is_ok(),
                    ReadRequest::Outcomes(_, _, reply) => {
                        reply.send(Ok(best.outcomes.clone())).is_ok()
                    }
                };
                assert!(answered, "nobody waits any more");
            }
        });
        let mut stream = Box::pin(stream_paced((), |reader| send_all(weak, (end, None), reader)));
        let (mut parts, mut signs) = (Vec::new(), 0);
        while let Some(part) = timeout(2 * SIGN_OF_LIFE, stream.next()).await.unwrap() {
            let part = part.unwrap().part.unwrap();
            if is_sign(&part) {
                signs += 1;
            } else {
                parts.push(part);
            }
        }
        // Three records were read.
        assert!(signs > 3 * 10, "{signs}");
        assert!(matches!(
            parts[..],
            [Part::Specification(_), Part::Result(_), Part::History(_), Part::Realizations(_)]
        ));
        drop(store);
        slow.await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn a_store_that_never_answers_is_not_waited_for_for_ever() {
        let (_, _, end, _) = ended();
        let (store, _commands) = mpsc::channel(1);
        let semaphore = Arc::new(Semaphore::new(1));
        let permit = permit(&semaphore).await;
        let stream =
            stream_paced(permit, |reader| send_all(store.downgrade(), (end, None), reader));
        let limit = Duration::from_secs(FETCH_SECONDS_MAX) + patience();
        let parts: Vec<_> = timeout(limit, stream.collect()).await.unwrap();
        let last = parts.last().unwrap().as_ref().unwrap_err();
        assert_eq!(last.code(), Code::DeadlineExceeded);
        assert!(last.message().contains("not read and computed"), "{last}");
        assert_eq!(semaphore.available_permits(), 1);
    }

    #[tokio::test(start_paused = true)]
    async fn draws_follow_the_realizations_in_blocks_that_follow_each_other() {
        let draw = PosteriorDraw {
            point: Point::of_bone([1.0; 7]),
            log_density: -1.5,
            mean: 3900.0,
            coefficient_of_variation: 0.03,
        };
        let samples = SetSamples { outcomes: vec![Ok(3900.0)], draws: vec![draw; DRAW_BLOCK + 1] };
        let stream =
            stream_paced(
                (),
                |reader| async move { send_samples(Some(3), &samples, &reader).await },
            );
        let parts: Vec<_> = stream.map(|part| part.unwrap().part.unwrap()).collect().await;
        let [Part::Realizations(_), Part::Draws(first), Part::Draws(last)] = parts.as_slice()
        else {
            panic!("{} other parts", parts.len());
        };
        assert_eq!((first.group, first.first, first.draws.len()), (Some(3), 0, DRAW_BLOCK));
        assert_eq!((last.group, last.first, last.draws.len()), (Some(3), DRAW_BLOCK as u64, 1));
        assert!(first.encoded_len() < 1 << 20, "{} bytes", first.encoded_len());
    }

    /// Advances time until the stream has an item.
    async fn next(
        stream: &mut (impl Stream<Item = Result<FetchResponse, Status>> + Unpin),
    ) -> Option<Result<FetchResponse, Status>> {
        for _ in 0..2 * FETCH_SECONDS_MAX {
            if let Some(next) = stream.next().now_or_never() {
                return next;
            }
            // While a thread computes, a paused clock does not advance by itself.
            advance(SIGN_OF_LIFE / 4).await;
        }
        panic!("nothing came");
    }

    #[tokio::test(start_paused = true)]
    async fn signs_of_life_come_while_the_result_is_computed_which_keeps_its_place() {
        let (job, search, end, _) = ended();
        let summary = search.summary();
        let left = Arc::new(StoredOutput { end, specification: job.specification, summary });
        let semaphore = Arc::new(Semaphore::new(1));
        let (release, released) = blocking::channel();
        let permit = permit(&semaphore).await;
        let mut stream = Box::pin(stream_paced(permit, |reader| async move {
            compute_on_thread(&left, &reader, move |_| released.recv().unwrap()).await
        }));
        for _ in 0..10 {
            let part = next(&mut stream).await.unwrap().unwrap().part.unwrap();
            assert!(is_sign(&part), "{part:?}");
        }
        drop(stream);
        for _ in 0..10 {
            tokio::task::yield_now().await;
        }
        assert_eq!(semaphore.available_permits(), 0, "others may begin to compute");
        release.send(()).unwrap();
        drop(semaphore.acquire().await.unwrap());
    }
}
