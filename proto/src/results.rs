//! Results and the history of a job as messages.

use osteon_common::inference::Conclusions;
use osteon_common::job::{Objective, Search};
use osteon_common::limits::{REALIZATIONS_MAX, SCRAMBLES_MAX};
use osteon_common::moments::KolmogorovTest;
use osteon_common::outcome::{FailureCounts, FailureKind, Outcome};
use osteon_common::posterior::PosteriorDraw;
use osteon_common::results::{
    BestPoint, Estimate, EstimatedError, Evaluation, EvaluationRole, GroupEnding, GroupResult,
    Integrity, JobResult,
};
use osteon_common::sampling::NominalSampling;
use osteon_common::settings::{Picking, SolverSettings};
use osteon_common::version::Program;
use osteon_common::violations::Violations;

use crate::choice::{
    FAILURE_KIND, JOB_FAILURE, JOB_STATUS, OBJECTIVE, PARAMETER, POINT_MEANING, SAMPLING,
};
use crate::conclusions::{self, FieldsOf};
use crate::data_summary::{data_from_message, data_to_message};
use crate::malformed::Malformed;
use crate::moments::{
    decay_from_message, decay_to_message, moments_from_message, moments_to_message,
};
use crate::parameter_values::{point_from_message, point_to_message};
use crate::setup;
use crate::specification::{search_from_message, search_to_message};
use crate::v1;

/// The parts of the result for one set of data that are sent in blocks of their own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResultBlocks {
    /// Outcomes of the best point.
    pub outcomes: Vec<Outcome>,
    /// Draws from the posterior.
    pub draws: Vec<PosteriorDraw>,
}

impl ResultBlocks {
    /// Takes them from the result for a set of data.
    pub fn new(best: Option<BestPoint>, conclusions: Conclusions) -> Self {
        Self {
            outcomes: best.map(|best| best.outcomes).unwrap_or_default(),
            draws: conclusions.posterior.map(|posterior| posterior.draws).unwrap_or_default(),
        }
    }
}

/// Returns the message of a result. Its groups have messages of their own, the outcomes of best
/// points are sent in realization blocks, and the draws from posteriors in draw blocks.
pub fn to_message(result: &JobResult) -> v1::JobResult {
    let conclusions = conclusions::to_message(&result.conclusions);
    v1::JobResult {
        status: JOB_STATUS.number(result.status),
        failure: result.failure.map_or(0, |failure| JOB_FAILURE.number(failure)),
        reason: result.reason.clone(),
        digest: result.digest.clone(),
        best: result.best.as_ref().map(best_to_message),
        data: result.data.as_ref().map(data_to_message),
        sensitivities: conclusions.sensitivities,
        identified: conclusions.identified,
        profiles: conclusions.profiles,
        solutions: conclusions.solutions,
        posterior: conclusions.posterior,
        objective: Some(v1::Objective { kind: OBJECTIVE.number(result.objective) }),
        search: Some(search_to_message(&result.search)),
        evaluations: result.evaluations,
        realizations: result.realizations,
        seed: result.seed,
        sampling: SAMPLING.number(result.sampling),
        scrambles: result.scrambles,
        control_variate: result.control_variate,
        solver: Some(setup::solver_to_message(&result.solver)),
        nominal_sampling: result.nominal.map(nominal_to_message),
        picking: Some(setup::picking_to_message(&result.picking)),
        version: result.program.version.clone(),
        numerics: result.program.numerics,
        commit: result.program.commit.clone(),
        integrity: result.integrity.as_ref().map(|found| v1::Integrity {
            banned_hosts: found.banned_hosts.clone(),
            earlier_digest: found.earlier_digest.clone(),
        }),
    }
}

/// Returns the result of a message, with the `blocks` and the `groups` that followed it.
///
/// # Errors
/// If a required field is absent, or a value is not one that a coordinator writes.
pub fn from_message(
    message: &v1::JobResult,
    blocks: ResultBlocks,
    groups: Vec<GroupResult>,
) -> Result<JobResult, Malformed> {
    let ResultBlocks { outcomes, draws } = blocks;
    let best = message.best.as_ref().map(|best| best_from_message(best, outcomes));
    let SpecificationParts { objective, search, solver, picking } = settings_from_message(message)?;
    Ok(JobResult {
        status: JOB_STATUS.required(message.status, "status")?,
        failure: JOB_FAILURE.optional(message.failure, "failure")?,
        reason: message.reason.clone(),
        digest: message.digest.clone(),
        best: best.transpose()?,
        data: message.data.as_ref().map(data_from_message).transpose()?,
        conclusions: conclusions_from_message(message, draws)?,
        groups,
        objective,
        search,
        evaluations: message.evaluations,
        realizations: message.realizations,
        seed: message.seed,
        sampling: SAMPLING.required(message.sampling, "sampling")?,
        scrambles: scrambles(message.scrambles)?,
        control_variate: message.control_variate,
        solver,
        nominal: message.nominal_sampling.map(nominal_from_message),
        picking,
        program: program_from_message(message),
        integrity: message.integrity.as_ref().map(|found| Integrity {
            banned_hosts: found.banned_hosts.clone(),
            earlier_digest: found.earlier_digest.clone(),
        }),
    })
}

/// Returns the message of the result of group number `group`.
pub fn group_to_message(group: u32, found: &GroupResult) -> v1::GroupResult {
    let conclusions = conclusions::to_message(&found.conclusions);
    v1::GroupResult {
        group,
        name: found.name.clone(),
        status: JOB_STATUS.number(found.status),
        reason: found.reason.clone(),
        best: found.best.as_ref().map(best_to_message),
        data: Some(data_to_message(&found.data)),
        sensitivities: conclusions.sensitivities,
        identified: conclusions.identified,
        profiles: conclusions.profiles,
        solutions: conclusions.solutions,
        posterior: conclusions.posterior,
    }
}

