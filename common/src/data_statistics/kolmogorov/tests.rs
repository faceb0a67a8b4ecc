//! Distances, and how often p-values are small.

use super::*;
use crate::ensemble::Germs;
use crate::job::MonteCarlo;
use crate::outcome::FailureKind;
use crate::parameters::Point;
use crate::realization::Ensemble;
use crate::special::standard_normal_quantile;

/// Draws `count` values of a normal law with mean 3900 and coefficient of variation 0.03.
fn normal(seed: u64, count: usize) -> Vec<f64> {
    let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
    germs.take(count).map(|u| 3900.0 * (1.0 + 0.03 * standard_normal_quantile(u))).collect()
}

#[test]
fn distances_of_small_samples() {
    for (a, b, expected) in [
        (&[1.0, 2.0][..], &[1.0, 2.0][..], 0.0),
        (&[1.0, 2.0], &[3.0, 4.0], 1.0),
        (&[1.0, 3.0], &[2.0, 4.0], 0.5),
        (&[1.0, 1.0, 1.0], &[1.0], 0.0),
        (&[1.0, 2.0, 3.0, 4.0], &[3.5], 0.75),
    ] {
        assert_eq!(distance(a, b), expected, "{a:?} {b:?}");
        assert_eq!(distance(b, a), expected, "{b:?} {a:?}");
    }
    let test = |data: &[f64], model: &[Outcome]| {
        kolmogorov_test(data, model, Sampling::MonteCarlo, FittedMoments::Neither)
            .map(|test| test.distance)
    };
    assert_eq!(test(&[], &[Ok(1.0)]), None);
    assert_eq!(test(&[1.0], &[Err(FailureKind::NoArrival)]), None);
    let model = [Ok(1.0), Err(FailureKind::NoArrival), Ok(3.0)];
    assert_eq!(test(&[2.0, 4.0], &model), Some(0.5));
}

/// Checks the fractions of p-values below 0.5, 0.1 and 0.05 to three standard deviations.
fn check_p_values(count: u64, of: impl Fn(u64) -> f64) {
    let p: Vec<f64> = (0..count).map(of).collect();
    for limit in [0.5, 0.1, 0.05_f64] {
        let share = p.iter().filter(|&&p| p < limit).count() as f64 / count as f64;
        let tolerance = 3.0 * (limit * (1.0 - limit) / count as f64).sqrt();
        assert!((share - limit).abs() < tolerance, "{share} below {limit}");
    }
}

#[test]
fn p_values_are_uniform_under_one_law_and_small_under_two() {
    let p = |seed: u64, sizes: (usize, usize), shift: f64| {
        let model: Vec<Outcome> = normal(2 * seed, sizes.1).iter().map(|v| Ok(v + shift)).collect();
        let data = normal(2 * seed + 1, sizes.0);
        kolmogorov_test(&data, &model, Sampling::MonteCarlo, FittedMoments::Neither)
            .unwrap()
            .p_value
    };
    for sizes in [(300, 400), (30, 2747), (100, 1000)] {
        check_p_values(200, |seed| p(seed, sizes, 0.0));
    }
    assert!(p(1, (300, 400), 60.0) < 2e-3, "{}", p(1, (300, 400), 60.0));
}

/// The velocities are the speed of 21 germs plus 5 % of other scatter; there are as many data
/// as points.
#[test]
fn p_values_are_uniform_against_sobol_points() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
    let velocities = |monte_carlo: MonteCarlo| -> Vec<f64> {
        let ensemble = Ensemble::drawn(&point, monte_carlo.germs()).unwrap();
        let speed = |index| {
            let rows = *ensemble.bone(index).unwrap().elasticity.rows();
            (rows[0][0] / 1598.8).sqrt() + 5e-9 * (rows[1][1] - rows[2][2])
        };
        (0..monte_carlo.realizations).map(speed).collect()
    };
    let plain = MonteCarlo { realizations: 256, ..MonteCarlo::default() };
    check_p_values(200, |seed| {
        let data = velocities(MonteCarlo { seed: 2 * seed, ..plain });
        let sobol = MonteCarlo { seed: 2 * seed + 1, sampling: Sampling::Sobol, ..plain };
        let model: Vec<Outcome> = velocities(sobol).into_iter().map(Ok).collect();
        kolmogorov_test(&data, &model, Sampling::Sobol, FittedMoments::Neither).unwrap().p_value
    });
}

