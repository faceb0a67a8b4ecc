//! Sends a copy of the store: one at a time, as fast as the client reads it.

use std::fs::File;
use std::time::Duration;

use futures::Stream;
use osteon_common::limits::{BACKUP_SECONDS_MAX, READER_STALL_SECONDS_MAX};
use osteon_proto::v1::backup_response::Part;
use osteon_proto::v1::{BackupEnd, BackupResponse};
use tokio::io::AsyncReadExt as _;
use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, sleep, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

use crate::service::no_answer::stopped_status;
use crate::store::StoreError;

/// Number of messages that are prepared before they are read.
const AHEAD: usize = 2;
/// Bytes of the file in one message.
const PART_BYTES: usize = 256 << 10;
/// Interval of empty parts, sent as heartbeats while the copy is made.
const SIGN_OF_LIFE: Duration = Duration::from_secs(2);

/// Result of a copy by the store's thread; `None` if it was stopped.
pub(crate) type Copied = Result<Option<File>, StoreError>;

/// Streams the copy. The permit `place` is held until the stream ends; a client that reads nothing
/// for a while, or takes too long in all, receives no more parts.
pub(crate) fn stream_copy(
    copied: oneshot::Receiver<Copied>,
    place: impl Send + 'static,
) -> impl Stream<Item = Result<BackupResponse, Status>> + Send {
    let (sender, sent) = mpsc::channel(AHEAD);
    tokio::spawn(async move {
        let _place = place;
        let begun = Instant::now();
        let outgoing =
            PartSender { sender, until: begun + Duration::from_secs(BACKUP_SECONDS_MAX) };
        match send(copied, &outgoing).await {
            Ok(bytes) => {
                let elapsed_s = begun.elapsed().as_secs_f64();
                tracing::info!(bytes, elapsed_s, "backup sent");
            }
            Err(Unsent::Gone) => tracing::warn!("backup ended: its client has gone"),
            Err(Unsent::Refused(status)) => {
                tracing::warn!(reason = status.message(), "backup failed");
                // A client that does not read sees the stream end.
                drop(outgoing.sender.try_send(Err(status)));
            }
        }
    });
    ReceiverStream::new(sent)
}

/// Reason why a copy was not sent completely.
enum Unsent {
    /// The client has gone.
    Gone,
    /// The client receives this status.
    Refused(Status),
}

/// Destination of the parts.
struct PartSender {
    sender: mpsc::Sender<Result<BackupResponse, Status>>,
    /// Time limit of the whole copy.
    until: Instant,
}

impl PartSender {
    async fn send(&self, part: Part) -> Result<(), Unsent> {
        let left = self.until.saturating_duration_since(Instant::now());
        let patience = Duration::from_secs(READER_STALL_SECONDS_MAX).min(left);
        let message = Ok(BackupResponse { part: Some(part) });
        match timeout(patience, self.sender.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(Unsent::Gone),
            Err(_) => Err(Unsent::Refused(Status::deadline_exceeded(format!(
                "the client read nothing of the backup for {READER_STALL_SECONDS_MAX} s, or not all of \
                 it within {BACKUP_SECONDS_MAX} s; start the backup again"
            )))),
        }
    }
}

/// Waits for the copy and sends it; returns its length.
async fn send(copied: oneshot::Receiver<Copied>, outgoing: &PartSender) -> Result<u64, Unsent> {
    let file = wait_for_copy(copied, outgoing).await?;
    let unread = |error: std::io::Error| {
        Unsent::Refused(Status::unavailable(format!("the copy cannot be read: {error}")))
    };
    let mut file = tokio::fs::File::from_std(file);
    let mut digest = blake3::Hasher::new();
    let mut length = 0;
    loop {
        let mut data = Vec::with_capacity(PART_BYTES);
        let part = (&mut file).take(PART_BYTES as u64).read_to_end(&mut data).await;
        if part.map_err(unread)? == 0 {
            break;
        }
        digest.update(&data);
        length += data.len() as u64;
        outgoing.send(Part::Data(data)).await?;
    }
    let digest = digest.finalize().to_hex().to_string();
    outgoing.send(Part::End(BackupEnd { length, digest })).await?;
    Ok(length)
}

/// Returns the file of the copy when it is complete.
async fn wait_for_copy(
    mut copied: oneshot::Receiver<Copied>,
    outgoing: &PartSender,
) -> Result<File, Unsent> {
    loop {
        outgoing.send(Part::Data(Vec::new())).await?;
        tokio::select! {
            copied = &mut copied => {
                return match copied {
                    Ok(Ok(Some(file))) => Ok(file),
                    Ok(Err(error)) => Err(Unsent::Refused(refusal_status(&error))),
                    // The store's thread ends with the coordinator.
                    Ok(Ok(None)) | Err(_) => Err(Unsent::Refused(stopped_status())),
                };
            }
            () = outgoing.sender.closed() => return Err(Unsent::Gone),
            () = sleep(SIGN_OF_LIFE) => {}
        }
    }
}

fn refusal_status(error: &StoreError) -> Status {
    match error {
        StoreError::NoFile => Status::failed_precondition(error.to_string()),
        _ => Status::unavailable(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use futures::StreamExt as _;
    use tokio::sync::Semaphore;
    use tonic::Code;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn signs_of_life_come_while_the_copy_is_made_and_its_client_may_go() {
        let (reply, copied) = oneshot::channel();
        let places = std::sync::Arc::new(Semaphore::new(1));
        let place = places.clone().acquire_owned().await;
        let mut stream = Box::pin(stream_copy(copied, place));
        let begun = Instant::now();
        for _ in 0..5 {
            let part = stream.next().await.unwrap().unwrap().part;
            assert_eq!(part, Some(Part::Data(Vec::new())));
        }
        assert!(begun.elapsed() >= 4 * SIGN_OF_LIFE, "{:?}", begun.elapsed());
        // The store's thread notices, and the next client gets the permit.
        drop(stream);
        drop(places.acquire().await);
        assert!(reply.is_closed());
    }

    #[tokio::test(start_paused = true)]
    async fn who_does_not_read_gives_the_place_back() {
        let (reply, copied) = oneshot::channel();
        let places = std::sync::Arc::new(Semaphore::new(1));
        let file = tempfile::tempfile().unwrap();
        file.set_len(100 * PART_BYTES as u64).unwrap();
        reply.send(Ok(Some(file))).unwrap();
        let place = places.clone().acquire_owned().await;
        let stream = stream_copy(copied, place);
        drop(places.acquire().await);
        assert!(stream.collect::<Vec<_>>().await.len() <= AHEAD + 1);
    }

    #[tokio::test]
    async fn a_store_in_memory_has_nothing_to_copy() {
        let (reply, copied) = oneshot::channel();
        reply.send(Err(StoreError::NoFile)).unwrap();
        let parts: Vec<_> = stream_copy(copied, ()).collect().await;
        let refused = parts.last().unwrap().as_ref().unwrap_err();
        assert_eq!(refused.code(), Code::FailedPrecondition);
        assert!(refused.message().contains("in memory"), "{refused}");
    }
}
