//! Body of a call, whose declared length is read before the message itself.

use std::future::poll_fn;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use http_body::{Body as HttpBody, Frame};
use tokio::time::{Sleep, sleep};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Bytes;

/// Length of the prefix of each message: one byte that tells whether it is compressed, then its
/// length as four bytes, most significant first (gRPC over HTTP/2, "Length-Prefixed-Message").
const PREFIX_BYTES: usize = 5;

/// A message whose prefix has arrived.
pub(crate) struct MessageBody {
    /// Bytes that have arrived and are not passed on yet.
    begun: Option<Bytes>,
    rest: Body,
    length: u64,
    patience: Option<(Duration, Pin<Box<Sleep>>)>,
}

impl MessageBody {
    /// Waits for the prefix of the message.
    ///
    /// # Errors
    /// An error of the connection.
    pub(crate) async fn begin(mut rest: Body) -> Result<Self, Status> {
        let mut begun = Vec::new();
        while begun.len() < PREFIX_BYTES {
            match poll_fn(|cx| Pin::new(&mut rest).poll_frame(cx)).await {
                // Trailers contain no data.
                Some(frame) => begun.extend(frame?.into_data().unwrap_or_default()),
                // The reader of the body reports that it is too short.
                None => break,
            }
        }
        let length = match begun[..] {
            [_, a, b, c, d, ..] => u64::from(u32::from_be_bytes([a, b, c, d])),
            _ => 0,
        };
        Ok(Self { begun: Some(begun.into()), rest, length, patience: None })
    }

    /// Returns the declared length of the message, bytes.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Returns the whole body, which must arrive within `limit` from now.
    pub(crate) fn collect_within(self, limit: Duration) -> Self {
        Self { patience: Some((limit, Box::pin(sleep(limit)))), ..self }
    }
}

impl HttpBody for MessageBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if let Some(begun) = self.begun.take() {
            return Poll::Ready(Some(Ok(Frame::data(begun))));
        }
        if let Some((limit, over)) = &mut self.patience
            && over.as_mut().poll(cx).is_ready()
        {
            let message = format!("the message did not come within {} s", limit.as_secs());
            return Poll::Ready(Some(Err(Status::deadline_exceeded(message))));
        }
        Pin::new(&mut self.rest).poll_frame(cx)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use tonic::Code;

    use super::*;

    /// A body of these pieces that never ends.
    struct Pieces(VecDeque<&'static [u8]>);

    impl HttpBody for Pieces {
        type Data = Bytes;
        type Error = Status;

        fn poll_frame(
            mut self: Pin<&mut Self>,
            _: &mut Context<'_>,
        ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
            match self.0.pop_front() {
                Some(piece) => Poll::Ready(Some(Ok(Frame::data(Bytes::from_static(piece))))),
                None => Poll::Pending,
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_message_is_passed_on_whole_and_in_time() {
        let pieces: [&[u8]; 4] = [&[0, 0], &[1], &[2, 3, 7], &[8, 9]];
        let body = Body::new(Pieces(pieces.into()));
        let message = MessageBody::begin(body).await.unwrap();
        assert_eq!(message.length(), 0x1_0203);
        let mut message = message.collect_within(Duration::from_secs(3));
        let mut passed = Vec::new();
        let error = loop {
            match poll_fn(|cx| Pin::new(&mut message).poll_frame(cx)).await.unwrap() {
                Ok(frame) => passed.extend(frame.into_data().unwrap()),
                Err(error) => break error,
            }
        };
        assert_eq!(passed, pieces.concat());
        assert_eq!(error.code(), Code::DeadlineExceeded);
        assert!(error.message().contains("within 3 s"), "{error}");
    }
}
