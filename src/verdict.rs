//! What a result means: whether the run is done, and why not. Read from the text of
//! `result.json`, so that a stored result is judged as one that was just computed.

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::results::{JobFailure, Status};
use serde_json::Value;

use crate::client::Fetched;
use crate::ending::Ending;

/// What a result means for the exit code.
pub(crate) fn ending(kind: JobKind, specification: &JobSpecification, json: &str) -> Ending {
    let value: Value = serde_json::from_str(json).unwrap_or_default();
    let done = match kind {
        JobKind::Identification => {
            matches!(value["status"].as_str(), Some("converged" | "max_evaluations"))
        }
        JobKind::Propagation => propagation_failure(specification, &value).is_none(),
    };
    if done { Ending::Done } else { Ending::RunFailed }
}

/// Whether the result is that of a run which somebody ended before its time: running it again
/// goes further.
pub(crate) fn is_cancelled(json: &str) -> bool {
    let value: Value = serde_json::from_str(json).unwrap_or_default();
    value["status"].as_str() == Some(Status::Cancelled.name())
}

/// Whether running it again may end otherwise: somebody ended the run before its time, or it failed
/// because of the machines that it ran on.
pub(crate) fn may_end_otherwise(json: &str) -> bool {
    is_cancelled(json) || machine_failure(json).is_some()
}

/// Why a run failed, if that lies in the machines that it ran on.
pub(crate) fn machine_failure(json: &str) -> Option<String> {
    let value: Value = serde_json::from_str(json).unwrap_or_default();
    let name = value["failure"].as_str()?;
    let failure = JobFailure::ALL.into_iter().find(|failure| failure.name() == name)?;
    let reason = value["reason"].as_str().unwrap_or(name);
    failure.lies_in_machines().then(|| reason.to_owned())
}

/// Why the result of a propagation is a failure; `None` if it is none.
pub(crate) fn propagation_failure(
    specification: &JobSpecification,
    value: &Value,
) -> Option<String> {
    let counts = value["failures"].as_object();
    let counts = counts.into_iter().flatten().filter_map(|(_, n)| n.as_u64());
    // A file may say anything.
    let failed = counts.fold(0, u64::saturating_add);
    let realizations = specification.monte_carlo.realizations;
    let most = specification.monte_carlo.max_failed_fraction;
    if failed as f64 / realizations as f64 > most {
        return Some(format!(
            "{failed} of {realizations} realizations failed; max_failed_fraction is {most:?}"
        ));
    }
    if !value["velocity"]["mean"].is_number() {
        return Some("no realization has a velocity".to_owned());
    }
    None
}

/// Why an ended job has no result to show or to keep; `None` if it has one. A propagation that
/// did not complete its only evaluation has none, a search has one from its start.
pub(crate) fn missing_result(fetched: &Fetched) -> Option<String> {
    if fetched.specification.kind == JobKind::Identification || fetched.result.best.is_some() {
        return None;
    }
    let how = match fetched.result.status {
        Status::Cancelled => "the job was cancelled before its end",
        Status::Failed | Status::Converged | Status::MaxEvaluations => "the job failed",
    };
    let reason = fetched.result.reason.as_ref();
    let reason = reason.map(|reason| format!(": {reason}")).unwrap_or_default();
    Some(format!("{how}; there is no result{reason}"))
}

#[cfg(test)]
mod tests;
