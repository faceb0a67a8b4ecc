//! Refusals as gRPC statuses with the details of `google.rpc`, and violations back from a status.

use std::collections::HashMap;
use std::time::Duration;

use osteon_common::violations::Violations;
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt as _};

/// Maximum size of the fields and messages that a status carries, bytes; the rest is counted in a
/// last entry. HTTP/2 peers refuse trailers of more than 16 KiB, and base64 adds a third.
const DETAIL_BYTES_MAX: usize = 8 << 10;

/// Returns `INVALID_ARGUMENT` with a `google.rpc.BadRequest` that names every field at fault.
pub fn invalid_argument(violations: &Violations) -> Status {
    let mut details = ErrorDetails::new();
    let mut bytes = 0;
    let total = violations.iter().count();
    for (listed, violation) in violations.iter().enumerate() {
        bytes += violation.field.len() + violation.message.len();
        if bytes > DETAIL_BYTES_MAX {
            details.add_bad_request_violation("", format!("and {} more", total - listed));
            break;
        }
        details.add_bad_request_violation(&violation.field, &violation.message);
    }
    let message = match total {
        1 => "the specification breaks a rule".to_owned(),
        _ => format!("the specification breaks {total} rules"),
    };
    Status::with_error_details(Code::InvalidArgument, message, details)
}

/// Returns `RESOURCE_EXHAUSTED` with a `google.rpc.RetryInfo`: the same request may succeed after
/// `retry`.
pub fn resource_exhausted(message: impl Into<String>, retry: Duration) -> Status {
    let details = ErrorDetails::with_retry_info(Some(retry));
    Status::with_error_details(Code::ResourceExhausted, message, details)
}

/// Returns `UNAVAILABLE` with a `google.rpc.RetryInfo`: another process may answer after `retry`.
pub fn unavailable(message: impl Into<String>, retry: Duration) -> Status {
    let details = ErrorDetails::with_retry_info(Some(retry));
    Status::with_error_details(Code::Unavailable, message, details)
}

/// Reason in a `google.rpc.ErrorInfo` of the status of a banned worker.
const BANNED: &str = "BANNED";
/// Domain of the reasons.
const DOMAIN: &str = "osteon";

/// Returns `PERMISSION_DENIED` with a `google.rpc.ErrorInfo`: the host of this worker is banned for wrong
/// answers, and trying again changes nothing.
pub fn banned(message: impl Into<String>) -> Status {
    let details = ErrorDetails::with_error_info(BANNED, DOMAIN, HashMap::new());
    Status::with_error_details(Code::PermissionDenied, message, details)
}

/// Returns whether [`banned`] made a status.
pub fn is_banned(status: &Status) -> bool {
    status.get_details_error_info().is_some_and(|it| it.domain == DOMAIN && it.reason == BANNED)
}

/// Returns the time to wait before a refused request is tried again, if its status carries one.
pub fn retry_after(status: &Status) -> Option<Duration> {
    status.get_details_retry_info()?.retry_delay
}

/// Returns the violations that a status carries, if [`invalid_argument`] made it.
pub fn violations(status: &Status) -> Option<Violations> {
    if status.code() != Code::InvalidArgument {
        return None;
    }
    let mut violations = Violations::new();
    for violation in status.get_details_bad_request()?.field_violations {
        violations.add(violation.field, violation.description);
    }
    (!violations.is_empty()).then_some(violations)
}

/// Returns `INVALID_ARGUMENT` with a `google.rpc.BadRequest` that names the one `field` of a
/// request that is at fault; `message` continues the sentence after its name.
pub fn bad_field(field: &str, message: &str) -> Status {
    let details = ErrorDetails::with_bad_request_violation(field, message);
    Status::with_error_details(Code::InvalidArgument, format!("{field} {message}"), details)
}

/// A kind of resource that a request may name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resource {
    /// A job.
    Job,
    /// A worker.
    Worker,
    /// A banned host.
    Host,
}

impl Resource {
    const ALL: [Self; 3] = [Self::Job, Self::Worker, Self::Host];

    /// Returns the resource type for a `google.rpc.ResourceInfo`.
    fn name(self) -> &'static str {
        match self {
            Self::Job => "job",
            Self::Worker => "worker",
            Self::Host => "host",
        }
    }
}

/// Returns `NOT_FOUND` with a `google.rpc.ResourceInfo` that names the resource by its `id`.
pub fn not_found(resource: Resource, id: impl Into<String>, message: impl Into<String>) -> Status {
    let message = message.into();
    let details = ErrorDetails::with_resource_info(resource.name(), id, "", &message);
    Status::with_error_details(Code::NotFound, message, details)
}

/// Returns the kind of the missing resource, if `status` reports one.
pub fn missing(status: &Status) -> Option<Resource> {
    let name = status.get_details_resource_info()?.resource_type;
    Resource::ALL.into_iter().find(|resource| resource.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn violations_survive_the_status() {
        let mut expected = Violations::new();
        expected.add("layers.coupling.density", "is -1; it must be above 0 (kg/m³)");
        expected.add("probe.receivers.count", "is 2; it must be 3 to 64");
        let status = invalid_argument(&expected);
        assert_eq!(status.code(), Code::InvalidArgument);
        assert_eq!(violations(&status), Some(expected));
    }

    #[test]
    fn a_long_list_is_cut_and_counted() {
        let mut long = Violations::new();
        for i in 0..1000 {
            long.add(format!("data.velocities[{i}]"), "is -1; it must be above 0 (m/s)");
        }
        let status = invalid_argument(&long);
        assert!(status.details().len() < 12 << 10, "{} bytes", status.details().len());
        let listed = violations(&status).unwrap();
        let count = listed.iter().count();
        let last = listed.iter().last().unwrap();
        assert_eq!(last.message, format!("and {} more", 1000 - (count - 1)));
    }

    #[test]
    fn a_refusal_for_now_says_when_to_come_back() {
        let status = resource_exhausted("too many jobs", Duration::from_secs(5));
        assert_eq!((status.code(), status.message()), (Code::ResourceExhausted, "too many jobs"));
        assert_eq!(retry_after(&status), Some(Duration::from_secs(5)));
        assert_eq!(retry_after(&Status::resource_exhausted("for ever")), None);
        let status = unavailable("it stops", Duration::from_millis(1500));
        assert_eq!((status.code(), status.message()), (Code::Unavailable, "it stops"));
        assert_eq!(retry_after(&status), Some(Duration::from_millis(1500)));
    }

    #[test]
    fn other_statuses_carry_none() {
        assert_eq!(violations(&Status::not_found("no job")), None);
        assert_eq!(violations(&Status::invalid_argument("plain")), None);
    }

    #[test]
    fn a_field_and_a_job_are_named_for_programs() {
        let status = bad_field("page_token", "is not a page token that List returned");
        assert_eq!(status.code(), Code::InvalidArgument);
        assert_eq!(status.message(), "page_token is not a page token that List returned");
        let mut expected = Violations::new();
        expected.add("page_token", "is not a page token that List returned");
        assert_eq!(violations(&status), Some(expected));

        let status = not_found(Resource::Job, "17", "there is no job 17");
        assert_eq!(missing(&status), Some(Resource::Job));
        assert_eq!((status.code(), status.message()), (Code::NotFound, "there is no job 17"));
        let resource = status.get_details_resource_info().unwrap();
        assert_eq!(
            (resource.resource_type.as_str(), resource.resource_name.as_str()),
            ("job", "17")
        );
    }
}
