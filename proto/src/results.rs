//! Results and the history of a job as messages.

use osteon_common::data_statistics::KolmogorovTest;
use osteon_common::job::{JobKind, MonteCarlo, Sampling};
use osteon_common::limits::{REALIZATIONS_MAX, SCRAMBLES_MAX};
use osteon_common::outcome::{FailureCounts, FailureKind, Outcome};
use osteon_common::parameters::Parameter;
use osteon_common::results::{
    BestPoint, Estimate, EstimatedError, Evaluation, GroupEnding, GroupResult, JobResult, Moments,
    Role, Status,
};
use osteon_common::settings::{Picking, SolverSettings};
use osteon_common::version::Program;
use osteon_common::violations::Violations;

use crate::batch;
use crate::malformed::Malformed;
use crate::setup;
use crate::v1;

/// The message of a result; the outcomes of its best point travel in realization blocks.
pub fn to_message(result: &JobResult) -> v1::JobResult {
    v1::JobResult {
        status: status_to_message(result.status).into(),
        reason: result.reason.clone().unwrap_or_default(),
        digest: result.digest.clone(),
        best: result.best.as_ref().map(best_to_message),
        data: result.data.as_ref().map(moments_to_message),
        evaluations: result.evaluations,
        realizations: result.realizations,
        seed: result.seed,
        solver: Some(setup::solver_to_message(&result.solver)),
        picking: Some(setup::picking_to_message(&result.picking)),
        version: result.program.version.clone(),
        numerics: result.program.numerics,
        commit: result.program.commit.clone().unwrap_or_default(),
        sampling: result.sampling.name().to_owned(),
        scrambles: result.scrambles,
        control_variate: result.control_variate,
        groups: result.groups.iter().map(group_to_message).collect(),
    }
}

/// The message of how the search for a group ended.
pub fn group_ending_to_message(ending: &GroupEnding) -> v1::GroupEnding {
    v1::GroupEnding {
        status: status_to_message(ending.status).into(),
        reason: ending.reason.clone().unwrap_or_default(),
        best: ending.best,
    }
}

/// How the search for a group ended.
///
/// # Errors
/// When the status is absent or unknown.
pub fn group_ending_from_message(message: &v1::GroupEnding) -> Result<GroupEnding, Malformed> {
    Ok(GroupEnding {
        status: ended(message.status)?,
        reason: (!message.reason.is_empty()).then(|| message.reason.clone()),
        best: message.best,
    })
}

fn group_to_message(group: &GroupResult) -> v1::GroupResult {
    v1::GroupResult {
        name: group.name.clone(),
        status: status_to_message(group.status).into(),
        reason: group.reason.clone().unwrap_or_default(),
        best: group.best.as_ref().map(best_to_message),
        data: Some(moments_to_message(&group.data)),
    }
}

fn group_from_message(message: &v1::GroupResult) -> Result<GroupResult, Malformed> {
    let data = message.data.as_ref().ok_or(Malformed::Missing { field: "data" })?;
    let best = message.best.as_ref().map(|best| best_from_message(best, Vec::new()));
    Ok(GroupResult {
        name: message.name.clone(),
        status: ended(message.status)?,
        reason: (!message.reason.is_empty()).then(|| message.reason.clone()),
        best: best.transpose()?,
        data: moments_from_message(data),
    })
}

fn best_to_message(best: &BestPoint) -> v1::BestPoint {
    v1::BestPoint {
        point: best.point.0.to_vec(),
        cost: best.cost,
        cost_error: best.cost_error,
        velocity: best.velocity.as_ref().map(estimate_to_message),
        failure_bias: best.failure_bias.as_ref().map(moments_to_message),
        kolmogorov: best.kolmogorov.map(test_to_message),
        failures: failures_to_message(&best.failures),
        estimated_error: best.estimated_error.map(errors_to_message),
    }
}

/// The status of something that has ended.
fn ended(number: i32) -> Result<Status, Malformed> {
    status_from_message(number)?.ok_or(Malformed::Missing { field: "status" })
}

