//! Tests of the inference with models whose solution is known.

use super::*;
use crate::bone_structure::BoneStructure;
use crate::bulk_velocity::bulk_velocity;
use crate::bulk_velocity::tests::{BOUNDS, OPTIMUM};
use crate::case::Setup;
use crate::ensemble::Germs;
use crate::group_settings::GroupSettings;
use crate::job::{Data, JobKind, Measurements, MonteCarlo, Objective, Range, Search};
use crate::observables::PerObservable;
use crate::outcome::FailureCounts;
use crate::parameters::{Parameter, Point};
use crate::random_quantities::RandomQuantities;
use crate::results::{Estimate, EvaluationRole, Moments};
use crate::special::standard_normal_quantile;
use crate::systematic::Systematic;

/// v = 0.99 √(c1111/ρ), Δ = 0.27 δ.
fn model(point: &Point) -> Moments {
    Moments {
        mean: 0.99 * libm::exp(bulk_velocity(point).unwrap().logarithm),
        coefficient_of_variation: 0.27 * point.dispersion(),
    }
}

/// Moments of so many velocities that they have no noise.
fn without_noise(mean: f64, coefficient_of_variation: f64) -> Data {
    let count = Some(1 << 60);
    let measurements = Measurements::Moments { mean, coefficient_of_variation, count };
    Data { measurements, repeatability: 0.0, decay_error: 0.0 }
}

fn specification(free: &[Parameter], velocities: Option<Vec<f64>>) -> JobSpecification {
    let Moments { mean, coefficient_of_variation } = model(&OPTIMUM);
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(
            velocities.map_or_else(
                || without_noise(mean, coefficient_of_variation),
                Data::from_velocities,
            ),
        ),
        parameters: Range::of_bone(Parameter::OF_BONE.map(|parameter| {
            let (start, (lower, upper)) = (OPTIMUM.get(parameter), BOUNDS[parameter as usize]);
            if free.contains(&parameter) {
                Range::Free { start, lower, upper }
            } else {
                Range::Fixed(start)
            }
        })),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo::default(),
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    }
}

fn row(point: Point, varied: Option<Parameter>) -> Evaluation {
    Evaluation {
        observables: PerObservable::default(),
        number: 0,
        role: EvaluationRole { varied, ..EvaluationRole::default() },
        point,
        moments: Some(model(&point)),
        cost: Some(0.0),
        failures: FailureCounts::default(),
        estimated_error: None,
    }
}

/// Returns the optimum as the best point.
fn best(cost: f64, standard_error: Moments) -> BestPoint {
    BestPoint {
        observables: PerObservable::default(),
        point: OPTIMUM,
        meaning: None,
        penalty: None,
        below_noise_from: None,
        cost: Some(cost),
        velocity: Some(Estimate { moments: model(&OPTIMUM), standard_error, controlled: false }),
        cost_error: None,
        failure_bias: None,
        kolmogorov: None,
        form: None,
        failures: FailureCounts::default(),
        estimated_error: None,
        outcomes: Vec::new(),
    }
}

/// Returns the inference at the optimum, with these relative standard errors of the model's
/// moments.
fn found(specification: &JobSpecification, errors: [f64; 2]) -> Inference {
    let moments = model(&OPTIMUM);
    let standard_error = Moments {
        mean: errors[0] * moments.mean,
        coefficient_of_variation: errors[1] * moments.coefficient_of_variation,
    };
    let best = best(0.0, standard_error);
    let mut rows = vec![row(OPTIMUM, None)];
    for parameter in Parameter::OF_BONE {
        let mut point = OPTIMUM;
        point.0[parameter as usize] += 1e-5 * specification.range(parameter).edge();
        rows.push(row(point, Some(parameter)));
    }
    inference(specification, 0, &best, &rows).unwrap()
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, expected {expected}");
}

#[test]
fn of_seven_free_parameters_two_combinations_are_identified() {
    let found = found(&specification(&Parameter::OF_BONE, None), [1e-3, 2e-2]);
    assert_eq!((found.fixed.len(), found.undetermined.len()), (2, 5));
    close(found.bulk_velocity.value, model(&OPTIMUM).mean / 0.99, 1e-12);
    // Both still depend on how far the parameters may move along the free directions.
    assert_eq!((found.bulk_velocity.known, found.dispersion.known), (None, None));
    // No single parameter is determined.
    assert!(found.parameters.iter().all(|(_, quantity)| quantity.known.is_none()));
}

