//! Tests of the conversion of results to and from messages.

use osteon_fuzz::properties;
use proptest::prelude::*;

use super::*;
use crate::posterior::tests::posterior;
use osteon_common::inference::{
    DerivedQuantity, Direction, Inference, NoiseErrors, Profile, Sensitivity, Solution, Solutions,
    Spread, Spreads, Uncertainty,
};
use osteon_common::job::{Prior, Sampling, SearchMethod};
use osteon_common::moments::{ConfidenceInterval, MomentIntervals, Outlier};
use osteon_common::parameters::{AS_IN_SETUP, BONE_PARAMETERS, Parameter, Point};
use osteon_common::results::{
    DataSummary, DecayEstimate, Integrity, JobFailure, Moments, PointMeaning, Status,
};

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

prop_compose! {
    fn best()(
        point in point(),
        meaning in proptest::option::of(proptest::sample::select(PointMeaning::ALL.to_vec())),
        cost in cost(),
        penalty in proptest::option::of(number()),
        below_noise_from: Option<u64>,
        velocity in proptest::option::of((moments(), moments(), any::<bool>())),
        failures in failures(),
        estimated_error in estimated_error(),
        cost_error in proptest::option::of(0.0..1.0),
        failure_bias in proptest::option::of(moments()),
        kolmogorov in proptest::option::of((0.0..1.0, 0.0..1.0)),
        decay in decay(),
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
            meaning,
            cost,
            cost_error,
            penalty,
            below_noise_from,
            velocity,
            decay,
            failure_bias,
            kolmogorov,
            failures,
            estimated_error,
            outcomes,
        }
    }
}

fn decay() -> impl Strategy<Value = Option<DecayEstimate>> {
    let numbers = (number(), number(), number());
    proptest::option::of(numbers.prop_map(|(mean, standard_deviation, standard_error)| {
        DecayEstimate { mean, standard_deviation, standard_error }
    }))
}

fn interval() -> impl Strategy<Value = ConfidenceInterval> {
    (number(), number()).prop_map(|(low, high)| ConfidenceInterval { low, high })
}

fn outlier() -> impl Strategy<Value = Outlier> {
    (any::<u64>(), number(), number()).prop_map(|(index, velocity, deviations)| Outlier {
        index,
        velocity,
        deviations,
    })
}

prop_compose! {
    fn data()(
        moments in moments(),
        count: Option<u64>,
        intervals in proptest::option::of((interval(), interval(), 0.0..1.0)),
        outliers in proptest::collection::vec(outlier(), 0..3),
        outlier_count: u64,
        rounding in proptest::option::of(number()),
        decay in decay(),
    ) -> DataSummary {
        let intervals = intervals.map(|(mean, coefficient_of_variation, level)| {
            MomentIntervals { mean, coefficient_of_variation, level }
        });
        DataSummary { moments, decay, count, intervals, outliers, outlier_count, rounding }
    }
}

prop_compose! {
    fn quantity()(
        value in number(),
        known in proptest::option::of((number(), number(), number(), number())),
    ) -> DerivedQuantity {
        let known = known.map(|(standard_error, lower, upper, free_share)| {
            Uncertainty { standard_error, interval: [lower, upper], free_share }
        });
        DerivedQuantity { value, known }
    }
}

/// A subset of the seven parameters in their order, each with probability ½, but at least one.
pub(crate) fn free() -> impl Strategy<Value = Vec<Parameter>> {
    proptest::sample::subsequence(Parameter::ALL.to_vec(), 1..=7)
}

