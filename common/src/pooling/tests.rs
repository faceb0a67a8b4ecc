//! Tests by simulated studies: how often intervals hold the truth, and how far estimates are from it.
//!
//! The truth of each group is drawn from a normal law, the mean of all from none (it is 0). A group's estimate is
//! the mean of eight normal data, and its error follows from their scatter, unless a test says otherwise.

use super::*;
use crate::ensemble::Germs;
use crate::special::standard_normal_quantile;

/// Data of each group.
const DATA: usize = 8;
/// Standard error of a group's estimate.
const ERROR: f64 = 0.01;

/// How studies are simulated.
#[derive(Clone, Copy)]
struct Simulated {
    groups: usize,
    studies: u64,
    /// Scatter of the truths, in standard errors of a group.
    scatter: f64,
    /// Standard deviation of an error that all groups share.
    common: f64,
    /// Spread of the logarithm of the groups' standard errors.
    unequal: f64,
}

const USUAL: Simulated =
    Simulated { groups: 12, studies: 200, scatter: 1.0, common: 0.0, unequal: 0.0 };

/// What was counted over all groups of all studies.
#[derive(Debug, Default)]
struct Counted {
    groups: u64,
    /// Intervals of groups, of the mean, of the scatter, and of the differences from the first group that hold
    /// the truth.
    held: u64,
    means: u64,
    scatters: u64,
    differences: u64,
    studies: u64,
    /// Sums of squares of the errors of pooled values and of the estimates.
    pooled: f64,
    alone: f64,
    /// Sum of the weights of the groups' own estimates.
    own: f64,
}

impl Simulated {
    /// Draws truths and estimates of one study.
    fn draw(&self, number: u64) -> (Vec<f64>, Vec<GroupEstimate>) {
        let germs = (0..).flat_map(|index| *Germs::draw(1000 + number, index).values());
        let mut normal = germs.map(standard_normal_quantile);
        let mut next = || normal.next().unwrap();
        let moved = self.common * next();
        let estimate = |next: &mut dyn FnMut() -> f64| {
            let truth = self.scatter * ERROR * next();
            let error = ERROR * libm::exp(self.unequal * next());
            let deviation = error * (DATA as f64).sqrt();
            let data: Vec<f64> = (0..DATA).map(|_| deviation * next()).collect();
            let mean = data.iter().sum::<f64>() / DATA as f64;
            let squares: f64 = data.iter().map(|one| (one - mean) * (one - mean)).sum();
            let variance = squares / ((DATA - 1) * DATA) as f64;
            let found = GroupEstimate {
                value: truth + mean + moved,
                error: variance.sqrt(),
                freedom: DATA as u64 - 1,
                common: vec![self.common],
            };
            (truth, found)
        };
        (0..self.groups).map(|_| estimate(&mut next)).unzip()
    }

    fn count(&self) -> Counted {
        let mut counted = Counted::default();
        for number in 0..self.studies {
            let (truths, estimates) = self.draw(number);
            let pooling = Pooling::new(estimates.clone()).unwrap();
            counted.studies += 1;
            counted.means += u64::from(holds(&pooling.mean(), 0.0));
            counted.scatters += u64::from(holds(&pooling.scatter(), self.scatter * ERROR));
            for (group, (truth, alone)) in truths.iter().zip(&estimates).enumerate() {
                let found = pooling.group(group);
                counted.groups += 1;
                counted.held += u64::from(holds(&found, *truth));
                counted.pooled += (found.value - truth) * (found.value - truth);
                counted.alone += (alone.value - truth) * (alone.value - truth);
                counted.own += pooling.own_weight(group);
                if group > 0 {
                    let difference = pooling.difference(group, 0);
                    counted.differences += u64::from(holds(&difference, truth - truths[0]));
                }
            }
        }
        counted
    }
}

impl Counted {
    /// Shares of the intervals of groups, differences, means and scatters that hold the truth.
    fn shares(&self) -> [f64; 4] {
        let pairs = self.groups - self.studies;
        let parts = [
            (self.held, self.groups),
            (self.differences, pairs),
            (self.means, self.studies),
            (self.scatters, self.studies),
        ];
        parts.map(|(part, all)| part as f64 / all as f64)
    }

    /// Root mean square error of the pooled values, relative to that of the estimates.
    fn relative_error(&self) -> f64 {
        (self.pooled / self.alone).sqrt()
    }
}

fn holds(found: &PooledNumber, truth: f64) -> bool {
    let [low, high] = found.interval;
    low <= truth && truth <= high
}

/// The bounds of a share that should be 0.95: the standard deviation of one of 2400 groups is 0.006, and that of a
/// share of 200 means twice as much.
fn is_nominal(share: f64) -> bool {
    (0.93..=0.97).contains(&share)
}

#[test]
fn intervals_of_groups_that_scatter_by_their_errors_hold_and_errors_are_a_fifth_smaller() {
    let counted = USUAL.count();
    let [groups, differences, means, scatters] = counted.shares();
    assert!(is_nominal(groups) && is_nominal(differences), "{counted:?}");
    assert!(means > 0.93 && scatters > 0.93, "{counted:?}");
    assert!(counted.relative_error() < 0.8, "{}", counted.relative_error());
}