#[test]
fn directions_are_orthonormal_and_change_what_they_say() {
    let found = found(&specification(&Parameter::OF_BONE, None), [1e-3; 2]);
    let fixed = found.fixed.iter().map(|direction| &direction.components);
    let all: Vec<&Vec<f64>> = fixed.chain(&found.undetermined).collect();
    for (i, one) in all.iter().enumerate() {
        for (j, other) in all.iter().enumerate() {
            let product: f64 = one.iter().zip(*other).map(|(a, b)| a * b).sum();
            assert!((product - f64::from(i == j)).abs() < 1e-9, "{i} {j}: {product}");
        }
    }
    // A small step along each direction changes the moments by the singular value, or not at all.
    let values: Vec<f64> = found.fixed.iter().map(|direction| direction.singular_value).collect();
    for (i, direction) in all.iter().enumerate() {
        let mut moved = OPTIMUM;
        for ((x, (lower, upper)), d) in moved.0.iter_mut().zip(BOUNDS).zip(direction.iter()) {
            *x += 1e-5 * d * (upper - lower);
        }
        let (here, there) = (model(&OPTIMUM), model(&moved));
        let change = [
            libm::log(there.mean / here.mean),
            libm::log(there.coefficient_of_variation / here.coefficient_of_variation),
        ];
        let size = (change[0] * change[0] + change[1] * change[1]).sqrt() / 1e-5;
        let expected = values.get(i).copied().unwrap_or(0.0);
        assert!((size - expected).abs() < 1e-3, "{i}: {size}, expected {expected}");
    }
}

/// c1111 ∝ e_L to the power 0.5848 at the optimum, so the standard error of e_L is that of v
/// divided by half of it.
#[test]
fn of_two_free_parameters_both_are_known() {
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let found = found(&specification(&free, None), [1e-3, 2e-2]);
    assert!(found.undetermined.is_empty());
    let slope = found.sensitivities[0].mean;
    close(slope, 0.2924, 1e-3);
    let [(young, one), (dispersion, other)] = found.parameters[..] else { panic!("two are free") };
    assert_eq!([young, dispersion], free);
    close(one.known.unwrap().standard_error / one.value, 1e-3 / slope, 1e-4);
    close(other.known.unwrap().standard_error / other.value, 2e-2, 1e-4);
}

#[test]
fn noise_of_the_data_counts() {
    let Moments { mean, coefficient_of_variation } = model(&OPTIMUM);
    // With two different values the influence on ln Δ is that of the mean alone.
    let velocities: Vec<f64> = (0..100)
        .map(|k| mean * (1.0 + coefficient_of_variation * if k % 2 == 0 { 1.0 } else { -1.0 }))
        .collect();
    let free = [Parameter::Density, Parameter::Dispersion];
    let found = found(&specification(&free, Some(velocities)), [0.0; 2]);
    let expected = coefficient_of_variation / 99.0_f64.sqrt();
    let noise = found.noise.data.unwrap();
    close(noise.mean, expected, 1e-12);
    close(noise.coefficient_of_variation, expected, 1e-12);
    close(
        found.bulk_velocity.known.unwrap().standard_error / found.bulk_velocity.value,
        expected,
        1e-4,
    );
}

/// A search is stopped one standard error before the end, in both moments: its intervals are longer
/// by the distance by which the solution would have moved.
#[test]
fn what_the_search_has_left_lengthens_the_intervals() {
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let mut specification = specification(&free, None);
    let full = found(&specification, [1e-3, 2e-2]);
    let Moments { mean, coefficient_of_variation } = model(&OPTIMUM);
    specification.data =
        Some(without_noise(mean * libm::exp(1e-3), coefficient_of_variation * libm::exp(-2e-2)));
    let stopped = found(&specification, [1e-3, 2e-2]);
    for (full, stopped, left) in [
        (full.bulk_velocity, stopped.bulk_velocity, 1e-3),
        (full.dispersion, stopped.dispersion, 2e-2),
    ] {
        let half = |quantity: DerivedQuantity| {
            let [lower, upper] = quantity.known.unwrap().interval;
            libm::log(upper / lower) / 2.0
        };
        close(half(stopped) - half(full), left, 1e-3);
        assert_eq!(full.known.unwrap().standard_error, stopped.known.unwrap().standard_error);
    }
}

