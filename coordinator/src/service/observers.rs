//! Observers of a job: each receives only the newest snapshot, and a slow one delays nobody.

use std::time::Duration;

use futures::{Stream, StreamExt as _, stream};
use osteon_proto::v1::{JobSnapshot, JobState, WatchResponse};
use tokio::sync::{mpsc, oneshot, watch};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

/// An observer that reads nothing for this long is dropped.
const PATIENCE: Duration = Duration::from_secs(30);

/// Returns a stream of the newest snapshots, starting with the first one other than number `after`,
/// until the job has ended. A slow reader misses the snapshots in between.
pub(crate) fn follow(
    snapshots: watch::Receiver<JobSnapshot>,
    after: u64,
) -> impl Stream<Item = Result<WatchResponse, Status>> {
    let (sender, receiver) = mpsc::channel(1);
    let (over, why) = oneshot::channel();
    tokio::spawn(async move {
        if let Err(status) = feed(snapshots, after, &sender).await {
            // The observer may have gone.
            let _ = over.send(status);
        }
    });
    let last = stream::once(why).filter_map(|why| std::future::ready(why.ok().map(Err)));
    ReceiverStream::new(receiver).map(Ok).chain(last)
}

/// Sends snapshots to one observer until the job has ended or the observer has gone.
async fn feed(
    mut snapshots: watch::Receiver<JobSnapshot>,
    mut seen: u64,
    sender: &mpsc::Sender<WatchResponse>,
) -> Result<(), Status> {
    loop {
        let snapshot = snapshots.borrow_and_update().clone();
        let ended = snapshot.state() == JobState::Ended;
        if ended || snapshot.sequence != seen {
            seen = snapshot.sequence;
            let response = WatchResponse { snapshot: Some(snapshot) };
            match sender.send_timeout(response, PATIENCE).await {
                Ok(()) => {}
                Err(mpsc::error::SendTimeoutError::Closed(_)) => return Ok(()),
                Err(mpsc::error::SendTimeoutError::Timeout(_)) => {
                    return Err(Status::aborted(format!(
                        "nothing was read of this stream for {} s; watch again, after the last \
                         sequence number that was seen",
                        PATIENCE.as_secs()
                    )));
                }
            }
        }
        if ended {
            return Ok(());
        }
        tokio::select! {
            changed = snapshots.changed() => {
                if changed.is_err() {
                    return Err(Status::unavailable(
                        "the coordinator has stopped; try again when it is back",
                    ));
                }
            }
            () = sender.closed() => return Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn snapshot(sequence: u64, state: JobState) -> JobSnapshot {
        JobSnapshot { sequence, state: state.into(), ..JobSnapshot::default() }
    }

    fn sequence(read: Option<Result<WatchResponse, Status>>) -> u64 {
        read.unwrap().unwrap().snapshot.unwrap().sequence
    }

    #[tokio::test]
    async fn a_watch_goes_on_after_what_was_seen() {
        let (sender, receiver) = watch::channel(snapshot(5, JobState::Running));
        let mut all = Box::pin(follow(receiver.clone(), 0));
        let mut resumed = Box::pin(follow(receiver, 5));
        assert_eq!(sequence(all.next().await), 5);
        sender.send_replace(snapshot(9, JobState::Running));
        assert_eq!(sequence(resumed.next().await), 9);
        assert_eq!(sequence(all.next().await), 9);
        // Every observer receives the end, whatever it has seen before.
        sender.send_replace(snapshot(9, JobState::Ended));
        for mut stream in [all, resumed] {
            assert_eq!(sequence(stream.next().await), 9);
            assert!(stream.next().await.is_none());
        }
    }

    #[tokio::test]
    async fn a_coordinator_that_stops_says_so() {
        let (sender, receiver) = watch::channel(snapshot(5, JobState::Running));
        let mut stream = Box::pin(follow(receiver, 0));
        assert_eq!(sequence(stream.next().await), 5);
        drop(sender);
        assert_eq!(stream.next().await.unwrap().unwrap_err().code(), Code::Unavailable);
    }

    #[tokio::test(start_paused = true)]
    async fn who_reads_nothing_is_dropped() {
        let (sender, receiver) = watch::channel(snapshot(1, JobState::Running));
        let mut stream = Box::pin(follow(receiver, 0));
        for sequence in 2..=4 {
            // The observer's task runs, and finds the channel full at the second snapshot.
            tokio::time::sleep(PATIENCE / 2).await;
            sender.send_replace(snapshot(sequence, JobState::Running));
        }
        tokio::time::sleep(PATIENCE * 2).await;
        assert_eq!(sender.receiver_count(), 0);
        assert_eq!(sequence(stream.next().await), 1);
        let dropped = stream.next().await.unwrap().unwrap_err();
        assert_eq!(dropped.code(), Code::Aborted, "{dropped}");
    }
}
