//! Statuses of requests that the core has not answered as it should.

use tonic::Status;

/// Returns the status of a request to a coordinator that has stopped meanwhile.
pub(crate) fn stopped_status() -> Status {
    Status::unavailable("the coordinator has stopped; try again when it is back")
}

/// Returns the status of a request that got an answer of another type than requested.
pub(crate) fn unexpected_status() -> Status {
    Status::internal("the coordinator gave an answer of another type than requested")
}
