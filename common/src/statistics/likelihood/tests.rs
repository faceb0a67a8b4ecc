use super::*;
use crate::ensemble::Germs;
use crate::outcome::FailureKind;
use crate::realization::Ensemble;
use crate::special::standard_normal_quantile;
use crate::statistics::moments;

pub(super) const OPTIMUM: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
const MEAN: f64 = 3906.0;
const DEVIATION: f64 = 105.0;

/// `count` draws of a normal law.
pub(super) fn drawn(seed: u64, count: usize) -> Vec<f64> {
    let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
    germs.take(count).map(|u| MEAN + DEVIATION * standard_normal_quantile(u)).collect()
}

/// Quantiles of the same law: data without sampling noise.
pub(super) fn quantiles(count: u32) -> Vec<f64> {
    let at = |k: u32| standard_normal_quantile((f64::from(k) + 0.5) / f64::from(count));
    (0..count).map(|k| MEAN + DEVIATION * at(k)).collect()
}

pub(super) fn outcomes(velocities: &[f64]) -> Vec<Outcome> {
    velocities.iter().map(|&velocity| Ok(velocity)).collect()
}

fn law(outcomes: &[Outcome]) -> Law<'_> {
    Law::from_outcomes(&MonteCarlo::default(), &OPTIMUM, outcomes).unwrap()
}

fn cost(max_failed_fraction: f64, outcomes: &[Outcome], measured: &[f64]) -> f64 {
    let monte_carlo = MonteCarlo { max_failed_fraction, ..MonteCarlo::default() };
    let statistics = PointStatistics::from_outcomes(&monte_carlo, &OPTIMUM, outcomes);
    likelihood_cost(&statistics, &monte_carlo, &OPTIMUM, outcomes, measured)
}

fn average_and_scatter(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let average = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - average) * (value - average)).sum();
    (average, (squares / (count - 1.0)).sqrt())
}

/// Compares with the formula as written, with one exponential for each pair of velocities.
#[test]
fn the_cost_is_that_of_the_formula() {
    let (model, measured) = (drawn(1, 60), drawn(2, 40));
    let found = moments(&model).unwrap();
    let deviation = found.mean * found.coefficient_of_variation;
    let scores: Vec<f64> = model.iter().map(|v| (v - found.mean) / deviation).collect();
    let b = bandwidth(&scores).unwrap();
    let c = 1.0 / (1.0 + b * b).sqrt();
    let pi = std::f64::consts::PI;
    let density = |x: f64| {
        let z = (x - found.mean) / deviation;
        let kernel = |score: f64| {
            let t = (z - c * score) / (c * b);
            libm::exp(-0.5 * t * t) / (c * b * (2.0 * pi).sqrt())
        };
        let kernels = scores.iter().map(|&score| kernel(score)).sum::<f64>() / 60.0;
        ((1.0 - 1e-4) * kernels + 1e-4 / (pi * (1.0 + z * z))) / deviation
    };
    let expected = -measured.iter().map(|&x| libm::log(density(x))).sum::<f64>() / 40.0;
    let found = cost(0.0, &outcomes(&model), &measured);
    assert!((found - expected).abs() < 1e-5, "{found} {expected}");
}

/// Data of the same law cost its entropy, ln(σ √(2πe)).
#[test]
fn many_velocities_cost_the_entropy_of_their_law() {
    let found = cost(0.0, &outcomes(&drawn(1, 100_000)), &quantiles(10_000));
    let entropy = libm::log(DEVIATION) + 0.5 * (1.0 + libm::log(2.0 * std::f64::consts::PI));
    assert!((found - entropy).abs() < 2e-3, "{found} {entropy}");
}

/// The point at which the likelihood of data without noise is largest, by one Newton step from the
/// truth with the normal law's information (1 of the mean in σ, 2 of ln σ), for models with exact
/// moments: the average of these is the bias due to smoothing. The sampling error, of data and of
/// model alike, is 1/√N of the mean and 1/√(2N) of ln σ.
#[test]
fn the_maximum_is_unbiased_to_well_under_the_sampling_error() {
    let measured = quantiles(20_000);
    for count in [100, 500, 2747, 10_000] {
        let mut found = [Vec::new(), Vec::new()];
        for seed in 0..100 {
            let mut model = drawn(seed, count);
            let Moments { mean, coefficient_of_variation } = moments(&model).unwrap();
            let ratio = DEVIATION / (mean * coefficient_of_variation);
            model.iter_mut().for_each(|velocity| *velocity = MEAN + ratio * (*velocity - mean));
            let outcomes = outcomes(&model);
            let [kernels, floor] = law(&outcomes).gradients(&measured);
            let slope =
                |mean, deviation| kernels.along(mean, deviation) + floor.along(mean, deviation);
            found[0].push(-slope(DEVIATION, 0.0));
            found[1].push(-0.5 * slope(0.0, 1.0));
        }
        let errors = [1.0 / (count as f64).sqrt(), 1.0 / (2.0 * count as f64).sqrt()];
        for (values, error) in found.iter().zip(errors) {
            let (bias, scatter) = average_and_scatter(values);
            assert!(bias.abs() < 0.2 * error, "{count}: {bias}, error {error}");
            assert!(scatter < 0.2 * error, "{count}: {scatter}, error {error}");
        }
    }
}