/// Returns the result of a group, with the `blocks` that followed it.
///
/// # Errors
/// Same as [`from_message`].
pub fn group_from_message(
    message: &v1::GroupResult,
    blocks: ResultBlocks,
) -> Result<GroupResult, Malformed> {
    let ResultBlocks { outcomes, draws } = blocks;
    let data = message.data.as_ref().ok_or(Malformed::Missing { field: "data" })?;
    let best = message.best.as_ref().map(|best| best_from_message(best, outcomes));
    Ok(GroupResult {
        name: message.name.clone(),
        status: JOB_STATUS.required(message.status, "status")?,
        reason: message.reason.clone(),
        best: best.transpose()?,
        data: data_from_message(data)?,
        conclusions: conclusions_of_group(message, draws)?,
    })
}

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
        decay: evaluation.decay,
    }
}

/// Returns one row of the history.
///
/// # Errors
/// If the point does not have seven finite numbers, or if a failure kind or the varied parameter is
/// unknown.
pub fn evaluation_from_message(message: &v1::EvaluationRow) -> Result<Evaluation, Malformed> {
    let varied = message.varied.map(|number| PARAMETER.required(number, "varied")).transpose()?;
    let &v1::EvaluationRow { group, start, posterior, .. } = message;
    let role = EvaluationRole { group, start, varied, posterior };
    Ok(Evaluation {
        number: message.number,
        role,
        point: point_from_message(message.point.as_ref())?,
        moments: message.moments.as_ref().map(moments_from_message),
        decay: message.decay,
        cost: message.cost,
        failures: failures_from_message(&message.failures)?,
        estimated_error: message.estimated_error.map(errors_from_message).transpose()?,
    })
}

fn best_to_message(best: &BestPoint) -> v1::BestPoint {
    v1::BestPoint {
        point: Some(point_to_message(&best.point)),
        meaning: best.meaning.map_or(0, |meaning| POINT_MEANING.number(meaning)),
        cost: best.cost,
        cost_error: best.cost_error,
        penalty: best.penalty,
        below_noise_from: best.below_noise_from,
        velocity: best.velocity.as_ref().map(estimate_to_message),
        failure_bias: best.failure_bias.as_ref().map(moments_to_message),
        kolmogorov: best.kolmogorov.map(test_to_message),
        failures: failures_to_message(&best.failures),
        estimated_error: best.estimated_error.map(errors_to_message),
        decay: best.decay.map(decay_to_message),
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
        point: point_from_message(message.point.as_ref())?,
        meaning: POINT_MEANING.optional(message.meaning, "meaning")?,
        cost: message.cost,
        cost_error: message.cost_error,
        penalty: message.penalty,
        below_noise_from: message.below_noise_from,
        velocity,
        decay: message.decay.map(decay_from_message),
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
        commit: message.commit.clone(),
    }
}

fn conclusions_from_message(
    message: &v1::JobResult,
    draws: Vec<PosteriorDraw>,
) -> Result<Conclusions, Malformed> {
    let fields = FieldsOf {
        sensitivities: &message.sensitivities,
        identified: message.identified.as_ref(),
        profiles: &message.profiles,
        solutions: message.solutions.as_ref(),
        posterior: message.posterior.as_ref(),
    };
    conclusions::from_message(&fields, draws)
}

fn conclusions_of_group(
    message: &v1::GroupResult,
    draws: Vec<PosteriorDraw>,
) -> Result<Conclusions, Malformed> {
    let fields = FieldsOf {
        sensitivities: &message.sensitivities,
        identified: message.identified.as_ref(),
        profiles: &message.profiles,
        solutions: message.solutions.as_ref(),
        posterior: message.posterior.as_ref(),
    };
    conclusions::from_message(&fields, draws)
}

/// The parts of a specification that a result repeats, as messages.
struct SpecificationParts {
    objective: Objective,
    search: Search,
    solver: SolverSettings,
    picking: Picking,
}

fn settings_from_message(message: &v1::JobResult) -> Result<SpecificationParts, Malformed> {
    let missing = |field| Malformed::Missing { field };
    let objective = message.objective.as_ref().ok_or(missing("objective"))?;
    let search = message.search.as_ref().ok_or(missing("search"))?;
    let solver = message.solver.as_ref().ok_or(missing("solver"))?;
    let picking = message.picking.as_ref().ok_or(missing("picking"))?;
    let mut violations = Violations::new();
    let settings = SpecificationParts {
        objective: OBJECTIVE.required(objective.kind, "kind")?,
        search: search_from_message(search, &mut violations),
        solver: setup::solver_from_message(solver, &mut violations),
        picking: setup::picking_from_message(picking, &mut violations),
    };
    violations.into_result(settings).map_err(Malformed::InvalidSetup)
}

fn scrambles(scrambles: u64) -> Result<u64, Malformed> {
    let allowed = "it must be 1 to 1024";
    let refused = Malformed::OutOfRange { field: "scrambles", value: scrambles as f64, allowed };
    (1..=SCRAMBLES_MAX).contains(&scrambles).then_some(scrambles).ok_or(refused)
}

fn nominal_to_message(nominal: NominalSampling) -> v1::NominalSampling {
    let NominalSampling { band, period, pairs } = nominal;
    v1::NominalSampling { band, period, pairs }
}

fn nominal_from_message(message: v1::NominalSampling) -> NominalSampling {
    let v1::NominalSampling { band, period, pairs } = message;
    NominalSampling { band, period, pairs }
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