/// The result of a message, with the `outcomes` of its best point.
///
/// # Errors
/// When a required field is absent, or a value is not one that a coordinator writes.
pub fn from_message(
    message: &v1::JobResult,
    outcomes: Vec<Outcome>,
) -> Result<JobResult, Malformed> {
    let best = match &message.best {
        Some(best) => Some(best_from_message(best, outcomes)?),
        None => None,
    };
    let (solver, picking) = settings_from_message(message)?;
    let (sampling, scrambles) = sampling_from_message(message)?;
    Ok(JobResult {
        status: ended(message.status)?,
        reason: (!message.reason.is_empty()).then(|| message.reason.clone()),
        digest: message.digest.clone(),
        best,
        data: message.data.as_ref().map(moments_from_message),
        groups: message.groups.iter().map(group_from_message).collect::<Result<_, _>>()?,
        evaluations: message.evaluations,
        realizations: message.realizations,
        seed: message.seed,
        sampling,
        scrambles,
        control_variate: message.control_variate,
        solver,
        picking,
        program: program_from_message(message),
    })
}

/// The message of one row of the history.
pub fn evaluation_to_message(evaluation: &Evaluation) -> v1::EvaluationRow {
    v1::EvaluationRow {
        number: evaluation.number,
        point: evaluation.point.0.to_vec(),
        moments: evaluation.moments.as_ref().map(moments_to_message),
        cost: evaluation.cost,
        failures: failures_to_message(&evaluation.failures),
        estimated_error: evaluation.estimated_error.map(errors_to_message),
        group: evaluation.role.group,
        start: evaluation.role.start,
        varied: evaluation.role.varied.map_or(0, |parameter| parameter as u32 + 1),
    }
}

/// One row of the history.
///
/// # Errors
/// When the point has not seven finite numbers, or a failure's code or the varied parameter is not
/// known.
pub fn evaluation_from_message(message: &v1::EvaluationRow) -> Result<Evaluation, Malformed> {
    let varied = match message.varied {
        0 => None,
        number => {
            let value = number.into();
            let parameter = Parameter::ALL.get(number as usize - 1).copied();
            Some(parameter.ok_or(Malformed::UnknownValue { field: "varied", value })?)
        }
    };
    Ok(Evaluation {
        number: message.number,
        role: Role { group: message.group, start: message.start, varied },
        point: batch::point(&message.point)?,
        moments: message.moments.as_ref().map(moments_from_message),
        cost: message.cost,
        failures: failures_from_message(&message.failures)?,
        estimated_error: message.estimated_error.map(errors_from_message).transpose()?,
    })
}

/// What `status` stands for in messages.
pub fn status_to_message(status: Status) -> v1::JobStatus {
    match status {
        Status::Converged => v1::JobStatus::Converged,
        Status::MaxEvaluations => v1::JobStatus::MaxEvaluations,
        Status::Cancelled => v1::JobStatus::Cancelled,
        Status::Failed => v1::JobStatus::Failed,
    }
}

/// The status of a message's number; `None` for a job that has not ended.
///
/// # Errors
/// When the number is not known.
pub fn status_from_message(number: i32) -> Result<Option<Status>, Malformed> {
    let unknown = Malformed::UnknownValue { field: "status", value: number.into() };
    Ok(match v1::JobStatus::try_from(number).map_err(|_| unknown)? {
        v1::JobStatus::Unspecified => None,
        v1::JobStatus::Converged => Some(Status::Converged),
        v1::JobStatus::MaxEvaluations => Some(Status::MaxEvaluations),
        v1::JobStatus::Cancelled => Some(Status::Cancelled),
        v1::JobStatus::Failed => Some(Status::Failed),
    })
}

/// The kind of a message's number.
///
/// # Errors
/// When the number is not known.
pub fn kind_from_message(number: i32) -> Result<JobKind, Malformed> {
    match v1::JobKind::try_from(number) {
        Ok(v1::JobKind::Identification) => Ok(JobKind::Identification),
        Ok(v1::JobKind::Propagation) => Ok(JobKind::Propagation),
        _ => Err(Malformed::UnknownValue { field: "kind", value: number.into() }),
    }
}

fn best_from_message(
    message: &v1::BestPoint,
    outcomes: Vec<Outcome>,
) -> Result<BestPoint, Malformed> {
    let velocity = match &message.velocity {
        Some(estimate) => Some(estimate_from_message(estimate)?),
        None => None,
    };
    Ok(BestPoint {
        point: batch::point(&message.point)?,
        cost: message.cost,
        cost_error: message.cost_error,
        velocity,
        failure_bias: message.failure_bias.as_ref().map(moments_from_message),
        kolmogorov: message.kolmogorov.as_ref().map(test_from_message),
        failures: failures_from_message(&message.failures)?,
        estimated_error: message.estimated_error.map(errors_from_message).transpose()?,
        outcomes,
    })
}

