//! Interpretation of a result: whether the run is complete, and if not, why. A stored result is
//! treated like one that was just computed.

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::results::Status;
use osteon_files::report::{Propagation, ResultFile};

use crate::fetched::Fetched;

/// Returns whether the run has a complete result: it was neither cancelled, nor has it failed.
pub fn is_complete(specification: &JobSpecification, result: &ResultFile) -> bool {
    match result {
        ResultFile::Identification(found) => found.status.is_complete(),
        ResultFile::Propagation(found) => propagation_failure(specification, found).is_none(),
    }
}

/// Returns whether the run was cancelled, in which case running it again continues it.
pub fn is_cancelled(result: &ResultFile) -> bool {
    result.status() == Some(Status::Cancelled)
}

/// Returns whether running the job again may end otherwise: the run was cancelled, or failed
/// because of the machines that it ran on.
pub fn is_worth_repeating(result: &ResultFile) -> bool {
    is_cancelled(result) || machine_failure(result).is_some()
}

/// Returns the reason why a run failed, if the machines that it ran on are the cause.
pub fn machine_failure(result: &ResultFile) -> Option<&str> {
    let (failure, reason) = result.failure()?;
    failure.is_retryable().then(|| reason.unwrap_or(failure.name()))
}

/// Returns the reason why the result of a propagation is a failure; `None` if it is not one.
pub fn propagation_failure(
    specification: &JobSpecification,
    result: &Propagation,
) -> Option<String> {
    // The counts come from a file and may be arbitrarily large.
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

/// Returns the reason why an ended job has no result to show or to keep; `None` if it has one. A
/// propagation has none until its only evaluation is complete, a search has one from its start.
pub fn missing_result(fetched: &Fetched) -> Option<String> {
    if fetched.result.kind() == JobKind::Identification || fetched.result.best_point(None).is_ok() {
        return None;
    }
    let how = match fetched.status {
        Status::Cancelled => "the job was cancelled before its end",
        Status::Failed | Status::Converged | Status::NotMatched | Status::MaxEvaluations => {
            "the job failed"
        }
    };
    let reason = fetched.reason.as_ref();
    let reason = reason.map(|reason| format!(": {reason}")).unwrap_or_default();
    Some(format!("{how}; there is no result{reason}"))
}

#[cfg(test)]
mod tests;