#[test]
fn nothing_is_known_where_the_model_does_not_match() {
    let mut specification = specification(&Parameter::OF_BONE, None);
    specification.data = Some(Data::from_moments(3000.0, 0.1));
    let mut rows = vec![row(OPTIMUM, None)];
    for parameter in Parameter::OF_BONE {
        let mut point = OPTIMUM;
        point.0[parameter as usize] *= 1.0 + 1e-5;
        rows.push(row(point, Some(parameter)));
    }
    let standard_error = Moments { mean: 1.0, coefficient_of_variation: 1e-4 };
    let best = best(0.6, standard_error);
    let found = inference(&specification, 0, &best, &rows).unwrap();
    assert!(!found.matched && found.bulk_velocity.known.is_none());
    // If one of the differences is missing, there is no inference.
    rows.pop();
    assert_eq!(inference(&specification, 0, &best, &rows), None);
}

/// At the optimum c1111 falls with e_L below 10.4 GPa: that of 17.7 GPa is that of 7.36 GPa, too, and
/// the closed form tells no more than that the double is below 7.6 GPa.
#[test]
fn a_modulus_with_a_double_within_the_bounds_is_not_known() {
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let mut specification = specification(&free, None);
    let known = |specification: &JobSpecification| {
        let found = found(specification, [1e-3, 2e-2]);
        assert!(found.bulk_velocity.known.is_some() && found.dispersion.known.is_some());
        found.parameters[0].1.known.is_some()
    };
    assert!(known(&specification));
    let range = &mut specification.parameters[Parameter::LongitudinalYoungModulus as usize];
    *range = Range::Free { start: 17.717e9, lower: 7.6e9, upper: 25e9 };
    assert!(known(&specification));
    let range = &mut specification.parameters[Parameter::LongitudinalYoungModulus as usize];
    *range = Range::Free { start: 17.717e9, lower: 7.3e9, upper: 25e9 };
    assert!(!known(&specification));
}

/// Compares with tabulated quantiles.
#[test]
fn quantiles_are_students() {
    for (freedom, expected) in [
        (1, 12.7062),
        (2, 4.3027),
        (3, 3.1824),
        (4, 2.7764),
        (5, 2.5706),
        (6, 2.4469),
        (10, 2.2281),
        (30, 2.0423),
        (100, 1.9840),
    ] {
        close(student_quantile(freedom), expected, 1e-3);
    }
    close(student_quantile(1_000_000), 1.95996, 1e-5);
}

/// Compares with a fine grid over the box.
#[test]
fn a_profile_is_the_lowest_cost() {
    let free = [
        Parameter::Density,
        Parameter::LongitudinalYoungModulus,
        Parameter::LongitudinalPoissonRatio,
        Parameter::Dispersion,
    ];
    let mut specification = specification(&free, None);
    // No bone within the bounds is light enough for this velocity.
    let data = Moments { mean: 1.2 * model(&OPTIMUM).mean, ..model(&OPTIMUM) };
    specification.data = None;
    let profiles = profiles(&specification, &OPTIMUM, model(&OPTIMUM), data, None);
    assert_eq!(profiles.len(), 4);
    for profile in profiles {
        for (&value, &cost) in profile.values.iter().zip(&profile.costs).step_by(5) {
            let mut lowest = f64::INFINITY;
            let grid = |parameter: Parameter, k: u32| {
                let (lower, upper) = BOUNDS[parameter as usize];
                if parameter == profile.parameter {
                    value
                } else {
                    lower + (upper - lower) * f64::from(k) / 40.0
                }
            };
            for (i, j, k) in
                (0..41).flat_map(|i| (0..41).flat_map(move |j| (0..41).map(move |k| (i, j, k))))
            {
                let mut point = OPTIMUM;
                point.0[0] = grid(Parameter::Density, i);
                point.0[1] = grid(Parameter::LongitudinalYoungModulus, j);
                point.0[2] = grid(Parameter::LongitudinalPoissonRatio, k);
                if bulk_velocity(&point).is_ok() {
                    let v = model(&point).mean / data.mean;
                    lowest = lowest.min((1.0 - v) * (1.0 - v));
                }
            }
            if profile.parameter == Parameter::Dispersion {
                let relative = 1.0 - value / OPTIMUM.dispersion();
                lowest += relative * relative;
            }
            assert!(cost <= lowest + 1e-12, "{:?} {value}: {cost}, {lowest}", profile.parameter);
            assert!(lowest - cost < 2e-3, "{:?} {value}: {cost}, {lowest}", profile.parameter);
        }
    }
}

