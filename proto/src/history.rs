//! The history of a job as messages.

use osteon_common::limits::REALIZATIONS_MAX;
use osteon_common::outcome::{FailureCounts, FailureKind};
use osteon_common::results::{EstimatedError, Evaluation, EvaluationRole, GroupEnding, Moments};

use crate::choice::{FAILURE_KIND, JOB_STATUS, PARAMETER};
use crate::malformed::Malformed;
use crate::observed::{means_from_messages, means_to_messages};
use crate::parameter_values::{point_from_message, point_to_message};
use crate::v1;

/// Returns the message of the ending of a group's search.
pub fn group_ending_to_message(ending: &GroupEnding) -> v1::GroupEnding {
    v1::GroupEnding {
        status: JOB_STATUS.number(ending.status),
        reason: ending.reason.clone(),
        best: ending.best,
    }
}

/// Returns the ending of a group's search.
///
/// # Errors
/// If the status is absent or unknown.
pub fn group_ending_from_message(message: &v1::GroupEnding) -> Result<GroupEnding, Malformed> {
    Ok(GroupEnding {
        status: JOB_STATUS.required(message.status, "status")?,
        reason: message.reason.clone(),
        best: message.best,
    })
}

/// Returns the message of one row of the history.
pub fn evaluation_to_message(evaluation: &Evaluation) -> v1::EvaluationRow {
    v1::EvaluationRow {
        number: evaluation.number,
        point: Some(point_to_message(&evaluation.point)),
        moments: evaluation.moments.as_ref().map(moments_to_message),
        cost: evaluation.cost,
        failures: failures_to_message(&evaluation.failures),
        estimated_error: evaluation.estimated_error.map(errors_to_message),
        group: evaluation.role.group,
        start: evaluation.role.start,
        varied: evaluation.role.varied.map(|parameter| PARAMETER.number(parameter)),
        posterior: evaluation.role.posterior,
        observables: means_to_messages(&evaluation.observables),
    }
}

/// Returns one row of the history.
///
/// # Errors
/// If the point does not have seven finite numbers, or if a failure kind, the varied parameter or
/// an observable is unknown.
pub fn evaluation_from_message(message: &v1::EvaluationRow) -> Result<Evaluation, Malformed> {
    let varied = message.varied.map(|number| PARAMETER.required(number, "varied")).transpose()?;
    let &v1::EvaluationRow { group, start, posterior, .. } = message;
    let point = point_from_message(message.point.as_ref())?;
    let shifted = point.shift().is_some();
    let role = EvaluationRole { group, start, varied, shifted, posterior };
    Ok(Evaluation {
        number: message.number,
        role,
        point,
        moments: message.moments.as_ref().map(moments_from_message),
        observables: means_from_messages(&message.observables)?,
        cost: message.cost,
        failures: failures_from_message(&message.failures)?,
        estimated_error: message.estimated_error.map(errors_from_message).transpose()?,
    })
}

fn moments_to_message(moments: &Moments) -> v1::Moments {
    v1::Moments { mean: moments.mean, coefficient_of_variation: moments.coefficient_of_variation }
}

fn moments_from_message(message: &v1::Moments) -> Moments {
    Moments { mean: message.mean, coefficient_of_variation: message.coefficient_of_variation }
}

fn errors_to_message(errors: EstimatedError) -> v1::EstimatedError {
    v1::EstimatedError { median: errors.median, largest: errors.largest }
}

fn errors_from_message(message: v1::EstimatedError) -> Result<EstimatedError, Malformed> {
    for (field, value) in [("median", message.median), ("largest", message.largest)] {
        if !value.is_finite() || value < 0.0 {
            let allowed = "an estimated error must be finite and at least 0";
            return Err(Malformed::OutOfRange { field, value, allowed });
        }
    }
    Ok(EstimatedError { median: message.median, largest: message.largest })
}

fn failures_to_message(failures: &FailureCounts) -> Vec<v1::FailureCount> {
    let count = |(kind, count): (FailureKind, u64)| v1::FailureCount {
        kind: FAILURE_KIND.number(kind),
        count,
    };
    failures.iter().map(count).collect()
}

fn failures_from_message(messages: &[v1::FailureCount]) -> Result<FailureCounts, Malformed> {
    let mut failures = FailureCounts::default();
    for message in messages {
        let kind = FAILURE_KIND.required(message.kind, "kind")?;
        if failures.get(kind) != 0 {
            return Err(Malformed::UnknownValue { field: "kind", value: message.kind.into() });
        }
        if message.count > REALIZATIONS_MAX {
            let (value, allowed) = (message.count as f64, "at most 10^7 realizations can fail");
            return Err(Malformed::OutOfRange { field: "count", value, allowed });
        }
        failures.add(kind, message.count);
    }
    Ok(failures)
}

#[cfg(test)]
pub(crate) mod tests;
