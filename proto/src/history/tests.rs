//! Tests of the conversion of the history to and from messages.

use osteon_common::observables::{OBSERVABLES, PerObservable};
use osteon_common::parameters::{AS_IN_SETUP, BONE_PARAMETERS, Parameter, Point};
use osteon_common::results::Status;
use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;

/// Any number, including both zeros, infinities and subnormal numbers.
pub(crate) fn number() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

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

pub(crate) fn point() -> impl Strategy<Value = Point> {
    let of_bone = proptest::array::uniform7(-1e12..1e12);
    let searched = proptest::array::uniform3(proptest::option::of(1e-3..1e12));
    (of_bone, searched).prop_map(|(of_bone, searched)| {
        let mut point = Point::of_bone(of_bone);
        for (value, found) in point.0[BONE_PARAMETERS..].iter_mut().zip(searched) {
            *value = found.unwrap_or(AS_IN_SETUP);
        }
        point
    })
}

properties! {
    fn evaluations_survive_the_wire(
        number in any::<u64>(),
        group in any::<u32>(),
        start in any::<u32>(),
        varied in proptest::option::of(0_usize..7),
        posterior in any::<bool>(),
        point in point(),
        moments in proptest::option::of(moments()),
        cost in cost(),
        failures in failures(),
        estimated_error in estimated_error(),
        has in any::<[bool; OBSERVABLES]>(),
        observed in number(),
    ) {
        let varied = varied.map(|k| Parameter::ALL[k]);
        let has = PerObservable(has);
        let observables = has.map(|has| has.then_some(observed));
        let role = EvaluationRole { group, start, varied, shifted: false, posterior };
        let evaluation =
            Evaluation { number, role, point, moments, observables, cost, failures, estimated_error };
        let message = evaluation_to_message(&evaluation);
        prop_assert_eq!(evaluation_from_message(&message), Ok(evaluation));
    }
}

#[test]
fn the_ending_of_a_group_survives() {
    let ending =
        GroupEnding { status: Status::Failed, reason: Some("why".to_owned()), best: Some(7) };
    let message = group_ending_to_message(&ending);
    assert_eq!(group_ending_from_message(&message), Ok(ending));
    let missing = v1::GroupEnding { status: 0, ..message };
    assert_eq!(group_ending_from_message(&missing), Err(Malformed::Missing { field: "status" }));
    let point = Some(point_to_message(&Point::of_bone([1.0; 7])));
    let row = v1::EvaluationRow { point, varied: Some(14), ..v1::EvaluationRow::default() };
    assert_eq!(
        evaluation_from_message(&row),
        Err(Malformed::UnknownValue { field: "varied", value: 14 })
    );
}