#[test]
fn solutions_are_the_best_of_each_start() {
    let at = |start: u32, density: f64, cost: f64| {
        let mut point = OPTIMUM;
        point.0[0] = density;
        let role = EvaluationRole { start, ..EvaluationRole::default() };
        Evaluation { role, cost: Some(cost), ..row(point, None) }
    };
    let rows = [
        at(0, 1500.0, 1.0),
        at(0, 1600.0, 1e-13),
        at(1, 1700.0, f64::INFINITY),
        at(2, 1800.0, 1e-14),
        at(2, 1900.0, 1e-3),
    ];
    let found = solutions(0, &rows);
    let expected = [(0, 1600.0, 2), (2, 1800.0, 2)];
    let seen = found.iter().map(|one| (one.start, one.point.density(), one.evaluations));
    assert!(seen.eq(expected), "{found:?}");
    let points: Vec<Point> = found.iter().map(|one| one.point).collect();
    let Spreads { parameters, entries } = spread(&points, &BoneStructure::default()).unwrap();
    assert_eq!((parameters[0].1.smallest, parameters[0].1.largest), (1600.0, 1800.0));
    assert_eq!(entries.len(), 21);
    close(entries[0].2.smallest, OPTIMUM.constants().elasticity().unwrap().rows()[0][0], 1e-12);
    assert_eq!(spread(&[], &BoneStructure::default()), None);
}

/// With noise as large as that of a few velocities, the ends of intervals stay where the law of the
/// elasticity is defined, and the dispersion has the same interval in both places.
#[test]
fn intervals_stay_within_the_law() {
    for parameter in Parameter::OF_BONE {
        if parameter == Parameter::LongitudinalShearModulus {
            // The moments hardly depend on it.
            continue;
        }
        let mut free = vec![parameter];
        if parameter != Parameter::Dispersion {
            free.push(Parameter::Dispersion);
        }
        let found = found(&specification(&free, None), [1.5, 1.5]);
        for (parameter, quantity) in &found.parameters {
            let [lower, upper] = quantity.known.unwrap().interval;
            assert!(lower < quantity.value && quantity.value < upper, "{parameter:?}");
            let mut ends = [OPTIMUM; 2];
            for (point, end) in ends.iter_mut().zip([lower, upper]) {
                let inside = end + 1e-9 * (quantity.value - end);
                point.0[*parameter as usize] = inside;
                // Moduli may be such that the others are not admissible with them.
                if !parameter.unit().contains("Pa") {
                    assert!(point.constants().elasticity().is_ok(), "{parameter:?}: {point:?}");
                }
                assert!(inside > 0.0 || parameter.unit().is_empty(), "{parameter:?}: {lower}");
            }
            if *parameter == Parameter::Dispersion {
                assert!(lower > 0.0 && upper <= crate::ensemble::DISPERSION_MAX, "{upper}");
                assert_eq!(*quantity, found.dispersion);
            }
        }
    }
}

