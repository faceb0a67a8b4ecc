//! What a result means: whether the run is done, and why not. A stored result is judged as one that was
//! just computed.

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::report::{Propagation, ResultFile};
use osteon_common::results::Status;

use crate::client::Fetched;
use crate::ending::Ending;

/// What a result means for the exit code.
pub(crate) fn ending(specification: &JobSpecification, result: &ResultFile) -> Ending {
    let done = match result {
        ResultFile::Identification(found) => {
            matches!(found.status, Status::Converged | Status::MaxEvaluations)
        }
        ResultFile::Propagation(found) => propagation_failure(specification, found).is_none(),
    };
    if done { Ending::Done } else { Ending::RunFailed }
}

/// Whether the result is that of a run which somebody ended before its time: running it again
/// goes further.
pub(crate) fn is_cancelled(result: &ResultFile) -> bool {
    result.status() == Some(Status::Cancelled)
}

/// Whether running it again may end otherwise: somebody ended the run before its time, or it failed
/// because of the machines that it ran on.
pub(crate) fn may_end_otherwise(result: &ResultFile) -> bool {
    is_cancelled(result) || machine_failure(result).is_some()
}

/// Why a run failed, if that lies in the machines that it ran on.
pub(crate) fn machine_failure(result: &ResultFile) -> Option<&str> {
    let (failure, reason) = result.failure()?;
    failure.is_retryable().then(|| reason.unwrap_or(failure.name()))
}

/// Why the result of a propagation is a failure; `None` if it is none.
pub(crate) fn propagation_failure(
    specification: &JobSpecification,
    result: &Propagation,
) -> Option<String> {
    // A file may say anything.
    let failed = result.failures.values().copied().fold(0, u64::saturating_add);
    let realizations = specification.monte_carlo.realizations;
    let most = specification.monte_carlo.max_failed_fraction;
    if failed as f64 / realizations as f64 > most {
        return Some(format!(
            "{failed} of {realizations} realizations failed; max_failed_fraction is {most:?}"
        ));
    }
    if result.velocity.moments.mean.is_none() {
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