prop_compose! {
    fn inference()(free in free())(
        matched in any::<bool>(),
        level in 0.0..1.0,
        noise in (proptest::option::of(moments()), moments()),
        slopes in proptest::collection::vec(
            (number(), number(), proptest::option::of(number())), free.len()),
        fixed in proptest::collection::vec(
            (0.0..10.0, proptest::collection::vec(number(), free.len())), 0..3),
        undetermined in proptest::collection::vec(
            proptest::collection::vec(number(), free.len()), 0..3),
        bulk_velocity in quantity().boxed(),
        dispersion in quantity().boxed(),
        parameters in proptest::collection::vec(quantity().boxed(), free.len()),
        free in Just(free),
    ) -> Inference {
        let slopes = free.iter().zip(slopes);
        let direction = |(singular_value, components)| Direction { singular_value, components };
        Inference {
            matched,
            level,
            noise: NoiseErrors { data: noise.0, sampling: noise.1 },
            sensitivities: slopes
                .map(|(&parameter, (mean, coefficient_of_variation, decay))| {
                    Sensitivity { parameter, mean, coefficient_of_variation, decay }
                })
                .collect(),
            fixed: fixed.into_iter().map(direction).collect(),
            undetermined,
            bulk_velocity,
            dispersion,
            parameters: free.iter().copied().zip(parameters).collect(),
            free,
        }
    }
}

prop_compose! {
    fn spread()(smallest in number(), largest in number(), mean in number()) -> Spread {
        Spread { smallest, largest, mean }
    }
}

prop_compose! {
    fn solutions()(
        points in proptest::collection::vec((any::<u32>(), point(), number(), any::<u64>()), 0..4),
        matching: u64,
        spreads in proptest::option::of((
            proptest::collection::vec(spread(), 7..=10),
            proptest::collection::vec((0_usize..6, 0_usize..6, spread()), 0..21),
        )),
    ) -> Solutions {
        let solution =
            |(start, point, cost, evaluations)| Solution { start, point, cost, evaluations };
        let points = points.into_iter().map(solution).collect();
        let spread = spreads.map(|(parameters, entries)| {
            let upper = |(i, j, spread): (usize, usize, Spread)| (i.min(j), i.max(j), spread);
            let parameters = Parameter::ALL.into_iter().zip(parameters).collect();
            Spreads { parameters, entries: entries.into_iter().map(upper).collect() }
        });
        Solutions { points, matching, spread }
    }
}

prop_compose! {
    fn conclusions()(
        inference in proptest::option::of(inference().boxed()),
        profiles in proptest::collection::vec(
            (0..Parameter::ALL.len(), proptest::collection::vec((number(), number()), 0..12)), 0..7),
        solutions in proptest::option::of(solutions().boxed()),
        posterior in proptest::option::of(posterior().boxed()),
    ) -> Conclusions {
        let profiles = profiles.into_iter().map(|(parameter, pairs)| {
            let (values, costs) = pairs.into_iter().unzip();
            Profile { parameter: Parameter::ALL[parameter], values, costs }
        });
        Conclusions { inference, profiles: profiles.collect(), solutions, posterior }
    }
}

prop_compose! {
    fn search()(
        method in proptest::sample::select(SearchMethod::ALL.to_vec()),
        starts: u64,
        sensitivities: bool,
        priors in proptest::array::uniform10(proptest::option::of((number(), number()))),
    ) -> Search {
        let priors = priors.map(|prior| prior.map(|(value, weight)| Prior { value, weight }));
        Search { starts, sensitivities, priors, ..Search::by(method) }
    }
}

prop_compose! {
    fn group()(
        name in "[a-zβ ]{0,9}",
        status in 0..Status::ALL.len(),
        reason in proptest::option::of("[a-z ]{1,20}"),
        best in proptest::option::of(best().boxed()),
        data in data().boxed(),
        conclusions in conclusions().boxed(),
    ) -> GroupResult {
        GroupResult { name, status: Status::ALL[status], reason, best, data, conclusions }
    }
}

