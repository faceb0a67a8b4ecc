//! Results over the wire.

use osteon_fuzz::properties;
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
    proptest::option::of(errors.prop_map(|(median, largest)| EstimatedError { median, largest }))
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
        let kolmogorov =
            kolmogorov.map(|(distance, p_value)| KolmogorovTest { distance, p_value });
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
    fn group()(
        name in "[a-zβ ]{0,9}",
        status in 0..Status::ALL.len(),
        reason in proptest::option::of("[a-z ]{1,20}"),
        best in proptest::option::of(best()),
        data in moments(),
    ) -> GroupResult {
        let best = best.map(|best| BestPoint { outcomes: Vec::new(), ..best });
        GroupResult { name, status: Status::ALL[status], reason, best, data }
    }
}

prop_compose! {
    fn result()(
        status in 0..Status::ALL.len(),
        reason in proptest::option::of("[a-z ]{1,20}"),
        best in proptest::option::of(best()),
        data in proptest::option::of(moments()),
        groups in proptest::collection::vec(group(), 0..3),
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
            groups,
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

properties! {
    fn results_survive_the_wire(result in result()) {
        let outcomes = result.best.as_ref().map(|best| best.outcomes.clone());
        let message = to_message(&result);
        prop_assert_eq!(from_message(&message, outcomes.unwrap_or_default()), Ok(result));
    }

    fn evaluations_survive_the_wire(
        number in any::<u64>(),
        group in any::<u32>(),
        start in any::<u32>(),
        varied in proptest::option::of(0_usize..7),
        point in point(),
        moments in proptest::option::of(moments()),
        cost in cost(),
        failures in failures(),
        estimated_error in estimated_error(),
    ) {
        let role = Role { group, start, varied: varied.map(|k| Parameter::ALL[k]) };
        let evaluation =
            Evaluation { number, role, point, moments, cost, failures, estimated_error };
        let message = evaluation_to_message(&evaluation);
        prop_assert_eq!(evaluation_from_message(&message), Ok(evaluation));
    }
}

#[test]
fn what_no_coordinator_writes_is_refused() {
    assert_eq!(status_from_message(9), Err(Malformed::UnknownValue { field: "status", value: 9 }));
    assert_eq!(kind_from_message(0), Err(Malformed::UnknownValue { field: "kind", value: 0 }));
    let twice = [v1::FailureCount { code: 1, count: 1 }, v1::FailureCount { code: 1, count: 2 }];
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

#[test]
fn the_ending_of_a_group_survives() {
    let ending =
        GroupEnding { status: Status::Failed, reason: Some("why".to_owned()), best: Some(7) };
    let message = group_ending_to_message(&ending);
    assert_eq!(group_ending_from_message(&message), Ok(ending));
    let missing = v1::GroupEnding { status: 0, ..message };
    assert_eq!(group_ending_from_message(&missing), Err(Malformed::Missing { field: "status" }));
    let row = v1::EvaluationRow { point: vec![1.0; 7], varied: 8, ..v1::EvaluationRow::default() };
    assert_eq!(
        evaluation_from_message(&row),
        Err(Malformed::UnknownValue { field: "varied", value: 8 })
    );
}
