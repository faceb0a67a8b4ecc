//! Sending what a job left: a few at a time, and to those who read.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use futures::{Stream, StreamExt as _, stream};
use osteon_common::limits::{FETCH_S_MAX, READER_PATIENCE_S};
use osteon_proto::v1::FetchResponse;
use osteon_proto::v1::fetch_response::Part;
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

/// Messages that are made before they are read.
const AHEAD: usize = 2;

/// The parts as a stream. Whoever takes nothing for a while, or takes too long for all, gets nothing
/// more, so that what the job left, and its `place` among the fetches, are not held for ever.
pub(crate) fn paced(
    parts: impl Iterator<Item = Part> + Send + 'static,
    place: impl Send + 'static,
) -> impl Stream<Item = Result<FetchResponse, Status>> + Send {
    let (sender, sent) = mpsc::channel(AHEAD);
    let too_slow = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&too_slow);
    tokio::spawn(async move {
        let _place = place;
        let until = Instant::now() + Duration::from_secs(FETCH_S_MAX);
        for part in parts {
            let patience = patience().min(until.saturating_duration_since(Instant::now()));
            let message = Ok(FetchResponse { part: Some(part) });
            match timeout(patience, sender.send(message)).await {
                Ok(Ok(())) => {}
                // The reader is gone.
                Ok(Err(_)) => return,
                Err(_) => {
                    too_slow.store(true, Ordering::Release);
                    return;
                }
            }
        }
    });
    let ending = stream::once(async move { told.load(Ordering::Acquire) });
    let ending = ending.filter_map(|too_slow| async move { too_slow.then(|| Err(too_late())) });
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
    use osteon_proto::v1::HistoryBlock;
    use tokio::sync::{OwnedSemaphorePermit, Semaphore};
    use tokio::time::sleep;
    use tonic::Code;

    use super::*;

    fn parts(count: usize) -> impl Iterator<Item = Part> + Send {
        (0..count).map(|_| Part::History(HistoryBlock::default()))
    }

    async fn place(places: &Arc<Semaphore>) -> OwnedSemaphorePermit {
        Arc::clone(places).acquire_owned().await.unwrap()
    }

    #[tokio::test(start_paused = true)]
    async fn a_steady_reader_gets_everything() {
        let places = Arc::new(Semaphore::new(1));
        let mut stream = Box::pin(paced(parts(10), place(&places).await));
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
        let stream = paced(parts(10), place(&places).await);
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
        let mut stream = Box::pin(paced(parts(100), place(&places).await));
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
        drop(paced(parts(10), place(&places).await));
        let back = timeout(patience() / 2, place(&places)).await;
        assert!(back.is_ok());
    }
}