#[test]
fn groups_with_unequal_errors_gain_more() {
    let counted = Simulated { unequal: 0.5, ..USUAL }.count();
    let [groups, ..] = counted.shares();
    assert!(is_nominal(groups), "{groups}");
    assert!(counted.relative_error() < 0.7, "{}", counted.relative_error());
}

#[test]
fn groups_without_scatter_share_one_value() {
    let counted = Simulated { scatter: 0.0, ..USUAL }.count();
    let [groups, differences, means, _] = counted.shares();
    assert!(groups > 0.97 && differences > 0.97 && means > 0.95, "{counted:?}");
    assert!(counted.relative_error() < 0.55, "{}", counted.relative_error());
}

#[test]
fn groups_that_scatter_far_stay_what_they_are() {
    let simulated = Simulated { scatter: 20.0, ..USUAL };
    let counted = simulated.count();
    let [groups, differences, means, scatters] = counted.shares();
    assert!(is_nominal(groups) && differences > 0.93, "{counted:?}");
    assert!(means > 0.91 && scatters > 0.91, "{counted:?}");
    assert!((counted.relative_error() - 1.0).abs() < 0.01, "{}", counted.relative_error());
    assert!(counted.own / counted.groups as f64 > 0.99);
}

#[test]
fn intervals_of_few_groups_hold() {
    for groups in [3, 5] {
        for scatter in [0.0, 1.0, 3.0] {
            let studies = 2400 / groups as u64;
            let counted = Simulated { groups, scatter, studies, ..USUAL }.count();
            let [share, differences, means, _] = counted.shares();
            let all = [share, differences, means];
            assert!(all.into_iter().all(|share| share > 0.93), "{groups} {scatter} {all:?}");
        }
    }
}

#[test]
fn what_moves_all_groups_is_not_averaged_away() {
    let simulated = Simulated { common: 2.0 * ERROR, scatter: 0.5, ..USUAL };
    let counted = simulated.count();
    let [groups, differences, means, _] = counted.shares();
    // All intervals of a study miss or hold together: the standard deviation of the share is 0.015.
    assert!(groups > 0.91 && means > 0.91 && differences > 0.93, "{counted:?}");
    // Without being told, the same studies are too sure of every group, and right about differences.
    let (mut held, mut all) = (0, 0);
    for number in 0..simulated.studies {
        let (truths, mut estimates) = simulated.draw(number);
        let told = Pooling::new(estimates.clone()).unwrap();
        estimates.iter_mut().for_each(|one| one.common = Vec::new());
        let untold = Pooling::new(estimates).unwrap();
        let [one, other] = [&told, &untold].map(|pooling| pooling.difference(3, 4));
        assert!((one.value - other.value).abs() < 1e-12);
        assert!((one.standard_error - other.standard_error).abs() < 1e-12);
        let found = truths.iter().enumerate();
        held += found.filter(|(group, truth)| holds(&untold.group(*group), **truth)).count();
        all += truths.len();
    }
    assert!((held as f64) < 0.6 * all as f64, "{held} of {all}");
}

#[test]
fn an_error_of_another_size_in_another_group_stays_in_their_difference() {
    let group = |value: f64, moved: f64| GroupEstimate {
        value,
        error: 0.01,
        freedom: 1_000_000,
        common: vec![moved],
    };
    let estimates = vec![group(0.0, 0.3), group(1.0, 0.1), group(2.0, 0.1), group(3.0, 0.1)];
    let pooling = Pooling::new(estimates).unwrap();
    let errors = [(1, 2), (0, 1)].map(|(one, other)| pooling.difference(one, other).standard_error);
    assert!((errors[0] - 0.01 * 2.0_f64.sqrt()).abs() < 1e-4, "{errors:?}");
    assert!((errors[1] - 0.2).abs() < 1e-3, "{errors:?}");
}

#[test]
fn fewer_than_three_groups_or_errors_that_are_no_numbers_are_refused() {
    let group = |error: f64| GroupEstimate { value: 1.0, error, freedom: 7, common: vec![0.1] };
    assert_eq!(Pooling::new(vec![group(0.1); 2]), None);
    assert!(Pooling::new(vec![group(0.1); 3]).is_some());
    for error in [0.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Pooling::new(vec![group(0.1), group(0.1), group(error)]), None);
    }
    let mut few = vec![group(0.1); 3];
    few[1].freedom = 2;
    assert_eq!(Pooling::new(few), None);
}

#[test]
fn many_groups_of_exact_values_have_the_scatter_of_the_values() {
    let value = |number: usize| standard_normal_quantile((number as f64 + 0.5) / 1000.0);
    let group = |number: usize| GroupEstimate {
        value: value(number),
        error: 1e-3,
        freedom: 100,
        common: Vec::new(),
    };
    let pooling = Pooling::new((0..1000).map(group).collect()).unwrap();
    let scatter = pooling.scatter();
    // The standard deviation of 1000 normal values is known to 1/√2000.
    assert!((scatter.value - 1.0).abs() < 5e-3, "{scatter:?}");
    assert!((scatter.standard_error * 2000.0_f64.sqrt() - 1.0).abs() < 0.1, "{scatter:?}");
    assert!((pooling.mean().standard_error * 1000.0_f64.sqrt() - 1.0).abs() < 0.02);
}