/// Moves velocities so that they have the moments of others, as a search moves its model.
fn moved(velocities: &[f64], to: &[f64]) -> Vec<Outcome> {
    let ([mean, deviation], [to, wide]) = (mean_and_deviation(velocities), mean_and_deviation(to));
    velocities.iter().map(|v| Ok(to + (v - mean) * (wide / deviation))).collect()
}

fn p_fitted(data: &[f64], model: &[Outcome]) -> f64 {
    kolmogorov_test(data, model, Sampling::MonteCarlo, FittedMoments::Both).unwrap().p_value
}

#[test]
fn p_values_of_a_fitted_model_are_uniform() {
    for count in [20, 100] {
        check_p_values(400, |seed| {
            let data = normal(2 * seed, count);
            p_fitted(&data, &moved(&normal(2 * seed + 1, 1000), &data))
        });
    }
}

/// The rounded velocities are tested as rounded: at 25 m/s the largest difference by rounding alone
/// would be 0.04, which 2747 velocities would never reach.
#[test]
fn p_values_of_rounded_velocities_are_uniform() {
    for step in [10.0, 25.0] {
        let below = (0..100).filter(|&seed| {
            let data: Vec<f64> =
                normal(2 * seed, 2747).iter().map(|v| step * (v / step).round()).collect();
            p_fitted(&data, &moved(&normal(2 * seed + 1, 2747), &data)) < 0.05
        });
        let count = below.count();
        assert!((1..=11).contains(&count), "{count} of 100 at {step} m/s");
    }
}

#[test]
fn another_law_has_a_small_p_value() {
    let model = normal(7, 2747);
    let of = |change: fn(f64) -> f64| -> f64 {
        let data: Vec<f64> = normal(8, 300).into_iter().map(change).collect();
        p_fitted(&data, &moved(&model, &data))
    };
    assert!(of(|v| v) > 0.05);
    // Skew, and with heavy tails.
    assert!(of(|v| 3900.0 + 100.0 * libm::exp((v - 3900.0) / 117.0)) < 0.005);
    assert!(of(|v| 3900.0 + 1e-6 * (v - 3900.0) * (v - 3900.0) * (v - 3900.0)) < 0.005);
    // A law that was not fitted may not be shifted or wider either.
    let unfitted = |change: fn(f64) -> f64| {
        let data: Vec<f64> = normal(8, 300).into_iter().map(change).collect();
        let model: Vec<Outcome> = model.iter().map(|v| Ok(*v)).collect();
        let fitted = FittedMoments::Neither;
        kolmogorov_test(&data, &model, Sampling::MonteCarlo, fitted).unwrap().p_value
    };
    assert!(unfitted(|v| v) > 0.05);
    assert!(unfitted(|v| v + 40.0) < 0.005);
    assert!(unfitted(|v| 3900.0 + 1.5 * (v - 3900.0)) < 0.01);
}

/// A fit of one moment leaves the other to be tested.
#[test]
fn only_fitted_moments_are_fitted() {
    let model: Vec<Outcome> = normal(7, 2747).into_iter().map(Ok).collect();
    let p = |fitted, change: fn(f64) -> f64| {
        let data: Vec<f64> = normal(8, 300).into_iter().map(change).collect();
        kolmogorov_test(&data, &model, Sampling::MonteCarlo, fitted).unwrap().p_value
    };
    let [neither, mean, both] =
        [FittedMoments::Neither, FittedMoments::Mean, FittedMoments::Both].map(|one| p(one, |v| v));
    assert!(neither >= mean && mean >= both, "{neither} {mean} {both}");
    assert!(p(FittedMoments::Mean, |v| 3900.0 + 1.5 * (v - 3900.0)) < 0.01);
    assert!(p(FittedMoments::Variation, |v| v + 40.0) < 0.005);
}

#[test]
fn a_law_can_be_moved_before_the_test() {
    let data = normal(8, 300);
    let model: Vec<Outcome> = normal(7, 2747).into_iter().map(|v| Ok(2.0 * v)).collect();
    let [mean, deviation] = mean_and_deviation(&data);
    let at = Moments { mean, coefficient_of_variation: deviation / mean };
    let (sampling, fitted) = (Sampling::MonteCarlo, FittedMoments::Both);
    let found = predictive_test(&data, &model, sampling, fitted, at).unwrap();
    assert!(found.p_value > 0.05, "{found:?}");
    assert_eq!(kolmogorov_test(&data, &model, sampling, fitted).unwrap().distance, 1.0);
    assert_eq!(predictive_test(&data, &[], sampling, fitted, at), None);
}