/// Returns the inference from velocities by a model that matches their moments exactly.
fn matching(velocities: Vec<f64>) -> Inference {
    let free = [Parameter::Density, Parameter::Dispersion];
    let specification = specification(&free, Some(velocities));
    let data = specification.data.as_ref().unwrap().moments(0);
    let mut point = OPTIMUM;
    let ratio = model(&OPTIMUM).mean / data.mean;
    point.0[0] *= ratio * ratio;
    point.0[6] = data.coefficient_of_variation / 0.27;
    let standard_error = Moments { mean: 0.0, coefficient_of_variation: 0.0 };
    let velocity = Estimate { moments: model(&point), standard_error, controlled: false };
    let best = BestPoint { point, velocity: Some(velocity), ..best(0.0, standard_error) };
    let beside = |parameter: Parameter| {
        let mut beside = point;
        beside.0[parameter as usize] += 1e-5 * specification.range(parameter).edge();
        row(beside, Some(parameter))
    };
    inference(&specification, 0, &best, &free.map(beside)).unwrap()
}

/// The share of 2000 sets of velocities of a normal law whose intervals hold the truth has a standard
/// deviation of 0.005.
#[test]
fn intervals_of_few_velocities_hold_the_truth_as_often_as_they_say() {
    let Moments { mean, coefficient_of_variation } = model(&OPTIMUM);
    let speed = libm::exp(bulk_velocity(&OPTIMUM).unwrap().logarithm);
    let holds = |quantity: DerivedQuantity, truth: f64| {
        let [lower, upper] = quantity.known.unwrap().interval;
        u32::from(lower <= truth && truth <= upper)
    };
    for count in [5, 10, 20, 50] {
        let mut held = [0; 2];
        for seed in 0..2000 {
            let germs = (0..).flat_map(|index| *Germs::draw(60_000 + seed, index).values());
            let velocity =
                |u| mean * (1.0 + coefficient_of_variation * standard_normal_quantile(u));
            let found = matching(germs.take(count).map(velocity).collect());
            held[0] += holds(found.bulk_velocity, speed);
            held[1] += holds(found.dispersion, OPTIMUM.dispersion());
        }
        let shares = held.map(|held| f64::from(held) / 2000.0);
        assert!(shares.iter().all(|share| (0.93..=0.97).contains(share)), "{count}: {shares:?}");
    }
}

/// The model's law has the moments of the model, and the data are of the same law. One of a hundred
/// velocities is doubled: the interval by the moments is then much longer, while the likelihood has its maximum where
/// it was.
#[test]
fn a_likelihood_has_intervals_in_spite_of_a_wrong_velocity() {
    let Moments { mean, coefficient_of_variation } = model(&OPTIMUM);
    let quantiles = |count: u32| -> Vec<f64> {
        let score = |k| standard_normal_quantile((f64::from(k) + 0.5) / f64::from(count));
        (0..count).map(|k| mean * (1.0 + coefficient_of_variation * score(k))).collect()
    };
    let free = [Parameter::LongitudinalYoungModulus, Parameter::Dispersion];
    let of = |velocities: Vec<f64>, objective: Objective| {
        let mut specification = specification(&free, Some(velocities));
        specification.objective = objective;
        let mut best = best(0.0, Moments { mean: 1e-6, coefficient_of_variation: 1e-9 });
        best.outcomes = quantiles(2747).into_iter().map(Ok).collect();
        let mut rows = vec![row(OPTIMUM, None)];
        for parameter in free {
            let mut point = OPTIMUM;
            point.0[parameter as usize] += 1e-5 * specification.range(parameter).edge();
            rows.push(row(point, Some(parameter)));
        }
        inference(&specification, 0, &best, &rows).unwrap()
    };
    for (count, most) in [(100, 0.25), (2747, 0.05)] {
        let clean = quantiles(count);
        let mut wrong = clean.clone();
        wrong[count as usize / 2] *= 2.0;
        let by_moments = of(wrong.clone(), Objective::Moments);
        let [clean, wrong] = [clean, wrong].map(|data| {
            let found = of(data, Objective::Likelihood);
            assert!(found.matched);
            let [low, high] = found.dispersion.known.unwrap().interval;
            high - low
        });
        assert!((wrong / clean - 1.0).abs() < most, "{wrong} {clean}");
        let of_moments =
            by_moments.dispersion.known.map(|known| known.interval[1] - known.interval[0]);
        assert!(of_moments.is_none_or(|length| length > 2.0 * wrong), "{of_moments:?} {wrong}");
    }
}