prop_compose! {
    fn result()(
        status in 0..Status::ALL.len(),
        reason in proptest::option::of("[a-z ]{1,20}"),
        best in proptest::option::of(best().boxed()),
        failure in proptest::option::of(proptest::sample::select(JobFailure::ALL.to_vec())),
        data in proptest::option::of(data().boxed()),
        conclusions in conclusions().boxed(),
        groups in proptest::collection::vec(group().boxed(), 0..3),
        search in search().boxed(),
        counts in proptest::array::uniform3(any::<u64>()),
        sampling in 0..Sampling::ALL.len(),
        scrambles in 1..=SCRAMBLES_MAX,
        control_variate: bool,
        numerics: u32,
        commit in proptest::option::of("[0-9a-f]{1,40}"),
    ) -> JobResult {
        JobResult {
            status: Status::ALL[status],
            failure,
            reason,
            digest: "0123456789abcdef".repeat(4),
            best,
            data,
            conclusions,
            groups,
            objective: Objective::ALL[usize::from(control_variate)],
            search,
            evaluations: counts[0],
            realizations: counts[1],
            seed: counts[2],
            sampling: Sampling::ALL[sampling],
            scrambles,
            control_variate,
            solver: SolverSettings::default(),
            nominal: control_variate.then_some(NominalSampling { band: 2e6, period: 1e-4, pairs: 7 }),
            picking: Picking::default(),
            program: Program { version: "0.1.0".to_owned(), numerics, commit },
            integrity: (numerics % 2 == 0).then(|| Integrity {
                banned_hosts: vec!["node-7".to_owned()],
                earlier_digest: (numerics % 4 == 0).then(|| "00".to_owned()),
            }),
        }
    }
}

properties! {
    fn results_survive_the_wire(result in result().boxed()) {
        let blocks = ResultBlocks::new(result.best.clone(), result.conclusions.clone());
        let message = to_message(&result);
        let read = from_message(&message, blocks, result.groups.clone());
        // The debug format also compares the signs of zeros.
        prop_assert_eq!(format!("{:?}", read.as_ref().ok()), format!("{:?}", Some(&result)));
        prop_assert_eq!(read, Ok(result));
    }

    fn groups_survive_the_wire(number in any::<u32>(), group in group().boxed()) {
        let blocks = ResultBlocks::new(group.best.clone(), group.conclusions.clone());
        let message = group_to_message(number, &group);
        prop_assert_eq!(message.group, number);
        prop_assert_eq!(group_from_message(&message, blocks), Ok(group));
    }

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
        decay in proptest::option::of(number()),
    ) {
        let varied = varied.map(|k| Parameter::ALL[k]);
        let role = EvaluationRole { group, start, varied, posterior };
        let evaluation =
            Evaluation { number, role, point, moments, decay, cost, failures, estimated_error };
        let message = evaluation_to_message(&evaluation);
        prop_assert_eq!(evaluation_from_message(&message), Ok(evaluation));
    }
}

#[test]
fn what_no_coordinator_writes_is_refused() {
    let twice = [v1::FailureCount { kind: 1, count: 1 }, v1::FailureCount { kind: 1, count: 2 }];
    let of_kind = |value| Err(Malformed::UnknownValue { field: "kind", value });
    assert_eq!(failures_from_message(&twice), of_kind(1));
    assert_eq!(failures_from_message(&[v1::FailureCount { kind: 6, count: 1 }]), of_kind(6));
    for median in [-1e-9, f64::NAN, f64::INFINITY] {
        let errors = v1::EstimatedError { median, largest: 1.0 };
        assert!(errors_from_message(errors).is_err(), "{median}");
    }
    assert_eq!(scrambles(SCRAMBLES_MAX), Ok(SCRAMBLES_MAX));
    assert!(scrambles(0).is_err() && scrambles(SCRAMBLES_MAX + 1).is_err());
    let many = |count| failures_from_message(&[v1::FailureCount { kind: 1, count }]);
    assert_eq!(many(REALIZATIONS_MAX).unwrap().total(), REALIZATIONS_MAX);
    assert!(many(REALIZATIONS_MAX + 1).is_err());
    assert_eq!(
        from_message(&v1::JobResult::default(), ResultBlocks::default(), vec![]),
        Err(Malformed::Missing { field: "objective" })
    );
}

