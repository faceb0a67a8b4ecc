//! Connections whose clients must read their answers.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Sleep, sleep};

/// A client that takes no byte for this long is dropped.
const UNREAD_MAX: Duration = Duration::from_secs(30);

/// A connection that fails when its client stops reading, as one may that sends request after request;
/// otherwise it would keep its place forever.
#[derive(Debug)]
pub(super) struct UnreadBounded<C> {
    connection: C,
    /// Time limit of the write under way.
    limit: Option<Pin<Box<Sleep>>>,
}

impl<C> UnreadBounded<C> {
    pub(super) fn new(connection: C) -> Self {
        Self { connection, limit: None }
    }

    /// Limits the time of an operation that waits for the client.
    fn bounded<T>(
        &mut self,
        cx: &mut Context<'_>,
        polled: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if polled.is_ready() {
            self.limit = None;
            return polled;
        }
        let limit = self.limit.get_or_insert_with(|| Box::pin(sleep(UNREAD_MAX)));
        limit.as_mut().poll(cx).map(|()| Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<C: AsyncRead + Unpin> AsyncRead for UnreadBounded<C> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.connection).poll_read(cx, buffer)
    }
}

impl<C: AsyncWrite + Unpin> AsyncWrite for UnreadBounded<C> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.connection).poll_write(cx, bytes);
        self.bounded(cx, written)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.connection).poll_flush(cx);
        self.bounded(cx, flushed)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let shut = Pin::new(&mut self.connection).poll_shutdown(cx);
        self.bounded(cx, shut)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, duplex};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn only_who_stops_reading_is_dropped() {
        let (near, mut far) = duplex(4);
        let mut near = UnreadBounded::new(near);
        let reading = tokio::spawn(async move {
            for _ in 0..3 {
                sleep(UNREAD_MAX * 9 / 10).await;
                far.read_u8().await.unwrap();
            }
            far
        });
        near.write_all(&[0; 7]).await.unwrap();
        let _far = reading.await.unwrap();
        let error = near.write_all(&[0; 8]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    }
}
