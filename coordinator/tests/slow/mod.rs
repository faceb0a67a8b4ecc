//! Submissions that begin and then stall.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use osteon_common::job::{Data, JobSpecification};
use osteon_common::limits::SMALL_SUBMISSION_BYTES_MAX;
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::{Bytes, Service as _, http};
use tonic::transport::Channel;

use crate::fake;

/// Returns a job whose submission is large enough to need a permit.
pub(crate) fn large() -> JobSpecification {
    let count = SMALL_SUBMISSION_BYTES_MAX as u32 / 4;
    let data =
        Some(Data::from_velocities((0..count).map(|i| 3900.0 + f64::from(i % 10)).collect()));
    JobSpecification { data, ..fake::identification(100, 10, 7) }
}

/// Begins a submission that announces `length` bytes and then stalls, until it is answered or its
/// deadline has passed.
pub(crate) async fn begin_submission(
    mut channel: Channel,
    length: u32,
    deadline: Option<Duration>,
) {
    let mut begun = vec![0];
    begun.extend(length.to_be_bytes());
    begun.push(0x0a);
    let mut request = http::Request::post("http://coordinator/osteon.v1.Jobs/Submit")
        .header("content-type", "application/grpc")
        .header("te", "trailers");
    if let Some(deadline) = deadline {
        request = request.header("grpc-timeout", format!("{}m", deadline.as_millis()));
    }
    let request = request.body(Body::new(Begun(Some(begun.into())))).unwrap();
    std::future::poll_fn(|cx| channel.poll_ready(cx)).await.unwrap();
    drop(channel.call(request).await);
}

/// A body that sends these bytes and never ends.
struct Begun(Option<Bytes>);

impl http_body::Body for Begun {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, Status>>> {
        match self.0.take() {
            Some(bytes) => Poll::Ready(Some(Ok(http_body::Frame::data(bytes)))),
            None => Poll::Pending,
        }
    }
}
