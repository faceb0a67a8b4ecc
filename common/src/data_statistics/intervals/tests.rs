//! Tests of the intervals by their coverage.

use super::*;
use crate::ensemble::Germs;
use crate::inference::{Noise, data_noise};
use crate::job::{Data, Group, Measurements};
use crate::moments::MOMENTS;

/// Draws values of the standard normal law.
fn standard_normal(seed: u64) -> impl Iterator<Item = f64> {
    let germs = (0..).flat_map(move |index| *Germs::draw(seed, index).values());
    germs.map(standard_normal_quantile)
}

/// Draws `count` values of a normal law with mean 3900 and coefficient of variation 0.03.
fn normal(seed: u64, count: usize) -> Vec<f64> {
    standard_normal(seed).take(count).map(|z| 3900.0 * (1.0 + 0.03 * z)).collect()
}

fn intervals(velocities: &[f64]) -> Option<MomentIntervals> {
    moment_intervals(&VelocitySet::independent(velocities))
}

fn holds(interval: ConfidenceInterval, value: f64) -> bool {
    interval.low <= value && value <= interval.high
}

/// Counts in how many of `repetitions` each interval contains the law's moment.
fn coverage(count: usize, repetitions: u64) -> [u64; 2] {
    let mut covered = [0, 0];
    for seed in 0..repetitions {
        let intervals = intervals(&normal(1000 + seed, count)).unwrap();
        covered[0] += u64::from(holds(intervals.mean, 3900.0));
        covered[1] += u64::from(holds(intervals.coefficient_of_variation, 0.03));
    }
    covered
}

#[test]
fn intervals_hold_the_moments_of_the_law_as_often_as_they_say() {
    // The standard deviation of a share of 2000 is 0.005.
    for count in [5, 10, 20, 50] {
        let shares = coverage(count, 2000).map(|count| count as f64 / 2000.0);
        assert!(shares.iter().all(|share| (0.93..=0.97).contains(share)), "{count}: {shares:?}");
    }
}

#[test]
fn so_do_those_of_moments_whose_number_of_velocities_is_given() {
    let of_count = |velocities: &[f64], count: Option<u64>| {
        let Moments { mean, coefficient_of_variation } = moments(velocities).unwrap();
        let measurements = Measurements::Moments { mean, coefficient_of_variation, count };
        intervals_of_moments(&Data { measurements, repeatability: 0.0, decay_error: 0.0 })
    };
    let mut covered = [0; 2];
    for seed in 0..2000 {
        let found = of_count(&normal(1000 + seed, 20), Some(20)).unwrap();
        covered[0] += u64::from(holds(found.mean, 3900.0));
        covered[1] += u64::from(holds(found.coefficient_of_variation, 0.03));
    }
    let shares = covered.map(|count| count as f64 / 2000.0);
    assert!(shares.iter().all(|share| (0.93..=0.97).contains(share)), "{shares:?}");
    for count in [None, Some(4)] {
        assert_eq!(of_count(&normal(1, 20), count), None);
    }
}

/// Student's law with ten degrees of freedom has a kurtosis of 4.
#[test]
fn heavy_tails_cost_little_coverage() {
    let mut covered = 0;
    for seed in 0..2000 {
        let mut normal = standard_normal(40_000 + seed);
        let mut value = || {
            let numerator = normal.next().unwrap();
            let squares: f64 = normal.by_ref().take(10).map(|z| z * z).sum();
            numerator / (squares / 10.0).sqrt()
        };
        // The variance of the law is 10/8.
        let scale = 3900.0 * 0.03 / 1.25_f64.sqrt();
        let velocities: Vec<f64> = (0..50).map(|_| 3900.0 + scale * value()).collect();
        let found = intervals(&velocities).unwrap();
        covered += u32::from(holds(found.coefficient_of_variation, 0.03));
    }
    assert!(covered >= 1840, "{covered} of 2000");
}

#[test]
fn many_velocities_have_the_intervals_of_the_normal_law() {
    let few = normal(1, RESAMPLED_MAX);
    let by_chi_square = intervals(&few).unwrap();
    let found = moments(&few).unwrap();
    let set = VelocitySet::independent(&few);
    let by_law = Influences::new(&set, found, found).normal(found, few.len());
    let close = |a: f64, b: f64, width: f64| (a - b).abs() < 0.06 * width;
    for (a, b) in [
        (by_chi_square.mean, by_law.mean),
        (by_chi_square.coefficient_of_variation, by_law.coefficient_of_variation),
    ] {
        let width = b.high - b.low;
        assert!(close(a.low, b.low, width) && close(a.high, b.high, width), "{a:?} {b:?}");
    }
}

#[test]
fn velocities_that_do_not_differ_have_no_interval() {
    assert_eq!(intervals(&[]), None);
    assert_eq!(intervals(&[3900.0]), None);
    assert_eq!(intervals(&[3900.0; 5]), None);
}

#[test]
fn the_same_velocities_have_the_same_interval() {
    let velocities = normal(3, 50);
    assert_eq!(intervals(&velocities), intervals(&velocities));
}

#[test]
fn fewer_than_five_parts_have_no_interval() {
    let velocities = normal(4, 8);
    let set = VelocitySet::independent(&velocities);
    assert_eq!(intervals(&velocities[..4]), None);
    assert!(intervals(&velocities[..5]).is_some());
    let of = |subjects: &[u32]| moment_intervals(&VelocitySet { subjects: Some(subjects), ..set });
    assert_eq!(of(&[0, 0, 1, 1, 2, 2, 3, 3]), None);
    assert!(of(&[0, 0, 1, 1, 2, 2, 3, 4]).is_some());
    assert_eq!(moment_intervals(&VelocitySet { repeatability: 400.0, ..set }), None);
}

