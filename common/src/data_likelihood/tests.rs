//! Likelihoods compared with direct formulas.

use std::f64::consts::PI;

use super::*;
use crate::ensemble::Germs;
use crate::special::standard_normal_quantile;

const VELOCITIES: [f64; 6] = [3900.0, 4010.0, 3805.0, 3950.0, 4100.0, 3870.0];

fn log(likelihood: &DataLikelihood, mean: f64, variation: f64) -> f64 {
    likelihood.log([libm::log(mean), libm::log(variation)])
}

/// Logarithm of the density of a normal law with this covariance matrix of two values.
fn pair(x: [f64; 2], mean: f64, variance: f64, covariance: f64) -> f64 {
    let determinant = variance * variance - covariance * covariance;
    let [a, b] = x.map(|x| x - mean);
    let square = (variance * (a * a + b * b) - 2.0 * covariance * a * b) / determinant;
    -0.5 * (libm::log(determinant) + square)
}

#[test]
fn independent_velocities_have_the_likelihood_of_a_normal_sample() {
    let likelihood = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
    let direct = |mean: f64, variation: f64| -> f64 {
        let sigma = mean * variation;
        let square = |v: &f64| (v - mean) / sigma * ((v - mean) / sigma);
        let of = |v: &f64| -0.5 * square(v) - libm::log(sigma);
        VELOCITIES.iter().map(of).sum()
    };
    let found = log(&likelihood, 3950.0, 0.03) - log(&likelihood, 3800.0, 0.02);
    let expected = direct(3950.0, 0.03) - direct(3800.0, 0.02);
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn the_instrument_adds_its_variance() {
    let with = DataLikelihood::independent(&VELOCITIES, 30.0).unwrap();
    let without = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
    let (mean, sigma) = (3940.0, 80.0);
    let total = (sigma * sigma + 900.0_f64).sqrt();
    let found = log(&with, mean, sigma / mean);
    assert!((found - log(&without, mean, total / mean)).abs() < 1e-9);
    assert_eq!(DataLikelihood::independent(&VELOCITIES, 300.0), None);
}

#[test]
fn velocities_of_one_subject_are_correlated() {
    let velocities = [3900.0, 3930.0, 4050.0, 4010.0];
    let found = DataLikelihood::of_subjects(&velocities, &[0, 0, 1, 1], 10.0).unwrap();
    let direct = |mean: f64, variation: f64| {
        let variance = (mean * variation) * (mean * variation);
        let of = |k: u32| {
            let share = (f64::from(k) + 0.5) / 1e4;
            let (total, both) = (variance + 100.0, share * variance);
            let [a, b, c, d] = velocities;
            libm::exp(pair([a, b], mean, total, both) + pair([c, d], mean, total, both))
        };
        libm::log((0..10_000).map(of).sum::<f64>())
    };
    let difference = log(&found, 3980.0, 0.02) - log(&found, 3900.0, 0.03);
    let expected = direct(3980.0, 0.02) - direct(3900.0, 0.03);
    assert!((difference - expected).abs() < 1e-6, "{difference} {expected}");
}

/// Draws `size` velocities of each of `count` subjects, with this share of the variance 100² within
/// subjects.
fn of_subjects(seed: u64, [count, size]: [usize; 2], within: f64) -> (Vec<f64>, Vec<u32>) {
    let germs = normal(seed, count * (size + 1));
    let (means, others) = germs.split_at(count);
    let one = |k: usize| {
        let off = |velocity: f64| velocity - 3900.0;
        let between = (1.0 - within).sqrt() * off(means[k / size]);
        (3900.0 + between + within.sqrt() * off(others[k]), (k / size) as u32)
    };
    (0..count * size).map(one).unzip()
}

/// The integral over the share between subjects by very many equal steps of ln(1 - ρ) and of ρ.
fn by_many_steps(subjects: &Subjects, mean: f64, variance: f64, instrument: f64) -> f64 {
    let log = |within: f64| {
        let rest = (within - instrument) / variance;
        let of = |class: &SubjectClass| class.log(mean, within, (1.0 - rest) * variance);
        subjects.0.iter().map(of).sum::<f64>()
    };
    let of = |k: u32| {
        // 1 - ρ from 1 down to 1e-9, in steps that are equal in its logarithm.
        let rest = libm::exp(-20.7 * (f64::from(k) + 0.5) / 4e5);
        log(rest.mul_add(variance, instrument)) + libm::log(rest * 20.7 / 4e5)
    };
    log_of_sum((0..400_000).map(of).collect::<Vec<f64>>().into_iter())
}

#[test]
fn the_share_between_subjects_is_integrated_out() {
    for (seed, sizes, within, instrument) in [
        (1, [20, 4], 0.5, 0.0),
        (2, [20, 4], 0.002, 0.0),
        (3, [20, 2], 0.001, 0.0),
        (4, [40, 8], 0.02, 0.0),
        (5, [687, 4], 0.05, 0.0),
        (6, [687, 4], 1.0, 0.0),
        (7, [5, 4], 1.0, 0.0),
        (8, [40, 8], 0.005, 20.0),
    ] {
        let (velocities, indices) = of_subjects(seed, sizes, within);
        let pairs = velocities.iter().copied().zip(indices);
        let subjects = Subjects::new(pairs, 3900.0);
        let log = |mean: f64, deviation: f64, by: &dyn Fn(&Subjects, f64, f64, f64) -> f64| {
            by(&subjects, mean, deviation * deviation, instrument)
        };
        let origin = (5.0, 105.0);
        for (mean, deviation) in [(5.0, 95.0), (-20.0, 130.0), (0.0, 60.0)] {
            let difference = |by: &dyn Fn(&Subjects, f64, f64, f64) -> f64| {
                log(mean, deviation, by) - log(origin.0, origin.1, by)
            };
            let (found, expected) = (difference(&Subjects::log), difference(&by_many_steps));
            assert!(
                (found - expected).abs() < 1e-3,
                "{sizes:?}, {within} within, {deviation}: {found} instead of {expected}"
            );
        }
    }
}

/// With a small share within the subjects, the scatter was found too small without limit.
#[test]
fn intervals_hold_the_scatter_whatever_its_share_within_subjects() {
    for within in [0.002, 0.02, 0.3] {
        let held = (0..60).filter(|seed| {
            let (velocities, subjects) = of_subjects(100 + seed, [20, 4], within);
            let found = DataLikelihood::of_subjects(&velocities, &subjects, 0.0).unwrap();
            let logs = (0..400).map(|k| {
                let deviation = 40.0 * libm::exp(1.8 * (f64::from(k) + 0.5) / 400.0);
                // The mean is nearly independent of the scatter.
                let mean = found.moments()[0];
                libm::exp(found.log([mean, libm::log(deviation) - mean]) + 300.0) * deviation
            });
            let densities: Vec<f64> = logs.collect();
            let total: f64 = densities.iter().sum();
            let below: f64 = densities[..203].iter().sum();
            // 100 is at 0.9163/1.8 of the range.
            (0.025..0.975).contains(&(below / total))
        });
        let held = held.count();
        // 57 expected; 5 standard deviations.
        assert!(held >= 48, "{within}: {held} of 60");
    }
}

#[test]
fn repeats_of_one_velocity_count_once() {
    let velocities: Vec<f64> = normal(8, 30);
    let twice: Vec<f64> = velocities.iter().chain(&velocities).copied().collect();
    let indices: Vec<u32> = (0..30).chain(0..30).collect();
    let repeated = DataLikelihood::of_subjects(&twice, &indices, 0.0).unwrap();
    let single = DataLikelihood::independent(&velocities, 0.0).unwrap();
    let difference = |of: &DataLikelihood| log(of, 3900.0, 0.03) - log(of, 3920.0, 0.02);
    assert!((difference(&repeated) - difference(&single)).abs() < 1e-9);
}

/// Errors of the model several times as large as the data's are averaged over just the same.
#[test]
fn large_errors_of_the_model_are_averaged_over() {
    let exact = DataLikelihood::independent(&normal(2, 400), 0.0).unwrap();
    for ratio in [1.5, 3.0, MODEL_ERROR_MAX] {
        let error = ratio * exact.errors()[0];
        let blurred = exact.clone().with_model_errors([error, 0.0]);
        let [mean, variation] = exact.moments();
        // Two normal laws, one after the other, are a normal law.
        let wide = 1.0 + ratio * ratio;
        for steps in [1.0, 2.0, 3.0] {
            let off = steps * wide.sqrt() * exact.errors()[0];
            let found = blurred.log([mean, variation]) - blurred.log([mean + off, variation]);
            let expected = 0.5 * steps * steps;
            assert!((found / expected - 1.0).abs() < 0.05, "{ratio}, {steps}: {found}");
        }
    }
}

/// Two normal laws, one after the other, are a normal law, also if the second is correlated, much wider than the
/// first, or both in turn.
#[test]
fn errors_of_the_setup_are_averaged_over() {
    let exact = DataLikelihood::independent(&normal(2, 20_000), 0.0).unwrap();
    let (noise, centre) = (exact.errors(), exact.moments());
    for (effects, sampling) in [
        (&[[20.0, 0.0]][..], 0.0),
        (&[[3.0, -4.0]], 0.0),
        (&[[0.3, 0.2]], 0.5),
        (&[[20.0, 5.0], [2.0, -1.0]], 1.0),
        (&[[90.0, -30.0], [10.0, 40.0], [0.1, 0.2]], 0.2),
    ] {
        let sum = |i: usize, j: usize| effects.iter().map(|one| one[i] * one[j]).sum::<f64>();
        let scaled = [0, 1].map(|i| [0, 1].map(|j| noise[i] * noise[j] * sum(i, j)));
        let blurred = exact.clone().with_model_errors(noise.map(|error| sampling * error));
        let blurred = blurred.with_systematic(scaled);
        let own = 1.0 + sampling * sampling;
        let (a, b, c) = (own + sum(0, 0), sum(0, 1), own + sum(1, 1));
        for [x, y] in [[1.0, 0.0], [0.0, 1.5], [1.5, 1.5], [-2.0, 1.0]] {
            let [x, y] = [x * a.sqrt(), y * c.sqrt()];
            let off = [centre[0] + x * noise[0], centre[1] + y * noise[1]];
            let expected = 0.5 * (c * x * x - 2.0 * b * x * y + a * y * y) / (a * c - b * b);
            let found = blurred.log(centre) - blurred.log(off);
            // The law of the data's own moments is not quite normal far from them.
            let error = (found - expected).abs();
            assert!(
                expected > 10.0 || error < 0.02 + 0.05 * expected,
                "{effects:?}, {x}, {y}: {found} {expected}"
            );
        }
    }
}

/// Compares with the average over many errors of the model's mean, of the size of the data's.
#[test]
fn errors_of_the_model_are_averaged_over() {
    let exact = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
    let error = exact.errors()[0];
    let blurred = exact.clone().with_model_errors([error, 0.0]);
    let average = |mean: f64| {
        let of = |k: i32| {
            let z = f64::from(k) / 20.0;
            let log = exact.log([libm::log(mean) + z * error, libm::log(0.025)]);
            libm::exp(log - 0.5 * z * z)
        };
        libm::log((-120..=120).map(of).sum::<f64>())
    };
    let found = log(&blurred, 3900.0, 0.025) - log(&blurred, 4000.0, 0.025);
    let expected = average(3900.0) - average(4000.0);
    assert!((found - expected).abs() < 0.01, "{found} {expected}");
    let same = exact.clone().with_model_errors([0.01 * error, 0.0]);
    assert_eq!(log(&same, 3900.0, 0.02), log(&exact, 3900.0, 0.02));
}

#[test]
fn moments_with_a_count_stand_for_a_sample() {
    let sample = DataLikelihood::independent(&VELOCITIES, 0.0).unwrap();
    let moments = crate::statistics::moments(&VELOCITIES).unwrap();
    let found = DataLikelihood::from_moments(moments, 6, 0.0).unwrap();
    let difference = log(&found, 3800.0, 0.05) - log(&sample, 3800.0, 0.05);
    assert!(difference.abs() < 1e-9, "{difference}");
}

/// Draws `count` values of a normal law with mean 3900 and standard deviation 100.
fn normal(seed: u64, count: usize) -> Vec<f64> {
    let germs = (0..).flat_map(|index| *Germs::draw(seed, index).values());
    germs.take(count).map(|u| 3900.0 + 100.0 * standard_normal_quantile(u)).collect()
}

/// Returns the likelihood without the possibility of wrong velocities.
fn plain(velocities: &[f64]) -> DataLikelihood {
    let moments = crate::statistics::moments(velocities).unwrap();
    DataLikelihood::from_moments(moments, velocities.len() as u64, 0.0).unwrap()
}

/// Returns mean and standard deviation of the posterior of v and of Δ under a uniform prior.
fn posterior(likelihood: &DataLikelihood) -> [[f64; 2]; 2] {
    let nodes = 120;
    let node = |[low, high]: [f64; 2], k: usize| low + (high - low) * (k as f64 + 0.5) / 120.0;
    let (mut total, mut sums) = (0.0, [[0.0; 2]; 2]);
    let peak = likelihood.log(likelihood.moments());
    for i in 0..nodes {
        for j in 0..nodes {
            let at = [node([3800.0, 4150.0], i), node([0.017, 0.14], j)];
            let weight = libm::exp(likelihood.log(at.map(libm::log)) - peak);
            total += weight;
            for (sums, value) in sums.iter_mut().zip(at) {
                sums[0] += weight * value;
                sums[1] += weight * value * value;
            }
        }
    }
    sums.map(|[first, second]| {
        let mean = first / total;
        [mean, (second / total - mean * mean).sqrt()]
    })
}

/// Most samples have no velocity much beyond three standard deviations. In the others it counts a
/// little less, as it should: with a velocity 3.8 deviations off, Δ moves by 0.3 of its own error.
#[test]
fn clean_data_lose_next_to_nothing_by_the_possibility_of_wrong_ones() {
    let off = |seed: u64| {
        let velocities = normal(seed, 100);
        let robust = DataLikelihood::independent(&velocities, 0.0).unwrap();
        let (with, without) = (posterior(&robust), posterior(&plain(&velocities)));
        let pairs = with.iter().zip(without);
        let of = |(with, without): (&[f64; 2], [f64; 2])| {
            let of_deviation = (with[1] / without[1] - 1.0).abs();
            ((with[0] - without[0]) / without[1]).abs().max(of_deviation)
        };
        pairs.map(of).fold(0.0, f64::max)
    };
    let mut off: Vec<f64> = (1..=20).map(off).collect();
    off.sort_unstable_by(f64::total_cmp);
    assert!(off[15] < 0.03 && off[19] < 0.35, "{off:?}");
}

#[test]
fn one_wrong_velocity_of_a_hundred_hardly_changes_the_posterior() {
    let mut velocities = normal(3, 100);
    velocities.sort_unstable_by(f64::total_cmp);
    velocities.swap(50, 99);
    let clean = posterior(&plain(&velocities[..99]));
    velocities[99] *= 2.0;
    let robust = DataLikelihood::independent(&velocities, 0.0).unwrap();
    let found = posterior(&robust);
    for (found, clean) in found.iter().zip(clean) {
        assert!((found[0] - clean[0]).abs() < 0.1 * clean[1], "{found:?} {clean:?}");
        assert!((found[1] / clean[1] - 1.0).abs() < 0.1, "{found:?} {clean:?}");
    }
    let blown_up = posterior(&plain(&velocities));
    assert!(blown_up[1][0] - clean[1][0] > 5.0 * clean[1][1], "{blown_up:?} {clean:?}");
    // The scales for grids are those of the others, too.
    let [of_mean, of_variation] = robust.errors();
    assert!((of_mean / (clean[0][1] / clean[0][0]) - 1.0).abs() < 0.1, "{of_mean}");
    assert!((of_variation / (clean[1][1] / clean[1][0]) - 1.0).abs() < 0.15, "{of_variation}");
    let share = robust.outlier_share(robust.moments()).unwrap();
    // Beta(2, 148) has the mean 1/75.
    assert!((0.011..0.016).contains(&share.mean), "{share:?}");
    let wrong = share.probabilities.last().unwrap();
    assert!(wrong.0 > 7000.0 && wrong.1 > 0.999, "{share:?}");
}

/// Compares with the sum over all velocities and a fine grid of ε: the core may be taken as normal.
#[test]
fn the_mixture_is_that_of_all_velocities() {
    let mut velocities = normal(9, 60);
    velocities.extend([4600.0, 4600.1, 5200.0]);
    let likelihood = DataLikelihood::independent(&velocities, 20.0).unwrap();
    let scale = RobustScale::from_velocities(&velocities).unwrap();
    let direct = |mean: f64, sigma: f64| {
        let variance = sigma * sigma + 400.0;
        let of = |rate: f64| -> f64 {
            let density = |velocity: &f64| {
                let off = velocity - mean;
                let normal = libm::exp(-0.5 * off * off / variance) / (2.0 * PI * variance).sqrt();
                let score = scale.deviations(*velocity) / 10.0;
                let broad = 1.0 / (PI * 10.0 * scale.deviation * (1.0 + score * score));
                libm::log((1.0 - rate) * normal + rate * broad)
            };
            let log = velocities.iter().map(density).sum::<f64>() + 48.0 * libm::log(1.0 - rate);
            libm::exp(log + 400.0)
        };
        libm::log((0..4000).map(|k| of((f64::from(k) + 0.5) / 8000.0)).sum())
    };
    let found = log(&likelihood, 3920.0, 0.025) - log(&likelihood, 3890.0, 0.03);
    let expected = direct(3920.0, 0.025 * 3920.0) - direct(3890.0, 0.03 * 3890.0);
    assert!((found - expected).abs() < 0.05, "{found} {expected}");
}

#[test]
fn a_wrong_velocity_of_a_subject_counts_little_too() {
    let mut velocities = normal(5, 80);
    let subjects: Vec<u32> = (0..80).map(|k| k / 4).collect();
    let found = |velocities: &[f64]| {
        posterior(&DataLikelihood::of_subjects(velocities, &subjects, 0.0).unwrap())
    };
    let clean = found(&velocities);
    velocities[33] *= 2.0;
    let wrong = found(&velocities);
    for (wrong, clean) in wrong.iter().zip(clean) {
        assert!((wrong[0] - clean[0]).abs() < 0.3 * clean[1], "{wrong:?} {clean:?}");
    }
}

/// Rounding to 50 m/s adds 208 m²/s² to the variance, 2 % of it.
#[test]
fn rounding_is_scatter_of_the_instrument() {
    let rounded: Vec<f64> = normal(4, 2000).iter().map(|v| 50.0 * (v / 50.0).round()).collect();
    let found = DataLikelihood::independent(&rounded, 0.0).unwrap();
    let mut finer = rounded.clone();
    finer[7] += 1e-3;
    let [_, with] = found.moments();
    let [_, without] = DataLikelihood::independent(&finer, 0.0).unwrap().moments();
    let expected = 0.5 * 2500.0 / 12.0 / 1e4;
    assert!((without - with - expected).abs() < 0.1 * expected, "{with} {without}");
    // A step of 1 m/s makes no difference.
    let fine: Vec<f64> = normal(4, 2000).iter().map(|v| v.round()).collect();
    assert_eq!(DataLikelihood::independent(&fine, 0.0).unwrap().instrument, 0.0);
}