/// A result of an identification in which every field is set.
fn complete() -> v1::JobResult {
    let spread = Spread { smallest: 1.0, largest: 3.0, mean: 2.0 };
    let quantity = DerivedQuantity {
        value: 1.0,
        known: Some(Uncertainty { standard_error: 0.1, interval: [0.8, 1.2], free_share: 0.0 }),
    };
    let free = vec![Parameter::Density];
    let moments = Moments { mean: 1.0, coefficient_of_variation: 0.1 };
    let conclusions = Conclusions {
        inference: Some(Inference {
            matched: true,
            level: 0.95,
            noise: NoiseErrors { data: None, sampling: moments },
            sensitivities: vec![Sensitivity {
                parameter: Parameter::Density,
                mean: -0.5,
                coefficient_of_variation: 0.0,
                decay: None,
            }],
            fixed: vec![Direction { singular_value: 0.2, components: vec![1.0] }],
            undetermined: Vec::new(),
            bulk_velocity: quantity,
            dispersion: quantity,
            parameters: vec![(Parameter::Density, quantity)],
            free,
        }),
        profiles: vec![Profile {
            parameter: Parameter::Density,
            values: vec![1.0, 2.0],
            costs: vec![0.0, 1.0],
        }],
        solutions: Some(Solutions {
            points: Vec::new(),
            matching: 1,
            spread: Some(Spreads {
                parameters: Parameter::OF_BONE.map(|parameter| (parameter, spread)).to_vec(),
                entries: vec![(0, 5, spread)],
            }),
        }),
        posterior: None,
    };
    to_message(&JobResult {
        status: Status::Converged,
        failure: None,
        reason: None,
        digest: String::new(),
        best: None,
        data: None,
        conclusions,
        groups: Vec::new(),
        objective: Objective::Moments,
        search: Search::default(),
        evaluations: 1,
        realizations: 1,
        seed: 1,
        sampling: Sampling::MonteCarlo,
        scrambles: 1,
        control_variate: false,
        solver: SolverSettings::default(),
        nominal: None,
        picking: Picking::default(),
        program: Program::current(None),
        integrity: None,
    })
}

#[test]
fn conclusions_with_a_part_missing_are_refused() {
    let refused = |change: fn(&mut v1::JobResult)| {
        let mut message = complete();
        from_message(&message, ResultBlocks::default(), vec![]).unwrap();
        change(&mut message);
        match from_message(&message, ResultBlocks::default(), vec![]).unwrap_err() {
            Malformed::Missing { field }
            | Malformed::WrongLength { field, .. }
            | Malformed::UnknownValue { field, .. }
            | Malformed::OutOfRange { field, .. } => field,
            other => panic!("{other}"),
        }
    };
    fn identified(message: &mut v1::JobResult) -> &mut v1::Identified {
        message.identified.as_mut().unwrap()
    }
    fn solutions(message: &mut v1::JobResult) -> &mut v1::Solutions {
        message.solutions.as_mut().unwrap()
    }
    assert_eq!(refused(|m| m.status = 0), "status");
    assert_eq!(refused(|m| m.failure = 99), "failure");
    assert_eq!(refused(|m| m.sensitivities[0].mean = None), "mean");
    assert_eq!(refused(|m| m.sensitivities[0].parameter = 0), "parameter");
    // A component for a parameter that no other field declares to be free.
    assert_eq!(refused(|m| m.sensitivities[0].parameter = 7), "dispersion");
    assert_eq!(refused(|m| identified(m).bulk_velocity = None), "bulk_velocity");
    assert_eq!(refused(|m| identified(m).sampling_noise = None), "sampling_noise");
    let of_interval =
        |m: &mut v1::JobResult| identified(m).dispersion.as_mut().unwrap().interval = None;
    assert_eq!(refused(of_interval), "interval");
    assert_eq!(refused(|m| identified(m).directions[0].components = None), "components");
    assert_eq!(refused(|m| m.profiles[0].costs.truncate(1)), "costs");
    assert_eq!(refused(|m| solutions(m).parameters.truncate(6)), "parameters");
    assert_eq!(refused(|m| solutions(m).parameters.swap(0, 1)), "parameters");
    assert_eq!(refused(|m| solutions(m).mandel[0].row = 7), "row");
    assert_eq!(refused(|m| solutions(m).mandel[0].column = 0), "column");
    assert_eq!(refused(|m| solutions(m).mandel[0].spread = None), "spread");
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
    let row = v1::EvaluationRow { point, varied: Some(11), ..v1::EvaluationRow::default() };
    assert_eq!(
        evaluation_from_message(&row),
        Err(Malformed::UnknownValue { field: "varied", value: 11 })
    );
}
