//! Results and the history of a job as messages.

use osteon_common::data_statistics::KolmogorovTest;
use osteon_common::job::{JobKind, MonteCarlo, Sampling};
use osteon_common::limits::{REALIZATIONS_MAX, SCRAMBLES_MAX};
use osteon_common::outcome::{FailureCounts, FailureKind, Outcome};
use osteon_common::results::{
    BestPoint, Estimate, EstimatedError, Evaluation, JobResult, Moments, Status,
};
use osteon_common::settings::{Picking, SolverSettings};
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
        best: result.best.as_ref().map(|best| v1::BestPoint {
            point: best.point.0.to_vec(),
            cost: best.cost,
            cost_error: best.cost_error,
            velocity: best.velocity.as_ref().map(estimate_to_message),
            failure_bias: best.failure_bias.as_ref().map(moments_to_message),
            kolmogorov: best.kolmogorov.map(test_to_message),
            failures: failures_to_message(&best.failures),
            estimated_error: best.estimated_error.map(errors_to_message),
        }),
        data: result.data.as_ref().map(moments_to_message),
        evaluations: result.evaluations,
        realizations: result.realizations,
        seed: result.seed,
        solver: Some(setup::solver_to_message(&result.solver)),
        picking: Some(setup::picking_to_message(&result.picking)),
        version: result.version.clone(),
        sampling: result.sampling.name().to_owned(),
        scrambles: result.scrambles,
        control_variate: result.control_variate,
    }
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
        status: status_from_message(message.status)?
            .ok_or(Malformed::Missing { field: "status" })?,
        reason: (!message.reason.is_empty()).then(|| message.reason.clone()),
        digest: message.digest.clone(),
        best,
        data: message.data.as_ref().map(moments_from_message),
        evaluations: message.evaluations,
        realizations: message.realizations,
        seed: message.seed,
        sampling,
        scrambles,
        control_variate: message.control_variate,
        solver,
        picking,
        version: message.version.clone(),
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
    }
}