/// Compares reported errors with the scatter over seeds: near the maximum, and far from it, where
/// the moments or the floor dominate.
#[test]
fn the_standard_error_is_that_of_repetition() {
    let plain = MonteCarlo::default();
    let sobol = MonteCarlo { realizations: 512, sampling: Sampling::Sobol, ..plain };
    let cases = [
        plain,
        MonteCarlo { control_variate: true, ..plain },
        MonteCarlo { scrambles: 16, ..sobol },
        sobol,
    ];
    let speeds = |monte_carlo: &MonteCarlo, seed| -> Vec<Outcome> {
        let monte_carlo = MonteCarlo { seed, ..*monte_carlo };
        let ensemble = Ensemble::drawn(&OPTIMUM, monte_carlo.germs()).unwrap();
        let noise = |index| 20.0 * (Germs::draw(seed ^ 0xabcd, index).values()[0] - 0.5);
        let speeds = ensemble.longitudinal_speeds(512).enumerate();
        speeds.map(|(index, speed)| Ok(speed + noise(index as u64))).collect()
    };
    let data: Vec<f64> = speeds(&plain, 1000).iter().filter_map(|o| o.ok()).collect();
    for (shift, stretch) in [(0.0, 1.0), (100.0, 1.0), (0.0, 1.4), (3000.0, 1.0)] {
        let measured: Vec<f64> =
            data.iter().map(|v| 3956.0 + shift + stretch * (v - 3956.0)).collect();
        for monte_carlo in cases {
            let (mut costs, mut variance) = (Vec::new(), 0.0);
            for seed in 1..=200 {
                let asked = MonteCarlo { seed, ..monte_carlo };
                let outcomes = speeds(&asked, seed);
                costs
                    .push(Law::from_outcomes(&asked, &OPTIMUM, &outcomes).unwrap().cost(&measured));
                let error = likelihood_error(&asked, &OPTIMUM, &outcomes, &measured).unwrap();
                variance += error * error / 200.0;
            }
            let (_, scatter) = average_and_scatter(&costs);
            let ratio = variance.sqrt() / scatter;
            let accepted = (0.75..1.45).contains(&ratio);
            assert!(accepted, "{ratio} of {scatter}: {shift}, {stretch}, {monte_carlo:?}");
        }
    }
}

#[test]
fn an_outlier_has_a_finite_cost_that_pulls() {
    let model = outcomes(&drawn(1, 500));
    let mut data = drawn(2, 300);
    let without = cost(0.0, &model, &data);
    data.push(30_000.0);
    let with = cost(0.0, &model, &data);
    // One of 301 velocities, at 250 standard deviations.
    assert!(with - without < 20.0 / 301.0, "{with} {without}");
    // For a model far from all of the data, a nearer one is better.
    let mut before = f64::INFINITY;
    for shift in [20_000.0, 10_000.0, 3000.0, 1000.0, 500.0, 200.0, 0.0] {
        let moved: Vec<f64> = data[..300].iter().map(|velocity| velocity + shift).collect();
        let found = cost(0.0, &model, &moved);
        assert!(found < before - 0.05, "{shift}: {found}, {before}");
        before = found;
    }
}

#[test]
fn the_law_is_that_of_the_successes() {
    let (model, data) = (drawn(1, 200), drawn(2, 50));
    let mut with = outcomes(&model);
    let without = cost(0.0, &with, &data);
    with.insert(17, Err(FailureKind::NoArrival));
    assert_eq!(cost(0.01, &with, &data), without);
    assert_eq!(cost(0.0, &with, &data), f64::INFINITY);
    let error = |outcomes: &[Outcome]| {
        likelihood_error(&MonteCarlo::default(), &OPTIMUM, outcomes, &data).unwrap()
    };
    assert!((error(&with) / error(&outcomes(&model)) - 1.0).abs() < 1e-12);
}

#[test]
fn without_different_velocities_there_is_no_law() {
    let data = [3900.0, 3950.0];
    for model in [&[][..], &[Err(FailureKind::NotFinite)], &[Ok(3900.0)], &[Ok(3900.0); 5]] {
        assert_eq!(cost(1.0, model, &data), f64::INFINITY, "{model:?}");
        assert_eq!(likelihood_error(&MonteCarlo::default(), &OPTIMUM, model, &data), None);
    }
    assert!(cost(0.0, &[Ok(3900.0), Ok(3950.0)], &data).is_finite());
}

/// Half of the values are equal: their middle half has no width, and the standard deviation keeps
/// the grid bounded.
#[test]
fn a_law_with_an_atom_has_a_bounded_grid() {
    let mut model = vec![3900.0; 3000];
    model.push(1e6);
    let found = cost(0.0, &outcomes(&model), &[3900.0, 3901.0]);
    assert!(found.is_finite(), "{found}");
}
