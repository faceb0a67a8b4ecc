//! Connections that end when their peer stops reading.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Sleep, sleep};

/// A peer that takes no byte for this long is dropped.
const PATIENCE: Duration = Duration::from_secs(30);

/// A connection whose writes fail when its peer has stopped reading for 30 s. Otherwise a page that nobody looks
/// at, or a client that sends request after request and reads no answer, would occupy it forever.
#[derive(Debug)]
pub(crate) struct ReadPeer<C> {
    connection: C,
    /// Time limit of the write under way.
    patience: Option<Pin<Box<Sleep>>>,
}

impl<C> ReadPeer<C> {
    /// Wraps a connection.
    pub(crate) fn new(connection: C) -> Self {
        Self { connection, patience: None }
    }

    /// Limits the time of an operation that has to wait for the peer.
    fn limit_wait<T>(
        &mut self,
        cx: &mut Context<'_>,
        polled: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if polled.is_ready() {
            self.patience = None;
            return polled;
        }
        let patience = self.patience.get_or_insert_with(|| Box::pin(sleep(PATIENCE)));
        patience.as_mut().poll(cx).map(|()| Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<C: AsyncRead + Unpin> AsyncRead for ReadPeer<C> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.connection).poll_read(cx, buffer)
    }
}

impl<C: AsyncWrite + Unpin> AsyncWrite for ReadPeer<C> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.connection).poll_write(cx, bytes);
        self.limit_wait(cx, written)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.connection).poll_flush(cx);
        self.limit_wait(cx, flushed)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let shut = Pin::new(&mut self.connection).poll_shutdown(cx);
        self.limit_wait(cx, shut)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, duplex};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn who_does_not_read_is_dropped_and_who_reads_slowly_is_not() {
        let (near, mut far) = duplex(4);
        let mut near = ReadPeer::new(near);
        let reading = tokio::spawn(async move {
            for _ in 0..3 {
                sleep(PATIENCE * 9 / 10).await;
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