/// One row of the history.
///
/// # Errors
/// When the point has not seven finite numbers, or a failure's code is not known.
pub fn evaluation_from_message(message: &v1::EvaluationRow) -> Result<Evaluation, Malformed> {
    Ok(Evaluation {
        number: message.number,
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
mod tests {
    use proptest::prelude::*;

    use super::*;
    use osteon_common::parameters::Point;

    fn moments() -> impl Strategy<Value = Moments> {
        (1.0..1e4, 0.0..1.0)
            .prop_map(|(mean, coefficient_of_variation)| Moments { mean, coefficient_of_variation })
    }

    fn failures() -> impl Strategy<Value = FailureCounts> {
        proptest::array::uniform5(0_u64..1000).prop_map(|counts| {
            let mut failures = FailureCounts::default();
            for (kind, count) in FailureKind::ALL.into_iter().zip(counts) {
                failures.add(kind, count);
            }
            failures
        })
    }

    fn estimated_error() -> impl Strategy<Value = Option<EstimatedError>> {
        let errors = (0.0..1e-3, 0.0..1.0);
        proptest::option::of(
            errors.prop_map(|(median, largest)| EstimatedError { median, largest }),
        )
    }

    fn cost() -> impl Strategy<Value = Option<f64>> {
        proptest::option::of(prop_oneof![0.0..10.0, Just(f64::INFINITY)])
    }

    fn point() -> impl Strategy<Value = Point> {
        proptest::array::uniform7(-1e12..1e12).prop_map(Point)
    }

    prop_compose! {
        fn best()(
            point in point(),
            cost in cost(),
            velocity in proptest::option::of((moments(), moments(), any::<bool>())),
            failures in failures(),
            estimated_error in estimated_error(),
            cost_error in proptest::option::of(0.0..1.0),
            failure_bias in proptest::option::of(moments()),
            kolmogorov in proptest::option::of((0.0..1.0, 0.0..1.0)),
        ) -> BestPoint {
            let kolmogorov = kolmogorov
                .map(|(distance, p_value)| KolmogorovTest { distance, p_value });
            let velocity = velocity.map(|(moments, standard_error, controlled)| Estimate {
                moments,
                standard_error,
                controlled,
            });
            let outcomes = vec![Ok(3900.0), Err(FailureKind::NoArrival)];
            BestPoint {
                point,
                cost,
                cost_error,
                velocity,
                failure_bias,
                kolmogorov,
                failures,
                estimated_error,
                outcomes,
            }
        }
    }

    prop_compose! {
        fn result()(
            status in 0..Status::ALL.len(),
            reason in proptest::option::of("[a-z ]{1,20}"),
            best in proptest::option::of(best()),
            data in proptest::option::of(moments()),
            evaluations: u64,
            realizations: u64,
            seed: u64,
            sampling in 0..Sampling::ALL.len(),
            scrambles in 1..=SCRAMBLES_MAX,
            control_variate: bool,
        ) -> JobResult {
            JobResult {
                status: Status::ALL[status],
                reason,
                digest: "0123456789abcdef".repeat(4),
                best,
                data,
                evaluations,
                realizations,
                seed,
                sampling: Sampling::ALL[sampling],
                scrambles,
                control_variate,
                solver: SolverSettings::default(),
                picking: Picking::default(),
                version: "0.1.0".to_owned(),
            }
        }
    }

    proptest! {
        #[test]
        fn results_survive_the_wire(result in result()) {
            let outcomes = result.best.as_ref().map(|best| best.outcomes.clone());
            let message = to_message(&result);
            prop_assert_eq!(from_message(&message, outcomes.unwrap_or_default()), Ok(result));
        }

        #[test]
        fn evaluations_survive_the_wire(
            number: u64,
            point in point(),
            moments in proptest::option::of(moments()),
            cost in cost(),
            failures in failures(),
            estimated_error in estimated_error(),
        ) {
            let evaluation = Evaluation { number, point, moments, cost, failures, estimated_error };
            let message = evaluation_to_message(&evaluation);
            prop_assert_eq!(evaluation_from_message(&message), Ok(evaluation));
        }
    }

    #[test]
    fn what_no_coordinator_writes_is_refused() {
        assert_eq!(
            status_from_message(9),
            Err(Malformed::UnknownValue { field: "status", value: 9 })
        );
        assert_eq!(kind_from_message(0), Err(Malformed::UnknownValue { field: "kind", value: 0 }));
        let twice =
            [v1::FailureCount { code: 1, count: 1 }, v1::FailureCount { code: 1, count: 2 }];
        assert_eq!(
            failures_from_message(&twice),
            Err(Malformed::UnknownValue { field: "code", value: 1 })
        );
        for median in [-1e-9, f64::NAN, f64::INFINITY] {
            let errors = v1::EstimatedError { median, largest: 1.0 };
            assert!(errors_from_message(errors).is_err(), "{median}");
        }
        let sampling = |name: &str, scrambles| {
            let sampling = name.to_owned();
            sampling_from_message(&v1::JobResult { sampling, scrambles, ..Default::default() })
        };
        assert_eq!(sampling("", 0), Ok((Sampling::MonteCarlo, 1)));
        assert_eq!(sampling("sobol", SCRAMBLES_MAX), Ok((Sampling::Sobol, SCRAMBLES_MAX)));
        assert_eq!(sampling("dice", 1), Err(Malformed::UnknownName { field: "sampling" }));
        assert!(sampling("sobol", SCRAMBLES_MAX + 1).is_err());
        let unknown = [v1::FailureCount { code: 6, count: 1 }];
        assert!(failures_from_message(&unknown).is_err());
        let many = |count| failures_from_message(&[v1::FailureCount { code: 1, count }]);
        assert_eq!(many(REALIZATIONS_MAX).unwrap().total(), REALIZATIONS_MAX);
        assert!(many(REALIZATIONS_MAX + 1).is_err());
        assert_eq!(
            from_message(&v1::JobResult::default(), vec![]),
            Err(Malformed::Missing { field: "solver" })
        );
    }
}