/// The bootstrap of subjects with one velocity each knows the law only by the velocities; its
/// intervals are similar.
#[test]
fn subjects_with_one_velocity_each_have_similar_intervals() {
    let velocities = normal(5, 60);
    let subjects: Vec<u32> = (0..60).collect();
    let alone = VelocitySet { repeatability: 50.0, ..VelocitySet::independent(&velocities) };
    let found = moment_intervals(&VelocitySet { subjects: Some(&subjects), ..alone }).unwrap();
    let expected = moment_intervals(&alone).unwrap();
    for (found, expected) in [
        (found.mean, expected.mean),
        (found.coefficient_of_variation, expected.coefficient_of_variation),
    ] {
        let width = expected.high - expected.low;
        let ends = [found.low - expected.low, found.high - expected.high];
        assert!(ends.iter().all(|end| end.abs() < 0.15 * width), "{found:?} {expected:?}");
    }
}

/// The instrument's scatter is no part of the law whose moments the intervals hold.
#[test]
fn intervals_with_repeatability_hold_the_moments_of_the_law_itself() {
    let repeatability = 60.0;
    let mut covered = 0;
    for seed in 0..200 {
        let noise = standard_normal(9000 + seed).map(|z| repeatability * z);
        let measured: Vec<f64> =
            normal(5000 + seed, 200).into_iter().zip(noise).map(|(v, e)| v + e).collect();
        let set = VelocitySet { repeatability, ..VelocitySet::independent(&measured) };
        let interval = moment_intervals(&set).unwrap().coefficient_of_variation;
        covered += u32::from(holds(interval, 0.03));
    }
    // Expected 190, with a standard deviation of 3.
    assert!((179..=199).contains(&covered), "{covered}");
}

const SUBJECTS: usize = 40;
const EACH: usize = 8;

/// Draws velocities of subjects with the mean 3900, the coefficient of variation 0.03 and the
/// intra-class correlation 0.8.
fn random_effects(seed: u64) -> Group {
    let between = standard_normal(2 * seed).take(SUBJECTS);
    let mut within = standard_normal(2 * seed + 1);
    let deviation = 3900.0 * 0.03;
    let mut group = Group::new("all", Vec::new());
    let mut subjects = Vec::new();
    for (subject, z) in (0..).zip(between) {
        for _ in 0..EACH {
            let own = 0.2_f64.sqrt() * within.next().unwrap();
            group.velocities.push(3900.0 + deviation * (0.8_f64.sqrt() * z + own));
            subjects.push(subject);
        }
    }
    group.subjects = Some(subjects);
    group
}

/// Returns whether the intervals of the logarithms of both moments by the delta method hold them.
fn delta_method_holds(data: &Data) -> [bool; 2] {
    let noise = Noise {
        data: data_noise(data, 0),
        model: [0.0; MOMENTS],
        systematic: [[0.0; MOMENTS]; MOMENTS],
    };
    let covariance = noise.covariance();
    let found = data.moments(0);
    let errors = [libm::log(found.mean / 3900.0), libm::log(found.coefficient_of_variation / 0.03)];
    [0, 1].map(|axis| errors[axis].abs() <= noise.quantile() * covariance[axis][axis].sqrt())
}

#[test]
fn intervals_of_subjects_hold_the_mean_as_often_as_they_say() {
    let repetitions = 400;
    let [mut by_bootstrap, mut by_delta, mut ignoring] = [0; 3];
    for seed in 0..repetitions {
        let group = random_effects(seed);
        let set = VelocitySet {
            subjects: group.subjects.as_deref(),
            ..VelocitySet::independent(&group.velocities)
        };
        by_bootstrap += u64::from(holds(moment_intervals(&set).unwrap().mean, 3900.0));
        let independent = Group { subjects: None, ..group.clone() };
        by_delta += u64::from(delta_method_holds(&Data::from_groups(vec![group]))[0]);
        ignoring += u64::from(delta_method_holds(&Data::from_groups(vec![independent]))[0]);
    }
    let share = |count: u64| count as f64 / repetitions as f64;
    for (name, count) in [("bootstrap", by_bootstrap), ("delta method", by_delta)] {
        assert!((0.90..=0.98).contains(&share(count)), "{name}: {count}");
    }
    assert!(share(ignoring) < 0.75, "{ignoring}");
}

/// Counts, over 400 samples, the intervals computed from the moments and the number of velocities
/// that contain the true moments.
#[test]
fn moments_with_a_number_have_the_noise_of_a_normal_law() {
    let mut held = [0; 2];
    for seed in 0..400 {
        let found = moments(&normal(20_000 + seed, 50)).unwrap();
        let Moments { mean, coefficient_of_variation } = found;
        let count = Some(50);
        let measurements = Measurements::Moments { mean, coefficient_of_variation, count };
        let data = Data { measurements, repeatability: 0.0, decay_error: 0.0 };
        assert_eq!(data_noise(&data, 0).map(|noise| noise.freedom), Some(49));
        for (held, holds) in held.iter_mut().zip(delta_method_holds(&data)) {
            *held += u64::from(holds);
        }
    }
    assert!(held.iter().all(|held| (360..=392).contains(held)), "{held:?}");
}