fn program_from_message(message: &v1::JobResult) -> Program {
    Program {
        version: message.version.clone(),
        numerics: message.numerics,
        commit: (!message.commit.is_empty()).then(|| message.commit.clone()),
    }
}

fn settings_from_message(message: &v1::JobResult) -> Result<(SolverSettings, Picking), Malformed> {
    let solver = message.solver.as_ref().ok_or(Malformed::Missing { field: "solver" })?;
    let picking = message.picking.as_ref().ok_or(Malformed::Missing { field: "picking" })?;
    let mut violations = Violations::new();
    let solver = setup::solver_from_message(solver, &mut violations);
    let picking = setup::picking_from_message(picking, &mut violations);
    violations.into_result((solver, picking)).map_err(Malformed::InvalidSetup)
}

/// Sampling and scrambles; an older version, which had no choice, says nothing of them.
fn sampling_from_message(message: &v1::JobResult) -> Result<(Sampling, u64), Malformed> {
    let default = MonteCarlo::default();
    let sampling = match message.sampling.as_str() {
        "" => default.sampling,
        name => {
            let named = Sampling::ALL.into_iter().find(|sampling| sampling.name() == name);
            named.ok_or(Malformed::UnknownName { field: "sampling" })?
        }
    };
    match message.scrambles {
        0 => Ok((sampling, default.scrambles)),
        scrambles @ 1..=SCRAMBLES_MAX => Ok((sampling, scrambles)),
        scrambles => {
            let (value, allowed) = (scrambles as f64, "it must be at most 1024");
            Err(Malformed::OutOfRange { field: "scrambles", value, allowed })
        }
    }
}

fn moments_to_message(moments: &Moments) -> v1::Moments {
    v1::Moments { mean: moments.mean, coefficient_of_variation: moments.coefficient_of_variation }
}

fn moments_from_message(message: &v1::Moments) -> Moments {
    Moments { mean: message.mean, coefficient_of_variation: message.coefficient_of_variation }
}

fn estimate_to_message(estimate: &Estimate) -> v1::Estimate {
    v1::Estimate {
        moments: Some(moments_to_message(&estimate.moments)),
        standard_error: Some(moments_to_message(&estimate.standard_error)),
        controlled: estimate.controlled,
    }
}

fn estimate_from_message(message: &v1::Estimate) -> Result<Estimate, Malformed> {
    let moments = message.moments.as_ref().ok_or(Malformed::Missing { field: "moments" })?;
    let standard_error =
        message.standard_error.as_ref().ok_or(Malformed::Missing { field: "standard_error" })?;
    Ok(Estimate {
        moments: moments_from_message(moments),
        standard_error: moments_from_message(standard_error),
        controlled: message.controlled,
    })
}

fn test_to_message(test: KolmogorovTest) -> v1::KolmogorovTest {
    v1::KolmogorovTest { distance: test.distance, p_value: test.p_value }
}

fn test_from_message(message: &v1::KolmogorovTest) -> KolmogorovTest {
    KolmogorovTest { distance: message.distance, p_value: message.p_value }
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
    let count =
        |(kind, count): (FailureKind, u64)| v1::FailureCount { code: kind.code().into(), count };
    failures.iter().map(count).collect()
}

fn failures_from_message(messages: &[v1::FailureCount]) -> Result<FailureCounts, Malformed> {
    let mut failures = FailureCounts::default();
    for message in messages {
        let kind = FailureKind::ALL.into_iter().find(|kind| u32::from(kind.code()) == message.code);
        let unknown = Malformed::UnknownValue { field: "code", value: message.code.into() };
        let kind = kind.ok_or(unknown)?;
        if failures.get(kind) != 0 {
            return Err(Malformed::UnknownValue { field: "code", value: message.code.into() });
        }
        if message.count > REALIZATIONS_MAX {
            let (value, allowed) =
                (message.count as f64, "no more realizations can fail than 10^7");
            return Err(Malformed::OutOfRange { field: "count", value, allowed });
        }
        failures.add(kind, message.count);
    }
    Ok(failures)
}

#[cfg(test)]
mod tests;
